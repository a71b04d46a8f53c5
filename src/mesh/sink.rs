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
    /// What vertices have besides, likewise.
    #[serde(default)]
    pub values_aside: SinkFile,
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

/// How a sink takes what vertices have besides a position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CornerForm {
    /// Not at all.
    #[default]
    None,
    /// Texture coordinates and normals with every corner of a triangle; the sink may also keep the
    /// lists in which corners name them by number (OBJ, PLY, 3MF). Colours with every vertex.
    OfCorners,
    /// One of each with every vertex: a vertex is handed over once for each that its corners have
    /// (GLB).
    OfVertices,
}

/// What vertices have besides a position, as slices parallel to them; each empty where there is
/// none.
#[derive(Clone, Copy, Debug, Default)]
pub struct VertexValues<'v> {
    /// RGBA.
    pub colours: &'v [[u8; 4]],
    /// Texture coordinates, v up; only with [`CornerForm::OfVertices`].
    pub uvs: &'v [[f32; 2]],
    /// Unit normals; only with [`CornerForm::OfVertices`].
    pub normals: &'v [[f32; 3]],
}

/// What the corners of triangles have of one kind, as slices parallel to these; both empty where
/// they have none.
#[derive(Clone, Copy, Debug)]
pub struct CornerValues<'t, T> {
    /// Numbers in the list that was handed over before.
    pub numbers: &'t [[u32; 3]],
    /// The same by value.
    pub values: &'t [[T; 3]],
}

impl<T> Default for CornerValues<'_, T> {
    fn default() -> Self {
        Self { numbers: &[], values: &[] }
    }
}

/// A crossing of the grid that no triangle tells of: one vertex stands for all that is around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InnerCrossing {
    /// The vertex.
    pub vertex: u32,
    /// Where that is.
    pub position: [f64; 3],
    /// What the surface is there.
    pub surface: Surface,
    /// The source triangle.
    pub source: u32,
}

/// Where triangles come from; all empty unless the sink asks.
#[derive(Clone, Copy, Debug, Default)]
pub struct DrawnFrom<'t> {
    /// Source triangles, parallel to the triangles.
    pub sources: &'t [u32],
    /// What there is between them.
    pub inner: &'t [InnerCrossing],
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
    /// Texture coordinates, v up; only with [`CornerForm::OfCorners`].
    pub uvs: CornerValues<'t, [f32; 2]>,
    /// Unit normals; only with [`CornerForm::OfCorners`].
    pub normals: CornerValues<'t, [f32; 3]>,
    /// Where they come from.
    pub from: DrawnFrom<'t>,
}

/// Takes vertices and triangles in order and writes a file.
///
/// A triangle may name any vertex that was handed over before it.
pub trait MeshSink {
    /// What can go wrong in the world of this sink.
    type Error: std::error::Error;

    /// Begins a part: what follows is of it, until the next one begins. Its number is that of
    /// [`crate::mesh::SceneNode::part`]. Triangles name vertices of their own part only. A file that
    /// is never told of a part has one, without a name.
    ///
    /// # Errors
    /// The file cannot be written.
    fn begin_part(&mut self, _number: u32, _name: &str) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Appends vertices; their numbers go on from the last one, starting at 0. Model units.
    ///
    /// # Errors
    /// The file cannot be written.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Self::Error>;

    /// How this sink takes colours, texture coordinates and normals.
    fn corner_form(&self) -> CornerForm {
        CornerForm::None
    }

    /// Tells what the vertices have that the last call of [`MeshSink::vertices`] appended.
    ///
    /// # Errors
    /// The file cannot be written.
    fn vertex_values(&mut self, _values: &VertexValues) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Appends to the list of texture coordinates, v up; numbers from 0, ahead of the triangles
    /// that name them.
    ///
    /// # Errors
    /// The file cannot be written.
    fn list_uvs(&mut self, _uvs: &[[f32; 2]]) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Appends to the list of normals, likewise.
    ///
    /// # Errors
    /// The file cannot be written.
    fn list_normals(&mut self, _normals: &[[f32; 3]]) -> Result<(), Self::Error> {
        Ok(())
    }

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
