//! A vertex on an edge that does not know it.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A vertex of the rim that lies within a tolerance of the inside of a boundary edge.
///
/// Matters because the neighbours do not hang together there: rounding opens a crack. Repaired by the grid, which
/// does not see cracks narrower than a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TJunction {
    /// The vertex, model units.
    pub position: [f64; 3],
    /// The ends of the edge, model units.
    pub ends: [[f64; 3]; 2],
    /// How far it lies from the edge, model units; 0 is not exact.
    pub distance: f64,
    /// The triangle of the edge, by its number in the file, from 0.
    pub triangle: u64,
}

impl fmt::Display for TJunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.ends.map(Point);
        write!(f, "The vertex at {} lies on the edge from {a} to {b}", Point(self.position))
    }
}
