//! The page of a model: what was found, decided and done, to be compared and turned.
//!
//! In:         input and output as files that are in place, and the outcome of the repair.
//! Out:        one HTML file that holds all it shows; in a batch two small pictures beside it.
//! Invariant:  readable without script: then both pictures stand side by side, and nothing turns.
//! Memory:     the share: pictures, light meshes and bands; the readers have as much again.
//! Fails:      [`ReportError`]; then no page is put in place.

mod carried;
mod facts;
mod gallery;
mod plot;

pub use gallery::Gallery;

use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::io::{IoError, ReadOptions};
use crate::mesh::MeshSource;
use crate::monitor::Monitor;
use crate::repair::Outcome;
use crate::report::ReportError;
use crate::report::error::Halt;
use crate::report::html::{Frame, write_page};
use crate::report::image_staged::StagedFile;
use crate::report::light_mesh::{Cube, LightMesh, lighten};
use crate::report::pictures::{Picture, draw_pair};
use crate::report::preview::scene::Scene;
use crate::report::preview::{OpenSource, PreviewOptions, Side};
use crate::store::Scratch;

const COMPARE: &str = include_str!("../html/assets/compare.js");
const VIEWER: &str = include_str!("../html/assets/viewer.js");

/// What a page tells of.
#[derive(Clone, Copy, Debug)]
pub struct ModelPage<'p> {
    /// In the heading.
    pub name: &'p str,
    /// The model.
    pub input: &'p Path,
    /// Its result.
    pub output: &'p Path,
    /// What came of it; `None` where it was copied since nothing is wrong with it.
    pub outcome: Option<&'p Outcome>,
    /// Address of the page of the catalogue, if it is part of one.
    pub back: Option<&'p str>,
}

/// How large what a page shows may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageOptions {
    /// Width and height of the pictures.
    pub picture_px: u32,
    /// Triangles of each of the two meshes that turn, at most.
    pub mesh_triangles: usize,
    /// Memory for pictures and meshes; readers take as much again.
    pub share_bytes: u64,
}

impl PageOptions {
    /// For one page.
    #[must_use]
    pub const fn large(share_bytes: u64) -> Self {
        Self { picture_px: 960, mesh_triangles: 20_000, share_bytes }
    }

    /// For thousands of pages.
    #[must_use]
    pub const fn small(share_bytes: u64) -> Self {
        Self { picture_px: 512, mesh_triangles: 12_000, share_bytes }
    }
}

/// What a page shows.
struct Shown {
    pictures: [Picture; 2],
    cube: Option<Cube>,
    meshes: [LightMesh; 2],
}

/// Writes the page of a model to `path`. Readers spill into the folder of `scratch`.
///
/// # Errors
/// A file cannot be read, the page cannot be written, the share is too small, or the monitor asks to
/// stop.
pub fn write_model_page(
    path: &Path,
    model: &ModelPage,
    options: &PageOptions,
    scratch: &Scratch,
    monitor: &dyn Monitor,
) -> Result<(), ReportError> {
    let shown = look(model, options, scratch, monitor)?;
    write_shown(path, model, &shown)
}

fn look(
    model: &ModelPage,
    options: &PageOptions,
    scratch: &Scratch,
    monitor: &dyn Monitor,
) -> Result<Shown, ReportError> {
    let share_bytes = options.share_bytes;
    let open = |path: &Path| {
        let source = crate::io::open(path, scratch, &ReadOptions { share_bytes })?;
        Ok(source as Box<dyn MeshSource<Error = IoError>>)
    };
    let input: &OpenSource<IoError> = &|| open(model.input);
    let output: &OpenSource<IoError> = &|| open(model.output);
    let scene = Scene { input, output: Some(output), monitor };
    let (width_px, height_px) = (options.picture_px, options.picture_px);
    let preview = PreviewOptions { width_px, height_px, share_bytes, ..PreviewOptions::default() };
    let pictures = draw_pair(&scene, &preview)?;
    let mut shown = Shown { pictures, cube: None, meshes: Default::default() };
    if options.mesh_triangles > 0 {
        shown.cube = match model.outcome.and_then(|outcome| outcome.output.proof.bounds) {
            Some([lo, hi]) => Cube::of(lo.into(), hi.into()),
            None => Cube::around(Side::Output, output, monitor)?,
        };
    }
    if let Some(cube) = &shown.cube {
        let most = options.mesh_triangles;
        shown.meshes = [
            lighten(Side::Input, input, cube, most, monitor)?,
            lighten(Side::Output, output, cube, most, monitor)?,
        ];
    }
    Ok(shown)
}

fn write_shown(path: &Path, model: &ModelPage, shown: &Shown) -> Result<(), ReportError> {
    let staged = StagedFile::create::<IoError>(path)?;
    let mut out = BufWriter::new(staged.file());
    let frame = Frame { title: model.name, back: model.back, scripts: &[COMPARE, VIEWER] };
    let written = write_page(&mut out, &frame, |html| {
        facts::write_verdict(html, model)?;
        html.element("div", &[("class", "looks")], |html| {
            carried::write_pictures(html, &shown.pictures)?;
            match shown.cube {
                Some(_) => carried::write_viewer(html, &shown.meshes),
                None => Ok(()),
            }
        })?;
        if shown.cube.is_some() {
            carried::write_meshes(html, &shown.meshes)?;
        }
        let Some(outcome) = model.outcome else { return Ok(()) };
        facts::write_facts(html, outcome)?;
        plot::write_stages(html, outcome)?;
        facts::write_settings(html, outcome)
    });
    let flushed = written.and_then(|()| out.flush());
    flushed.map_err(|error: io::Error| Halt::from(error).at(path))?;
    drop(out);
    staged.put_in_place::<IoError>()?;
    Ok(())
}
