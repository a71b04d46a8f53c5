//! A shell that nobody sees.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A connected surface that cannot be seen from outside of the model.
///
/// Matters because it costs triangles and shows nothing; by itself it harms nothing. Repaired by the hidden stage,
/// which takes out what no ray from outside reaches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HiddenShell {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Their area, model units squared.
    pub area: f64,
    /// The first corner of its first triangle, model units.
    pub position: [f64; 3],
}

impl fmt::Display for HiddenShell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, place) = (self.triangles, Point(self.position));
        write!(
            f,
            "A shell of {count} triangles, from triangle {} on, is hidden; it is at {place}",
            self.triangle
        )
    }
}
