//! The scratch folder: where temporary files lie, and how many bytes went in and out.

use std::fs::{File, OpenOptions};
use std::io::ErrorKind;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::store::StoreError;

/// A folder for files of ours, with counters for the bytes moved. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Scratch {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    folder: PathBuf,
    next_name: AtomicU64,
    read_bytes: AtomicU64,
    written_bytes: AtomicU64,
    spilled_runs: AtomicU64,
}

impl Scratch {
    /// Scratch files under `folder`, which exists.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self {
            inner: Arc::new(Inner {
                folder: folder.to_path_buf(),
                next_name: AtomicU64::new(0),
                read_bytes: AtomicU64::new(0),
                written_bytes: AtomicU64::new(0),
                spilled_runs: AtomicU64::new(0),
            }),
        }
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.inner.folder
    }

    /// The path of a named file in the folder.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.inner.folder.join(name)
    }

    /// A file without a name: it vanishes with its last handle, also after kill -9.
    ///
    /// # Errors
    /// The folder is not writable.
    pub fn anonymous(&self, purpose: &str) -> Result<File, StoreError> {
        loop {
            let number = self.inner.next_name.fetch_add(1, Ordering::Relaxed);
            let path = self.path(&format!("{purpose}.{number}.tmp"));
            let opened = OpenOptions::new().read(true).write(true).create_new(true).open(&path);
            match opened {
                Ok(file) => {
                    std::fs::remove_file(&path).map_err(|e| StoreError::io("unlink", &path, e))?;
                    return Ok(file);
                }
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(StoreError::io("create", &path, e)),
            }
        }
    }

    /// Writes all of `bytes` at `offset` and counts them.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn write_at(&self, file: &File, bytes: &[u8], offset: u64) -> Result<(), StoreError> {
        file.write_all_at(bytes, offset)
            .map_err(|e| StoreError::io("write to", self.folder(), e))?;
        self.count_written(bytes.len() as u64);
        Ok(())
    }

    /// Reads exactly `bytes.len()` bytes at `offset` and counts them.
    ///
    /// # Errors
    /// The file is shorter, or the disk is broken.
    pub fn read_at(&self, file: &File, bytes: &mut [u8], offset: u64) -> Result<(), StoreError> {
        file.read_exact_at(bytes, offset)
            .map_err(|e| StoreError::io("read from", self.folder(), e))?;
        self.count_read(bytes.len() as u64);
        Ok(())
    }

    /// Adds to the bytes written.
    pub fn count_written(&self, bytes: u64) {
        self.inner.written_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds to the bytes read.
    pub fn count_read(&self, bytes: u64) {
        self.inner.read_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds one spilled sort run.
    pub fn count_spill(&self) {
        self.inner.spilled_runs.fetch_add(1, Ordering::Relaxed);
    }

    /// Bytes read so far.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.inner.read_bytes.load(Ordering::Relaxed)
    }

    /// Bytes written so far.
    #[must_use]
    pub fn written_bytes(&self) -> u64 {
        self.inner.written_bytes.load(Ordering::Relaxed)
    }

    /// Sort runs that went to disk so far.
    #[must_use]
    pub fn spilled_runs(&self) -> u64 {
        self.inner.spilled_runs.load(Ordering::Relaxed)
    }
}

/// Hands a folder's names to the disk, so that a rename in it survives a power cut.
///
/// # Errors
/// The folder cannot be opened or synchronised.
pub fn sync_folder(folder: &Path) -> Result<(), StoreError> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let handle = File::open(folder).map_err(|e| StoreError::io("open", folder, e))?;
    handle.sync_all().map_err(|e| StoreError::io("synchronise", folder, e))
}
