//! How far a step has come, and where it says so.

use std::path::Path;

use rkyv::{Archive, Deserialize, Serialize};

use crate::store::{Digest, StoreError};

/// A file as it has to be found again.
#[derive(
    Clone,
    Debug,
    Default,
    PartialEq,
    Eq,
    Archive,
    Serialize,
    Deserialize,
    serde::Serialize,
    serde::Deserialize,
)]
pub struct FileState {
    /// Its name in the work folder.
    pub name: String,
    /// Its size; what lies beyond was written later and does not count.
    pub len_bytes: u64,
    /// Its records.
    pub records: u64,
    /// Digest over the digests of its parts: of the directory of a brick file, of the blocks of a
    /// spool. Each part is checked when it is touched for the first time.
    pub root: Digest,
}

impl FileState {
    /// The file called `name` among those that earlier steps left.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when there is none.
    pub fn find<'f>(files: &'f [Self], name: &str) -> Result<&'f Self, StoreError> {
        let lost = || StoreError::damaged(Path::new(name), 0, "a file of an earlier step", "none");
        files.iter().find(|file| file.name == name).ok_or_else(lost)
    }
}

/// How far a step has come in the middle of its work.
#[derive(Clone, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Progress {
    /// Items that are done, in the step's own order.
    pub items: u64,
    /// The files that it writes, as far as they go.
    pub files: Vec<FileState>,
    /// What it counted so far, as its own text (JSON).
    pub counts: String,
}

/// Where a step begins, and where it notes how far it has come.
pub trait Checkpoints: Sync {
    /// What an earlier run noted of this step.
    fn start(&self) -> Option<Progress> {
        None
    }

    /// A step notes its progress each time it has written this much.
    fn interval_bytes(&self) -> u64 {
        u64::MAX
    }

    /// Commits the progress: a run that is killed from now on goes on from here.
    ///
    /// # Errors
    /// The work folder cannot be written.
    fn save(&self, progress: Progress) -> Result<(), StoreError> {
        let _ = progress;
        Ok(())
    }
}

/// Every step begins at its beginning, and nothing is noted.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCheckpoints;

impl Checkpoints for NoCheckpoints {}
