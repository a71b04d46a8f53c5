//! A batch of triangles as they come out of a file.

/// A named object of the input file (OBJ `o`, else `g`; one for STL, PLY and OFF).
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Part {
    /// The name as written in the file; may be empty.
    pub name: String,
}

/// The polygon number of a triangle that came from no polygon of the file.
pub const NO_POLYGON: u32 = u32::MAX;

/// Triangles in file order, as parallel arrays; n-gons arrive already cut into triangles.
///
/// `corners`, `parts`, `materials` and `polygons` have one entry per triangle. `indices`, `uvs`
/// and `colours` have either one entry per triangle or none at all, the same for the whole file.
#[derive(Clone, Debug, Default)]
pub struct TriangleBatch {
    /// Corner positions in model units; NaN and infinities may occur.
    pub corners: Vec<[[f64; 3]; 3]>,
    /// Numbers for [`crate::mesh::MeshSource::part`].
    pub parts: Vec<u32>,
    /// Numbers for [`crate::mesh::MeshSource::material`].
    pub materials: Vec<u32>,
    /// Number of the polygon in the file, counted from 0, that the triangle was cut from.
    pub polygons: Vec<u32>,
    /// Vertex numbers in the file, from 0, in formats that have indices.
    pub indices: Vec<[u32; 3]>,
    /// Texture coordinates of the corners.
    pub uvs: Vec<[[f32; 2]; 3]>,
    /// RGBA colours of the corners.
    pub colours: Vec<[[u8; 4]; 3]>,
}

impl TriangleBatch {
    /// The number of triangles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Empties the batch and keeps its memory.
    pub fn clear(&mut self) {
        self.corners.clear();
        self.parts.clear();
        self.materials.clear();
        self.polygons.clear();
        self.indices.clear();
        self.uvs.clear();
        self.colours.clear();
    }

    /// Adds a triangle without optional attributes.
    pub fn push(&mut self, corners: [[f64; 3]; 3], part: u32, material: u32, polygon: u32) {
        self.corners.push(corners);
        self.parts.push(part);
        self.materials.push(material);
        self.polygons.push(polygon);
    }
}
