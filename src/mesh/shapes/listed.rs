//! Triangles in memory as a source, as if read from a file.

use std::convert::Infallible;

use crate::mesh::shapes::Corners;
use crate::mesh::{Discarded, MeshSource, TriangleBatch};

/// Triangles per batch: few, so that short lists come in several.
const BATCH_TRIANGLES: usize = 1024;

/// A list of triangles with one part and one material.
#[derive(Clone, Debug)]
pub struct ListedTriangles {
    corners: Vec<Corners>,
    /// Vertex numbers, as many as `corners`, or none.
    indices: Vec<[u32; 3]>,
    vertices: Option<u64>,
    next: usize,
}

impl ListedTriangles {
    /// Triangles without vertex numbers, as in an STL file.
    #[must_use]
    pub fn without_indices(corners: Vec<Corners>) -> Self {
        Self { corners, indices: Vec::new(), vertices: None, next: 0 }
    }

    /// Triangles between numbered vertices, as in a PLY file.
    ///
    /// # Panics
    /// An index leads nowhere.
    #[must_use]
    pub fn with_indices(vertices: &[[f64; 3]], indices: Vec<[u32; 3]>) -> Self {
        let corners = indices.iter().map(|t| t.map(|number| vertices[number as usize])).collect();
        let vertices = Some(vertices.len() as u64);
        Self { indices, vertices, ..Self::without_indices(corners) }
    }
}

impl MeshSource for ListedTriangles {
    type Error = Infallible;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, Infallible> {
        batch.clear();
        let end = (self.next + BATCH_TRIANGLES).min(self.corners.len());
        for number in self.next..end {
            batch.push(self.corners[number], 0, 0, number as u32);
        }
        if !self.indices.is_empty() {
            batch.indices.extend_from_slice(&self.indices[self.next..end]);
        }
        self.next = end;
        Ok(!batch.is_empty())
    }

    fn discarded(&self) -> Discarded {
        Discarded::default()
    }

    fn bytes_read(&self) -> u64 {
        (self.next * size_of::<Corners>()) as u64
    }

    fn vertex_count(&self) -> Option<u64> {
        self.vertices
    }
}
