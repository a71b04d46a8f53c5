//! The bytes of buffers, wherever they are: in the model file, in files beside it, or decoded.
//!
//! Nothing is held but blocks of them, in a cache of fixed size. Files are opened when they are
//! first needed, in the model's folder only. Memory: the share, and 16 KiB for each of
//! [`MOST_OPEN`] files.

use std::ops::Range;
use std::path::PathBuf;

use crate::io::beside::{file_inside, folder_of};
use crate::io::error::{IoError, shown};
use crate::io::gltf::model::{BufferRecord, Model, NONE, origin};
use crate::io::gltf::text::DATA_MARK;
use crate::io::input::Input;

/// The most files that are open at a time.
const MOST_OPEN: usize = 4;
/// Blocks that may hold the same place of the cache.
const WAYS: usize = 4;
const LEAST_BLOCK_BYTES: u64 = 4 << 10;
const MOST_BLOCK_BYTES: u64 = 64 << 10;

/// A part of a buffer in memory.
#[derive(Debug)]
struct Block {
    buffer: u32,
    number: u64,
    bytes: Vec<u8>,
}

/// Reads buffers through a cache.
pub(crate) struct Buffers {
    input: Input,
    binary: Option<Range<u64>>,
    folder: Option<PathBuf>,
    /// Files by the number of their buffer, and the one that gives way next.
    open: Vec<(u32, Input)>,
    next_open: usize,
    block_shift: u32,
    blocks: Vec<Block>,
    /// By set: the block that gives way next.
    hands: Vec<u8>,
    last: usize,
}

impl Buffers {
    pub(crate) fn new(input: Input, binary: Option<Range<u64>>, share_bytes: u64) -> Self {
        let block_bytes = (share_bytes / 32).clamp(LEAST_BLOCK_BYTES, MOST_BLOCK_BYTES);
        let block_shift = block_bytes.ilog2();
        let sets = (share_bytes >> block_shift) as usize / WAYS;
        let sets = sets.clamp(1, 1 << 16);
        let empty = |_| Block { buffer: NONE, number: 0, bytes: Vec::new() };
        Self {
            folder: folder_of(input.path()),
            input,
            binary,
            open: Vec::new(),
            next_open: 0,
            block_shift,
            blocks: (0..WAYS * sets).map(empty).collect(),
            hands: vec![0; sets],
            last: 0,
        }
    }

    pub(crate) fn input(&self) -> &Input {
        &self.input
    }

    /// Finds the bytes of a buffer, and how many there are.
    pub(crate) fn locate(
        &mut self,
        model: &mut Model,
        number: u32,
    ) -> Result<BufferRecord, IoError> {
        let mut record = model.buffer(number)?;
        if record.origin == origin::COMPRESSED {
            let found = "none: it is for the extension meshopt_compression, which is not read";
            return Err(model.wrong(("buffer", number), "an address or a chunk", found));
        }
        if record.origin != origin::UNKNOWN {
            return Ok(record);
        }
        let there = match model.text_of(record.uri)? {
            None => {
                let chunk = self.binary.clone().filter(|_| number == 0);
                let Some(chunk) = chunk else {
                    return Err(model.wrong(("buffer", number), "an address or a chunk", "none"));
                };
                (record.origin, record.start) = (origin::CHUNK, chunk.start);
                chunk.end - chunk.start
            }
            Some(uri) => match uri.strip_prefix(DATA_MARK).and_then(|text| text.parse().ok()) {
                Some(segment) if segment < model.segments.table.len() => {
                    let [start, length] = model.segments.table.get(segment)?;
                    (record.origin, record.start) = (origin::SEGMENT, start);
                    length
                }
                _ => {
                    record.origin = origin::FILE;
                    self.file(model, number, &uri)?.size_bytes()
                }
            },
        };
        if record.length > there {
            let expected = format!("{} bytes", record.length);
            return Err(model.wrong(("buffer", number), expected, format!("{there}")));
        }
        model.buffers.set(number.into(), record)?;
        Ok(record)
    }

