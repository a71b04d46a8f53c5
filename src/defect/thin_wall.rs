//! A wall that is thin.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A triangle with another one close behind its middle that faces the other way.
///
/// Matters because it breaks when printed and vanishes in coarse grids; by itself it harms nothing. A repair looks
/// deeper, or makes the wall thicker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThinWall {
    /// Its number in the file, from 0.
    pub triangle: u64,
    /// From its middle straight to the other side, model units.
    pub thickness: f64,
    /// Its middle, model units.
    pub position: [f64; 3],
}

impl fmt::Display for ThinWall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = Point(self.position);
        write!(f, "The wall at triangle {} is {} thick at {place}", self.triangle, self.thickness)
    }
}
