//! A sheet that hangs from a surface.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A sheet that hangs from other triangles by an edge, by less than half of its border, is open on the
/// rest, and leaves the edge closed when it goes.
///
/// Matters because it encloses nothing, and its edge is not manifold. Repaired by ingest, which takes it out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fin {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Their area, model units squared.
    pub area: f64,
    /// The length by which it hangs, model units.
    pub hinge: f64,
    /// The length of its open border, model units.
    pub open: f64,
    /// The first corner of its first triangle, model units.
    pub position: [f64; 3],
}

impl fmt::Display for Fin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, place) = (self.triangles, Point(self.position));
        write!(
            f,
            "A fin of {count} triangles, from triangle {} on, hangs at {place}",
            self.triangle
        )
    }
}
