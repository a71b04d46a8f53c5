//! A point in which otherwise separate sheets touch.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::VertexPlace;

/// A vertex whose triangles form more than one fan.
///
/// Matters because the surface around it is no disc: normals, parametrisation and offsets are
/// undefined there. Repaired by contouring, which gives every sheet at a cell its own vertex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NonmanifoldVertex {
    /// The vertex.
    #[serde(flatten)]
    pub vertex: VertexPlace,
    /// How many fans of triangles, connected over edges, meet in it.
    pub fans: u64,
}

impl fmt::Display for NonmanifoldVertex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Vertex {} joins {} separate fans", self.vertex, self.fans)
    }
}
