//! A shell with a rim.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A connected surface that has boundary edges: a solid with holes, or a sheet.
///
/// Matters because it has no inside. Repaired by the bridge stage: holes are filled, free sheets become walls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenShell {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Their area, model units squared.
    pub area: f64,
    /// The share of the sides of its triangles that are open: 1 for a single triangle, 0.01 for a
    /// solid with a small hole.
    pub open_share: f64,
    /// The first corner of its first triangle, model units.
    pub position: [f64; 3],
}

impl fmt::Display for OpenShell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, place) = (self.triangles, Point(self.position));
        write!(
            f,
            "A shell of {count} triangles, from triangle {} on, is open; it is at {place}",
            self.triangle
        )
    }
}
