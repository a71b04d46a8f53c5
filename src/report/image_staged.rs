//! A file that is seen under its name only when it is complete.
//!
//! Invariant:  the target is untouched until [`StagedFile::put_in_place`], and whole afterwards,
//!             also across a crash; an abandoned file is removed.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::report::preview::PreviewError;

/// A file beside its target, under another name.
pub(crate) struct StagedFile {
    target: PathBuf,
    partial: PathBuf,
    file: File,
}

impl StagedFile {
    /// Creates the file beside `target`.
    pub(crate) fn create<E: std::error::Error>(target: &Path) -> Result<Self, PreviewError<E>> {
        let mut name = OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        // One name for all runs: what a killed one left is written over by the next.
        name.push(".brickmend.partial");
        let partial = target.with_file_name(name);
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let create = || -> io::Result<File> {
            let file = options.open(&partial)?;
            // Two runs with one target: the second does not write into the first one's file.
            file.try_lock()?;
            // From here on it is ours, and so is what becomes of it.
            file.set_len(0).inspect_err(|_| drop(fs::remove_file(&partial)))?;
            Ok(file)
        };
        let file = create().map_err(|source| PreviewError::io("create", &partial, source))?;
        Ok(Self { target: target.to_path_buf(), partial, file })
    }

    /// Where it is until then, for writers that open files by themselves.
    pub(crate) fn partial(&self) -> &Path {
        &self.partial
    }

    /// The file to write to.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// The error of a write that failed.
    pub(crate) fn failed<E: std::error::Error>(&self, source: io::Error) -> PreviewError<E> {
        PreviewError::io("write", &self.partial, source)
    }

    /// Hands the bytes to the disk and gives the file its name; returns its size.
    pub(crate) fn put_in_place<E: std::error::Error>(self) -> Result<u64, PreviewError<E>> {
        let bytes = self.file.metadata().map_err(|source| self.failed(source))?.len();
        self.file.sync_all().map_err(|source| self.failed(source))?;
        fs::rename(&self.partial, &self.target)
            .map_err(|source| PreviewError::io("rename to", &self.target, source))?;
        let folder = match self.target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        File::open(folder)
            .and_then(|folder| folder.sync_all())
            .map_err(|source| PreviewError::io("sync", folder, source))?;
        Ok(bytes)
    }
}

impl Drop for StagedFile {
    fn drop(&mut self) {
        // After the rename there is nothing left under this name; before, nobody else can help.
        let _ = fs::remove_file(&self.partial);
    }
}
