//! OBJ: two readers that give the same answer, and a writer.
//!
//! Files up to [`LARGEST_TOBJ_BYTES`] are read by `tobj`. Where that fails or would take too much
//! memory, and for every larger file, the streaming reader's word stands. Materials come from MTL files beside the model.

mod library;
mod materials;
mod named;
mod normalised;
mod statements;
mod stream_reader;
#[cfg(test)]
mod tests;
mod tobj_reader;
mod writer;

use crate::io::input::Input;
pub use crate::io::obj::library::{LIBRARY_MARK, library_name, write_library};
pub(crate) use crate::io::obj::named::find_names;
use crate::io::obj::stream_reader::ObjStreamReader;
use crate::io::obj::tobj_reader::{Attempt, TobjReader};
pub(crate) use crate::io::obj::writer::ObjWriter;
use crate::io::{IoError, ReadOptions, Source};
use crate::store::Scratch;

/// Larger files are never given to `tobj`, which holds six times their size in memory.
const LARGEST_TOBJ_BYTES: u64 = 4 << 20;

/// Opens an OBJ file with the reader that its size and content ask for.
pub(crate) fn open_obj(
    input: Input,
    scratch: &Scratch,
    options: &ReadOptions,
) -> Result<Source, IoError> {
    Ok(match TobjReader::open(input, LARGEST_TOBJ_BYTES, scratch, options)? {
        Attempt::Read(reader) => reader,
        Attempt::Declined(input) => Box::new(ObjStreamReader::new(input, scratch, options)),
    })
}
