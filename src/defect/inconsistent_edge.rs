//! Two neighbours that face opposite ways.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::EdgePlace;

/// An edge that both its triangles run along in the same direction.
///
/// Matters because one of the two takes for inside what the other takes for outside; shading,
/// volumes and slicers go wrong. Repaired by the sign stage, which decides anew what is inside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InconsistentEdge {
    /// The edge.
    #[serde(flatten)]
    pub edge: EdgePlace,
}

impl fmt::Display for InconsistentEdge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Edge {} has two triangles that face opposite ways", self.edge)
    }
}
