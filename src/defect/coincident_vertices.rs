//! Two vertices in one place.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// Two vertices of an indexed file that triangles use and that have exactly the same position.
///
/// Matters because readers that weld by position, and formats without indices, see one vertex
/// where the file has two: a manifold file stops being one. Repaired by contouring, which moves
/// no two vertices to one point of the output's grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoincidentVertices {
    /// The smallest vertex number at this position, and the other one; from 0.
    pub vertices: [u32; 2],
    /// Where they are, in model units.
    pub position: [f64; 3],
}

impl fmt::Display for CoincidentVertices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.vertices;
        write!(f, "Vertices {a} and {b} are both at {}", Point(self.position))
    }
}
