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
use crate::io::words::{Dialect, Words, parse_number};
use crate::mesh::Material;

/// Further materials of a file's libraries have no properties.
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
        // A library that cannot be opened costs its materials' properties, never the model.
        let Ok(input) = Input::open(path, 0) else { return Ok(()) };
        let mut words = Words::new(input, Dialect::Comments);
        let mut text = String::new();
        loop {
            let line = match read_line(&mut words) {
                Ok(Some(line)) => line,
                Ok(None) | Err(IoError::Unreadable { .. }) => break,
                Err(error) => return Err(error),
            };
            if line.starts_with("newmtl ") {
                self.define(&text);
                text.clear();
            }
            // The last of several equal lines counts, so old ones need not be kept.
            if text.len() < 16 << 10 {
                text.push_str(&line);
            }
        }
        self.define(&text);
        Ok(())
    }

    /// Adds the material of a text that holds one.
    fn define(&mut self, text: &str) {
        let Ok((materials, _)) = tobj::load_mtl_buf(&mut text.as_bytes()) else { return };
        for material in materials {
            if self.defined.len() >= MOST_DEFINITIONS {
                return;
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
    }
}

/// The next line that `tobj` shall see, in its words; empty for all others.
fn read_line(words: &mut Words) -> Result<Option<String>, IoError> {
    let keyword = match words.word()? {
        None => return Ok(None),
        Some(b"newmtl") => "newmtl",
        Some(b"Kd") => "Kd",
        Some(b"d") => "d",
        Some(b"Tr") => "Tr",
        Some(_) => {
            words.skip_line()?;
            return Ok(Some(String::new()));
        }
    };
    if keyword == "newmtl" {
        let name = words.name()?;
        let known = !name.is_empty();
        return Ok(Some(if known { format!("newmtl {name}\n") } else { String::new() }));
    }
    let mut numbers = Vec::new();
    while let Some(word) = words.word_on_line()? {
        // `d -halo 0.5` has a word in front of its number.
        numbers.extend(parse_number(word).filter(|_| numbers.len() < 3));
    }
    let needed = if keyword == "Kd" { 3 } else { 1 };
    if numbers.len() < needed {
        return Ok(Some(String::new()));
    }
    let numbers: Vec<_> = numbers[..needed].iter().map(f64::to_string).collect();
    Ok(Some(format!("{keyword} {}\n", numbers.join(" "))))
}
