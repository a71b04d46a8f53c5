//! A shell that is small for the model.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A connected surface whose box is small against that of the model.
///
/// Matters because it is mostly dirt, and may be what a slicer stumbles on; by itself it harms nothing. A repair
/// keeps it where it is larger than a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TinyShell {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// The diagonal of its box, model units.
    pub diagonal: f64,
    /// The first corner of its first triangle, model units.
    pub position: [f64; 3],
}

impl fmt::Display for TinyShell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, place) = (self.triangles, Point(self.position));
        write!(f, "A shell of {count} triangles is {} across; it is at {place}", self.diagonal)
    }
}
