//! One part on its way into a file of several: its numbers go on from those of the parts before.
//!
//! Memory: the triangles of one call; the materials of looks, spilled beyond a share.

use serde::{Deserialize, Serialize};

use crate::io::{IoError, LookMap};
use crate::mesh::{
    CornerForm, CornerValues, DrawnFrom, MeshSink, SinkState, SinkStats, SinkTriangles,
    VertexValues,
};

/// What there is of vertices and of the two lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Numbered {
    pub vertices: u64,
    pub uvs: u64,
    pub normals: u64,
    pub triangles: u64,
}

/// Takes a part that is numbered from 0.
pub struct PartSink<'s> {
    sink: &'s mut (dyn MeshSink<Error = IoError> + Send),
    looks: LookMap,
    /// In front of this part.
    before: Numbered,
    /// This part included.
    pub after: Numbered,
    indices: Vec<[u32; 3]>,
    uvs: Vec<[u32; 3]>,
    normals: Vec<[u32; 3]>,
}

impl<'s> PartSink<'s> {
    /// For a part behind what is there `before`, whose surfaces name looks.
    pub fn new(
        sink: &'s mut (dyn MeshSink<Error = IoError> + Send),
        looks: LookMap,
        before: Numbered,
    ) -> Self {
        let (indices, uvs, normals) = Default::default();
        Self { sink, looks, before, after: before, indices, uvs, normals }
    }
}

/// The same numbers behind those of earlier parts.
fn shift(numbers: &[[u32; 3]], by: u64, shifted: &mut Vec<[u32; 3]>) {
    shifted.clear();
    shifted.extend(numbers.iter().map(|corner| corner.map(|number| number + by as u32)));
}

impl MeshSink for PartSink<'_> {
    type Error = IoError;

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.after.vertices += positions.len() as u64;
        self.sink.vertices(positions)
    }

    fn corner_form(&self) -> CornerForm {
        self.sink.corner_form()
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), IoError> {
        self.sink.vertex_values(values)
    }

    fn list_uvs(&mut self, uvs: &[[f32; 2]]) -> Result<(), IoError> {
        self.after.uvs += uvs.len() as u64;
        self.sink.list_uvs(uvs)
    }

    fn list_normals(&mut self, normals: &[[f32; 3]]) -> Result<(), IoError> {
        self.after.normals += normals.len() as u64;
        self.sink.list_normals(normals)
    }

    fn needs_corners(&self) -> bool {
        self.sink.needs_corners()
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        self.after.triangles += triangles.indices.len() as u64;
        shift(triangles.indices, self.before.vertices, &mut self.indices);
        shift(triangles.uvs.numbers, self.before.uvs, &mut self.uvs);
        shift(triangles.normals.numbers, self.before.normals, &mut self.normals);
        self.sink.triangles(&SinkTriangles {
            indices: &self.indices,
            corners: triangles.corners,
            surfaces: self.looks.materials_of(triangles.surfaces)?,
            uvs: CornerValues { numbers: &self.uvs, values: triangles.uvs.values },
            normals: CornerValues { numbers: &self.normals, values: triangles.normals.values },
            from: DrawnFrom::default(),
        })
    }

    fn bytes_so_far(&self) -> u64 {
        self.sink.bytes_so_far()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        self.sink.checkpoint()
    }

    /// The part is whole; the file is not.
    fn finish(self: Box<Self>) -> Result<SinkStats, IoError> {
        let Numbered { vertices, triangles, .. } = self.after;
        Ok(SinkStats { vertices, triangles, ..SinkStats::default() })
    }
}
