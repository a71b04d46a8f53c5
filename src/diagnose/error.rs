//! What can go wrong while a model is read for its diagnosis.

use crate::store::StoreError;

/// Why there is no diagnosis.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError<E> {
    /// The file cannot be read.
    #[error("Cannot read the model")]
    Source {
        /// The reader's own word.
        source: E,
    },
    /// The scratch disk failed, there are too many triangles, or the caller asked to stop.
    #[error(transparent)]
    Store(#[from] StoreError),
}
