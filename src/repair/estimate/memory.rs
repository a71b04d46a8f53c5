//! How much memory a run will hold at its peak.
//!
//! The budget is a bound by itself; small models stay far below it. The figures were fitted to the
//! peaks that the kernel reports (VmHWM), step by step; see docs/estimate.md.

use crate::ingest::SoupSums;
use crate::io::Format;
use crate::mesh::Attributes;
use crate::repair::estimate::counts::Counts;
use crate::repair::estimate::disk::{
    CELL_TRIANGLE_BYTES, FAN_BYTES, FileSizes, MEASURED_EDGES_BYTES, SMALL_BIN,
};
use crate::repair::measuring::SAMPLES;
use crate::repair::plan::{MemoryPlan, WINDOW_BYTES};

/// The program, and what a worker holds while bricks pass.
const BASE_BYTES: f64 = 13e6;
const THREAD_BYTES: f64 = 1.0e6;
/// OBJ files up to 4 MiB are held whole, this many times.
const WHOLE_FILE_BYTES: f64 = (4_u32 << 20) as f64;
const WHOLE_FILE_FACTOR: f64 = 5.0;
/// A vertex of a larger file: position, texture coordinates, colour.
const INPUT_VERTEX_BYTES: f64 = 36.0;
/// A triangle while it is sorted into bins, with its place in the order.
const BIN_SORT_BYTES: f64 = 120.0;
/// A triangle whose bin is examined: by hashing, or by sorts where the bin is large.
const HASHED_BYTES: f64 = 200.0;
const SORTED_BYTES: f64 = 320.0;
/// A flipped edge in the cuts of its opening, and an odd face.
const FLIP_BYTES: f64 = 100.0;
const FACE_BYTES: f64 = 100.0;
/// A triangle whose seams are looked for: three sides, with their places in the order.
const SIDE_BYTES: f64 = 3.0 * 176.0;
/// A triangle that is painted: its corners in two sorts.
const CORNERS_BYTES: f64 = 6.0 * 40.0;
/// A vertex of the output: its hash, and its position in the table of the reader.
const HASH_BYTES: f64 = 8.0;
const POSITION_BYTES: f64 = 24.0;
/// A triangle while the pairs of its cell are tested; so many at one time in each thread.
const JOINED_BYTES: f64 = 300.0;
const MOST_JOINED: f64 = 16_384.0;
/// A triangle that is compared, and one that is put in order for it; samples of both surfaces with
/// their distances.
const MEASURED_BYTES: f64 = 90.0;
const MEASURED_SORT_BYTES: f64 = 220.0;
const SAMPLES_BYTES: f64 = 4.0 * SAMPLES as f64 * 300.0;
/// What an allocator keeps of the lists of early steps; larger ones go back at once.
const RETAINED_BYTES: f64 = (32_u32 << 20) as f64;
/// Room that lists keep for growing.
const GROWTH: f64 = 1.4;

/// What an estimate of memory rests on.
pub struct MemoryModel<'e> {
    pub sums: &'e SoupSums,
    pub counts: &'e Counts,
    pub plan: &'e MemoryPlan,
    pub format: Format,
    /// What the output has besides its shape.
    pub attributes: Attributes,
    /// Triangles in the largest bin.
    pub largest_bin: f64,
    pub input_format: Format,
    /// Vertices that the input lists.
    pub input_vertices: u64,
}

impl MemoryModel<'_> {
    /// The peak of all steps, which `budget_bytes` bounds.
    pub fn peak(&self, files: &FileSizes, budget_bytes: u64) -> u64 {
        let most = &self.counts.at_most;
        let share = self.plan.share_bytes as f64;
        let pairs = most.brick_triangles as f64;
        let windows = self.plan.cached_windows as f64 * WINDOW_BYTES as f64;
        let window = |file: f64| file.min(windows);
        let threads = self.plan.threads as f64;
        let is_mapped = self.attributes.uvs || self.attributes.colours;
        let looks = if is_mapped {
            (SIDE_BYTES * self.sums.finite_triangles() as f64).min(share / 2.0)
        } else {
            0.0
        };
        let read = self.reader().max(looks);
        let bin = (BIN_SORT_BYTES * pairs).min(share);
        let examine = if self.largest_bin > SMALL_BIN {
            (SORTED_BYTES * pairs.min(threads * self.largest_bin)).min(share / 2.0)
        } else {
            HASHED_BYTES * pairs.min(threads * self.largest_bin)
        };
        let openings = FLIP_BYTES * most.flips as f64 + FACE_BYTES * most.odd_faces as f64;
        let patch = window(files.hits) + openings.min(share);
        let flood = window(files.hits) + (FACE_BYTES * most.odd_faces as f64).min(share);
        let contour = window(files.hits) + window(files.signs) + window(files.cells);
        let early = read.max(bin).max(examine);
        let painting = if self.attributes.any() {
            (CORNERS_BYTES * most.triangles as f64).min(share / 1.5)
        } else {
            0.0
        };
        let late = patch.max(flood).max(contour + painting).max(self.proof(files));
        let late = late.max(self.measuring());
        let bytes =
            BASE_BYTES + THREAD_BYTES * threads + early.max(early.min(RETAINED_BYTES) + late);
        (bytes as u64).min(budget_bytes)
    }

    fn reader(&self) -> f64 {
        let share = self.plan.share_bytes as f64;
        let input = self.sums.stats.input_bytes as f64;
        if self.input_format == Format::Obj && input <= 2.0 * WHOLE_FILE_BYTES {
            return WHOLE_FILE_FACTOR * input;
        }
        (GROWTH * INPUT_VERTEX_BYTES * self.input_vertices as f64).min(share)
    }

    /// What the comparison holds: both surfaces, one of them in order.
    fn measuring(&self) -> f64 {
        let share = self.plan.share_bytes as f64 / 4.0 * 3.0;
        let written = GROWTH * MEASURED_BYTES * self.counts.at_most.triangles as f64;
        let read = GROWTH * MEASURED_SORT_BYTES * self.sums.finite_triangles() as f64;
        let positions = POSITION_BYTES * self.counts.at_most.vertices as f64;
        let edges = GROWTH * MEASURED_EDGES_BYTES * (self.counts.at_most.triangles as f64);
        written.min(share / 7.0)
            + edges.min(share / 8.0)
            + read.min(share / 3.0)
            + positions.min(share / 6.0)
            + SAMPLES_BYTES
    }

    fn proof(&self, files: &FileSizes) -> f64 {
        let share = self.plan.share_bytes as f64;
        let vertices = self.counts.at_most.vertices as f64;
        let hashes = (HASH_BYTES * vertices).min(share / 8.0);
        let positions = if self.format.has_indices() {
            (POSITION_BYTES * vertices).min(share / 8.0)
        } else {
            0.0
        };
        // A short OBJ file is held whole, and the output may be shorter than its bound.
        let whole = if self.format == Format::Obj {
            WHOLE_FILE_FACTOR * files.output.min(WHOLE_FILE_BYTES)
        } else {
            0.0
        };
        let open = (FAN_BYTES * self.counts.open_vertices as f64).min(share / 4.0);
        let triangles = self.counts.at_most.triangles as f64;
        let cells = (CELL_TRIANGLE_BYTES * triangles).min(share / 8.0);
        let threads = self.plan.threads as f64;
        let joined = (JOINED_BYTES * triangles)
            .min(JOINED_BYTES * threads * MOST_JOINED)
            .min(share / 16.0 * 3.0);
        (GROWTH * (hashes + positions) + open + cells + joined).max(whole)
    }
}
