//! What can be wrong with a mesh: one file per defect, found by the proof and by the diagnosis and
//! told with its place.
//!
//! A defect is data, never an error. Positions are in model units; triangle numbers count the
//! triangles of the file from 0; vertex numbers exist only in formats that have indices.

mod boundary_edge;
mod coincident_vertices;
mod degenerate_triangle;
mod duplicate_triangle;
mod fin;
mod hidden_shell;
mod inconsistent_edge;
mod intersecting_triangles;
mod inward_component;
mod isolated_vertex;
mod kind;
mod marks;
mod nonfinite_triangle;
mod nonmanifold_edge;
mod nonmanifold_vertex;
mod open_loop;
mod open_shell;
mod overlapping_triangles;
mod place;
mod smallest;
mod t_junction;
mod thin_wall;
mod tiny_shell;
mod touching_triangles;

pub use boundary_edge::BoundaryEdge;
pub use coincident_vertices::CoincidentVertices;
pub use degenerate_triangle::DegenerateTriangle;
pub use duplicate_triangle::DuplicateTriangle;
pub use fin::Fin;
pub use hidden_shell::HiddenShell;
pub use inconsistent_edge::InconsistentEdge;
pub use intersecting_triangles::{IntersectingTriangles, Meeting, MeetingCounts};
pub use inward_component::InwardComponent;
pub use isolated_vertex::IsolatedVertex;
pub use kind::DefectKind;
pub use marks::{Marked, Marks, SortedMarks};
pub use nonfinite_triangle::NonfiniteTriangle;
pub use nonmanifold_edge::NonmanifoldEdge;
pub use nonmanifold_vertex::NonmanifoldVertex;
pub use open_loop::OpenLoop;
pub use open_shell::OpenShell;
pub use overlapping_triangles::OverlappingTriangles;
pub use place::{EdgePlace, VertexPlace};
pub use smallest::{MOST_PLACES, Smallest};
pub use t_junction::TJunction;
pub use thin_wall::ThinWall;
pub use tiny_shell::TinyShell;
pub use touching_triangles::TouchingTriangles;

use std::fmt;

use serde::{Deserialize, Serialize};

/// One thing that is wrong, and where.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Defect {
    /// A corner that is no place.
    NonfiniteTriangle(NonfiniteTriangle),
    /// A rim.
    BoundaryEdge(BoundaryEdge),
    /// A rim all around.
    OpenLoop(OpenLoop),
    /// More than two triangles at one edge.
    NonmanifoldEdge(NonmanifoldEdge),
    /// Two neighbours that disagree about the outside.
    InconsistentEdge(InconsistentEdge),
    /// Sheets that touch in a point only.
    NonmanifoldVertex(NonmanifoldVertex),
    /// A closed surface that is inside out.
    InwardComponent(InwardComponent),
    /// Two triangles that go through each other or touch.
    IntersectingTriangles(IntersectingTriangles),
    /// Two triangles that share an area.
    OverlappingTriangles(OverlappingTriangles),
    /// A triangle that is there already.
    DuplicateTriangle(DuplicateTriangle),
    /// A triangle without area.
    DegenerateTriangle(DegenerateTriangle),
    /// A vertex on an edge that does not know it.
    TJunction(TJunction),
    /// A sheet that hangs from a surface.
    Fin(Fin),
    /// A shell with a rim.
    OpenShell(OpenShell),
    /// A wall that is thin.
    ThinWall(ThinWall),
    /// A shell that nobody sees.
    HiddenShell(HiddenShell),
    /// A shell that is small for the model.
    TinyShell(TinyShell),
    /// Two triangles that touch.
    TouchingTriangles(TouchingTriangles),
    /// Two vertices in one place.
    CoincidentVertices(CoincidentVertices),
    /// A vertex that nothing uses.
    IsolatedVertex(IsolatedVertex),
}

