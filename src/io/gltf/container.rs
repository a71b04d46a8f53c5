//! The chunks of a GLB file: JSON first, then the buffer that has no name. A text file is one chunk.

use std::ops::Range;

use crate::io::error::{IoError, Place, shown};
use crate::io::input::Input;

/// What GLB files begin with.
pub(crate) const MAGIC: &[u8; 4] = b"glTF";
/// The only version of the container there is.
pub(crate) const VERSION: u32 = 2;
/// Magic, version and size.
pub(crate) const HEADER_BYTES: u64 = 12;
/// Size and type in front of a chunk.
pub(crate) const CHUNK_HEADER_BYTES: u64 = 8;
/// Types of chunks.
pub(crate) const JSON: &[u8; 4] = b"JSON";
pub(crate) const BINARY: &[u8; 4] = b"BIN\0";

/// Where things are in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Chunks {
    pub(crate) json: Range<u64>,
    pub(crate) binary: Option<Range<u64>>,
    pub(crate) is_text: bool,
}

/// Type and content of a chunk.
struct Chunk {
    kind: [u8; 4],
    content: Range<u64>,
}

/// Finds the chunks; other ones are passed over.
pub(crate) fn find_chunks(input: &mut Input) -> Result<Chunks, IoError> {
    if !input.look_ahead(MAGIC.len())?.starts_with(MAGIC) {
        return Ok(Chunks { json: 0..input.size_bytes(), binary: None, is_text: true });
    }
    let end = read_header(input)?;
    let json = match next_chunk(input, HEADER_BYTES, end)? {
        Some(chunk) if chunk.kind == *JSON => chunk.content,
        _ => return Err(unreadable(input, HEADER_BYTES, "a JSON chunk", "none")),
    };
    let mut at = json.end;
    while let Some(chunk) = next_chunk(input, at, end)? {
        if chunk.kind == *BINARY {
            return Ok(Chunks { json, binary: Some(chunk.content), is_text: false });
        }
        at = chunk.content.end;
    }
    Ok(Chunks { json, binary: None, is_text: false })
}

/// Reads the header and tells where the last chunk ends.
fn read_header(input: &mut Input) -> Result<u64, IoError> {
    let header = input.bytes(HEADER_BYTES as usize, "the header of a GLB file")?;
    let (words, _) = header.as_chunks::<4>();
    let [version, size_bytes] = [1, 2].map(|at| u32::from_le_bytes(words[at]));
    if version != VERSION {
        let found = format!("version {version}");
        return Err(unreadable(input, 4, "version 2 of GLB", &found));
    }
    let size_bytes = u64::from(size_bytes);
    if size_bytes > input.size_bytes() {
        return Err(input.ended(&format!("{size_bytes} bytes, as the header says")));
    }
    Ok(size_bytes)
}

/// The chunk at `at`; `None` where there is no room for one.
fn next_chunk(input: &mut Input, at: u64, end: u64) -> Result<Option<Chunk>, IoError> {
    let start = at + CHUNK_HEADER_BYTES;
    if start > end {
        return Ok(None);
    }
    input.seek(at);
    let header = input.bytes(CHUNK_HEADER_BYTES as usize, "the header of a chunk")?;
    let (words, _) = header.as_chunks::<4>();
    let (size_bytes, kind) = (u64::from(u32::from_le_bytes(words[0])), words[1]);
    if size_bytes > end - start {
        let found = format!("{} chunk of {size_bytes}", shown(&kind));
        let expected = format!("a chunk of at most {} bytes", end - start);
        return Err(unreadable(input, at, &expected, &found));
    }
    Ok(Some(Chunk { kind, content: start..start + size_bytes }))
}

fn unreadable(input: &Input, offset: u64, expected: &str, found: &str) -> IoError {
    IoError::unreadable(input.path(), Place::Byte(offset), expected, found)
}
