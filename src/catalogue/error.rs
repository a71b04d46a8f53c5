//! What can end a batch before its end.

use std::path::PathBuf;

use crate::repair::{Blame, RepairError};
use crate::store::StoreError;

/// Why a batch, or a look at one, could not go on. A model that fails is none of these.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogueError {
    /// A pattern of files cannot be understood.
    #[error("The pattern {pattern:?} cannot be understood: {reason}")]
    Pattern {
        /// The pattern.
        pattern: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The results would lie among the models, or the other way round.
    #[error("{target} and {models} are the same folder; results need one of their own")]
    SameFolder {
        /// Folder of the models.
        models: PathBuf,
        /// Folder of the results.
        target: PathBuf,
    },
    /// There is no catalogue in this folder.
    #[error("{folder} has no journal of a batch in it")]
    NoJournal {
        /// The folder.
        folder: PathBuf,
    },
    /// The journal is of another version of the program.
    #[error(
        "The journal {path} has schema {found}, this version reads {expected}; use the version that \
         wrote it, or begin anew in another folder"
    )]
    OtherSchema {
        /// The journal.
        path: PathBuf,
        /// Its schema.
        found: String,
        /// Ours.
        expected: String,
    },
    /// The journal cannot be used.
    #[error("The journal {path} cannot be used")]
    Journal {
        /// The journal.
        path: PathBuf,
        /// The database's word.
        source: rusqlite::Error,
    },
    /// A worker cannot be started.
    #[error("A worker cannot be started from {program}")]
    Worker {
        /// The program.
        program: PathBuf,
        /// The system's word.
        source: std::io::Error,
    },
    /// No model has this name.
    #[error("{model} is no model of this catalogue")]
    NoSuchModel {
        /// As asked for.
        model: String,
    },
    /// The memory does not do for one worker.
    #[error(
        "A memory budget of {found_bytes} bytes is below the floor of {needed_bytes} bytes: \
         {jobs} workers, and this process"
    )]
    BudgetBelowFloor {
        /// The budget.
        found_bytes: u64,
        /// The least that would do.
        needed_bytes: u64,
        /// Workers at one time.
        jobs: usize,
    },
    /// The folder of the results is locked.
    #[error(transparent)]
    Locked(RepairError),
    /// Folders and files.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl CatalogueError {
    /// Whose fault it is.
    #[must_use]
    pub fn blame(&self) -> Blame {
        match self {
            Self::Pattern { .. }
            | Self::SameFolder { .. }
            | Self::NoJournal { .. }
            | Self::NoSuchModel { .. }
            | Self::BudgetBelowFloor { .. } => Blame::Usage,
            Self::OtherSchema { .. } | Self::Journal { .. } => Blame::Disk,
            Self::Worker { .. } => Blame::Temporary,
            Self::Locked(error) => error.blame(),
            Self::Store(StoreError::Cancelled) => Blame::Interrupted,
            Self::Store(_) => Blame::Disk,
        }
    }
}