impl Defect {
    /// What kind of defect this is.
    #[must_use]
    pub const fn kind(&self) -> DefectKind {
        match self {
            Self::NonfiniteTriangle(_) => DefectKind::NonfiniteTriangle,
            Self::BoundaryEdge(_) => DefectKind::BoundaryEdge,
            Self::OpenLoop(_) => DefectKind::OpenLoop,
            Self::NonmanifoldEdge(_) => DefectKind::NonmanifoldEdge,
            Self::InconsistentEdge(_) => DefectKind::InconsistentEdge,
            Self::NonmanifoldVertex(_) => DefectKind::NonmanifoldVertex,
            Self::InwardComponent(_) => DefectKind::InwardComponent,
            Self::IntersectingTriangles(_) => DefectKind::IntersectingTriangles,
            Self::OverlappingTriangles(_) => DefectKind::OverlappingTriangles,
            Self::DuplicateTriangle(_) => DefectKind::DuplicateTriangle,
            Self::DegenerateTriangle(_) => DefectKind::DegenerateTriangle,
            Self::TJunction(_) => DefectKind::TJunction,
            Self::Fin(_) => DefectKind::Fin,
            Self::OpenShell(_) => DefectKind::OpenShell,
            Self::ThinWall(_) => DefectKind::ThinWall,
            Self::HiddenShell(_) => DefectKind::HiddenShell,
            Self::TinyShell(_) => DefectKind::TinyShell,
            Self::TouchingTriangles(_) => DefectKind::TouchingTriangles,
            Self::CoincidentVertices(_) => DefectKind::CoincidentVertices,
            Self::IsolatedVertex(_) => DefectKind::IsolatedVertex,
        }
    }

    /// A point to look at, in model units; a triangle with a corner at infinity has none, and a
    /// vertex that nothing uses is known by its number only.
    #[must_use]
    pub fn place(&self) -> Option<[f64; 3]> {
        match self {
            Self::NonfiniteTriangle(_) | Self::IsolatedVertex(_) => None,
            Self::BoundaryEdge(edge) => Some(edge.edge.middle()),
            Self::NonmanifoldEdge(edge) => Some(edge.edge.middle()),
            Self::InconsistentEdge(edge) => Some(edge.edge.middle()),
            Self::NonmanifoldVertex(vertex) => Some(vertex.vertex.position),
            Self::DegenerateTriangle(triangle) => Some(triangle.corners[0]),
            Self::OpenLoop(defect) => Some(defect.position),
            Self::InwardComponent(defect) => Some(defect.position),
            Self::IntersectingTriangles(defect) => Some(defect.position),
            Self::OverlappingTriangles(defect) => Some(defect.position),
            Self::DuplicateTriangle(defect) => Some(defect.position),
            Self::TJunction(defect) => Some(defect.position),
            Self::Fin(defect) => Some(defect.position),
            Self::OpenShell(defect) => Some(defect.position),
            Self::ThinWall(defect) => Some(defect.position),
            Self::HiddenShell(defect) => Some(defect.position),
            Self::TinyShell(defect) => Some(defect.position),
            Self::TouchingTriangles(defect) => Some(defect.position),
            Self::CoincidentVertices(defect) => Some(defect.position),
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonfiniteTriangle(defect) => defect.fmt(f),
            Self::BoundaryEdge(defect) => defect.fmt(f),
            Self::OpenLoop(defect) => defect.fmt(f),
            Self::NonmanifoldEdge(defect) => defect.fmt(f),
            Self::InconsistentEdge(defect) => defect.fmt(f),
            Self::NonmanifoldVertex(defect) => defect.fmt(f),
            Self::InwardComponent(defect) => defect.fmt(f),
            Self::IntersectingTriangles(defect) => defect.fmt(f),
            Self::OverlappingTriangles(defect) => defect.fmt(f),
            Self::DuplicateTriangle(defect) => defect.fmt(f),
            Self::DegenerateTriangle(defect) => defect.fmt(f),
            Self::TJunction(defect) => defect.fmt(f),
            Self::Fin(defect) => defect.fmt(f),
            Self::OpenShell(defect) => defect.fmt(f),
            Self::ThinWall(defect) => defect.fmt(f),
            Self::HiddenShell(defect) => defect.fmt(f),
            Self::TinyShell(defect) => defect.fmt(f),
            Self::TouchingTriangles(defect) => defect.fmt(f),
            Self::CoincidentVertices(defect) => defect.fmt(f),
            Self::IsolatedVertex(defect) => defect.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_defect_is_written_with_its_kind_and_told_with_its_place() {
        let edge = EdgePlace { ends: [[0.0; 3], [2.0, 0.0, 4.0]], vertices: Some([3, 7]) };
        let defect = Defect::BoundaryEdge(BoundaryEdge { edge });
        let json = serde_json::to_value(defect).expect("plain data is always JSON");
        assert_eq!(json["kind"], "boundary_edge");
        assert_eq!(json["vertices"], serde_json::json!([3, 7]));
        assert_eq!(defect.place(), Some([1.0, 0.0, 2.0]));
        let text = defect.to_string();
        assert_eq!(text, "Edge 3-7 from (0, 0, 0) to (2, 0, 4) has one triangle only");
        let back: Defect = serde_json::from_value(json).expect("what was written can be read");
        assert_eq!(back, defect);
    }
}
