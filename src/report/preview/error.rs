//! What can go wrong while a preview is drawn.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::store::StoreError;

/// Which of the two meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The mesh before the repair.
    Input,
    /// The mesh after it.
    Output,
}

impl Side {
    /// Both sides, left to right.
    pub const ALL: [Self; 2] = [Self::Input, Self::Output];

    /// The name of the EXR layer.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Output => "output",
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// An error of the world around a preview; `E` is the error of the mesh sources.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PreviewError<E: std::error::Error> {
    /// A mesh cannot be opened or read.
    #[error("Cannot read the {side} mesh for the preview")]
    Source {
        /// Which of the two.
        side: Side,
        /// The word of the reader.
        source: E,
    },
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
    /// The file name says nothing about the format.
    #[error("{path} names no picture format: expected .png or .exr")]
    UnknownFormat {
        /// The name as given.
        path: PathBuf,
    },
    /// A view without pixels, or with more than can be drawn.
    #[error("A view of {width_px} x {height_px} pixels: expected 1 to {limit_px} each way")]
    SizeUnsupported {
        /// Width of one view.
        width_px: u32,
        /// Height of one view.
        height_px: u32,
        /// The largest width and height.
        limit_px: u32,
    },
    /// The share cannot hold what has to be in memory at one time.
    #[error("{what} needs {needed_bytes} bytes of memory, the preview was given {share_bytes}")]
    ShareTooSmall {
        /// What has to be in memory.
        what: &'static str,
        /// How much that is.
        needed_bytes: u64,
        /// How much there is.
        share_bytes: u64,
    },
    /// The surfaces cannot be measured: the scratch disk fails.
    #[error("Cannot measure the deviation for the preview")]
    Measure(#[source] StoreError),
    /// No threads to measure with.
    #[error("Cannot start {threads} threads for the preview")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The system's word.
        source: rayon::ThreadPoolBuildError,
    },
    /// The caller asked to stop; no file was put in place.
    #[error("Stopped on request")]
    Cancelled,
}

impl<E: std::error::Error> PreviewError<E> {
    /// What the scratch disk says.
    pub(crate) fn measure(error: StoreError) -> Self {
        match error {
            StoreError::Cancelled => Self::Cancelled,
            error => Self::Measure(error),
        }
    }

    /// Wraps a system error with what was tried and where.
    pub(crate) fn io(doing: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Io { doing, path: path.to_path_buf(), source }
    }
}
