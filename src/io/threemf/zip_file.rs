//! A zip archive on its way out: members one after the other, each once.
//!
//! Sizes and checksums stand in front of a member and are known behind it: headers lie in the head
//! of the output, which may be patched, and no reader has to look for descriptors. No times:
//! equal contents are equal bytes. Memory: two blocks, and the deflater's window.

use std::path::Path;

use flate2::{Compress, Compression, Crc, FlushCompress, Status};

use crate::io::error::{IoError, Place};
use crate::io::output::Output;

const BLOCK_BYTES: usize = 64 << 10;
const LOCAL: &[u8] = b"PK\x03\x04";
const CENTRAL: &[u8] = b"PK\x01\x02";
const END: &[u8] = b"PK\x05\x06";
const END64: &[u8] = b"PK\x06\x06";
const LOCATOR64: &[u8] = b"PK\x06\x07";
/// Versions that know deflate, and sizes of eight bytes.
const VERSION: u16 = 20;
const VERSION64: u16 = 45;
const STORED: u16 = 0;
const DEFLATED: u16 = 8;
/// The first day that there is, 1980-01-01.
const DATE: u16 = 0x21;
/// Says that a number stands elsewhere, in eight bytes.
const ELSEWHERE: u64 = u32::MAX as u64;

/// A member that is complete, or the one under way.
#[derive(Debug)]
struct Member {
    name: String,
    method: u16,
    /// Whether its sizes have eight bytes.
    is_large: bool,
    offset: u64,
    checksum: u32,
    packed_bytes: u64,
    bytes: u64,
}

impl Member {
    /// What both headers of a member say.
    fn header(&self) -> Vec<u8> {
        let version = if self.is_large { VERSION64 } else { VERSION };
        let mut header = Vec::new();
        for number in [version, 0, self.method, 0, DATE] {
            header.extend(number.to_le_bytes());
        }
        header.extend(self.checksum.to_le_bytes());
        for size in [self.packed_bytes, self.bytes] {
            let size = if self.is_large { ELSEWHERE } else { size };
            header.extend((size as u32).to_le_bytes());
        }
        header.extend((self.name.len() as u16).to_le_bytes());
        header
    }

    /// What stands behind the name: sizes of eight bytes, and the offset in the directory.
    fn extra(&self, in_directory: bool) -> Vec<u8> {
        let mut numbers = Vec::new();
        if self.is_large {
            numbers.extend(self.bytes.to_le_bytes());
            numbers.extend(self.packed_bytes.to_le_bytes());
        }
        if in_directory && self.offset >= ELSEWHERE {
            numbers.extend(self.offset.to_le_bytes());
        }
        let mut extra = Vec::new();
        if !numbers.is_empty() {
            extra.extend(1_u16.to_le_bytes());
            extra.extend((numbers.len() as u16).to_le_bytes());
            extra.extend(numbers);
        }
        extra
    }

    fn local(&self) -> Vec<u8> {
        let extra = self.extra(false);
        let mut header = [LOCAL, &self.header()].concat();
        header.extend((extra.len() as u16).to_le_bytes());
        header.extend(self.name.as_bytes());
        header.extend(extra);
        header
    }

    fn central(&self) -> Vec<u8> {
        let extra = self.extra(true);
        let mut header = [CENTRAL, &VERSION64.to_le_bytes(), &self.header()].concat();
        header.extend((extra.len() as u16).to_le_bytes());
        // No comment, first disk, no attributes.
        header.extend([0; 10]);
        header.extend((self.offset.min(ELSEWHERE) as u32).to_le_bytes());
        header.extend(self.name.as_bytes());
        header.extend(extra);
        header
    }
}

/// Writes an archive.
pub(super) struct ZipFile {
    output: Output,
    members: Vec<Member>,
    crc: Crc,
    deflater: Compress,
    plain: Vec<u8>,
    packed: Vec<u8>,
}

impl ZipFile {
    /// An archive in an output without a byte.
    pub(super) fn new(output: Output) -> Self {
        Self {
            output,
            members: Vec::new(),
            crc: Crc::new(),
            deflater: Compress::new(Compression::default(), false),
            plain: Vec::with_capacity(BLOCK_BYTES),
            packed: Vec::with_capacity(BLOCK_BYTES),
        }
    }

    pub(super) fn path(&self) -> &Path {
        self.output.path()
    }

