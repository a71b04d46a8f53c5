//! Which format a file has: by its first bytes, and by its extension where those say nothing.

use std::path::Path;

use crate::io::Format;
use crate::io::error::{IoError, Place, shown};
use crate::io::gltf::MAGIC;
use crate::io::input::Input;
use crate::io::off::is_off_keyword;
use crate::io::packed::{Packing, Unpacker, content_name};
use crate::io::stl::{facets_by_size, may_be_facets};
use crate::io::words::MARK;
use crate::store::Scratch;

/// How much of the content is looked at.
const HEAD_BYTES: usize = 8 << 10;

/// Statements that OBJ files begin with.
const OBJ_KEYWORDS: [&[u8]; 12] =
    [b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl"];

/// The format of a file, told by its content first and its extension second.
///
/// Of a packed file only the head is unpacked: what is refused here is no model, but where the head
/// is binary the whole content may still turn out to be none.
///
/// # Errors
/// The file cannot be opened, is of a format that is not read yet, or of none that is known.
pub fn detect(path: &Path) -> Result<Format, IoError> {
    let mut input = Input::open(path, 0)?;
    match Packing::of(input.look_ahead(HEAD_BYTES)?) {
        Some(packing) => format_of_head(&Unpacker::new(input, packing)?),
        None => format_of(&mut input),
    }
}

/// Opens a file, unpacks it if it is packed, and tells its format.
///
/// # Errors
/// As for [`detect`]; or the packed stream is broken, or the scratch folder fails.
pub(crate) fn open_model(
    path: &Path,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<(Input, Format), IoError> {
    let mut input = Input::open(path, share_bytes)?;
    if let Some(packing) = Packing::of(input.look_ahead(HEAD_BYTES)?) {
        let unpacker = Unpacker::new(input, packing)?;
        format_of_head(&unpacker)?;
        input = unpacker.unpack(scratch, share_bytes)?;
    }
    let format = format_of(&mut input)?;
    Ok((input, format))
}

fn format_of_head(unpacker: &Unpacker) -> Result<Format, IoError> {
    let (path, head) = (unpacker.path(), unpacker.head());
    judge(path, &content_name(path), &head[..head.len().min(HEAD_BYTES)], unpacker.size_bytes())
}

fn format_of(input: &mut Input) -> Result<Format, IoError> {
    let path = input.path().to_path_buf();
    let name = if input.is_unpacked() { content_name(&path) } else { path.clone() };
    let size_bytes = input.size_bytes();
    let head = input.look_ahead(HEAD_BYTES)?;
    judge(&path, &name, &head[..head.len().min(HEAD_BYTES)], Some(size_bytes))
}

/// The format of content that begins with `head` and is called `name`; its size may not be known.
fn judge(
    path: &Path,
    name: &Path,
    head: &[u8],
    size_bytes: Option<u64>,
) -> Result<Format, IoError> {
    // Whether the archive holds a model is told when it is opened.
    if head.starts_with(b"PK\x03\x04") {
        return Ok(Format::ThreeMf);
    }
    let refused = |found: String| {
        let expected = "an OBJ, STL, PLY, OFF, 3MF or glTF file";
        Err(IoError::unreadable(path, Place::Byte(0), expected, found))
    };
    if head.is_empty() {
        return refused("an empty file".to_owned());
    }
    if Packing::of(head).is_some() {
        return refused("a packed file in a packed file".to_owned());
    }
    if let Some(format) = by_content(head, size_bytes) {
        return Ok(format);
    }
    match format_of_extension(name) {
        Some(Format::ThreeMf) => refused(shown(head)),
        Some(format) if format == Format::Stl || !is_mostly_zero(head) => Ok(format),
        _ => refused(shown(head)),
    }
}

/// Whether this is no text, whatever its name says; a stray zero byte does no harm.
fn is_mostly_zero(head: &[u8]) -> bool {
    2 * head.iter().filter(|&&byte| byte == 0).count() >= head.len()
}

/// The format that a file name asks for.
#[must_use]
pub fn format_of_extension(path: &Path) -> Option<Format> {
    match extension(path)?.as_str() {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "ply" => Some(Format::Ply),
        "off" | "coff" | "noff" => Some(Format::Off),
        "3mf" => Some(Format::ThreeMf),
        // Text with the extension `.gltf` is told by its content; it is not written.
        "glb" => Some(Format::Glb),
        _ => None,
    }
}

/// The format that the whole name of a model says, also of a packed one (`chair.obj.gz`).
#[must_use]
pub fn format_of_name(path: &Path) -> Option<Format> {
    let name = content_name(path);
    match extension(&name)?.as_str() {
        "gltf" => Some(Format::Glb),
        _ => format_of_extension(&name),
    }
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

fn by_content(head: &[u8], size_bytes: Option<u64>) -> Option<Format> {
    if head.starts_with(MAGIC) {
        return Some(Format::Glb);
    }
    let first_line = head.split(|&b| b == b'\n').next().unwrap_or_default();
    if first_line.trim_ascii_end() == b"ply" {
        return Some(Format::Ply);
    }
    let is_binary_stl = match size_bytes {
        Some(size_bytes) => facets_by_size(head, size_bytes).is_some_and(|header| header.exact),
        None => may_be_facets(head),
    };
    if is_binary_stl {
        return Some(Format::Stl);
    }
    if head.contains(&0) {
        return None;
    }
    let head = head.strip_prefix(MARK).unwrap_or(head);
    // No other format is JSON.
    if head.trim_ascii_start().starts_with(b"{") {
        return Some(Format::Glb);
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
            (b"\xef\xbb\xbfv 1 2 3\n", Format::Obj),
            (b"\xef\xbb\xbfsolid a\n", Format::Stl),
            (b"PK\x03\x04", Format::ThreeMf),
            (b"glTF\x02\0\0\0", Format::Glb),
            (b"\xef\xbb\xbf \n{\"asset\":{}}", Format::Glb),
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
        assert!(matches!(detected("a.3mf", b"x"), Err(IoError::Unreadable { .. })));
    }
}
