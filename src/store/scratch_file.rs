//! A file of ours: written and read at offsets, counted, and charged for the room that it takes.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::FallocateFlags;

use crate::store::{Scratch, StoreError};

/// A scratch file. One without a name gives its room back when it is dropped.
#[derive(Debug)]
pub struct ScratchFile {
    file: File,
    path: PathBuf,
    scratch: Scratch,
    /// What it is charged for: its highest end so far.
    end_bytes: AtomicU64,
    has_name: bool,
}

impl ScratchFile {
    pub(crate) fn nameless(file: File, path: PathBuf, scratch: Scratch) -> Self {
        Self { file, path, scratch, end_bytes: AtomicU64::new(0), has_name: false }
    }

    pub(crate) fn named(file: File, path: PathBuf, scratch: Scratch, end_bytes: u64) -> Self {
        Self { file, path, scratch, end_bytes: AtomicU64::new(end_bytes), has_name: true }
    }

    /// Where it lies; for messages, where it has no name.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder that it belongs to.
    #[must_use]
    pub fn scratch(&self) -> &Scratch {
        &self.scratch
    }

    /// The handle, for maps and hand-overs to the disk.
    #[must_use]
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Its size.
    ///
    /// # Errors
    /// The file system fails.
    pub fn len_bytes(&self) -> Result<u64, StoreError> {
        let metadata = self.file.metadata().map_err(|e| StoreError::io("stat", &self.path, e))?;
        Ok(metadata.len())
    }

    /// Writes all of `bytes` at `offset`.
    ///
    /// # Errors
    /// The disk is full or broken, or the limit is reached.
    pub fn write_at(&self, bytes: &[u8], offset: u64) -> Result<(), StoreError> {
        self.charge(offset + bytes.len() as u64)?;
        self.file
            .write_all_at(bytes, offset)
            .map_err(|e| StoreError::io("write to", &self.path, e))?;
        self.scratch.count_written(bytes.len() as u64);
        Ok(())
    }

    /// Reads exactly `bytes.len()` bytes at `offset`.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when the file is shorter; or the disk is broken.
    pub fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<(), StoreError> {
        match self.file.read_exact_at(bytes, offset) {
            Ok(()) => {
                self.scratch.count_read(bytes.len() as u64);
                Ok(())
            }
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                let expected = format!("{} bytes more", bytes.len());
                Err(StoreError::damaged(&self.path, offset, expected, "the end of the file"))
            }
            Err(e) => Err(StoreError::io("read from", &self.path, e)),
        }
    }

    /// Reserves blocks of the disk, so that they can be mapped whole.
    ///
    /// # Errors
    /// The disk is full, or the limit is reached.
    pub fn reserve(&self, offset: u64, len: u64) -> Result<(), StoreError> {
        self.charge(offset + len)?;
        rustix::fs::fallocate(&self.file, FallocateFlags::empty(), offset, len)
            .map_err(|e| StoreError::io("reserve room in", &self.path, e.into()))
    }

    /// Cuts the file off at `len`.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when the file is shorter; or the file system fails.
    pub fn truncate(&self, len: u64) -> Result<(), StoreError> {
        let there = self.len_bytes()?;
        if there < len {
            let expected = format!("{len} bytes");
            return Err(StoreError::damaged(&self.path, there, expected, format!("{there}")));
        }
        self.file.set_len(len).map_err(|e| StoreError::io("cut off", &self.path, e))?;
        let before = self.end_bytes.fetch_min(len, Ordering::Relaxed);
        self.scratch.release(before.saturating_sub(len));
        Ok(())
    }

    fn charge(&self, end: u64) -> Result<(), StoreError> {
        let before = self.end_bytes.fetch_max(end, Ordering::Relaxed);
        let more = end.saturating_sub(before);
        if more == 0 {
            return Ok(());
        }
        self.scratch.charge(more).inspect_err(|_| {
            self.end_bytes.fetch_min(before, Ordering::Relaxed);
        })
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        if !self.has_name {
            self.scratch.release(*self.end_bytes.get_mut());
        }
    }
}
