//! What a verification tells of a file: one documented, versioned record. See docs/verify.md.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::deviate::Deviation;
use crate::repair::outcome::{Verdict, as_text};
use crate::repair::thresholds::Threshold;
use crate::verify::Proof;

/// Version of the schema of verifications.
pub const VERIFICATION_VERSION: u32 = 1;

/// All that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// [`VERIFICATION_VERSION`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// How good the file is.
    pub verdict: Verdict,
    /// Why it is not better, what fails it first.
    pub reasons: Vec<Reason>,
    /// The file.
    pub file: SurfaceReport,
    /// What tells its vertices apart.
    pub vertices: VertexNames,
    /// The proof of the guarantees.
    pub proof: Proof,
    /// What it is compared with.
    pub original: Option<SurfaceReport>,
    /// How far it lies from that; `None` where there is nothing to compare, or one of the two has no
    /// area.
    pub deviation: Option<Deviation>,
    /// What the verdict rests on; `None` where nothing is compared.
    pub thresholds: Option<Thresholds>,
}

/// Why a verdict is what it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reason {
    /// `review`, or `fail`.
    pub verdict: Verdict,
    /// In words.
    pub text: String,
}

/// What tells vertices apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VertexNames {
    /// Their numbers in the file; in formats without, their places.
    Numbers,
    /// Their places.
    Places,
}

/// How large a surface is, and of what kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Its path as given.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Its triangles.
    pub triangles: u64,
    /// Whether every edge has two triangles, one each way, and every vertex one fan.
    pub is_closed: bool,
    /// Sets of triangles connected by vertices.
    pub components: u64,
    /// Vertices - edges + triangles.
    pub euler_characteristic: i64,
    /// Handles of all components together; `None` unless it is closed.
    pub genus: Option<i64>,
    /// Area, model units squared.
    pub area: f64,
    /// Signed volume, model units cubed; `None` unless it is closed. What components have in common
    /// counts for each.
    pub volume: Option<f64>,
    /// Lowest and highest corner.
    pub bounds: Option<[[f64; 3]; 2]>,
}

impl SurfaceReport {
    /// What a proof tells of a surface.
    pub(crate) fn new(path: &Path, proof: &Proof) -> Self {
        let is_closed = is_closed(proof);
        let genus = proof.components as i64 - proof.euler_characteristic / 2;
        Self {
            path: path.to_path_buf(),
            triangles: proof.triangles,
            is_closed,
            components: proof.components,
            euler_characteristic: proof.euler_characteristic,
            genus: is_closed.then_some(genus),
            area: proof.area,
            volume: is_closed.then_some(proof.volume),
            bounds: proof.bounds,
        }
    }
}

/// Whether a surface has no border, and is a manifold that is consistently oriented.
pub(crate) fn is_closed(proof: &Proof) -> bool {
    let broken = proof.boundary_edges
        + proof.nonmanifold_edges
        + proof.nonmanifold_vertices
        + proof.inconsistent_edges;
    broken == 0 && proof.components > 0
}

/// Thresholds as they were applied: lengths in model units, shares 0 to 1, angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Largest distance.
    pub max_deviation: Threshold<f64>,
    /// Share of the visible surface that is lost.
    pub max_lost: Threshold<f64>,
    /// Share of the surface that is invented.
    pub max_invented: Threshold<f64>,
    /// Median angle between normals.
    pub max_normal_deg: Threshold<f64>,
    /// Share of sharp edges that are kept, at least.
    pub min_creases: Threshold<f64>,
    /// Difference of volumes over that of the original.
    pub max_volume: Threshold<f64>,
    /// Difference of the numbers of components.
    pub max_components: Threshold<f64>,
    /// Difference of the genus.
    pub max_genus: Threshold<f64>,
}
