//! What can go wrong while a surface is read for a comparison.

use crate::store::StoreError;

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviateError<E> {
    /// The file cannot be read.
    #[error("Cannot read the surface to compare")]
    Source {
        /// The reader's own word.
        source: E,
    },
    /// The scratch disk failed, or the caller asked to stop.
    #[error(transparent)]
    Store(#[from] StoreError),
}
