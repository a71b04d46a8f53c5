//! Packed files: gzip and Zstandard, told by their first bytes, unpacked once into scratch.
//!
//! In: a user's file. Out: an [`Input`] over its content, which is read like any file. The head is
//! there before anything is written, so that what cannot be a model is refused at once. Memory: a
//! block, an input buffer, and the decoder's window of at most 8 MiB. Fails: streams that are
//! corrupt or end too early, with the byte of the packed file; content that swells beyond
//! [`MOST_RATIO`]; a full disk.

mod gzip;
#[cfg(test)]
mod tests;
mod zstandard;

use std::io::{BufRead, ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::io::error::{IoError, Place};
use crate::io::input::Input;
use crate::store::Scratch;

/// Content of this size is unpacked however small the packed file is.
pub(crate) const HARMLESS_BYTES: u64 = 64 << 20;
/// Beyond [`HARMLESS_BYTES`], content that takes more than this many times the bytes of the packed
/// file read so far is refused. Models stay far below: text about 4, regular grids about 50.
pub(crate) const MOST_RATIO: u64 = 256;
/// More packed bytes than this without one byte of content are no model: empty members, or a name
/// in a header that does not end.
const MOST_IDLE_BYTES: u64 = 8 << 20;
/// How much is unpacked at a time.
const BLOCK_BYTES: usize = 256 << 10;

/// How a file is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Gzip,
    Zstandard,
}

impl Packing {
    /// How content that begins like this is packed, if it is.
    pub(crate) fn of(head: &[u8]) -> Option<Self> {
        if head.starts_with(&[0x1f, 0x8b]) {
            Some(Self::Gzip)
        } else if head.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
            Some(Self::Zstandard)
        } else {
            None
        }
    }

    fn expected(self) -> &'static str {
        match self {
            Self::Gzip => "a whole gzip stream",
            Self::Zstandard => "a whole zstd stream with windows of at most 8 MiB",
        }
    }
}

/// The name that the content of a packed file has: without the packing's extension.
#[must_use]
pub fn content_name(path: &Path) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension == "gz" || extension == "zst" {
        path.with_extension("")
    } else {
        path.to_path_buf()
    }
}

/// A decoder over packed bytes.
trait Stream: Read {
    fn packed(&mut self) -> &mut PackedBytes;
}

/// The user's file as decoders want it; knows how far they have come, and what really failed.
#[derive(Debug)]
struct PackedBytes {
    input: Input,
    /// Bytes that were consumed since content came last.
    idle_bytes: u64,
    failed: Option<IoError>,
}

impl Read for PackedBytes {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(bytes.len());
        bytes[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for PackedBytes {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.idle_bytes > MOST_IDLE_BYTES {
            let expected = format!("content within {MOST_IDLE_BYTES} packed bytes");
            let place = Place::PackedByte(self.input.offset());
            self.failed = Some(IoError::unreadable(self.input.path(), place, expected, "none"));
            return Err(ErrorKind::Other.into());
        }
        if self.input.available().is_empty()
            && let Err(error) = self.input.fill()
        {
            self.failed = Some(error);
            return Err(ErrorKind::Other.into());
        }
        Ok(self.input.available())
    }

    fn consume(&mut self, count: usize) {
        self.input.consume(count);
        self.idle_bytes += count as u64;
    }
}

/// A packed file under way: its head first, then all of it.
pub(crate) struct Unpacker {
    path: PathBuf,
    packing: Packing,
    stream: Box<dyn Stream>,
    /// What was unpacked and not yet written.
    block: Vec<u8>,
    ended: bool,
}

impl Unpacker {
    /// Unpacks the head of a file, of which nothing was consumed.
    pub(crate) fn new(input: Input, packing: Packing) -> Result<Self, IoError> {
        let path = input.path().to_path_buf();
        let packed = PackedBytes { input, idle_bytes: 0, failed: None };
        let stream = match packing {
            Packing::Gzip => gzip::decode(packed),
            Packing::Zstandard => zstandard::decode(packed)
                .map_err(|e| IoError::input("prepare to unpack", &path, e))?,
        };
        let block = Vec::with_capacity(BLOCK_BYTES);
        let mut unpacker = Self { path, packing, stream, block, ended: false };
        unpacker.next_block()?;
        Ok(unpacker)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The first bytes of the content.
    pub(crate) fn head(&self) -> &[u8] {
        &self.block
    }

    /// The size of the content, if the head is all of it.
    pub(crate) fn size_bytes(&self) -> Option<u64> {
        self.ended.then_some(self.block.len() as u64)
    }

    /// Unpacks all content into a scratch file.
    pub(crate) fn unpack(mut self, scratch: &Scratch, share_bytes: u64) -> Result<Input, IoError> {
        let file = scratch.anonymous("unpacked")?;
        let mut size_bytes = 0;
        while !self.block.is_empty() {
            file.write_at(&self.block, size_bytes)?;
            size_bytes += self.block.len() as u64;
            self.check_ratio(size_bytes)?;
            self.next_block()?;
        }
        let packed_bytes = self.stream.packed().input.offset();
        let sizes = (size_bytes, packed_bytes);
        Ok(Input::unpacked(&self.path, file, sizes, share_bytes))
    }

    /// Replaces the block by the next one; empty behind the last.
    fn next_block(&mut self) -> Result<(), IoError> {
        self.block.clear();
        self.block.resize(BLOCK_BYTES, 0);
        let mut filled = 0;
        while filled < BLOCK_BYTES && !self.ended {
            match self.stream.read(&mut self.block[filled..]) {
                Ok(0) => self.ended = true,
                Ok(count) => {
                    filled += count;
                    self.stream.packed().idle_bytes = 0;
                }
                Err(error) => return Err(self.failed(&error)),
            }
        }
        self.block.truncate(filled);
        Ok(())
    }

    fn check_ratio(&mut self, unpacked_bytes: u64) -> Result<(), IoError> {
        let read_bytes = self.stream.packed().input.offset();
        if unpacked_bytes > HARMLESS_BYTES && unpacked_bytes / MOST_RATIO > read_bytes {
            let path = self.path.clone();
            return Err(IoError::Bomb { path, unpacked_bytes, read_bytes });
        }
        Ok(())
    }

    fn failed(&mut self, error: &std::io::Error) -> IoError {
        let packed = self.stream.packed();
        if let Some(failed) = packed.failed.take() {
            return failed;
        }
        let found = match error.kind() {
            ErrorKind::UnexpectedEof => "the end of the file".to_owned(),
            _ => error.to_string(),
        };
        let place = Place::PackedByte(packed.input.offset());
        IoError::unreadable(&self.path, place, self.packing.expected(), found)
    }
}
