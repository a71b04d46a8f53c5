//! The libraries that an OBJ file names, and the images that these name, found as they are read.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::named::Names;
use crate::io::obj::materials::{other_map, texture_name};
use crate::io::words::{Dialect, Words};

/// Enters what the OBJ file `input` names, and what its libraries name.
pub(crate) fn find_names(input: Input, names: &mut Names) -> Result<(), IoError> {
    let mut words = Words::new(input, Dialect::CommentsAndContinuations);
    let (mut last, mut looked_at) = (Vec::new(), BTreeSet::new());
    while let Some(word) = words.word()? {
        if word != b"mtllib" {
            words.skip_line()?;
            continue;
        }
        let libraries = words.raw_name()?;
        // Many files say it again for every object.
        if libraries == last {
            continue;
        }
        // One file whose name may hold blanks, or several files.
        if names.enter(&libraries) {
            look_into(&libraries, &mut looked_at, names);
        } else {
            for library in libraries.split(u8::is_ascii_whitespace) {
                if library != libraries && names.enter(library) {
                    look_into(library, &mut looked_at, names);
                }
            }
        }
        last = libraries;
    }
    Ok(())
}

/// Enters the images of a library once. What cannot be read of it names nothing.
fn look_into(library: &[u8], looked_at: &mut BTreeSet<PathBuf>, names: &mut Names) {
    let Some(path) = names.path_of(library) else { return };
    if looked_at.contains(&path) {
        return;
    }
    if let Ok(input) = Input::open(&path, 0) {
        let folder = parent_of(library);
        let mut words = Words::new(input, Dialect::Comments);
        while let Ok(Some(image)) = next_image(&mut words) {
            // From the library's own folder if it is there, else from the model's.
            if folder.is_empty() || !names.enter(&[folder, b"/", image.as_bytes()].concat()) {
                names.enter(image.as_bytes());
            }
        }
    }
    looked_at.insert(path);
}

/// The folder in a name as it is written.
fn parent_of(library: &[u8]) -> &[u8] {
    let slash = library.iter().rposition(|&byte| byte == b'/' || byte == b'\\');
    slash.map_or(&[], |slash| &library[..slash])
}

/// The next image that a library names; `None` at its end.
fn next_image(words: &mut Words) -> Result<Option<String>, IoError> {
    loop {
        let is_map = match words.word()? {
            None => return Ok(None),
            Some(word) => is_map(word),
        };
        if is_map {
            let line = words.name()?;
            let name = texture_name(&line);
            if !name.is_empty() {
                return Ok(Some(name.to_owned()));
            }
        }
        words.skip_line()?;
    }
}

fn is_map(keyword: &[u8]) -> bool {
    let keyword = keyword.to_ascii_lowercase();
    other_map(&keyword).is_some() || keyword.starts_with(b"map_") || keyword == b"decal"
}
