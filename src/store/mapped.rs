//! The only place that maps files, and the only `unsafe` of the library.
//!
//! Only scratch files of our own are mapped, in windows, after `fallocate`: a sparse page written
//! on a full disk would kill the process (SIGBUS), and a whole-file map would count as resident.

#![expect(unsafe_code, reason = "memory maps are unsafe by nature; see the invariants below")]

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use memmap2::{Mmap, MmapMut, MmapOptions};
use rustix::fs::FallocateFlags;

use crate::store::StoreError;

/// A scratch file that is mapped window by window.
#[derive(Debug)]
pub struct MappedFile {
    file: File,
    path: PathBuf,
}

impl MappedFile {
    /// A new, empty file at `path`, replacing an older one.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(path: &Path) -> Result<Self, StoreError> {
        let opened =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path);
        let file = opened.map_err(|e| StoreError::io("create", path, e))?;
        Ok(Self { file, path: path.to_path_buf() })
    }

    /// An existing file, to be read.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let file = File::open(path).map_err(|e| StoreError::io("open", path, e))?;
        Ok(Self { file, path: path.to_path_buf() })
    }

    /// The file's path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's size.
    ///
    /// # Errors
    /// The file system fails.
    pub fn len_bytes(&self) -> Result<u64, StoreError> {
        let metadata = self.file.metadata().map_err(|e| StoreError::io("stat", &self.path, e))?;
        Ok(metadata.len())
    }

    /// Reserves `len` bytes at `offset` on the disk and maps them for writing.
    ///
    /// # Errors
    /// The disk is full, or the map is refused.
    pub fn map_new(&self, offset: u64, len: usize) -> Result<MmapMut, StoreError> {
        rustix::fs::fallocate(&self.file, FallocateFlags::empty(), offset, len as u64)
            .map_err(|e| StoreError::io("reserve room in", &self.path, e.into()))?;
        // SAFETY: the file is ours alone (the work folder is locked), its blocks exist, and it is
        // never truncated while a map lives.
        unsafe { MmapOptions::new().offset(offset).len(len).map_mut(&self.file) }
            .map_err(|e| StoreError::io("map", &self.path, e))
    }

    /// Maps `len` bytes at `offset` for reading, with their pages present.
    ///
    /// # Errors
    /// The file is shorter than that, or the map is refused.
    pub fn map(&self, offset: u64, len: usize) -> Result<Mmap, StoreError> {
        let end = self.len_bytes()?;
        if offset + len as u64 > end {
            return Err(StoreError::Damaged {
                path: self.path.clone(),
                offset: end,
                expected: format!("{} bytes more", offset + len as u64 - end),
                found: "the end of the file".to_owned(),
            });
        }
        // SAFETY: as above; the length was checked, and nobody truncates a scratch file in use.
        unsafe { MmapOptions::new().offset(offset).len(len).populate().map(&self.file) }
            .map_err(|e| StoreError::io("map", &self.path, e))
    }
}
