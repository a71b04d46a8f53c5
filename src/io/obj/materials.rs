//! The materials of an OBJ file: MTL files from its own folder, parsed by `tobj`.
//!
//! Only lines that mean something to us, and that parse, are handed on, one material at a time:
//! `tobj` refuses a whole file for one bad line, and holds it whole. Libraries that are missing,
//! lie outside of the folder or cannot be read leave their materials without properties.
//! Memory: one entry a material, at most [`MOST_DEFINITIONS`].

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::names::Names;
use crate::io::numbers::parse_number;
use crate::io::words::{Dialect, Words};
use crate::mesh::Material;

/// The most materials in the libraries of one file.
const MOST_DEFINITIONS: usize = 1 << 20;

/// What the libraries of a file define, by name.
#[derive(Debug)]
pub(crate) struct Library {
    folder: PathBuf,
    defined: HashMap<String, Material>,
}

impl Library {
    /// Nothing yet; libraries are sought beside `model`.
    pub(crate) fn new(model: &Path) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).to_path_buf();
        Self { folder, defined: HashMap::new() }
    }

    /// Reads what `mtllib` names: one file whose name may hold blanks, or several files.
    pub(crate) fn load(&mut self, names: &str) -> Result<(), IoError> {
        if let Some(path) = self.existing(names) {
            return self.load_file(&path);
        }
        for name in names.split_ascii_whitespace() {
            if let Some(path) = self.existing(name) {
                self.load_file(&path)?;
            }
        }
        Ok(())
    }

    /// The number of a material that a face uses.
    pub(crate) fn number(
        &self,
        used: &mut Names<Material>,
        path: &Path,
        name: &str,
    ) -> Result<u32, IoError> {
        used.number(path, name, |name| match self.defined.get(&name) {
            Some(material) => material.clone(),
            None => Material { name, ..Material::default() },
        })
    }

    /// The path of a file inside of the model's folder, if it is there.
    fn existing(&self, name: &str) -> Option<PathBuf> {
        let name = name.replace('\\', "/");
        let relative = Path::new(&name);
        let is_inside = relative
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        let path = self.folder.join(relative);
        (is_inside && !name.is_empty() && path.is_file()).then_some(path)
    }

    fn load_file(&mut self, path: &Path) -> Result<(), IoError> {
        // A library that cannot be read costs its materials' properties, never the model.
        let Ok(input) = Input::open(path, 0) else { return Ok(()) };
        let mut words = Words::new(input, Dialect::Comments);
        let mut lines = Lines::default();
        while let Ok(Some((keyword, line))) = read_line(&mut words) {
            if keyword == Keyword::Name {
                self.define(path, &std::mem::take(&mut lines).concat())?;
            }
            // The last of several equal statements counts.
            lines[keyword as usize] = line;
        }
        self.define(path, &lines.concat())
    }

    /// Adds the material of a text that holds one.
    fn define(&mut self, path: &Path, text: &str) -> Result<(), IoError> {
        let Ok((materials, _)) = tobj::load_mtl_buf(&mut text.as_bytes()) else { return Ok(()) };
        for material in materials {
            if self.defined.len() >= MOST_DEFINITIONS {
                return Err(IoError::too_many(path, "materials", MOST_DEFINITIONS as u64));
            }
            let opaque = material.dissolve.unwrap_or(1.0) >= 1.0;
            let tr = material.unknown_param.get("Tr").and_then(|tr| tr.parse::<f64>().ok());
            let material = Material {
                name: material.name,
                transparent: !opaque || tr.is_some_and(|tr| tr > 0.0),
                diffuse: material.diffuse.map(|colour| colour.map(|channel| channel as f32)),
            };
            self.defined.insert(material.name.clone(), material);
        }
        Ok(())
    }
}

/// A statement that `tobj` shall see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keyword {
    Name,
    Diffuse,
    Dissolve,
    Transparency,
}

/// The statements of one material, by keyword.
type Lines = [String; 4];

/// The next statement for `tobj`, in its words; `None` at the end of the file.
fn read_line(words: &mut Words) -> Result<Option<(Keyword, String)>, IoError> {
    loop {
        let (keyword, needed) = match words.word()? {
            None => return Ok(None),
            Some(b"newmtl") => (Keyword::Name, 0),
            Some(b"Kd") => (Keyword::Diffuse, 3),
            Some(b"d") => (Keyword::Dissolve, 1),
            Some(b"Tr") => (Keyword::Transparency, 1),
            Some(_) => {
                words.skip_line()?;
                continue;
            }
        };
        if keyword == Keyword::Name {
            return Ok(Some((keyword, format!("newmtl {}\n", words.name()?))));
        }
        let mut numbers = Vec::new();
        while let Some(word) = words.word_on_line()? {
            // `d -halo 0.5` has a word in front of its number.
            numbers.extend(parse_number(word).filter(|_| numbers.len() < needed));
        }
        if numbers.len() == needed {
            let numbers: Vec<_> = numbers.iter().map(f64::to_string).collect();
            let word = ["newmtl", "Kd", "d", "Tr"][keyword as usize];
            return Ok(Some((keyword, format!("{word} {}\n", numbers.join(" ")))));
        }
    }
}
