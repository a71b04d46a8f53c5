//! Which files a model names: libraries of OBJ files and the images in them, images of PLY files,
//! buffers and images of glTF files.
//!
//! In:         a model. Out: every place that its readers look at, and whether a file is there.
//! Invariant:  the places are found as the readers find them. Nothing outside of the model's folder
//!             is looked at, also where links lead there.
//! Memory:     [`MOST_NAMED`] names.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

use crate::io::beside::{file_inside, folder_of};
use crate::io::detect::open_model;
use crate::io::error::IoError;
use crate::io::words::{Dialect, Words};
use crate::io::{Format, gltf, obj};
use crate::store::Scratch;

/// The most names that are kept; a model that has more is told.
pub const MOST_NAMED: usize = 1 << 14;

/// What a model names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NamedFiles {
    /// Files by their ways from the model's folder, in order; whether each is there.
    pub files: BTreeMap<PathBuf, bool>,
    /// The first name that leads out of the folder, as text; no reader follows it.
    pub outside: Option<String>,
    /// Whether there are more names than are kept.
    pub has_more: bool,
}

/// The names of a model, as they are found.
pub(crate) struct Names {
    /// Where the model's folder really is, if it is there.
    folder: Option<PathBuf>,
    named: NamedFiles,
}

impl Names {
    fn of(model: &Path) -> Self {
        Self { folder: folder_of(model), named: NamedFiles::default() }
    }

    /// Enters a name that stands in the model or in a file that it names; whether it is there.
    pub(crate) fn enter(&mut self, name: &[u8]) -> bool {
        let Some(folder) = self.folder.as_ref().filter(|_| !name.is_empty()) else { return false };
        let Some(way) = way_inside(name) else {
            let text = || String::from_utf8_lossy(name).into_owned();
            self.named.outside.get_or_insert_with(text);
            return false;
        };
        let is_there = file_inside(folder, name).is_some();
        if !is_there && folder.join(&way).exists() {
            self.named.outside.get_or_insert_with(|| way.to_string_lossy().into_owned());
        } else if self.named.files.len() < MOST_NAMED || self.named.files.contains_key(&way) {
            self.named.files.insert(way, is_there);
        } else {
            self.named.has_more = true;
        }
        is_there
    }

    /// The real path of a name, if it is one of a file in the folder.
    pub(crate) fn path_of(&self, name: &[u8]) -> Option<PathBuf> {
        file_inside(self.folder.as_ref()?, name)
    }
}

/// A name as a way from the folder down, without steps on the spot; `None` where it leads out.
fn way_inside(name: &[u8]) -> Option<PathBuf> {
    let name: Vec<u8> = name.iter().map(|&b| if b == b'\\' { b'/' } else { b }).collect();
    let mut way = PathBuf::new();
    for part in Path::new(OsStr::from_bytes(&name)).components() {
        match part {
            Component::Normal(part) => way.push(part),
            Component::CurDir => {}
            _ => return None,
        }
    }
    (!way.as_os_str().is_empty()).then_some(way)
}

/// Finds what the model at `path` names. Packed content is spilled to the scratch folder.
///
/// # Errors
/// The model cannot be read, or the scratch folder fails.
pub fn named_files(
    path: &Path,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<NamedFiles, IoError> {
    let (mut input, format) = open_model(path, scratch, share_bytes)?;
    let mut names = Names::of(path);
    match format {
        Format::Obj => obj::find_names(input, &mut names)?,
        Format::Ply => find_images(Words::new(input, Dialect::Plain), &mut names)?,
        Format::Glb => gltf::find_names(&mut input, &mut names, scratch, share_bytes)?,
        Format::Stl | Format::Off | Format::ThreeMf => {}
    }
    Ok(names.named)
}

/// The images that the header of a PLY file names.
fn find_images(mut words: Words, names: &mut Names) -> Result<(), IoError> {
    loop {
        match words.word_on_line()? {
            Some(b"end_header") => return Ok(()),
            Some(b"comment") => {
                let comment = words.short_rest()?.unwrap_or_default();
                if let Some(name) = comment.strip_prefix("TextureFile ") {
                    names.enter(name.trim().as_bytes());
                }
            }
            _ => {}
        }
        if !words.skip_line()? {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> NamedFiles {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let root = folder.path().join("models");
        for (name, content) in files {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
            std::fs::write(path, content).expect("writable");
        }
        let scratch = Scratch::new(folder.path());
        named_files(&root.join(files[0].0), &scratch, 1 << 20).expect("readable")
    }

    fn ways(named: &NamedFiles) -> Vec<(&str, bool)> {
        named.files.iter().map(|(way, there)| (way.to_str().expect("text"), *there)).collect()
    }

    #[test]
    fn an_obj_file_names_its_libraries_and_their_images() {
        let library = "newmtl a\nmap_Kd -s 1 1 wood grain.png\nbump -bm 0.5 .\\bump.png\n\
                       map_Kd gone.png\nmap_d ../out.png\n";
        let named = found(&[
            ("a.obj", "v 0 0 0\nmtllib mtl/a b.mtl\nmtllib x.mtl y.mtl # both\nf 1 1 1\n"),
            ("mtl/a b.mtl", library),
            ("x.mtl", "newmtl x\n"),
            ("mtl/bump.png", "bump"),
            ("wood grain.png", "wood"),
        ]);
        let expected = [
            ("gone.png", false),
            ("mtl/a b.mtl", true),
            ("mtl/bump.png", true),
            ("mtl/gone.png", false),
            ("mtl/wood grain.png", false),
            ("wood grain.png", true),
            ("x.mtl", true),
        ];
        let of_interest: Vec<(&str, bool)> = ways(&named)
            .into_iter()
            .filter(|(way, _)| expected.iter().any(|e| e.0 == *way))
            .collect();
        assert_eq!(of_interest, expected);
        assert!(named.files.contains_key(Path::new("y.mtl")), "it may come to be");
        assert_eq!(named.outside.as_deref(), Some("mtl/../out.png"), "as it is followed first");
    }

    #[test]
    fn ply_and_gltf_files_name_images_and_buffers() {
        let ply = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nend_header\n";
        assert_eq!(ways(&found(&[("a.ply", ply), ("a.png", "x")])), [("a.png", true)]);
        let gltf = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"a%20b.bin","byteLength":1},
            {"uri":"data:;base64,AAAA","byteLength":3}],"images":[{"uri":"i.png"},{"bufferView":0}]}"#;
        let named = found(&[("a.gltf", gltf), ("a b.bin", "x")]);
        assert_eq!(ways(&named), [("a b.bin", true), ("i.png", false)]);
        assert_eq!(ways(&found(&[("a.stl", "solid mtllib a.mtl\nendsolid\n")])), []);
    }

    #[test]
    fn links_that_lead_out_are_outside() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let root = folder.path().join("models");
        std::fs::create_dir(&root).expect("a folder");
        std::fs::write(folder.path().join("secret"), "x").expect("writable");
        std::os::unix::fs::symlink("../secret", root.join("a.mtl")).expect("a link");
        std::fs::write(root.join("a.obj"), "mtllib a.mtl\nv 0 0 0\n").expect("writable");
        let scratch = Scratch::new(folder.path());
        let named = named_files(&root.join("a.obj"), &scratch, 1 << 20).expect("readable");
        assert_eq!((ways(&named), named.outside.as_deref()), (vec![], Some("a.mtl")));
    }
}
