//! A file being written: buffered, counted, and handed to the disk at the end.
//!
//! Memory: one buffer of 256 KiB each for the file and for what waits beside it.

use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::io::error::IoError;
use crate::store::{Scratch, StoreError};

const BUFFER_BYTES: usize = 256 << 10;

/// The output file, append only but for its header.
#[derive(Debug)]
pub(crate) struct Output {
    path: PathBuf,
    file: BufWriter<File>,
    bytes: u64,
}

impl Output {
    pub(crate) fn create(path: &Path) -> Result<Self, IoError> {
        let file = File::create(path).map_err(|e| IoError::output("create", path, e))?;
        let file = BufWriter::with_capacity(BUFFER_BYTES, file);
        Ok(Self { path: path.to_path_buf(), file, bytes: 0 })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    #[inline]
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        self.bytes += bytes.len() as u64;
        self.file.write_all(bytes).map_err(|e| IoError::output("write", &self.path, e))
    }

    /// Appends everything that was laid aside.
    pub(crate) fn append(&mut self, aside: Aside) -> Result<(), IoError> {
        let Aside { scratch, mut file, bytes } = aside;
        let aside_error = |e| IoError::Store(StoreError::io("read from", scratch.folder(), e));
        file.flush().map_err(aside_error)?;
        let mut file = file.into_inner().map_err(|e| aside_error(e.into_error()))?;
        file.seek(SeekFrom::Start(0)).map_err(aside_error)?;
        self.flush()?;
        let copied = std::io::copy(&mut file, self.file.get_mut())
            .map_err(|e| IoError::output("write", &self.path, e))?;
        debug_assert_eq!(copied, bytes);
        scratch.count_read(copied);
        self.bytes += copied;
        Ok(())
    }

    /// Replaces bytes at the start of the file, which exist already.
    pub(crate) fn patch(&mut self, bytes: &[u8], offset: u64) -> Result<(), IoError> {
        debug_assert!(offset + bytes.len() as u64 <= self.bytes);
        self.flush()?;
        let patched = self.file.get_ref().write_all_at(bytes, offset);
        patched.map_err(|e| IoError::output("write", &self.path, e))
    }

    /// Hands all bytes to the disk and tells how many they are.
    pub(crate) fn finish(mut self) -> Result<u64, IoError> {
        self.flush()?;
        let synced = self.file.get_ref().sync_all();
        synced.map_err(|e| IoError::output("synchronise", &self.path, e))?;
        Ok(self.bytes)
    }

    fn flush(&mut self) -> Result<(), IoError> {
        self.file.flush().map_err(|e| IoError::output("write", &self.path, e))
    }
}

/// Bytes that belong behind others which are not complete yet: a scratch file without a name.
#[derive(Debug)]
pub(crate) struct Aside {
    scratch: Scratch,
    file: BufWriter<File>,
    bytes: u64,
}

impl Aside {
    pub(crate) fn new(scratch: &Scratch) -> Result<Self, IoError> {
        let file = BufWriter::with_capacity(BUFFER_BYTES, scratch.anonymous("faces")?);
        Ok(Self { scratch: scratch.clone(), file, bytes: 0 })
    }

    #[inline]
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        self.bytes += bytes.len() as u64;
        self.scratch.count_written(bytes.len() as u64);
        let written = self.file.write_all(bytes);
        written.map_err(|e| StoreError::io("write to", self.scratch.folder(), e).into())
    }
}
