//! What can go wrong while layers are written.

use std::path::{Path, PathBuf};

use crate::deviate::DeviateError;
use crate::io::IoError;
use crate::repair::Blame;
use crate::report::preview::PreviewError;
use crate::store::StoreError;

/// Why there are no layers.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LayersError {
    /// A layer would replace the input or the output.
    #[error("{path} is a model of this repair; choose another folder for --export")]
    OverModel {
        /// The model.
        path: PathBuf,
    },
    /// A tolerance in metres, and a model without a unit.
    #[error(
        "{path} states no unit, so --export-tolerance in metres means nothing; say --units, or give \
         cells, model units or %"
    )]
    NoUnit {
        /// The input.
        path: PathBuf,
    },
    /// The folder cannot be made, or an old layer not be removed.
    #[error("Cannot {doing} {path}")]
    Folder {
        /// What was tried, as a verb.
        doing: &'static str,
        /// The folder or the layer.
        path: PathBuf,
        /// The system's word.
        source: std::io::Error,
    },
    /// A model cannot be read.
    #[error("Cannot read {path} for the layers")]
    Source {
        /// The input or the output.
        path: PathBuf,
        /// The reader's word.
        source: Box<IoError>,
    },
    /// A layer cannot be written.
    #[error("Cannot write {path}")]
    Layer {
        /// The layer.
        path: PathBuf,
        /// The writer's word.
        source: Box<IoError>,
    },
    /// A layer cannot be put in place.
    #[error(transparent)]
    InPlace(PreviewError<IoError>),
    /// The scratch disk fails.
    #[error("Cannot measure for the layers")]
    Scratch(#[source] StoreError),
    /// No threads to measure with.
    #[error("Cannot start {threads} threads for the layers")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The system's word.
        source: rayon::ThreadPoolBuildError,
    },
    /// Squares of lengths are no numbers.
    #[error("{path} is too large to be measured, so there are no layers")]
    TooLarge {
        /// The input or the output.
        path: PathBuf,
    },
    /// The caller asked to stop.
    #[error("Stopped on request")]
    Cancelled,
}

impl LayersError {
    /// Whose fault it is.
    #[must_use]
    pub fn blame(&self) -> Blame {
        match self {
            Self::OverModel { .. } | Self::NoUnit { .. } | Self::TooLarge { .. } => Blame::Usage,
            Self::Threads { .. } => Blame::Memory,
            Self::Cancelled => Blame::Interrupted,
            Self::Scratch(StoreError::DiskLimit { .. }) => Blame::Limit,
            Self::Folder { .. }
            | Self::Source { .. }
            | Self::Layer { .. }
            | Self::InPlace(_)
            | Self::Scratch(_) => Blame::Disk,
        }
    }

    /// What the scratch disk says.
    pub(crate) fn scratch(error: StoreError) -> Self {
        match error {
            StoreError::Cancelled => Self::Cancelled,
            error => Self::Scratch(error),
        }
    }

    /// What the reader of a model says.
    pub(crate) fn source(path: &Path, source: IoError) -> Self {
        match source {
            IoError::Store(error) => Self::scratch(error),
            source => Self::Source { path: path.to_path_buf(), source: Box::new(source) },
        }
    }

    /// What the writer of a layer says.
    pub(crate) fn layer(path: &Path, source: IoError) -> Self {
        match source {
            IoError::Store(error) => Self::scratch(error),
            source => Self::Layer { path: path.to_path_buf(), source: Box::new(source) },
        }
    }

    /// What measuring against a model, or what is of it, says.
    pub(crate) fn deviate(path: &Path, error: DeviateError<IoError>) -> Self {
        match error {
            DeviateError::Source { source } => Self::source(path, source),
            DeviateError::Store(error) => Self::scratch(error),
        }
    }

    /// What the system says of the folder or a layer.
    pub(crate) fn folder(doing: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Folder { doing, path: path.to_path_buf(), source }
    }
}
