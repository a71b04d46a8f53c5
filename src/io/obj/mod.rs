//! OBJ: two readers that give the same answer, and a writer.
//!
//! Files up to [`LARGEST_TOBJ_BYTES`] are read by `tobj`. Where that fails, and for every larger
//! file, the streaming reader's word stands. Materials come from MTL files beside the model.

mod materials;
mod normalised;
mod statements;
mod stream_reader;
#[cfg(test)]
mod tests;
mod tobj_reader;
mod writer;

use std::path::Path;

use crate::io::obj::stream_reader::ObjStreamReader;
use crate::io::obj::tobj_reader::TobjReader;
pub(crate) use crate::io::obj::writer::ObjWriter;
use crate::io::{IoError, ReadOptions, Source};
use crate::store::Scratch;

/// Larger files are never given to `tobj`, which holds four times their size in memory.
const LARGEST_TOBJ_BYTES: u64 = 4 << 20;

/// Opens an OBJ file with the reader that its size and content ask for.
pub(crate) fn open_obj(
    path: &Path,
    scratch: &Scratch,
    options: &ReadOptions,
) -> Result<Source, IoError> {
    if let Some(reader) = TobjReader::open(path, LARGEST_TOBJ_BYTES)? {
        return Ok(Box::new(reader));
    }
    Ok(Box::new(ObjStreamReader::open(path, scratch, options)?))
}
