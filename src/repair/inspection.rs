//! What an inspection tells of a model: one documented, versioned record.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::diagnose::{Finding, LoopReport, Owners, ShellReport};
use crate::mesh::LengthUnit;
use crate::repair::length::Length;
use crate::repair::outcome::as_text;

/// Version of the schema of inspections.
pub const INSPECTION_VERSION: u32 = 1;

/// What is small, near and thin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InspectSettings {
    /// Thinner walls are told.
    pub thin: Length,
    /// Shells whose boxes have a smaller diagonal are told.
    pub tiny: Length,
    /// A vertex that is no farther from an edge lies on it.
    pub junction: Length,
    /// What a model unit is, for files that do not say so.
    pub unit: Option<LengthUnit>,
}

impl InspectSettings {
    /// Walls thinner than this share of the diagonal are told.
    pub const DEFAULT_THIN: Length = Length::Percent(0.2);
    /// Shells smaller than this share of the diagonal are told.
    pub const DEFAULT_TINY: Length = Length::Percent(0.5);
    /// A hundred times what rounding to single precision moves a vertex off its edge.
    pub const DEFAULT_JUNCTION: Length = Length::Percent(0.001);
}

impl Default for InspectSettings {
    fn default() -> Self {
        Self {
            thin: Self::DEFAULT_THIN,
            tiny: Self::DEFAULT_TINY,
            junction: Self::DEFAULT_JUNCTION,
            unit: None,
        }
    }
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inspection {
    /// [`INSPECTION_VERSION`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Path of the model as given.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Whether nothing was found but remarks.
    pub is_sound: bool,
    /// Size of the model.
    pub size: ModelSize,
    /// Its parts: those that have triangles.
    pub parts: Owners,
    /// Its materials: those that have triangles.
    pub materials: Owners,
    /// Its connected surfaces.
    pub shells: ShellReport,
    /// Its open rims.
    pub rims: LoopReport,
    /// Its defects and remarks, worst first.
    pub findings: Vec<Finding>,
    /// The lengths that decided, model units.
    pub tolerances: ToleranceReport,
    /// What a repair with default settings would take; `None` where it would refuse.
    pub repair: Option<RepairCost>,
}

/// How large a model is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelSize {
    /// Triangles of the file; n-gons are cut.
    pub triangles: u64,
    /// Different positions of vertices that triangles use.
    pub vertices: u64,
    /// Vertices that the file lists; `None` in formats that do not list them.
    pub listed_vertices: Option<u64>,
    /// Vertices that became one with others since they lie in their places: topology is by place.
    pub merged_vertices: u64,
    /// Edges.
    pub edges: u64,
    /// Used vertices - edges + triangles.
    pub euler_characteristic: i64,
    /// What a model unit is, where the file says so.
    pub unit: Option<LengthUnit>,
    /// Lowest and highest corner, model units.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Diagonal of the box, model units.
    pub diagonal: f64,
    /// Area, model units squared.
    pub area: f64,
    /// Volume, model units cubed; `None` unless all is closed and consistently oriented. What
    /// several solids have in common counts for each.
    pub volume: Option<f64>,
}

/// What decided about distances, model units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToleranceReport {
    /// Thinner walls were told.
    pub thin: f64,
    /// Smaller shells were told.
    pub tiny: f64,
    /// Vertices this near to an edge lie on it.
    pub junction: f64,
}

/// What a repair would take, see [`crate::repair::Estimate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairCost {
    /// The depth that the run begins with.
    pub depth: u32,
    /// Side of a cell, model units.
    pub cell_size: f64,
    /// Cells with a marked edge, expected.
    pub leaf_cells: u64,
    /// Peak of resident memory, at most.
    pub memory_bytes: u64,
    /// Peak of the work folder with the output, at most.
    pub disk_bytes: u64,
    /// Size of the output as PLY, at most.
    pub output_bytes: u64,
    /// Seconds of all stages together, expected.
    pub seconds: f64,
}

impl Inspection {
    /// What was found and harms, worst first.
    pub fn defects(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.is_note && finding.count > 0)
    }

    /// What was found and harms nothing by itself.
    pub fn notes(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.is_note && finding.count > 0)
    }
}
