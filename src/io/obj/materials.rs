//! The materials of an OBJ file: MTL files from its own folder, parsed by `tobj`.
//!
//! Only lines that mean something to us, and that parse, are handed on, one material at a time:
//! `tobj` refuses a whole file for one bad line, and holds it whole. Libraries that are missing,
//! lie outside of the folder (also by links) or cannot be read leave their materials without
//! properties. Each is read once. Memory: the share, spilled beyond.

use std::collections::BTreeSet;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::io::beside::{file_inside, folder_of};
use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::names::Materials;
use crate::io::numbers::parse_number;
use crate::io::words::{Dialect, Words};
use crate::mesh::{Maps, Material, OtherMaps, Texture};
use crate::store::Scratch;

/// The most names of libraries in one file, and the most files that they lead to.
const MOST_NAMES: u64 = 1 << 16;
const MOST_FILES: usize = 4096;

/// What the libraries of a file define, by name.
pub(crate) struct Library {
    /// The model, and where its folder really is, if it is there.
    model: PathBuf,
    folder: Option<PathBuf>,
    /// Names so far, and the last statement: many files say it again for every object.
    names: u64,
    last: Vec<u8>,
    /// Device and inode of the files that were read.
    loaded: BTreeSet<(u64, u64)>,
    defined: Materials,
}