    /// Starts a member; `is_large` where it or what it is packed to may exceed four bytes' numbers.
    pub(super) fn start(&mut self, name: &str, is_large: bool) -> Result<(), IoError> {
        let offset = self.output.bytes();
        let (name, method) = (name.to_owned(), DEFLATED);
        let member =
            Member { name, method, is_large, offset, checksum: 0, packed_bytes: 0, bytes: 0 };
        self.output.write(&member.local())?;
        self.members.push(member);
        self.crc.reset();
        self.deflater.reset();
        Ok(())
    }

    /// Appends to the member that was started last.
    #[inline]
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        if self.plain.len() + bytes.len() > BLOCK_BYTES {
            self.deflate(FlushCompress::None)?;
        }
        self.plain.extend_from_slice(bytes);
        Ok(())
    }

    /// Completes the member that was started last.
    pub(super) fn end(&mut self) -> Result<(), IoError> {
        self.deflate(FlushCompress::Finish)?;
        let Some(member) = self.members.last_mut() else { return Ok(()) };
        member.checksum = self.crc.sum();
        (member.bytes, member.packed_bytes) = (self.deflater.total_in(), self.deflater.total_out());
        if !member.is_large && member.bytes.max(member.packed_bytes) >= ELSEWHERE {
            let (path, what) = (self.output.path().to_path_buf(), "bytes besides the mesh");
            return Err(IoError::TooLarge { path, what, limit: ELSEWHERE });
        }
        self.output.patch(&member.local(), member.offset)
    }

    /// Adds a member as it is. `show` is called twice and shows the same bytes: its header, which
    /// may lie anywhere, is known before it is written.
    pub(super) fn store(
        &mut self,
        name: &str,
        mut show: impl FnMut(&mut dyn FnMut(&[u8]) -> Result<(), IoError>) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let (mut crc, mut bytes) = (Crc::new(), 0);
        show(&mut |block| {
            crc.update(block);
            bytes += block.len() as u64;
            Ok(())
        })?;
        if bytes >= ELSEWHERE {
            let (path, what) = (self.output.path().to_path_buf(), "bytes in one image");
            return Err(IoError::TooLarge { path, what, limit: ELSEWHERE });
        }
        let member = Member {
            name: name.to_owned(),
            method: STORED,
            is_large: false,
            offset: self.output.bytes(),
            checksum: crc.sum(),
            packed_bytes: bytes,
            bytes,
        };
        self.output.write(&member.local())?;
        let mut again = Crc::new();
        show(&mut |block| {
            again.update(block);
            self.output.write(block)
        })?;
        if again.sum() != member.checksum {
            let (expected, found) = ("images that stay as they are", "another content");
            return Err(IoError::unreadable(name.as_ref(), Place::Byte(0), expected, found));
        }
        self.members.push(member);
        Ok(())
    }

    fn deflate(&mut self, flush: FlushCompress) -> Result<(), IoError> {
        self.crc.update(&self.plain);
        let mut at = 0;
        loop {
            self.packed.clear();
            let before = self.deflater.total_in();
            let status = self
                .deflater
                .compress_vec(&self.plain[at..], &mut self.packed, flush)
                .expect("a deflater takes any bytes");
            at += (self.deflater.total_in() - before) as usize;
            self.output.write(&self.packed)?;
            let is_done = match flush {
                FlushCompress::Finish => status == Status::StreamEnd,
                _ => at == self.plain.len() && self.packed.len() < self.packed.capacity(),
            };
            if is_done {
                self.plain.clear();
                return Ok(());
            }
        }
    }

    /// Writes the directory.
    pub(super) fn finish(mut self) -> Result<Output, IoError> {
        let start = self.output.bytes();
        for member in &self.members {
            self.output.write(&member.central())?;
        }
        let (end, count) = (self.output.bytes(), self.members.len() as u64);
        if end >= ELSEWHERE {
            self.output.write(&end64(start, end, count))?;
        }
        let mut record = [END, &[0; 4]].concat();
        for _ in 0..2 {
            record.extend((count as u16).to_le_bytes());
        }
        for number in [end - start, start] {
            record.extend((number.min(ELSEWHERE) as u32).to_le_bytes());
        }
        record.extend([0; 2]);
        self.output.write(&record)?;
        Ok(self.output)
    }
}

/// The end of the directory where it is far from the start, and what leads there.
fn end64(start: u64, end: u64, count: u64) -> Vec<u8> {
    let mut record = [END64, &44_u64.to_le_bytes()].concat();
    for _ in 0..2 {
        record.extend(VERSION64.to_le_bytes());
    }
    record.extend([0; 8]);
    for number in [count, count, end - start, start] {
        record.extend(number.to_le_bytes());
    }
    record.extend(LOCATOR64);
    record.extend([0; 4]);
    record.extend(end.to_le_bytes());
    record.extend(1_u32.to_le_bytes());
    record
}
