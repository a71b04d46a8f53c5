//! A file being written: buffered, counted, digested, and handed to the disk at the end.
//!
//! Both the output and what waits beside it can be gone on with by a later run, from any state
//! that [`Stream::state`] told. Memory: one buffer of 256 KiB each.

use std::ops::Range;
use std::path::Path;

use crate::io::error::IoError;
use crate::mesh::SinkFile;
use crate::store::{Digest, Digester, Scratch, ScratchFile, StoreError};

const BUFFER_BYTES: usize = 256 << 10;
/// Bytes below may be replaced at the end (headers with counts).
const HEAD_BYTES: u64 = 4096;
/// Faces that wait until all vertices are written, in the scratch folder.
pub(crate) const FACES: &str = "output.faces";
/// Vertices that wait until it is known what stands in front of them.
pub(crate) const VERTICES: &str = "output.vertices";
/// What vertices have besides a position, likewise.
pub(crate) const VALUES: &str = "output.values";
/// All that may wait beside an output.
pub const ASIDE: [&str; 3] = [FACES, VERTICES, VALUES];

/// A file that grows at its end.
#[derive(Debug)]
pub(crate) struct Stream {
    file: ScratchFile,
    buffer: Vec<u8>,
    written_bytes: u64,
    /// Over all written bytes behind the head.
    tail: Digester,
}

impl Stream {
    fn new(file: ScratchFile) -> Self {
        let buffer = Vec::with_capacity(BUFFER_BYTES);
        Self { file, buffer, written_bytes: 0, tail: Digester::default() }
    }

    /// Goes on behind the bytes that `state` tells of, after reading them again.
    fn reopen(file: ScratchFile, state: &SinkFile) -> Result<Self, StoreError> {
        let mut stream = Self::new(file);
        stream.read_tail(state.bytes)?;
        stream.written_bytes = state.bytes;
        let found = stream.digest()?;
        if found == state.digest {
            return Ok(stream);
        }
        let expected = format!("bytes with digest {:02x?}", state.digest);
        Err(StoreError::damaged(stream.file.path(), 0, expected, format!("{found:02x?}")))
    }

    fn read_tail(&mut self, end: u64) -> Result<(), StoreError> {
        let mut block = vec![0; BUFFER_BYTES];
        let mut at = HEAD_BYTES;
        while at < end {
            let part = &mut block[..(end - at).min(BUFFER_BYTES as u64) as usize];
            self.file.read_at(part, at)?;
            self.tail.update(part);
            at += part.len() as u64;
        }
        Ok(())
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        if self.buffer.len() + bytes.len() > BUFFER_BYTES {
            self.flush()?;
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.written_bytes + self.buffer.len() as u64
    }

    fn flush(&mut self) -> Result<(), StoreError> {
        self.file.write_at(&self.buffer, self.written_bytes)?;
        let in_head = HEAD_BYTES.saturating_sub(self.written_bytes).min(self.buffer.len() as u64);
        self.tail.update(&self.buffer[in_head as usize..]);
        self.written_bytes += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }

    /// Over the head as it is now and all that follows.
    fn digest(&self) -> Result<Digest, StoreError> {
        let mut head = vec![0; self.written_bytes.min(HEAD_BYTES) as usize];
        self.file.read_at(&mut head, 0)?;
        let mut whole = Digester::default();
        whole.update(&head);
        whole.update(&self.tail.digest());
        Ok(whole.digest())
    }

    fn state(&mut self) -> Result<SinkFile, StoreError> {
        self.flush()?;
        Ok(SinkFile { bytes: self.written_bytes, digest: self.digest()? })
    }
}

/// Whether the file at `path` is still what a writer left.
///
/// # Errors
/// [`StoreError::Damaged`] when it is not; or the disk fails.
pub fn check_output(path: &Path, state: &SinkFile, scratch: &Scratch) -> Result<(), StoreError> {
    let file = scratch.open_to_read(path)?;
    let there = file.len_bytes()?;
    if there != state.bytes {
        let (expected, found) = (format!("{} bytes", state.bytes), format!("{there}"));
        return Err(StoreError::damaged(path, there, expected, found));
    }
    Stream::reopen(file, state).map(drop)
}

/// The output file, append only but for its head.
#[derive(Debug)]
pub(crate) struct Output {
    stream: Stream,
}

impl Output {
    pub(crate) fn create(path: &Path, scratch: &Scratch) -> Result<Self, IoError> {
        Ok(Self { stream: Stream::new(scratch.create_at(path)?) })
    }

    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        state: &SinkFile,
    ) -> Result<Self, IoError> {
        let file = scratch.open_at(path)?;
        file.truncate(state.bytes)?;
        Ok(Self { stream: Stream::reopen(file, state)? })
    }

