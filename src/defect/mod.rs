//! What can be wrong with a mesh: one file per defect, found by the proof and told with its place.
//!
//! A defect is data, never an error. Positions are in model units; triangle numbers count the
//! triangles of the file from 0; vertex numbers exist only in formats that have indices.

mod boundary_edge;
mod coincident_vertices;
mod degenerate_triangle;
mod inconsistent_edge;
mod intersecting_triangles;
mod inward_component;
mod kind;
mod nonfinite_triangle;
mod nonmanifold_edge;
mod nonmanifold_vertex;
mod place;

pub use boundary_edge::BoundaryEdge;
pub use coincident_vertices::CoincidentVertices;
pub use degenerate_triangle::DegenerateTriangle;
pub use inconsistent_edge::InconsistentEdge;
pub use intersecting_triangles::IntersectingTriangles;
pub use inward_component::InwardComponent;
pub use kind::DefectKind;
pub use nonfinite_triangle::NonfiniteTriangle;
pub use nonmanifold_edge::NonmanifoldEdge;
pub use nonmanifold_vertex::NonmanifoldVertex;
pub use place::{EdgePlace, VertexPlace};

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
    /// More than two triangles at one edge.
    NonmanifoldEdge(NonmanifoldEdge),
    /// Two neighbours that disagree about the outside.
    InconsistentEdge(InconsistentEdge),
    /// Sheets that touch in a point only.
    NonmanifoldVertex(NonmanifoldVertex),
    /// A triangle without area.
    DegenerateTriangle(DegenerateTriangle),
    /// Two vertices in one place.
    CoincidentVertices(CoincidentVertices),
    /// A closed surface that is inside out.
    InwardComponent(InwardComponent),
    /// Two triangles that go through each other or touch.
    IntersectingTriangles(IntersectingTriangles),
}

impl Defect {
    /// What kind of defect this is.
    #[must_use]
    pub const fn kind(&self) -> DefectKind {
        match self {
            Self::NonfiniteTriangle(_) => DefectKind::NonfiniteTriangle,
            Self::BoundaryEdge(_) => DefectKind::BoundaryEdge,
            Self::NonmanifoldEdge(_) => DefectKind::NonmanifoldEdge,
            Self::InconsistentEdge(_) => DefectKind::InconsistentEdge,
            Self::NonmanifoldVertex(_) => DefectKind::NonmanifoldVertex,
            Self::DegenerateTriangle(_) => DefectKind::DegenerateTriangle,
            Self::CoincidentVertices(_) => DefectKind::CoincidentVertices,
            Self::InwardComponent(_) => DefectKind::InwardComponent,
            Self::IntersectingTriangles(_) => DefectKind::IntersectingTriangles,
        }
    }

    /// A point to look at, in model units; a triangle with a corner at infinity has none.
    #[must_use]
    pub fn place(&self) -> Option<[f64; 3]> {
        match self {
            Self::NonfiniteTriangle(_) => None,
            Self::BoundaryEdge(edge) => Some(edge.edge.middle()),
            Self::NonmanifoldEdge(edge) => Some(edge.edge.middle()),
            Self::InconsistentEdge(edge) => Some(edge.edge.middle()),
            Self::NonmanifoldVertex(vertex) => Some(vertex.vertex.position),
            Self::DegenerateTriangle(triangle) => Some(triangle.corners[0]),
            Self::CoincidentVertices(pair) => Some(pair.position),
            Self::InwardComponent(component) => Some(component.position),
            Self::IntersectingTriangles(pair) => Some(pair.position),
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonfiniteTriangle(defect) => defect.fmt(f),
            Self::BoundaryEdge(defect) => defect.fmt(f),
            Self::NonmanifoldEdge(defect) => defect.fmt(f),
            Self::InconsistentEdge(defect) => defect.fmt(f),
            Self::NonmanifoldVertex(defect) => defect.fmt(f),
            Self::DegenerateTriangle(defect) => defect.fmt(f),
            Self::CoincidentVertices(defect) => defect.fmt(f),
            Self::InwardComponent(defect) => defect.fmt(f),
            Self::IntersectingTriangles(defect) => defect.fmt(f),
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
