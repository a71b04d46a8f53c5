//! A file of the user's, read through one buffer of fixed size; never mapped, never held whole.
//!
//! Invariant: `available()` is what follows byte `offset()` of the content. Memory: the capacity.

use std::fs::{File, Metadata, OpenOptions};
use std::io::ErrorKind;
use std::os::unix::fs::{FileExt, FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;

use crate::io::error::{IoError, Place};
use crate::store::ScratchFile;

/// The largest input buffer in bytes.
const LARGEST_BUFFER_BYTES: u64 = 512 << 10;
/// The smallest input buffer in bytes; longer than any word.
const SMALLEST_BUFFER_BYTES: u64 = 16 << 10;

/// A buffered, seekable input file that counts what it reads.
#[derive(Debug)]
pub(crate) struct Input {
    path: PathBuf,
    content: Content,
    size_bytes: u64,
    buffer: Vec<u8>,
    at: usize,
    end: usize,
    /// Offset in the file of `buffer[end]`.
    end_offset: u64,
    /// Bytes consumed in passes before the last seek.
    earlier_bytes: u64,
    /// Where the present pass began.
    start_offset: u64,
}

/// Where the bytes come from.
#[derive(Debug)]
enum Content {
    /// The user's file.
    File(File),
    /// What a packed file of the user's holds.
    Unpacked { file: ScratchFile, packed_bytes: u64 },
}

impl Input {
    /// Opens a regular file and takes a part of `share_bytes` as its buffer.
    pub(crate) fn open(path: &Path, share_bytes: u64) -> Result<Self, IoError> {
        let (file, metadata) = open_regular(path)?;
        Ok(Self::over(path, Content::File(file), metadata.len(), share_bytes))
    }

    /// The content of the packed file at `path`: `size_bytes` in a scratch file, from
    /// `packed_bytes` of the user's.
    pub(crate) fn unpacked(
        path: &Path,
        file: ScratchFile,
        (size_bytes, packed_bytes): (u64, u64),
        share_bytes: u64,
    ) -> Self {
        let content = Content::Unpacked { file, packed_bytes };
        Self::over(path, content, size_bytes, share_bytes)
    }

    fn over(path: &Path, content: Content, size_bytes: u64, share_bytes: u64) -> Self {
        let capacity = (share_bytes / 8).clamp(SMALLEST_BUFFER_BYTES, LARGEST_BUFFER_BYTES);
        Self {
            path: path.to_path_buf(),
            content,
            size_bytes,
            buffer: vec![0; capacity as usize],
            at: 0,
            end: 0,
            end_offset: 0,
            earlier_bytes: 0,
            start_offset: 0,
        }
    }

    /// The user's path, also where the content was unpacked.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether this is the content of a packed file.
    pub(crate) fn is_unpacked(&self) -> bool {
        matches!(self.content, Content::Unpacked { .. })
    }

    /// The size of the content when it was opened.
    pub(crate) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// Where in the file the next byte stands.
    pub(crate) fn offset(&self) -> u64 {
        self.end_offset - (self.end - self.at) as u64
    }

    /// Bytes of the user's file that were consumed, in all passes.
    pub(crate) fn bytes_read(&self) -> u64 {
        match &self.content {
            Content::File(_) => self.consumed(),
            Content::Unpacked { packed_bytes, .. } => *packed_bytes,
        }
    }

    fn consumed(&self) -> u64 {
        self.earlier_bytes + (self.offset() - self.start_offset)
    }

    #[inline]
    pub(crate) fn available(&self) -> &[u8] {
        &self.buffer[self.at..self.end]
    }

    #[inline]
    pub(crate) fn consume(&mut self, count: usize) {
        debug_assert!(count <= self.end - self.at);
        self.at += count;
    }

    /// Consumes `count` of the available bytes and shows them.
    #[inline]
    pub(crate) fn take(&mut self, count: usize) -> &[u8] {
        let start = self.at;
        self.at += count;
        &self.buffer[start..self.at]
    }

    /// Makes more bytes available; `false` at the end of the file or when the buffer is full.
    pub(crate) fn fill(&mut self) -> Result<bool, IoError> {
        if self.at > 0 {
            self.buffer.copy_within(self.at..self.end, 0);
            self.end -= self.at;
            self.at = 0;
        }
        if self.end == self.buffer.len() {
            return Ok(false);
        }
        let mut buffer = std::mem::take(&mut self.buffer);
        let count = self.read_some(&mut buffer[self.end..], self.end_offset);
        self.buffer = buffer;
        let count = count?;
        self.end += count;
        self.end_offset += count as u64;
        Ok(count > 0)
    }

    /// Makes at least `count` bytes available, or as many as the file has left.
    pub(crate) fn look_ahead(&mut self, count: usize) -> Result<&[u8], IoError> {
        while self.end - self.at < count && self.fill()? {}
        Ok(self.available())
    }

    /// Consumes exactly `count` bytes, which fit the buffer.
    #[inline]
    pub(crate) fn bytes(&mut self, count: usize, expected: &str) -> Result<&[u8], IoError> {
        if self.end - self.at < count && self.look_ahead(count)?.len() < count {
            return Err(self.ended(expected));
        }
        Ok(self.take(count))
    }

    /// Consumes `count` bytes without looking at them.
    pub(crate) fn skip(&mut self, count: u64, expected: &str) -> Result<(), IoError> {
        let buffered = (self.end - self.at) as u64;
        if count <= buffered {
            self.at += count as usize;
            return Ok(());
        }
        if count > self.size_bytes.saturating_sub(self.offset()) {
            return Err(self.ended(expected));
        }
        let target = self.offset() + count;
        let (earlier, start) = (self.earlier_bytes, self.start_offset);
        self.seek(target);
        (self.earlier_bytes, self.start_offset) = (earlier, start);
        Ok(())
    }

    /// Goes on at another place of the file; what was consumed so far stays counted.
    pub(crate) fn seek(&mut self, offset: u64) {
        self.earlier_bytes = self.consumed();
        self.start_offset = offset;
        let buffer_offset = self.end_offset - self.end as u64;
        if (buffer_offset..=self.end_offset).contains(&offset) {
            self.at = (offset - buffer_offset) as usize;
        } else {
            (self.at, self.end, self.end_offset) = (0, 0, offset);
        }
    }

    /// Reads all of `bytes` at a place of the content, past the buffer; not counted.
    pub(crate) fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<(), IoError> {
        let mut filled = 0;
        while filled < bytes.len() {
            let at = offset + filled as u64;
            let count = self.read_some(&mut bytes[filled..], at)?;
            if count == 0 {
                return Err(self.ended("what was there before"));
            }
            filled += count;
        }
        Ok(())
    }

    /// Reads some bytes at a place of the content; none at its end.
    fn read_some(&self, room: &mut [u8], offset: u64) -> Result<usize, IoError> {
        match &self.content {
            Content::File(file) => {
                read_at(file, room, offset).map_err(|e| IoError::input("read", &self.path, e))
            }
            Content::Unpacked { file, .. } => {
                let left = self.size_bytes.saturating_sub(offset);
                let count = left.min(room.len() as u64) as usize;
                file.read_at(&mut room[..count], offset)?;
                Ok(count)
            }
        }
    }

    /// The error of a file that ends too early, at its end.
    pub(crate) fn ended(&self, expected: &str) -> IoError {
        let end = self.end_offset.max(self.size_bytes);
        IoError::unreadable(&self.path, Place::Byte(end), expected, "the end of the file")
    }
}

/// Opens for reading what is a regular file. Pipes and devices are refused before they are opened,
/// and nothing that takes their place meanwhile, or only looks like a file, can block.
fn open_regular(path: &Path) -> Result<(File, Metadata), IoError> {
    let failed = |e| IoError::input("open", path, e);
    refuse_others(path, &std::fs::metadata(path).map_err(failed)?)?;
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    refuse_others(path, &metadata)?;
    Ok((file, metadata))
}

fn refuse_others(path: &Path, metadata: &Metadata) -> Result<(), IoError> {
    match kind_of(metadata) {
        Some(found) => Err(IoError::NotAFile { path: path.to_path_buf(), found }),
        None => Ok(()),
    }
}

/// Reads some bytes at a place of a file; none at its end.
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> std::io::Result<usize> {
    loop {
        match file.read_at(bytes, offset) {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

fn kind_of(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        None
    } else if kind.is_dir() {
        Some("a folder")
    } else if kind.is_fifo() {
        Some("a pipe")
    } else if kind.is_socket() {
        Some("a socket")
    } else {
        Some("a device")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_counted_over_skips_and_passes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a");
        let content: Vec<u8> = (0..100_000_u32).map(|i| (i % 251) as u8).collect();
        std::fs::write(&path, &content).expect("a file");
        let mut input = Input::open(&path, 0).expect("opens");
        assert_eq!(input.bytes(3, "x").expect("3 bytes"), &content[..3]);
        input.skip(50_000, "x").expect("inside");
        assert_eq!(input.bytes(4, "x").expect("4 bytes"), &content[50_003..50_007]);
        assert_eq!((input.offset(), input.bytes_read()), (50_007, 50_007));
        input.seek(10);
        input.skip(20_000, "x").expect("inside");
        assert_eq!((input.offset(), input.bytes_read()), (20_010, 70_007));
        assert!(matches!(
            input.skip(80_000, "x"),
            Err(IoError::Unreadable { place: Place::Byte(100_000), .. })
        ));
    }

    #[test]
    fn folders_pipes_and_devices_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let refused = |path: &Path| matches!(Input::open(path, 0), Err(IoError::NotAFile { .. }));
        assert!(refused(folder.path()));
        assert!(refused(Path::new("/dev/zero")));
        let pipe = folder.path().join("pipe");
        let mode = rustix::fs::Mode::from_raw_mode(0o600);
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0)
            .expect("a pipe");
        assert!(refused(&pipe));
        let missing = Input::open(&folder.path().join("none"), 0);
        assert!(matches!(missing, Err(error) if error.is_input()));
    }
}
