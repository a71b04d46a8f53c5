//! Files that a model names: only those in its own folder, also where links lead elsewhere.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

/// Where the folder of `model` really is, if it is there.
pub(crate) fn folder_of(model: &Path) -> Option<PathBuf> {
    let folder = match model.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    folder.canonicalize().ok()
}

/// The path of the file `name` inside of a canonical folder, if it is there.
pub(crate) fn file_inside(folder: &Path, name: &[u8]) -> Option<PathBuf> {
    let name: Vec<u8> = name.iter().map(|&b| if b == b'\\' { b'/' } else { b }).collect();
    let relative = Path::new(OsStr::from_bytes(&name));
    let stays_inside =
        relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays_inside || name.is_empty() {
        return None;
    }
    // Links may lead elsewhere: where the file really is counts.
    let path = folder.join(relative).canonicalize().ok()?;
    (path.starts_with(folder) && path.is_file()).then_some(path)
}
