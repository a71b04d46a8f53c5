//! Two triangles that touch.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// Two triangles that meet beyond what they share, but neither goes through the other.
///
/// Matters because the smallest change makes it a crossing; by itself it harms nothing. Repaired by contouring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TouchingTriangles {
    /// Their numbers in the file, from 0, the smaller one first.
    pub triangles: [u64; 2],
    /// The middle of the overlap of their boxes, model units.
    pub position: [f64; 3],
}

impl fmt::Display for TouchingTriangles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.triangles;
        write!(f, "Triangles {a} and {b} touch near {}", Point(self.position))
    }
}
