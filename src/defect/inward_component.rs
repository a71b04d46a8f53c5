//! A closed surface that is inside out.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A closed component whose orientation says that the solid is on its wrong side.
///
/// Matters because its volume is then negative: it counts as a cavity, or as nothing. Repaired by
/// the sign stage, which decides anew what is inside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InwardComponent {
    /// The number of its first triangle in the file, from 0.
    pub triangle: u64,
    /// A point of it: the first by x, then y, then z; in model units.
    pub position: [f64; 3],
}

impl fmt::Display for InwardComponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = Point(self.position);
        write!(f, "The component at {place}, from triangle {} on, faces inward", self.triangle)
    }
}
