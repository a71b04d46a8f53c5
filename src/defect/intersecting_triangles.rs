//! Two triangles that go through each other or touch.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// Two triangles that meet anywhere but in vertices and edges that they share.
///
/// Matters because inside and outside are undefined there: slicers, booleans and simulations fail
/// or guess. Touching counts, since the smallest change makes it a crossing. Repaired by
/// contouring, which places each vertex in a cell of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntersectingTriangles {
    /// Their numbers in the file, from 0, the smaller one first.
    pub triangles: [u64; 2],
    /// The middle of the overlap of their boxes, in model units.
    pub position: [f64; 3],
}

impl fmt::Display for IntersectingTriangles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.triangles;
        write!(f, "Triangles {a} and {b} intersect near {}", Point(self.position))
    }
}
