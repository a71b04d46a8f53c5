//! The writing end: vertices and triangles into any file.

use serde::{Deserialize, Serialize};

use crate::mesh::Surface;

/// A file that a sink has written, as far as it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SinkFile {
    /// Its size.
    pub bytes: u64,
    /// Digest of its bytes.
    pub digest: [u8; 16],
}

/// How far a sink has come: enough for another one to go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SinkState {
    /// Vertices taken.
    pub vertices: u64,
    /// Triangles taken.
    pub triangles: u64,
    /// The output.
    pub output: SinkFile,
    /// The faces that wait beside it, in formats that need that.
    pub aside: SinkFile,
    /// The vertices that wait beside it, likewise.
    #[serde(default)]
    pub vertices_aside: SinkFile,
}

/// What a sink wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SinkStats {
    /// Vertices written.
    pub vertices: u64,
    /// Triangles written.
    pub triangles: u64,
    /// The finished file.
    pub file: SinkFile,
}

/// Triangles for a sink, as parallel slices.
#[derive(Clone, Copy, Debug, Default)]
pub struct SinkTriangles<'t> {
    /// Vertex numbers.
    pub indices: &'t [[u32; 3]],
    /// The same corners' positions, for formats without indices; may be empty where the sink needs
    /// none.
    pub corners: &'t [[[f64; 3]; 3]],
    /// What they are; empty where the sink was not told of any material.
    pub surfaces: &'t [Surface],
}

/// Takes vertices and triangles in order and writes a file.
///
/// A triangle may name any vertex that was handed over before it.
pub trait MeshSink {
    /// What can go wrong in the world of this sink.
    type Error: std::error::Error;

    /// Appends vertices; their numbers go on from the last one, starting at 0. Model units.
    ///
    /// # Errors
    /// The file cannot be written.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Self::Error>;

    /// Whether [`MeshSink::triangles`] needs the corners' positions.
    fn needs_corners(&self) -> bool {
        true
    }

    /// Appends triangles.
    ///
    /// # Errors
    /// The file cannot be written.
    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), Self::Error>;

    /// Bytes taken so far, about.
    fn bytes_so_far(&self) -> u64;

    /// Writes out what is buffered and tells how far the files go.
    ///
    /// # Errors
    /// The file cannot be written.
    fn checkpoint(&mut self) -> Result<SinkState, Self::Error>;

    /// Completes the file, and hands its bytes to the disk (fsync).
    ///
    /// # Errors
    /// The file cannot be completed.
    fn finish(self: Box<Self>) -> Result<SinkStats, Self::Error>;
}