    pub(crate) fn path(&self) -> &Path {
        self.stream.file.path()
    }

    #[inline]
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        Ok(self.stream.write(bytes)?)
    }

    /// Bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.stream.bytes()
    }

    /// Appends everything that was laid aside; that file stays until it is removed.
    pub(crate) fn append(&mut self, mut aside: Aside) -> Result<(), IoError> {
        aside.for_each_block(|block| self.write(block))
    }

    /// Replaces bytes of the head, which exist already.
    pub(crate) fn patch(&mut self, bytes: &[u8], offset: u64) -> Result<(), IoError> {
        let end = offset + bytes.len() as u64;
        assert!(end <= HEAD_BYTES.min(self.stream.bytes()), "only the head is replaced");
        self.stream.flush()?;
        Ok(self.stream.file.write_at(bytes, offset)?)
    }

    /// How far the file goes, for [`Output::reopen`].
    pub(crate) fn state(&mut self) -> Result<SinkFile, IoError> {
        Ok(self.stream.state()?)
    }

    /// Hands all bytes to the disk and tells what they are.
    pub(crate) fn finish(mut self) -> Result<SinkFile, IoError> {
        let state = self.stream.state()?;
        let file = &self.stream.file;
        let synced = file.file().sync_all();
        synced.map_err(|e| StoreError::io("synchronise", file.path(), e))?;
        Ok(state)
    }
}

/// Bytes that belong behind others which are not complete yet: a file of the scratch folder.
#[derive(Debug)]
pub(crate) struct Aside {
    stream: Stream,
}

impl Aside {
    /// Starts one of [`ASIDE`].
    pub(crate) fn create(scratch: &Scratch, name: &str) -> Result<Self, IoError> {
        Ok(Self { stream: Stream::new(scratch.create(name)?) })
    }

    pub(crate) fn reopen(scratch: &Scratch, name: &str, state: &SinkFile) -> Result<Self, IoError> {
        let file = scratch.open(name)?;
        file.truncate(state.bytes)?;
        Ok(Self { stream: Stream::reopen(file, state)? })
    }

    #[inline]
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        Ok(self.stream.write(bytes)?)
    }

    /// Bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.stream.bytes()
    }

    /// Shows all bytes in order, in blocks of 256 KiB but for the last.
    pub(crate) fn for_each_block(
        &mut self,
        visit: impl FnMut(&[u8]) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        self.for_each_block_in(0..self.bytes(), visit)
    }

    /// The same for some of the bytes.
    pub(crate) fn for_each_block_in(
        &mut self,
        range: Range<u64>,
        mut visit: impl FnMut(&[u8]) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        self.stream.flush()?;
        let mut block = vec![0; BUFFER_BYTES];
        let mut at = range.start;
        while at < range.end {
            let left = range.end - at;
            let part = &mut block[..left.min(BUFFER_BYTES as u64) as usize];
            self.stream.file.read_at(part, at)?;
            visit(part)?;
            at += part.len() as u64;
        }
        Ok(())
    }

    /// How far the file goes, for [`Aside::reopen`].
    pub(crate) fn state(&mut self) -> Result<SinkFile, IoError> {
        Ok(self.stream.state()?)
    }
}
