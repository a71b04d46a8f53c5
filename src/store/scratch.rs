//! The scratch folder: where files of ours lie, what they take of the disk, what moved.

use std::fs::{File, OpenOptions};
use std::io::ErrorKind;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::OFlags;

use crate::store::{ScratchFile, StoreError};

/// A folder for files of ours, with a limit for what they take and counters for the bytes moved.
/// Cheap to clone.
#[derive(Clone, Debug)]
pub struct Scratch {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    folder: PathBuf,
    next_name: AtomicU64,
    counters: Arc<Counters>,
}

/// What all folders of a run took together.
#[derive(Debug, Default)]
struct Counters {
    limit_bytes: u64,
    held_bytes: AtomicU64,
    peak_bytes: AtomicU64,
    read_bytes: AtomicU64,
    written_bytes: AtomicU64,
    spilled_runs: AtomicU64,
}

impl Scratch {
    /// Scratch files under `folder`, which exists.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self::limited(folder, u64::MAX)
    }

    /// Scratch files under `folder` that take at most `limit_bytes` of the disk, all together.
    #[must_use]
    pub fn limited(folder: &Path, limit_bytes: u64) -> Self {
        let counters = Arc::new(Counters { limit_bytes, ..Counters::default() });
        Self::counted(folder, counters)
    }

    /// Scratch files under another folder, which count together with those under this one.
    #[must_use]
    pub fn beside(&self, folder: &Path) -> Self {
        Self::counted(folder, Arc::clone(&self.inner.counters))
    }

    fn counted(folder: &Path, counters: Arc<Counters>) -> Self {
        let inner = Inner { folder: folder.to_path_buf(), next_name: AtomicU64::new(0), counters };
        Self { inner: Arc::new(inner) }
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
    pub fn anonymous(&self, purpose: &str) -> Result<ScratchFile, StoreError> {
        let file = match self.nameless() {
            Ok(file) => file,
            Err(_) => self.unlinked(purpose)?,
        };
        let path = self.path(&format!("({purpose})"));
        Ok(ScratchFile::nameless(file, path, self.clone()))
    }

    /// A file that never had a name, where the file system can do that.
    fn nameless(&self) -> std::io::Result<File> {
        let flags = OFlags::TMPFILE.bits() as i32;
        OpenOptions::new().read(true).write(true).custom_flags(flags).open(self.folder())
    }

    /// A file that loses its name at once.
    fn unlinked(&self, purpose: &str) -> Result<File, StoreError> {
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

    /// A new, empty file with a name in the folder, replacing an older one.
    ///
    /// # Errors
    /// The folder is not writable.
    pub fn create(&self, name: &str) -> Result<ScratchFile, StoreError> {
        self.create_at(&self.path(name))
    }

    /// A new, empty file at `path`, replacing an older one, that counts like those in the folder.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create_at(&self, path: &Path) -> Result<ScratchFile, StoreError> {
        if let Ok(old) = std::fs::metadata(path) {
            self.release(old.len());
        }
        let opened =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path);
        let file = opened.map_err(|e| StoreError::io("create", path, e))?;
        Ok(ScratchFile::named(file, path.to_path_buf(), self.clone(), 0))
    }

    /// A file that is there, to be read and gone on with. It counts already.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when it is gone; or it cannot be opened.
    pub fn open(&self, name: &str) -> Result<ScratchFile, StoreError> {
        self.open_at(&self.path(name))
    }

    /// As [`Scratch::open`], anywhere.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open_at(&self, path: &Path) -> Result<ScratchFile, StoreError> {
        let opened = OpenOptions::new().read(true).write(true).open(path);
        let file = opened.map_err(|e| match e.kind() {
            ErrorKind::NotFound => StoreError::damaged(path, 0, "a file", "none"),
            _ => StoreError::io("open", path, e),
        })?;
        let len = file.metadata().map_err(|e| StoreError::io("stat", path, e))?.len();
        Ok(ScratchFile::named(file, path.to_path_buf(), self.clone(), len))
    }

    /// A file anywhere, to be read only.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open_to_read(&self, path: &Path) -> Result<ScratchFile, StoreError> {
        let file = File::open(path).map_err(|e| StoreError::io("open", path, e))?;
        Ok(ScratchFile::named(file, path.to_path_buf(), self.clone(), u64::MAX))
    }

    /// Removes a file of the folder, if it is there.
    ///
    /// # Errors
    /// The folder is not writable.
    pub fn remove(&self, name: &str) -> Result<(), StoreError> {
        self.remove_at(&self.path(name))
    }

    /// Removes a file that counts, if it is there.
    ///
    /// # Errors
    /// Its folder is not writable.
    pub fn remove_at(&self, path: &Path) -> Result<(), StoreError> {
        let len = std::fs::metadata(path).map_or(0, |file| file.len());
        match std::fs::remove_file(path) {
            Ok(()) => self.release(len),
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            Err(e) => return Err(StoreError::io("remove", path, e)),
        }
        Ok(())
    }

    /// Counts what an earlier run left at `path`.
    pub fn adopt(&self, path: &Path) {
        let len = std::fs::metadata(path).map_or(0, |file| file.len());
        let held = self.inner.counters.held_bytes.fetch_add(len, Ordering::Relaxed) + len;
        self.inner.counters.peak_bytes.fetch_max(held, Ordering::Relaxed);
    }

    /// Takes `bytes` of the disk.
    ///
    /// # Errors
    /// [`StoreError::DiskLimit`].
    pub(crate) fn charge(&self, bytes: u64) -> Result<(), StoreError> {
        let held = self.inner.counters.held_bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
        let limit_bytes = self.inner.counters.limit_bytes;
        if held > limit_bytes {
            self.release(bytes);
            return Err(StoreError::DiskLimit { needed_bytes: held, limit_bytes });
        }
        self.inner.counters.peak_bytes.fetch_max(held, Ordering::Relaxed);
        Ok(())
    }

    /// Gives `bytes` of the disk back.
    pub(crate) fn release(&self, bytes: u64) {
        // What was there before this run began may go without having been counted.
        let less = |held: u64| Some(held.saturating_sub(bytes));
        let _ =
            self.inner.counters.held_bytes.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
    }

    /// Adds to the bytes written.
    pub fn count_written(&self, bytes: u64) {
        self.inner.counters.written_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds to the bytes read.
    pub fn count_read(&self, bytes: u64) {
        self.inner.counters.read_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds one spilled sort run.
    pub fn count_spill(&self) {
        self.inner.counters.spilled_runs.fetch_add(1, Ordering::Relaxed);
    }

    /// Bytes read so far.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.inner.counters.read_bytes.load(Ordering::Relaxed)
    }

    /// Bytes written so far.
    #[must_use]
    pub fn written_bytes(&self) -> u64 {
        self.inner.counters.written_bytes.load(Ordering::Relaxed)
    }

    /// Sort runs that went to disk so far.
    #[must_use]
    pub fn spilled_runs(&self) -> u64 {
        self.inner.counters.spilled_runs.load(Ordering::Relaxed)
    }

    /// The most that all files took of the disk at one time.
    #[must_use]
    pub fn peak_bytes(&self) -> u64 {
        self.inner.counters.peak_bytes.load(Ordering::Relaxed)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_counts_what_lies_on_the_disk_and_not_what_was_moved() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::limited(folder.path(), 1000);
        for _ in 0..5 {
            let file = scratch.anonymous("test").expect("a file");
            file.write_at(&[1; 600], 0).expect("600 of 1000");
            file.write_at(&[2; 600], 0).expect("the same 600");
        }
        let file = scratch.create("named").expect("a file");
        file.write_at(&[1; 900], 0).expect("900 of 1000");
        let refused = file.write_at(&[1; 200], 850);
        assert!(matches!(refused, Err(StoreError::DiskLimit { needed_bytes: 1050, .. })));
        drop(file);
        assert!(scratch.anonymous("test").expect("a file").write_at(&[0; 101], 0).is_err());
        scratch.remove("named").expect("it is there");
        scratch.anonymous("test").expect("a file").write_at(&[0; 1000], 0).expect("all free");
        assert_eq!(scratch.peak_bytes(), 1000);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }

    #[test]
    fn files_lose_their_names_where_the_file_system_knows_no_nameless_ones() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let file = scratch.unlinked("test").expect("a file");
        assert_eq!(file.metadata().expect("a file").len(), 0);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }
}
