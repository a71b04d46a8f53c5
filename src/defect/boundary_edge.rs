//! The rim of a surface.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::EdgePlace;

/// An edge with exactly one triangle: the surface ends here.
///
/// Matters because inside and outside are then not separated: nothing can be printed, filled or
/// subtracted. Repaired by the patch stage, which closes every boundary cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoundaryEdge {
    /// The edge.
    #[serde(flatten)]
    pub edge: EdgePlace,
}

impl fmt::Display for BoundaryEdge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Edge {} has one triangle only", self.edge)
    }
}
