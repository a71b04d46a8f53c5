//! An edge at which a surface branches.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::EdgePlace;

/// An edge with more than two triangles.
///
/// Matters because a walk over the surface has no way on: which neighbour comes next is undefined,
/// and so is the inside between the sheets. Repaired by contouring, which gives every sheet at a
/// cell its own vertex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NonmanifoldEdge {
    /// The edge.
    #[serde(flatten)]
    pub edge: EdgePlace,
    /// How many triangles it has.
    pub triangles: u64,
}

impl fmt::Display for NonmanifoldEdge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Edge {} has {} triangles", self.edge, self.triangles)
    }
}
