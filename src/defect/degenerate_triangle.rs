//! A triangle without area.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A triangle whose corners lie on one line or in one point, exactly.
///
/// Matters because it has no normal: everything that divides by its area breaks. Repaired by
/// contouring, which writes a new surface and tests each triangle on the output's grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DegenerateTriangle {
    /// Its number in the file, from 0.
    pub triangle: u64,
    /// Its corners, in model units.
    pub corners: [[f64; 3]; 3],
}

impl fmt::Display for DegenerateTriangle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Triangle {} at {} has no area", self.triangle, Point(self.corners[0]))
    }
}
