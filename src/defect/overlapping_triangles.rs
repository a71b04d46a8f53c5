//! Two triangles that share an area.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// Two triangles in one plane, exactly, that have an area in common.
///
/// Matters because the surface is there twice: it flickers, and what is inside is undefined. Repaired by
/// contouring, which writes a new surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlappingTriangles {
    /// Their numbers in the file, from 0, the smaller one first.
    pub triangles: [u64; 2],
    /// The middle of the overlap of their boxes, model units.
    pub position: [f64; 3],
}

impl fmt::Display for OverlappingTriangles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.triangles;
        write!(f, "Triangles {a} and {b} overlap near {}", Point(self.position))
    }
}
