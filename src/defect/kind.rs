//! The names of the defects.

use serde::{Deserialize, Serialize};

/// Every defect that is known, worst first: the order in which they are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DefectKind {
    /// A corner that is no place.
    NonfiniteTriangle,
    /// A face with an index that leads nowhere.
    WildFace,
    /// A face with fewer than three corners.
    ShortFace,
    /// A rim.
    BoundaryEdge,
    /// A rim all around.
    OpenLoop,
    /// More than two triangles at one edge.
    NonmanifoldEdge,
    /// Two neighbours that disagree about the outside.
    InconsistentEdge,
    /// Sheets that touch in a point only.
    NonmanifoldVertex,
    /// A closed surface that is inside out.
    InwardComponent,
    /// Two triangles that go through each other or touch.
    IntersectingTriangles,
    /// Two triangles that share an area.
    OverlappingTriangles,
    /// A triangle that is there already.
    DuplicateTriangle,
    /// A triangle without area.
    DegenerateTriangle,
    /// A vertex on an edge that does not know it.
    TJunction,
    /// A sheet that hangs from a surface.
    Fin,
    /// A shell with a rim.
    OpenShell,
    /// A wall that is thin.
    ThinWall,
    /// A shell that nobody sees.
    HiddenShell,
    /// A shell that is small for the model.
    TinyShell,
    /// Two triangles that touch.
    TouchingTriangles,
    /// Two vertices in one place.
    CoincidentVertices,
    /// A vertex that nothing uses.
    IsolatedVertex,
}

impl DefectKind {
    /// All kinds, in order.
    pub const ALL: [Self; 22] = [
        Self::NonfiniteTriangle,
        Self::WildFace,
        Self::ShortFace,
        Self::BoundaryEdge,
        Self::OpenLoop,
        Self::NonmanifoldEdge,
        Self::InconsistentEdge,
        Self::NonmanifoldVertex,
        Self::InwardComponent,
        Self::IntersectingTriangles,
        Self::OverlappingTriangles,
        Self::DuplicateTriangle,
        Self::DegenerateTriangle,
        Self::TJunction,
        Self::Fin,
        Self::OpenShell,
        Self::ThinWall,
        Self::HiddenShell,
        Self::TinyShell,
        Self::TouchingTriangles,
        Self::CoincidentVertices,
        Self::IsolatedVertex,
    ];

    /// Whether an inspection tells it as a remark: by itself it harms nothing.
    #[must_use]
    pub const fn is_note(self) -> bool {
        matches!(
            self,
            Self::ThinWall
                | Self::HiddenShell
                | Self::TinyShell
                | Self::TouchingTriangles
                | Self::CoincidentVertices
                | Self::IsolatedVertex
        )
    }

    /// What `count` of them are called in a sentence.
    #[must_use]
    pub const fn noun(self, count: u64) -> &'static str {
        let one = count == 1;
        match self {
            Self::NonfiniteTriangle if one => "triangle with an infinite or undefined corner",
            Self::NonfiniteTriangle => "triangles with infinite or undefined corners",
            Self::WildFace if one => "face with an index that leads nowhere",
            Self::WildFace => "faces with indices that lead nowhere",
            Self::ShortFace if one => "face with fewer than three corners",
            Self::ShortFace => "faces with fewer than three corners",
            Self::BoundaryEdge if one => "boundary edge",
            Self::BoundaryEdge => "boundary edges",
            Self::OpenLoop if one => "open rim",
            Self::OpenLoop => "open rims",
            Self::NonmanifoldEdge if one => "non-manifold edge",
            Self::NonmanifoldEdge => "non-manifold edges",
            Self::InconsistentEdge if one => "inconsistently oriented edge",
            Self::InconsistentEdge => "inconsistently oriented edges",
            Self::NonmanifoldVertex if one => "non-manifold vertex",
            Self::NonmanifoldVertex => "non-manifold vertices",
            Self::InwardComponent if one => "component oriented inward",
            Self::InwardComponent => "components oriented inward",
            Self::IntersectingTriangles if one => "pair of intersecting triangles",
            Self::IntersectingTriangles => "pairs of intersecting triangles",
            Self::OverlappingTriangles if one => "pair of overlapping triangles",
            Self::OverlappingTriangles => "pairs of overlapping triangles",
            Self::DuplicateTriangle if one => "duplicate triangle",
            Self::DuplicateTriangle => "duplicate triangles",
            Self::DegenerateTriangle if one => "degenerate triangle",
            Self::DegenerateTriangle => "degenerate triangles",
            Self::TJunction if one => "T-junction",
            Self::TJunction => "T-junctions",
            Self::Fin if one => "fin",
            Self::Fin => "fins",
            Self::OpenShell if one => "open shell",
            Self::OpenShell => "open shells",
            Self::ThinWall if one => "triangle on a thin wall",
            Self::ThinWall => "triangles on thin walls",
            Self::HiddenShell if one => "hidden shell",
            Self::HiddenShell => "hidden shells",
            Self::TinyShell if one => "tiny shell",
            Self::TinyShell => "tiny shells",
            Self::TouchingTriangles if one => "pair of touching triangles",
            Self::TouchingTriangles => "pairs of touching triangles",
            Self::CoincidentVertices if one => "vertex in the place of another",
            Self::CoincidentVertices => "vertices in the place of others",
            Self::IsolatedVertex if one => "isolated vertex",
            Self::IsolatedVertex => "isolated vertices",
        }
    }

    /// What a repair does to it, unless its settings say otherwise.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::NonfiniteTriangle | Self::WildFace | Self::ShortFace => "is dropped",
            Self::BoundaryEdge => "is closed with its rim",
            Self::OpenLoop => "a hole is filled; what is open on purpose gets walls",
            Self::NonmanifoldEdge => "each sheet gets vertices of its own",
            Self::InconsistentEdge | Self::InwardComponent => "what is inside is decided anew",
            Self::NonmanifoldVertex => "each sheet gets a vertex of its own",
            Self::IntersectingTriangles => "solids become one",
            Self::OverlappingTriangles => "becomes one surface",
            Self::DuplicateTriangle => "counts once",
            Self::DegenerateTriangle => "has no part in the new surface",
            Self::TJunction => "is closed: narrower than a cell",
            Self::Fin => "is taken out",
            Self::OpenShell => "holes are filled, a free sheet becomes a wall",
            Self::ThinWall => "the grid gets deeper, or the wall thicker",
            Self::HiddenShell | Self::IsolatedVertex => "is left out",
            Self::TinyShell => "stays where it is larger than a cell",
            Self::TouchingTriangles => "become one surface, or part",
            Self::CoincidentVertices => "become one",
        }
    }
}
