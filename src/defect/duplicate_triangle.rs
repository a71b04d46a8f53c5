//! A triangle that is there already.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A triangle with the same corners as one before it, exactly; it may face the other way.
///
/// Matters because it closes nothing, flickers, and makes edges that are not manifold. Repaired by ingest, which
/// counts one of the copies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DuplicateTriangle {
    /// The first of them in the file, from 0, and this one.
    pub triangles: [u64; 2],
    /// Whether it faces the other way.
    pub is_reversed: bool,
    /// Its first corner, model units.
    pub position: [f64; 3],
}

impl fmt::Display for DuplicateTriangle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, copy] = self.triangles;
        let way = if self.is_reversed { ", turned over," } else { "" };
        write!(f, "Triangle {copy} is triangle {first} again{way} at {}", Point(self.position))
    }
}
