//! What came of a repair: the JSON that the command line prints. See docs/outcome.md.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};

use crate::bridge::{MendStats, ThickenStats};
use crate::contour::{ContourStats, SurfaceDetail};
use crate::deviate::Deviation;
use crate::hidden::HiddenStats;
use crate::ingest::{SettleStats, SoupMeasure, SoupStats};
use crate::mesh::Attributes;
use crate::monitor::{Counter, Gauge, Stage};
use crate::octree::{Domain, SnapBox};
use crate::patch::{Opening, PatchStats};
use crate::repair::parts::PartReport;
use crate::repair::settings::Settings;
use crate::scan::ScanStats;
use crate::sign::{SignStats, VoteStats};
use crate::transfer::BorderStats;
use crate::verify::Proof;

/// Version of this schema.
pub const SCHEMA_VERSION: u32 = 1;

/// How good the result is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing to look at.
    Pass,
    /// Sound, but a person should look: the reasons say at what.
    Review,
    /// Not sound, which only a method with a caveat may end with: the reasons say how.
    Fail,
}

/// The input as it came.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoupReport {
    /// Its path.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Counts.
    #[serde(flatten)]
    pub stats: SoupStats,
    /// Number of parts and materials named in the file.
    pub parts: u64,
    /// See `parts`.
    pub materials: u64,
    /// Box of the finite triangles, model units.
    pub bounds: SnapBox,
    /// Area and signed volume.
    #[serde(flatten)]
    pub measure: SoupMeasure,
}

/// Defects that the input had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Duplicates, rims, degenerate triangles.
    #[serde(flatten)]
    pub settle: SettleStats,
    /// Odd faces of the grid.
    pub odd_faces: u64,
    /// Openings: connected sets of odd faces.
    pub openings: u64,
    /// Edges hit more than once: features below a cell.
    pub multi_edges: u64,
}

/// What was added that the input did not have.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Invented {
    /// Polygons of the output that lie on patches.
    pub patch_polygons: u64,
    /// Volume inside by the fill rule and outside by parity, cubic model units.
    pub filled_volume: f64,
    /// Part of that volume that only the resolution seals.
    pub sealed_by_resolution_volume: f64,
    /// The largest openings that were closed, in cells of the grid.
    pub largest_openings: Vec<Opening>,
}

/// What the input had and the output does not. Counted in grid edges with hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// Surface thinner than a cell.
    pub thin_edges: u64,
    /// Surface inside of the solid.
    pub buried_edges: u64,
    /// Share of all hit edges that none of the output's polygons stand for, 0..1.
    pub share_of_surface: f64,
}

/// The output as it was written and proved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputReport {
    /// Its path.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// The proof on the written file.
    pub proof: Proof,
    /// Output area over input area.
    pub area_ratio: f64,
    /// The threshold at which cells were merged, in cells; 0 by methods that merge none.
    pub decimate_cells: f64,
    /// Counts of contouring.
    pub contour: ContourStats,
    /// What the method cannot promise, if it is not the one that the guarantees rest on.
    pub caveat: Option<String>,
}

/// What reached the output besides its shape, and what did not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransferReport {
    /// What triangles tell of what they are.
    pub surfaces: SurfaceDetail,
    /// What vertices and corners have.
    pub attributes: Attributes,
    /// Sets of triangles of the input that seams of texture coordinates and jumps of colours part;
    /// 0 where the output has neither.
    pub looks: u64,
    /// Counts of borders between materials.
    #[serde(flatten)]
    pub borders: BorderStats,
    /// What the input has and the output does not hold.
    pub lost: Vec<String>,
}

/// A file of what was taken away, or added.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerReport {
    /// Its path; `None` where there is nothing to be in it.
    pub file: Option<String>,
    /// Its triangles.
    pub triangles: u64,
    /// Their area, square model units.
    pub area: f64,
}

/// Files of what was taken away and added; the caller has them written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayersReport {
    /// What lies farther away is removed or added, model units.
    pub tolerance: f64,
    /// What of the input is not near the output.
    pub removed: LayerReport,
    /// What of the output is not near the input.
    pub added: LayerReport,
    /// What closes openings; `None` where the output does not tell.
    pub patches: Option<LayerReport>,
}

/// What a stage took; the caller stamps the seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Wall time.
    pub seconds: f64,
    /// Time of the processors, all threads together.
    pub cpu_seconds: f64,
    /// The most that was resident, of what the caller saw: it looks now and then.
    pub resident_bytes: Option<u64>,
}

/// What the run held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MemoryReport {
    /// `--max-memory`.
    pub budget_bytes: u64,
    /// The most that the accountant had granted.
    pub granted_bytes: u64,
    /// Peak resident memory as the kernel tells it (VmHWM); the caller fills it in.
    pub peak_bytes: Option<u64>,
    /// Threads that worked.
    pub threads: usize,
    /// Peaks of what was resident.
    pub resident: BTreeMap<Gauge, u64>,
}

/// What the run took of the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiskReport {
    /// `--max-disk`, if there is one.
    pub limit_bytes: Option<u64>,
    /// The most that the work folder and the output took at one time.
    pub peak_bytes: u64,
}

/// Where the run went on from, and what had to be made again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResumeReport {
    /// How often the work was gone on with after it had been stopped.
    pub resumptions: u32,
    /// Files of the work folder that were found damaged and made again.
    pub rebuilt: Vec<String>,
}

/// Everything about a repair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// [`SCHEMA_VERSION`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Which part of the model this is of, with `--parts separate`.
    #[serde(default)]
    pub part: Option<PartReport>,
    /// How good the result is.
    pub verdict: Verdict,
    /// What a person should look at.
    pub reasons: Vec<String>,
    /// The input.
    pub input: SoupReport,
    /// The settings.
    pub settings: Settings,
    /// The grid.
    pub grid: Domain,
    /// Why it is as deep as it is.
    pub depth_reason: String,
    /// Side of a cell, model units.
    pub cell_size: f64,
    /// Defects found.
    pub found: Found,
    /// Added.
    pub invented: Invented,
    /// Left out.
    pub dropped: Dropped,
    /// The output.
    pub output: OutputReport,
    /// How far the output lies from the input; `None` if that was not wanted, or the input is too
    /// large for squares of its lengths.
    pub deviation: Option<Deviation>,
    /// What was taken away and added, as files; `None` if that was not wanted. The caller has them
    /// written.
    #[serde(default)]
    pub exports: Option<LayersReport>,
    /// Counts of mending: walls and fills.
    pub mend: MendStats,
    /// Counts of what was thickened.
    pub thickened: ThickenStats,
    /// What nobody sees.
    pub hidden: HiddenStats,
    /// What reached the output besides its shape.
    pub transfer: TransferReport,
    /// Counts of scan, patch and sign.
    pub scan: ScanStats,
    /// See `scan`.
    pub patch: PatchStats,
    /// Votes on winding numbers, with the fill rule `nonzero`.
    pub votes: VoteStats,
    /// See `scan`.
    pub sign: SignStats,
    /// Seconds per stage.
    pub stages: BTreeMap<Stage, StageReport>,
    /// Bytes moved and triangles scanned.
    pub counters: BTreeMap<Counter, u64>,
    /// Memory.
    pub memory: MemoryReport,
    /// Disk.
    pub disk: DiskReport,
    /// Resumption.
    pub resume: ResumeReport,
}

/// Names of files may have any bytes, and JSON has text only.
pub(super) fn as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
