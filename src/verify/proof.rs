//! What the proof found, and whether it holds.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::{Defect, DefectKind, MeetingCounts};

/// The counts of one file, and whether they are what is guaranteed.
///
/// Triangles with an infinite corner, and those that name one vertex twice, are counted as such
/// and have no part in the topology.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Proof {
    /// Vertices that the file lists; distinct positions in formats without indices.
    pub vertices: u64,
    /// Triangles of the file.
    pub triangles: u64,
    /// Edges between vertices, each counted once.
    pub edges: u64,
    /// Edges with one triangle.
    pub boundary_edges: u64,
    /// Edges with more than two triangles.
    pub nonmanifold_edges: u64,
    /// Vertices with more than one fan of triangles.
    pub nonmanifold_vertices: u64,
    /// Edges with two triangles in the same direction.
    pub inconsistent_edges: u64,
    /// Triangles whose corners lie on one line, exactly.
    pub degenerate_triangles: u64,
    /// Used vertices in the place of one with a smaller number; 0 in formats without indices.
    pub coincident_vertices: u64,
    /// Vertices of no triangle of the topology. Told, but no failure.
    pub unused_vertices: u64,
    /// Triangles with a NaN or infinite coordinate.
    pub nonfinite_triangles: u64,
    /// Faces that the reader left out: too short, or with indices that lead nowhere.
    pub discarded_faces: u64,
    /// Sets of triangles connected by vertices.
    pub components: u64,
    /// Used vertices - edges + triangles of the topology.
    pub euler_characteristic: i64,
    /// Closed components that face the wrong way, or enclose nothing; 0 when not asked.
    pub inward_components: u64,
    /// Closed components for which that could not be decided: their coordinates differ by more
    /// than sixty decimal places, or they touch another one where nesting is asked.
    pub undecided_components: u64,
    /// Pairs of triangles with an area that meet anywhere but in vertices and edges that they
    /// share; touching counts. 0 when not asked.
    pub intersecting_pairs: u64,
    /// The same, by how they meet.
    pub meetings: MeetingCounts,
    /// Signed volume in cubed model units, rounded; means nothing unless closed.
    pub volume: f64,
    /// Area in squared model units, rounded.
    pub area: f64,
    /// Lowest and highest corner of the triangles with finite corners.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// The first eight defects of each kind; of pairs that meet, of each way to meet.
    pub places: Vec<Defect>,
}

/// One reason why the proof does not hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Failure {
    /// The file has no triangle.
    Empty,
    /// The reader left faces out.
    DiscardedFaces(u64),
    /// So many defects of a kind.
    Defects(DefectKind, u64),
    /// So many components of unknown orientation.
    UndecidedComponents(u64),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => write!(f, "no triangle"),
            Self::DiscardedFaces(1) => write!(f, "1 face that leads nowhere"),
            Self::DiscardedFaces(count) => write!(f, "{count} faces that lead nowhere"),
            Self::Defects(kind, count) => write!(f, "{count} {}", kind.noun(count)),
            Self::UndecidedComponents(1) => write!(f, "1 component of unknown orientation"),
            Self::UndecidedComponents(count) => {
                write!(f, "{count} components of unknown orientation")
            }
        }
    }
}

impl Proof {
    /// How many defects of a kind there are; 0 for those that only a diagnosis looks for.
    #[must_use]
    pub fn count(&self, kind: DefectKind) -> u64 {
        match kind {
            DefectKind::NonfiniteTriangle => self.nonfinite_triangles,
            DefectKind::BoundaryEdge => self.boundary_edges,
            DefectKind::NonmanifoldEdge => self.nonmanifold_edges,
            DefectKind::InconsistentEdge => self.inconsistent_edges,
            DefectKind::NonmanifoldVertex => self.nonmanifold_vertices,
            DefectKind::DegenerateTriangle => self.degenerate_triangles,
            DefectKind::CoincidentVertices => self.coincident_vertices,
            DefectKind::InwardComponent => self.inward_components,
            DefectKind::IntersectingTriangles => self.intersecting_pairs,
            // The proof does not look for these, or has them among others.
            _ => 0,
        }
    }

    /// Whether the surface is what is guaranteed of every output.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.failures().is_empty()
    }

    /// Why not.
    #[must_use]
    pub fn failures(&self) -> Vec<Failure> {
        let mut failures = Vec::new();
        if self.triangles == 0 {
            failures.push(Failure::Empty);
        }
        if self.discarded_faces > 0 {
            failures.push(Failure::DiscardedFaces(self.discarded_faces));
        }
        let defects = DefectKind::ALL.map(|kind| (kind, self.count(kind)));
        let present = defects.into_iter().filter(|&(_, count)| count > 0);
        failures.extend(present.map(|(kind, count)| Failure::Defects(kind, count)));
        if self.undecided_components > 0 {
            failures.push(Failure::UndecidedComponents(self.undecided_components));
        }
        failures
    }
}