impl Library {
    /// Nothing yet; libraries are sought beside `model`.
    pub(crate) fn new(model: &Path, scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            model: model.to_path_buf(),
            folder: folder_of(model),
            names: 0,
            last: Vec::new(),
            loaded: BTreeSet::new(),
            defined: Materials::new(scratch, share_bytes),
        }
    }

    /// Reads what `mtllib` names: one file whose name may hold blanks, or several files.
    pub(crate) fn load(&mut self, names: &[u8]) -> Result<(), IoError> {
        if names == self.last {
            return Ok(());
        }
        self.last = names.to_vec();
        if let Some(path) = self.existing(names)? {
            return self.load_file(&path);
        }
        for name in names.split(u8::is_ascii_whitespace) {
            if let Some(path) = self.existing(name)? {
                self.load_file(&path)?;
            }
        }
        Ok(())
    }

    /// The number of a material that a face of the file at `path` uses.
    pub(crate) fn number(
        &mut self,
        used: &mut Materials,
        path: &Path,
        name: &str,
    ) -> Result<u32, IoError> {
        let before = used.count();
        let number = used.number(path, name)?;
        if used.count() > before
            && let Some(known) = self.defined.find(name)?
        {
            used.set(number, &self.defined.get(known)?)?;
        }
        Ok(number)
    }

    /// The path of a file inside of the model's folder, if it is there.
    fn existing(&mut self, name: &[u8]) -> Result<Option<PathBuf>, IoError> {
        self.names += 1;
        if self.names > MOST_NAMES {
            return Err(IoError::too_many(&self.model, "names of material libraries", MOST_NAMES));
        }
        Ok(self.folder.as_ref().and_then(|folder| file_inside(folder, name)))
    }

    fn load_file(&mut self, path: &Path) -> Result<(), IoError> {
        // A library that cannot be read costs its materials' properties, never the model.
        let Ok(file) = std::fs::metadata(path) else { return Ok(()) };
        if !self.loaded.insert((file.dev(), file.ino())) {
            return Ok(());
        }
        if self.loaded.len() > MOST_FILES {
            let what = "material libraries";
            return Err(IoError::too_many(&self.model, what, MOST_FILES as u64));
        }
        let Ok(input) = Input::open(path, 0) else { return Ok(()) };
        let mut words = Words::new(input, Dialect::Comments);
        let (mut lines, mut maps) = (Lines::default(), OtherMaps::default());
        while let Ok(Some(statement)) = read_line(&mut words) {
            let (keyword, line) = match statement {
                Stated::Line(keyword, line) => (keyword, line),
                Stated::Map(map) => {
                    maps = maps.with(map);
                    continue;
                }
            };
            if keyword == Keyword::Name {
                let text = std::mem::take(&mut lines).concat();
                self.define(path, &text, std::mem::take(&mut maps))?;
            }
            // The last of several equal statements counts.
            lines[keyword as usize] = line;
        }
        self.define(path, &lines.concat(), maps)
    }

    /// An image that the library at `path` names: from its own folder, if it is there, else from
    /// the model's.
    fn texture(&self, path: &Path, name: String) -> Texture {
        let own = self.folder.as_ref().and_then(|folder| {
            let below = path.parent()?.strip_prefix(folder).ok()?.to_str()?;
            let joined = format!("{below}/{name}");
            let is_there = !below.is_empty() && file_inside(folder, joined.as_bytes()).is_some();
            is_there.then_some(joined)
        });
        Texture::Beside(own.unwrap_or(name))
    }

    /// Adds the material of a text that holds one.
    fn define(&mut self, path: &Path, text: &str, maps: OtherMaps) -> Result<(), IoError> {
        let Ok((materials, _)) = tobj::load_mtl_buf(&mut text.as_bytes()) else { return Ok(()) };
        for material in materials {
            let stated = |name: &str| material.unknown_param.get(name).map(String::as_str);
            let number = |name| {
                let number = stated(name).and_then(|text| text.parse::<f32>().ok());
                number.filter(|number| number.is_finite())
            };
            let dissolve = material.dissolve.map(|d| d as f32).filter(|d| d.is_finite());
            let opacity = dissolve.or(number("Tr").map(|tr| 1.0 - tr));
            let material = Material {
                transparent: opacity.is_some_and(|opacity| opacity < 1.0)
                    || number("Tr").is_some_and(|tr| tr > 0.0),
                diffuse: material
                    .diffuse
                    .map(|c| c.map(|channel| channel as f32))
                    .filter(is_finite),
                opacity: opacity.map(|opacity| opacity.clamp(0.0, 1.0)),
                emissive: stated("Ke").and_then(colour).filter(is_finite),
                metallic: number("Pm"),
                roughness: number("Pr"),
                alpha_cutoff: None,
                texture: material.diffuse_texture.map(|name| self.texture(path, name)),
                maps: Maps::default(),
                other_maps: maps,
                name: material.name,
            };
            let number = self.defined.number(path, &material.name)?;
            self.defined.set(number, &material)?;
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
    Emissive,
    Metallic,
    Roughness,
    Texture,
}

/// The statements of one material, by keyword.
type Lines = [String; 8];

/// What a library states.
enum Stated {
    /// A statement for `tobj`, in its words.
    Line(Keyword, String),
    /// A map that we know of, and no more.
    Map(OtherMaps),
}

/// The next statement that means something; `None` at the end of the file.
fn read_line(words: &mut Words) -> Result<Option<Stated>, IoError> {
    loop {
        let (keyword, needed) = match words.word()? {
            None => return Ok(None),
            Some(b"newmtl") => (Keyword::Name, 0),
            Some(b"Kd") => (Keyword::Diffuse, 3),
            Some(b"d") => (Keyword::Dissolve, 1),
            Some(b"Tr") => (Keyword::Transparency, 1),
            Some(b"Ke") => (Keyword::Emissive, 3),
            Some(b"Pm") => (Keyword::Metallic, 1),
            Some(b"Pr") => (Keyword::Roughness, 1),
            Some(b"map_Kd") => (Keyword::Texture, 0),
            Some(word) => match other_map(word) {
                Some(map) => return Ok(Some(Stated::Map(map))),
                None => {
                    words.skip_line()?;
                    continue;
                }
            },
        };
        match keyword {
            Keyword::Name => {
                return Ok(Some(Stated::Line(keyword, format!("newmtl {}\n", words.name()?))));
            }
            // The name may follow options, and may hold blanks: what begins with a dash is skipped.
            Keyword::Texture => {
                let line = words.name()?;
                let name = texture_name(&line);
                return Ok(Some(Stated::Line(keyword, format!("map_Kd {name}\n"))));
            }
            _ => {}
        }
        let mut numbers = Vec::new();
        while let Some(word) = words.word_on_line()? {
            // `d -halo 0.5` has a word in front of its number.
            numbers.extend(parse_number(word).filter(|_| numbers.len() < needed));
        }
        if numbers.len() == needed {
            let numbers: Vec<_> = numbers.iter().map(f64::to_string).collect();
            let word = ["newmtl", "Kd", "d", "Tr", "Ke", "Pm", "Pr", "map_Kd"][keyword as usize];
            return Ok(Some(Stated::Line(keyword, format!("{word} {}\n", numbers.join(" ")))));
        }
    }
}

/// The map that a statement gives, if we know of such.
pub(crate) fn other_map(keyword: &[u8]) -> Option<OtherMaps> {
    Some(match keyword.to_ascii_lowercase().as_slice() {
        b"map_bump" | b"bump" | b"norm" | b"map_kn" | b"disp" => OtherMaps::NORMAL,
        b"map_ks" | b"map_ns" | b"map_pr" | b"map_pm" | b"map_ps" | b"refl" => OtherMaps::GLOSS,
        b"map_ke" => OtherMaps::EMISSION,
        b"map_d" | b"map_tr" => OtherMaps::OPACITY,
        b"map_ao" => OtherMaps::OCCLUSION,
        _ => return None,
    })
}

fn is_finite(colour: &[f32; 3]) -> bool {
    colour.iter().all(|channel| channel.is_finite())
}

/// Three numbers in words.
fn colour(text: &str) -> Option<[f32; 3]> {
    let mut numbers = text.split_ascii_whitespace().map(|word| word.parse().ok());
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

/// The name of an image behind the options of its statement (`-s 1 1 1`, `-clamp on`, ...).
pub(crate) fn texture_name(line: &str) -> &str {
    let mut rest = line.trim_start();
    while rest.starts_with('-') {
        let takes_word = ["-imfchan", "-type", "-texres"].iter().any(|o| rest.starts_with(o));
        rest = after_word(rest);
        if takes_word {
            rest = after_word(rest);
        }
        // Numbers and switches belong to the option.
        while let Some(word) = rest.split_ascii_whitespace().next()
            && (["on", "off"].contains(&word) || word.parse::<f64>().is_ok())
            && !after_word(rest).is_empty()
        {
            rest = after_word(rest);
        }
    }
    rest
}

fn after_word(text: &str) -> &str {
    text.split_once(|c: char| c.is_ascii_whitespace()).map_or("", |(_, rest)| rest.trim_start())
}
