//! The writing end: vertices and triangles into any file.

/// What a sink wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SinkStats {
    /// Vertices written.
    pub vertices: u64,
    /// Triangles written.
    pub triangles: u64,
    /// Size of the finished file.
    pub bytes: u64,
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

    /// Whether [`MeshSink::triangles`] needs the corners' positions; `corners` may be empty where
    /// it does not.
    fn needs_corners(&self) -> bool {
        true
    }

    /// Appends triangles: vertex numbers, and the same corners' positions for formats without
    /// indices. Both slices have the same length, unless the sink needs no corners.
    ///
    /// # Errors
    /// The file cannot be written.
    fn triangles(
        &mut self,
        indices: &[[u32; 3]],
        corners: &[[[f64; 3]; 3]],
    ) -> Result<(), Self::Error>;

    /// Completes the file, and hands its bytes to the disk (fsync).
    ///
    /// # Errors
    /// The file cannot be completed.
    fn finish(self: Box<Self>) -> Result<SinkStats, Self::Error>;
}