    /// The file of a buffer, opened if it is not.
    fn file(&mut self, model: &Model, number: u32, uri: &str) -> Result<&Input, IoError> {
        if let Some(at) = self.open.iter().position(|(buffer, _)| *buffer == number) {
            return Ok(&self.open[at].1);
        }
        let name = unescaped(uri);
        let path = self.folder.as_ref().and_then(|folder| file_inside(folder, &name));
        let Some(path) = path else {
            let found = format!("none called {}", shown(&name));
            return Err(model.wrong(("buffer", number), "a file in the model's folder", found));
        };
        let file = (number, Input::open(&path, 0)?);
        let at = self.next_open;
        self.next_open = (at + 1) % MOST_OPEN;
        match self.open.get_mut(at) {
            Some(slot) => *slot = file,
            None => self.open.push(file),
        }
        Ok(&self.open[at].1)
    }

    /// Reads all of `bytes` at a place of a buffer that was located.
    #[inline]
    pub(crate) fn read(
        &mut self,
        model: &mut Model,
        buffer: u32,
        mut offset: u64,
        mut bytes: &mut [u8],
    ) -> Result<(), IoError> {
        loop {
            let number = offset >> self.block_shift;
            let block = &self.blocks[self.last];
            if block.buffer != buffer || block.number != number {
                self.last = self.find(model, buffer, number)?;
            }
            let block = &self.blocks[self.last].bytes;
            let at = (offset & ((1 << self.block_shift) - 1)) as usize;
            let count = bytes.len().min(block.len() - at);
            let (now, later) = bytes.split_at_mut(count);
            now.copy_from_slice(&block[at..at + count]);
            if later.is_empty() {
                return Ok(());
            }
            bytes = later;
            offset += count as u64;
        }
    }

    /// The place of a block in the cache, after loading it.
    fn find(&mut self, model: &mut Model, buffer: u32, number: u64) -> Result<usize, IoError> {
        const MIX: u64 = 0x9e37_79b9_7f4a_7c15;
        let sets = self.hands.len() as u64;
        let set = (number.wrapping_add(u64::from(buffer).wrapping_mul(MIX) >> 32) % sets) as usize;
        for at in WAYS * set..WAYS * (set + 1) {
            let block = &self.blocks[at];
            if block.buffer == buffer && block.number == number {
                return Ok(at);
            }
        }
        let hand = &mut self.hands[set];
        let at = WAYS * set + usize::from(*hand);
        *hand = (*hand + 1) % WAYS as u8;
        self.load(model, at, buffer, number)?;
        Ok(at)
    }

    #[cold]
    fn load(
        &mut self,
        model: &mut Model,
        at: usize,
        buffer: u32,
        number: u64,
    ) -> Result<(), IoError> {
        let record = model.buffer(buffer)?;
        let block_bytes = 1 << self.block_shift;
        let first = number << self.block_shift;
        let mut bytes = std::mem::take(&mut self.blocks[at].bytes);
        self.blocks[at].buffer = NONE;
        // The last block ends with the buffer; what is asked for was checked to be in it.
        bytes.resize(record.length.saturating_sub(first).min(block_bytes) as usize, 0);
        assert!(!bytes.is_empty(), "byte {first} of a buffer of {}", record.length);
        let offset = record.start + first;
        match record.origin {
            origin::CHUNK => self.input.read_at(&mut bytes, offset)?,
            origin::SEGMENT => model.segments.read_at(&mut bytes, offset)?,
            _ => {
                let uri = model.text_of(record.uri)?.unwrap_or_default();
                self.file(model, buffer, &uri)?.read_at(&mut bytes, offset)?;
            }
        }
        self.blocks[at] = Block { buffer, number, bytes };
        Ok(())
    }
}

/// An address with its percent signs resolved.
pub(crate) fn unescaped(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let digit = |at: usize| after.get(at).and_then(|&byte| char::from(byte).to_digit(16));
        match digit(0).zip(digit(1)).filter(|_| *first == b'%') {
            Some((high, low)) => {
                bytes.push((16 * high + low) as u8);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_are_resolved_where_digits_follow() {
        assert_eq!(unescaped("a%20b%2Ebin"), b"a b.bin");
        assert_eq!(unescaped("100%.bin%2"), b"100%.bin%2");
        assert_eq!(unescaped("%2e%2E/%zz"), b"../%zz");
    }
}
