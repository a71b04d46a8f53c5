//! The reading end: any file as a stream of triangle batches.

use serde::{Deserialize, Serialize};

use crate::mesh::{Material, Part, TriangleBatch};

/// Faces that a reader had to leave out because they lead nowhere. Defects, not errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Discarded {
    /// Faces with an index outside of the vertex list.
    pub wild_index_faces: u64,
    /// Faces with fewer than three corners.
    pub short_faces: u64,
}

/// A stream of triangles in file order.
///
/// Both name lists may grow while the file is read; an index in a batch is valid once that batch
/// has been delivered.
pub trait MeshSource {
    /// What can go wrong in the world of this source.
    type Error: std::error::Error;

    /// Replaces `batch` by the next triangles; `false` when there were none left.
    ///
    /// # Errors
    /// The file cannot be read or ends too early; what was delivered before stays valid.
    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, Self::Error>;

    /// The objects seen so far, never empty once a batch was delivered.
    fn parts(&self) -> &[Part];

    /// The materials seen so far, never empty once a batch was delivered.
    fn materials(&self) -> &[Material];

    /// What was left out so far.
    fn discarded(&self) -> Discarded;

    /// Bytes of the input consumed so far.
    fn bytes_read(&self) -> u64;

    /// The number of vertices that the file lists, in formats that have indices (after the end).
    fn vertex_count(&self) -> Option<u64>;
}
