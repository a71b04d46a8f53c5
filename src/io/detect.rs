//! Which format a file has: by its first bytes, and by its extension where those say nothing.

use std::path::Path;

use crate::io::Format;
use crate::io::error::{IoError, Place, shown};
use crate::io::input::Input;
use crate::io::off::is_off_keyword;
use crate::io::stl::{HEADER_BYTES, facets_by_size};

/// How much of a file is looked at.
const HEAD_BYTES: usize = 8 << 10;

/// Statements that OBJ files begin with.
const OBJ_KEYWORDS: [&[u8]; 12] =
    [b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl"];

/// The format of a file, told by its content first and its extension second.
///
/// # Errors
/// The file cannot be opened, is of a format that is not read yet, or of none that is known.
pub fn detect(path: &Path) -> Result<Format, IoError> {
    let mut input = Input::open(path, 0)?;
    let size_bytes = input.size_bytes();
    let head = input.look_ahead(HEAD_BYTES)?;
    let head = &head[..head.len().min(HEAD_BYTES)];
    let unsupported = |format| Err(IoError::Unsupported { path: path.to_path_buf(), format });
    if head.starts_with(b"glTF") {
        return unsupported("GLB");
    }
    if head.starts_with(b"PK\x03\x04") {
        return unsupported("3MF");
    }
    if let Some(format) = by_content(head, size_bytes) {
        return Ok(format);
    }
    match extension(path).as_deref() {
        Some("glb") => return unsupported("GLB"),
        Some("3mf") => return unsupported("3MF"),
        _ => {}
    }
    let found = if head.is_empty() { "an empty file".to_owned() } else { shown(head) };
    let refusal = IoError::unreadable(path, Place::Byte(0), "an OBJ, STL, PLY or OFF file", found);
    if head.is_empty() { Err(refusal) } else { format_of_extension(path).ok_or(refusal) }
}

/// The format that a file name asks for.
#[must_use]
pub fn format_of_extension(path: &Path) -> Option<Format> {
    match extension(path)?.as_str() {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "ply" => Some(Format::Ply),
        "off" | "coff" | "noff" => Some(Format::Off),
        _ => None,
    }
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

fn by_content(head: &[u8], size_bytes: u64) -> Option<Format> {
    let first_line = head.split(|&b| b == b'\n').next().unwrap_or_default();
    if first_line.trim_ascii_end() == b"ply" {
        return Some(Format::Ply);
    }
    let counted = head.get(..HEADER_BYTES).and_then(|header| facets_by_size(header, size_bytes));
    if counted.is_some_and(|header| header.exact) {
        return Some(Format::Stl);
    }
    if head.contains(&0) {
        return None;
    }
    let keyword = first_word_outside_of_comments(head)?;
    if keyword.eq_ignore_ascii_case(b"solid") {
        Some(Format::Stl)
    } else if is_off_keyword(keyword) {
        Some(Format::Off)
    } else if OBJ_KEYWORDS.contains(&keyword) {
        Some(Format::Obj)
    } else {
        None
    }
}

fn first_word_outside_of_comments(head: &[u8]) -> Option<&[u8]> {
    head.split(|&b| b == b'\n')
        .map(<[u8]>::trim_ascii)
        .find(|line| !line.is_empty() && line[0] != b'#')?
        .split(u8::is_ascii_whitespace)
        .next()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detected(name: &str, content: &[u8]) -> Result<Format, IoError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("a file");
        detect(&path)
    }

    #[test]
    fn content_outweighs_the_extension() {
        let mut stl = vec![b's'; 80];
        stl[..6].copy_from_slice(b"solid ");
        stl.extend_from_slice(&[1, 0, 0, 0]);
        stl.extend_from_slice(&[0; 50]);
        for (content, format) in [
            (stl.as_slice(), Format::Stl),
            (b"solid a\nfacet", Format::Stl),
            (b"ply\r\nformat", Format::Ply),
            (b"# c\n\nCOFF # x\n", Format::Off),
            (b"OFF4 4 0\n", Format::Off),
            (b"# c\n\n  v 1 2 3\n", Format::Obj),
        ] {
            for name in ["a.obj", "a.stl", "a.ply", "a.off", "a"] {
                assert_eq!(detected(name, content).expect("known"), format, "{name}");
            }
        }
    }

    #[test]
    fn the_extension_decides_where_the_content_says_nothing() {
        assert_eq!(detected("a.OBJ", b"# only comments\n").expect("known"), Format::Obj);
        assert_eq!(detected("a.stl", &[0; 200]).expect("known"), Format::Stl);
        assert!(matches!(detected("a.txt", b"hello"), Err(IoError::Unreadable { .. })));
        assert!(matches!(detected("a.obj", b""), Err(IoError::Unreadable { .. })));
    }

    #[test]
    fn glb_and_3mf_are_recognised_and_refused() {
        for (name, content, expected) in [
            ("a.obj", &b"glTF\x02\0\0\0"[..], "GLB"),
            ("a", b"PK\x03\x04", "3MF"),
            ("a.3mf", b"x", "3MF"),
            ("a.glb", b"x", "GLB"),
        ] {
            let error = detected(name, content).expect_err("refused");
            assert!(matches!(&error, IoError::Unsupported { format, .. } if *format == expected));
            assert!(error.is_input());
        }
    }
}
