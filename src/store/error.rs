//! What can go wrong between us and the disk.

use std::path::{Path, PathBuf};

/// An error of the world below the bricks.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The operating system refused.
    #[error("Cannot {doing} {path}")]
    Io {
        /// What was tried, as a verb.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's own word.
        source: std::io::Error,
    },
    /// The bytes on disk are not the bytes that were written.
    #[error("{path} is damaged at byte {offset}: expected {expected}, found {found}")]
    Damaged {
        /// The scratch file.
        path: PathBuf,
        /// Where in the file.
        offset: u64,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The memory budget cannot hold what the next step needs.
    #[error("{what} needs {needed_bytes} bytes of memory, {free_bytes} of {budget_bytes} are free")]
    OverBudget {
        /// Who asked.
        what: &'static str,
        /// How much was asked for.
        needed_bytes: u64,
        /// How much was left.
        free_bytes: u64,
        /// The whole budget.
        budget_bytes: u64,
    },
    /// The work folder and the output have reached the limit that the user set.
    #[error(
        "{needed_bytes} bytes of disk are needed now, the limit is {limit_bytes}; \
         run again with more to go on"
    )]
    DiskLimit {
        /// What would lie on the disk with the next write.
        needed_bytes: u64,
        /// The limit.
        limit_bytes: u64,
    },
    /// More records than the format can number.
    #[error("{what}: more than {limit} are not supported")]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// The largest number allowed.
        limit: u64,
    },
    /// The caller asked to stop.
    #[error("Stopped on request")]
    Cancelled,
}

impl StoreError {
    /// Wraps a system error with what was tried and where.
    pub fn io(doing: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Io { doing, path: path.to_path_buf(), source }
    }

    /// Whether the disk, a quota or the system's limit of a file's size is reached.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        match self {
            Self::Io { source, .. } => {
                matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge)
            }
            _ => false,
        }
    }

    pub(crate) fn damaged(
        path: &Path,
        offset: u64,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        let (path, expected, found) = (path.to_path_buf(), expected.into(), found.into());
        Self::Damaged { path, offset, expected, found }
    }

    /// Whether the work so far is worth keeping: the run was stopped, it did not go wrong.
    #[must_use]
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Cancelled | Self::DiskLimit { .. } | Self::Io { .. })
    }
}
