//! A triangle with a corner that is no place.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A triangle with a coordinate that is NaN or infinite.
///
/// Matters because nothing can be computed of it. Repaired by ingest, which drops it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NonfiniteTriangle {
    /// Its number in the file, from 0.
    pub triangle: u64,
}

impl fmt::Display for NonfiniteTriangle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Triangle {} has an infinite or undefined corner", self.triangle)
    }
}
