//! Files in and out of a repair, in a folder of their own.

use std::cell::Cell;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use brickmend::io::{Format, format_of_extension};
use brickmend::mesh::shapes::Corners;
use brickmend::monitor::Void;
use brickmend::repair::{Depth, Limits, Outcome, Reach, RepairError, Settings, repair};
use brickmend::sign::FillRule;
use tempfile::TempDir;

use crate::support::obj::unwelded_obj;
use crate::support::surface::Surface;

/// How a soup is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Rounds to single precision.
    BinaryStl,
    AsciiStl,
    Obj,
}

/// A folder for the files of a test.
pub struct Workshop {
    folder: TempDir,
    next: Cell<u32>,
}

/// A finished repair.
pub struct Repaired {
    pub outcome: Outcome,
    pub path: PathBuf,
}

/// Settings with a fixed depth.
pub fn at_depth(depth: u32) -> Settings {
    Settings { depth: Depth::Levels(depth), ..Settings::default() }
}

/// As [`at_depth`], with a vertex for every cell that the surface passes.
pub fn unclustered(depth: u32) -> Settings {
    Settings { decimate: Reach::Cells(0.0), ..at_depth(depth) }
}

/// Repairs a soup from OBJ to PLY and checks every guarantee on the written file.
pub fn repair_soup(
    soup: &[Corners],
    settings: &Settings,
) -> Result<(Outcome, Surface), RepairError> {
    let workshop = Workshop::new();
    let input = workshop.write(soup, Encoding::Obj);
    let repaired = workshop.repair(&input, "ply", settings, &Limits::default())?;
    let surface = Surface::read_proven(&repaired.path, settings.fill_rule);
    Ok((repaired.outcome, surface))
}

/// A result with every promise kept, or the word that nothing is left of the soup.
pub fn repair_anything(soup: &[Corners], encoding: Encoding, rule: FillRule, depth: u32) {
    let workshop = Workshop::new();
    let input = workshop.write(soup, encoding);
    let mut settings = at_depth(depth);
    settings.fill_rule = rule;
    match workshop.repair(&input, "ply", &settings, &Default::default()) {
        Ok(repaired) => drop(Surface::read_proven(&repaired.path, rule)),
        Err(RepairError::EmptyResult { .. } | RepairError::NoTriangle { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

/// Repairs a soup within all sorts of limits, looks at each outcome, and demands the same bytes and
/// an empty work folder.
pub fn same_whatever_the_limits(soup: &[Corners], settings: &Settings, look: impl Fn(&Outcome)) {
    let workshop = Workshop::new();
    let input = workshop.write(soup, Encoding::Obj);
    let limits = [
        Limits::default(),
        Limits { share_bytes: Some(16 << 10), ..Limits::default() },
        Limits { threads: 8, ..Limits::default() },
    ];
    let bytes = limits.map(|limits| {
        let repaired = workshop.repair(&input, "ply", settings, &limits).expect("a result");
        look(&repaired.outcome);
        let left = repaired.path.with_extension("ply.brickmend");
        assert!(!left.exists(), "nothing is left of the work");
        std::fs::read(repaired.path).expect("it is there")
    });
    assert!(bytes.iter().all(|other| *other == bytes[0]));
}

impl Workshop {
    pub fn new() -> Self {
        Self { folder: TempDir::new().expect("a temporary folder"), next: Cell::new(0) }
    }

    fn path(&self, stem: &str, extension: &str) -> PathBuf {
        let number = self.next.replace(self.next.get() + 1);
        self.folder.path().join(format!("{stem}{number}.{extension}"))
    }

    /// Writes a soup.
    pub fn write(&self, soup: &[Corners], encoding: Encoding) -> PathBuf {
        let (extension, bytes) = match encoding {
            Encoding::BinaryStl => ("stl", binary_stl(soup)),
            Encoding::AsciiStl => ("stl", ascii_stl(soup).into_bytes()),
            Encoding::Obj => ("obj", unwelded_obj(soup).into_bytes()),
        };
        let path = self.path("soup", extension);
        std::fs::write(&path, bytes).expect("the folder is writable");
        path
    }

    /// Writes a text.
    pub fn write_text(&self, extension: &str, text: &str) -> PathBuf {
        let path = self.path("text", extension);
        std::fs::write(&path, text).expect("the folder is writable");
        path
    }

    /// Repairs a file into a new one.
    pub fn repair(
        &self,
        input: &Path,
        extension: &str,
        settings: &Settings,
        limits: &Limits,
    ) -> Result<Repaired, RepairError> {
        let path = self.path("repaired", extension);
        let format = format_of_extension(&path).unwrap_or(Format::Ply);
        let outcome = repair(input, &path, format, settings, limits, &Void)?;
        Ok(Repaired { outcome, path })
    }
}

fn binary_stl(soup: &[Corners]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((soup.len() as u32).to_le_bytes());
    for corners in soup {
        bytes.extend([0; 12]);
        let coordinates = corners.iter().flatten();
        bytes.extend(coordinates.flat_map(|&x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl(soup: &[Corners]) -> String {
    let mut text = String::from("solid soup\n");
    for corners in soup {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        for [x, y, z] in corners {
            writeln!(text, "vertex {x} {y} {z}").expect("strings grow");
        }
        text.push_str("endloop\nendfacet\n");
    }
    text.push_str("endsolid soup\n");
    text
}
