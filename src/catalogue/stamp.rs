//! How a file is known again: cheaply by what the file system says of it, surely by its hash.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::store::{Digest, StoreError, digest_file};

/// What the file system says of a file. When all of it is as it was, so is the content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// Size.
    pub bytes: u64,
    /// Last change of the content, nanoseconds since 1970.
    pub mtime_ns: i64,
    /// Last change of the content or of what is known of it, likewise.
    pub ctime_ns: i64,
    /// Number in its file system.
    pub inode: u64,
}

impl Stamp {
    /// Of a file whose metadata are at hand.
    #[must_use]
    pub fn of(metadata: &Metadata) -> Self {
        let nanoseconds = |seconds: i64, rest: i64| seconds.saturating_mul(1_000_000_000) + rest;
        Self {
            bytes: metadata.len(),
            mtime_ns: nanoseconds(metadata.mtime(), metadata.mtime_nsec()),
            ctime_ns: nanoseconds(metadata.ctime(), metadata.ctime_nsec()),
            inode: metadata.ino(),
        }
    }

    /// Of the file at `path`; `None` where there is none.
    #[must_use]
    pub fn at(path: &Path) -> Option<Self> {
        std::fs::metadata(path).ok().filter(Metadata::is_file).map(|metadata| Self::of(&metadata))
    }
}

/// A stamp with the hash of the content at that time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamped {
    /// What the file system said.
    pub stamp: Stamp,
    /// The first half of blake3 over the content.
    pub digest: Digest,
}

impl Stamped {
    /// Reads the file at `path`. A file that changes meanwhile has the stamp it had before, which
    /// then fits no longer.
    ///
    /// # Errors
    /// The file cannot be read, or `cancelled` says to stop.
    pub fn read(path: &Path, cancelled: &dyn Fn() -> bool) -> Result<Self, StoreError> {
        let metadata = std::fs::metadata(path).map_err(|e| StoreError::io("open", path, e))?;
        let stamp = Stamp::of(&metadata);
        Ok(Self { stamp, digest: digest_file(path, cancelled)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touched_file_has_another_stamp_and_the_same_digest() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a");
        std::fs::write(&path, b"content").expect("writable");
        let before = Stamped::read(&path, &|| false).expect("readable");
        assert_eq!(Stamp::at(&path), Some(before.stamp));
        std::fs::rename(&path, folder.path().join("b")).expect("movable");
        std::fs::write(&path, b"content").expect("writable");
        let after = Stamped::read(&path, &|| false).expect("readable");
        assert_ne!(before.stamp, after.stamp);
        assert_eq!(before.digest, after.digest);
        assert_eq!(Stamp::at(folder.path()), None, "a folder is no file");
    }
}
