//! What can end a repair without a result.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::contour::{ContourError, WriteError};
use crate::ingest::{IngestError, SoupStats};
use crate::io::IoError;
use crate::patch::PatchError;
use crate::repair::length::Reach;
use crate::sign::SignError;
use crate::store::StoreError;
use crate::transfer::TransferError;
use crate::verify::VerifyError;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// The input cannot be read.
    #[error(transparent)]
    Input(IoError),
    /// The input has no triangle with an area.
    #[error("{path}: no triangle is left: {reason}")]
    NoTriangle {
        /// The input.
        path: PathBuf,
        /// What became of its faces.
        reason: String,
    },
    /// `--strict` and broken faces.
    #[error("{path}: {found} broken faces, and strict input was asked for")]
    Broken {
        /// The input.
        path: PathBuf,
        /// How many.
        found: u64,
    },
    /// The memory budget is too small for any model.
    #[error("A memory budget of {found_bytes} bytes is below the floor of {needed_bytes} bytes")]
    BudgetBelowFloor {
        /// The budget.
        found_bytes: u64,
        /// The least that would do, with one thread.
        needed_bytes: u64,
    },
    /// The disk limit is too small for this model.
    #[error(
        "A disk limit of {limit_bytes} bytes is below the estimate of {needed_bytes} bytes for \
         this model at this depth"
    )]
    DiskBelowEstimate {
        /// The limit.
        limit_bytes: u64,
        /// What the work folder and the output may take.
        needed_bytes: u64,
    },
    /// The input is not what it was when the run began.
    #[error("{path} changed while it was read; run again")]
    InputChanged {
        /// The input.
        path: PathBuf,
    },
    /// The output would replace the input.
    #[error("The output {path} is the input itself, which is never touched; give another name")]
    OutputIsInput {
        /// The file.
        path: PathBuf,
    },
    /// The input lies where scratch files lie, which are removed.
    #[error("The input {path} lies in the work folder of this output, {folder}; move it first")]
    InputInWorkFolder {
        /// The input.
        path: PathBuf,
        /// The work folder.
        folder: PathBuf,
    },
    /// The material library or an image beside the output would replace a file that is not ours.
    #[error(
        "{path} would be replaced by what belongs to the output, and is none of brickmend's; give \
         the output another name"
    )]
    ForeignLibrary {
        /// The file.
        path: PathBuf,
    },
    /// Two levels of detail would be the same file.
    #[error("The level {level} is listed twice")]
    SameLevel {
        /// The level.
        level: Reach,
    },
    /// A method that does not merge cells was asked to.
    #[error("{option} needs --method mdc: no other merges cells")]
    NothingToMerge {
        /// What asked for it.
        option: &'static str,
    },
    /// Parts that are kept apart, and something that is there for one solid only.
    #[error("{option} is for one solid, and --parts separate keeps several apart")]
    OnlyAsUnion {
        /// What asked for it.
        option: &'static str,
    },
    /// No threshold gives as few triangles as were asked for.
    #[error(
        "At most {limit} triangles were asked for, and the surface has {fewest} at the least, \
         however many cells are merged; a smaller --depth gives fewer"
    )]
    TooManyTriangles {
        /// What was asked for.
        limit: u64,
        /// The fewest that were found.
        fewest: u64,
    },
    /// A length with a unit for a file without one.
    #[error(
        "{path} states no unit, so a length in metres means nothing; say --units, or give model units \
         or %"
    )]
    NoUnit {
        /// The input.
        path: PathBuf,
    },
    /// Numbers to be converted in a file without a unit.
    #[error("{path} states no unit, so its numbers cannot be turned into another; say --units")]
    NothingToConvert {
        /// The input.
        path: PathBuf,
    },
    /// Single precision cannot hold cells of this depth at this place.
    #[error(
        "Single precision (STL) is too coarse for depth {depth} this far from the origin: \
         depth {possible_depth} would do, or PLY, OBJ or OFF as the output"
    )]
    OutputTooCoarse {
        /// The depth asked for.
        depth: u32,
        /// The deepest depth that would do; 0 when none.
        possible_depth: u32,
    },
    /// The result has no triangle.
    #[error("{path}: the result has no triangle: {reason}")]
    EmptyResult {
        /// The input.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The written file does not prove sound: a bug of ours.
    #[error("The proof of the written file failed: {failures}; the work folder {folder} is kept")]
    ProofFailed {
        /// What failed, with places.
        failures: String,
        /// The work folder.
        folder: PathBuf,
    },
    /// Another run works on the same output.
    #[error("Another run holds {folder}")]
    Locked {
        /// The work folder.
        folder: PathBuf,
    },
    /// The work folder or the output cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The output cannot be written.
    #[error(transparent)]
    Output(IoError),
    /// Patching failed.
    #[error("Patching failed")]
    Patch(#[source] PatchError),
    /// Sign generation failed.
    #[error("Sign generation failed")]
    Sign(#[source] SignError),
    /// Looking for borders between materials failed.
    #[error("Looking for borders between materials failed")]
    Transfer(#[source] TransferError),
    /// Contouring failed.
    #[error("Contouring failed")]
    Contour(#[source] ContourError),
    /// The written file cannot be read back.
    #[error("The written file cannot be read back")]
    ReadBack(#[source] IoError),
    /// The threads cannot be started.
    #[error("Cannot start {threads} threads")]
    Threads {
        /// How many.
        threads: usize,
        /// The system's word.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Whose fault an error is; decides the exit code and what becomes of the work folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Blame {
    /// Ours.
    Internal,
    /// The command line's.
    Usage,
    /// The model's: no result.
    Model,
    /// The disk's.
    Disk,
    /// Another run's.
    Lock,
    /// The input file's.
    Input,
    /// Nobody's in particular: the same command may well work the next time.
    Temporary,
    /// The system's, which gave less memory than there was to be.
    Memory,
    /// The caller's: interrupted.
    Interrupted,
    /// A limit that the user set: stopped on the way, to be gone on with.
    Limit,
}

impl RepairError {
    /// Whose fault it is.
    #[must_use]
    pub fn blame(&self) -> Blame {
        if self.is_memory_short() {
            return Blame::Memory;
        }
        match self {
            Self::Input(error) if error.is_input() => Blame::Input,
            Self::Input(IoError::Store(error)) => blame_store(error),
            Self::Output(IoError::Store(error)) | Self::ReadBack(IoError::Store(error)) => {
                blame_store(error)
            }
            // The file is ours: it is the disk that cannot give it back.
            Self::ReadBack(IoError::Input { .. }) => Blame::Disk,
            Self::Input(_) | Self::Output(_) => Blame::Disk,
            Self::NoTriangle { .. } | Self::Broken { .. } => Blame::Input,
            Self::InputChanged { .. } => Blame::Temporary,
            Self::BudgetBelowFloor { .. }
            | Self::DiskBelowEstimate { .. }
            | Self::OutputIsInput { .. }
            | Self::InputInWorkFolder { .. }
            | Self::ForeignLibrary { .. }
            | Self::SameLevel { .. }
            | Self::NothingToMerge { .. }
            | Self::OnlyAsUnion { .. }
            | Self::TooManyTriangles { .. }
            | Self::NoUnit { .. }
            | Self::NothingToConvert { .. }
            | Self::OutputTooCoarse { .. } => Blame::Usage,
            Self::EmptyResult { .. } => Blame::Model,
            Self::Locked { .. } => Blame::Lock,
            Self::Store(error)
            | Self::Patch(PatchError::Store(error))
            | Self::Sign(SignError::Store(error))
            | Self::Contour(ContourError::Store(error))
            | Self::Transfer(TransferError::Store(error)) => blame_store(error),
            Self::ProofFailed { .. }
            | Self::Patch(_)
            | Self::Sign(_)
            | Self::Contour(_)
            | Self::Transfer(_)
            | Self::ReadBack(_) => Blame::Internal,
            // What a thread needs of the system is its stack.
            Self::Threads { .. } => Blame::Memory,
        }
    }

    /// Whether the system had no memory for a mapping, whatever the file it was to be of.
    fn is_memory_short(&self) -> bool {
        let mut cause: Option<&dyn std::error::Error> = Some(self);
        while let Some(error) = cause {
            let system: Option<&std::io::Error> = error.downcast_ref();
            if system.is_some_and(|error| error.kind() == std::io::ErrorKind::OutOfMemory) {
                return true;
            }
            cause = error.source();
        }
        false
    }

    /// Whether the work folder may serve a later run, or explain this one.
    #[must_use]
    pub fn keeps_work(&self) -> bool {
        let blame = self.blame();
        matches!(
            blame,
            Blame::Internal | Blame::Disk | Blame::Memory | Blame::Interrupted | Blame::Limit
        )
    }

    /// The file of the work folder whose bytes are not those that were written, if that is it.
    pub(crate) fn damaged_file(&self) -> Option<&Path> {
        let store = match self {
            Self::Store(error)
            | Self::Input(IoError::Store(error))
            | Self::Output(IoError::Store(error))
            | Self::ReadBack(IoError::Store(error))
            | Self::Patch(PatchError::Store(error))
            | Self::Sign(SignError::Store(error))
            | Self::Contour(ContourError::Store(error))
            | Self::Transfer(TransferError::Store(error)) => error,
            _ => return None,
        };
        match store {
            StoreError::Damaged { path, .. } => Some(path),
            _ => None,
        }
    }

    /// What is wrong with an input of which no triangle with an area is left.
    pub(crate) fn no_triangle(path: &Path, stats: &SoupStats) -> Self {
        let reason = format!(
            "{} read, {} with corners that are not finite, {} faces with wild indices, {} faces \
             with fewer than three corners, {} without area",
            stats.triangles,
            stats.nonfinite_triangles,
            stats.discarded.wild_index_faces,
            stats.discarded.short_faces,
            stats.triangles - stats.nonfinite_triangles
        );
        Self::NoTriangle { path: path.to_path_buf(), reason }
    }

    pub(crate) fn from_ingest(error: IngestError<IoError>, path: &Path) -> Self {
        match error {
            IngestError::Source(error) => Self::Input(error),
            IngestError::Store(error) => Self::Store(error),
            IngestError::Broken { found } => Self::Broken { path: path.to_path_buf(), found },
            IngestError::TooManyTriangles { limit } => {
                Self::Store(StoreError::TooMany { what: "Triangles of the input", limit })
            }
        }
    }

    pub(crate) fn from_write(error: WriteError<IoError>) -> Self {
        match error {
            WriteError::Contour(error) => Self::Contour(error),
            WriteError::Sink(error) => Self::Output(error),
        }
    }

    pub(crate) fn from_verify(error: VerifyError<IoError>) -> Self {
        match error {
            VerifyError::Source { source } => Self::ReadBack(source),
            VerifyError::Store(error) => Self::Store(error),
        }
    }
}

fn blame_store(error: &StoreError) -> Blame {
    match error {
        StoreError::Cancelled => Blame::Interrupted,
        StoreError::DiskLimit { .. } => Blame::Limit,
        StoreError::TooMany { .. } | StoreError::OverBudget { .. } => Blame::Usage,
        _ => Blame::Disk,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_the_system_refused_is_its_fault_whatever_file_it_was_for() {
        let refused = || std::io::Error::from(std::io::ErrorKind::OutOfMemory);
        let store = || StoreError::io("map", Path::new("a.bricks"), refused());
        let input = IoError::input("map", Path::new("a.stl"), refused());
        for error in [
            RepairError::Store(store()),
            RepairError::Sign(SignError::Store(store())),
            RepairError::Input(input),
        ] {
            assert_eq!(error.blame(), Blame::Memory, "{error}");
            assert!(error.keeps_work());
        }
    }
}
