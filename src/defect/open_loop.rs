//! A rim all around.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// A set of boundary edges that follow each other around sheets: the rim of a hole, or of a sheet.
///
/// Matters because it is what has to be closed: its length tells a crack from an opening. Repaired by the bridge
/// stage, which fills it or makes a wall of the sheet; else by the patch stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenLoop {
    /// Boundary edges.
    pub edges: u64,
    /// Their length, model units.
    pub length: f64,
    /// Where the first of them begins, model units.
    pub position: [f64; 3],
    /// Lowest and highest corner, model units.
    pub bounds: [[f64; 3]; 2],
}

impl fmt::Display for OpenLoop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "An open rim of {} edges and length {} passes {}",
            self.edges,
            self.length,
            Point(self.position)
        )
    }
}
