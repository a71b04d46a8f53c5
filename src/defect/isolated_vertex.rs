//! A vertex that nothing uses.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A vertex that the file lists and no triangle names.
///
/// Matters because it is dead weight; by itself it harms nothing. Repaired by reading: only triangles are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IsolatedVertex {
    /// Its number in the file, from 0.
    pub vertex: u64,
}

impl fmt::Display for IsolatedVertex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "No triangle uses vertex {}", self.vertex)
    }
}
