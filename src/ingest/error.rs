//! What can go wrong while a file is taken in.

use crate::store::StoreError;

/// An error of the input file or of the scratch disk.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IngestError<E: std::error::Error> {
    /// The input cannot be read.
    #[error(transparent)]
    Source(E),
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// More triangles than the formats of the work folder can number.
    #[error("The input has more than {limit} triangles")]
    TooManyTriangles {
        /// The largest number allowed.
        limit: u64,
    },
    /// `--strict`: broken geometry is refused.
    #[error("{found} broken faces (NaN, infinite or wild indices), and strict input was asked for")]
    Broken {
        /// How many.
        found: u64,
    },
}
