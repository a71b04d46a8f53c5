//! What can go wrong while a page is written.

use std::io;
use std::path::{Path, PathBuf};

use crate::catalogue::CatalogueError;
use crate::io::IoError;
use crate::repair::Blame;
use crate::report::preview::PreviewError;

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The journal cannot be read.
    #[error(transparent)]
    Journal(#[from] CatalogueError),
    /// A picture cannot be drawn, or a file cannot be put in place.
    #[error(transparent)]
    Picture(#[from] PreviewError<IoError>),
    /// A coloured surface cannot be written.
    #[error("Cannot write the coloured surface")]
    Export(#[source] IoError),
    /// The page cannot be written.
    #[error("Cannot write {path}")]
    Write {
        /// The page.
        path: PathBuf,
        /// The system's word.
        source: io::Error,
    },
    /// A folder for pages cannot be made, or a page that no longer counts cannot be removed.
    #[error("Cannot {doing} {path}")]
    Folder {
        /// What was tried, as a verb.
        doing: &'static str,
        /// The folder or the page.
        path: PathBuf,
        /// The system's word.
        source: io::Error,
    },
}

impl ReportError {
    /// Whose fault it is.
    #[must_use]
    pub fn blame(&self) -> Blame {
        match self {
            Self::Journal(error) => error.blame(),
            Self::Picture(PreviewError::Cancelled) => Blame::Interrupted,
            Self::Picture(PreviewError::ShareTooSmall { .. }) => Blame::Usage,
            Self::Picture(_) | Self::Export(_) | Self::Write { .. } | Self::Folder { .. } => {
                Blame::Disk
            }
        }
    }
}

/// What stops a page while it is written, before it is said where.
pub(crate) enum Halt {
    /// The file.
    Write(io::Error),
    /// The journal.
    Journal(CatalogueError),
}

impl From<io::Error> for Halt {
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

impl From<CatalogueError> for Halt {
    fn from(error: CatalogueError) -> Self {
        Self::Journal(error)
    }
}

impl Halt {
    /// With the page that it stopped.
    pub(crate) fn at(self, path: &Path) -> ReportError {
        match self {
            Self::Write(source) => ReportError::Write { path: path.to_path_buf(), source },
            Self::Journal(error) => error.into(),
        }
    }
}
