//! The names of the defects.

use serde::{Deserialize, Serialize};

/// Every defect that is known, in the order in which they are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DefectKind {
    /// A corner that is no place.
    NonfiniteTriangle,
    /// A rim.
    BoundaryEdge,
    /// More than two triangles at one edge.
    NonmanifoldEdge,
    /// Two neighbours that disagree about the outside.
    InconsistentEdge,
    /// Sheets that touch in a point only.
    NonmanifoldVertex,
    /// A triangle without area.
    DegenerateTriangle,
    /// Two vertices in one place.
    CoincidentVertices,
    /// A closed surface that is inside out.
    InwardComponent,
    /// Two triangles that go through each other or touch.
    IntersectingTriangles,
}

impl DefectKind {
    /// All kinds, in order.
    pub const ALL: [Self; 9] = [
        Self::NonfiniteTriangle,
        Self::BoundaryEdge,
        Self::NonmanifoldEdge,
        Self::InconsistentEdge,
        Self::NonmanifoldVertex,
        Self::DegenerateTriangle,
        Self::CoincidentVertices,
        Self::InwardComponent,
        Self::IntersectingTriangles,
    ];

    /// What `count` of them are called in a sentence.
    #[must_use]
    pub const fn noun(self, count: u64) -> &'static str {
        let one = count == 1;
        match self {
            Self::NonfiniteTriangle if one => "triangle with an infinite or undefined corner",
            Self::NonfiniteTriangle => "triangles with infinite or undefined corners",
            Self::BoundaryEdge if one => "boundary edge",
            Self::BoundaryEdge => "boundary edges",
            Self::NonmanifoldEdge if one => "non-manifold edge",
            Self::NonmanifoldEdge => "non-manifold edges",
            Self::InconsistentEdge if one => "inconsistently oriented edge",
            Self::InconsistentEdge => "inconsistently oriented edges",
            Self::NonmanifoldVertex if one => "non-manifold vertex",
            Self::NonmanifoldVertex => "non-manifold vertices",
            Self::DegenerateTriangle if one => "degenerate triangle",
            Self::DegenerateTriangle => "degenerate triangles",
            Self::CoincidentVertices if one => "vertex in the place of another",
            Self::CoincidentVertices => "vertices in the place of others",
            Self::InwardComponent if one => "component oriented inward",
            Self::InwardComponent => "components oriented inward",
            Self::IntersectingTriangles if one => "pair of intersecting triangles",
            Self::IntersectingTriangles => "pairs of intersecting triangles",
        }
    }
}
