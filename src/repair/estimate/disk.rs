//! How many bytes lie in the work folder, step by step.
//!
//! The sizes of records are those of docs/format.md. What a step reads goes once the step after it
//! has finished, so the peak is the largest sum of what one step reads and writes. All of it is an
//! upper bound: the counts are.

use serde::{Deserialize, Serialize};

use crate::ingest::SoupSums;
use crate::io::Format;
use crate::mesh::Attributes;
use crate::repair::estimate::counts::Counts;
use crate::repair::measuring::SAMPLES;
use crate::repair::plan::MemoryPlan;

/// Records of spools.
const SOUP_BYTES: f64 = 88.0;
const ATTRIBUTE_BYTES: f64 = 112.0;
const BIN_ENTRY_BYTES: f64 = 24.0;
/// A copy that is dropped, at most three of four triangles.
const DROP_BYTES: f64 = 16.0 * 0.75;
const FLIP_BYTES: f64 = 16.0;
/// Records of sorts: a triangle with its brick; an odd face with its component.
const BIN_SORT_BYTES: f64 = 96.0;
const FACE_BYTES: f64 = 24.0;
/// A sort of wide records holds so many bytes more for the order of each.
const ORDER_BYTES: f64 = 24.0;
/// Triangles of a bin that are examined by hashing; a larger one is sorted by edges.
pub const SMALL_BIN: f64 = 32_768.0;
/// The largest bin has at most so many times the triangles of the mean one.
const CROWDED: f64 = 50.0;
/// Edges of a triangle in that sort.
const EDGE_SORT_BYTES: f64 = 96.0;
/// A triangle on the border of a sheet, and at most so many of them for an edge of a rim.
const BORDER_BYTES: f64 = 32.0;
const BORDERS_PER_RIM: f64 = 4.0;
/// Pairs of triangles on an edge of two, of each triangle at most three halves.
const JOINT_BYTES: f64 = 12.0;
/// A triangle's label, and a sheet.
const LABEL_BYTES: f64 = 4.0;
const SHEET_BYTES: f64 = 80.0;
/// Records of bricks: what an edge, a kept hit, a plane, a crossing and a vertex take.
const HIT_EDGE_BYTES: f64 = 4.0;
const KEPT_HIT_BYTES: f64 = 4.0;
const PLANE_BYTES: f64 = 32.0;
const CROSSING_BYTES: f64 = 8.0;
const OFFSET_BYTES: f64 = 2.0;
/// What a crossing is, and what the face of a PLY file says of that: material, colour, patch.
const SURFACE_BYTES: f64 = 4.0;
const FACE_SURFACE_BYTES: f64 = 9.0;
const VERTEX_BYTES: f64 = 12.0;
const CELL_BYTES: f64 = 4.0;
/// Of three hits of an edge all are kept, of more three.
const MOST_KEPT: f64 = 3.0;
/// An archive's own fields and its entry in the directory.
const ARCHIVE_BYTES: f64 = 60.0;
const DIRECTORY_BYTES: f64 = 40.0;
/// A brick holds the edges on its max sides as well: 33 x 33 lines in place of 32 x 32.
const BORDER_SHARE: f64 = 33.0 * 33.0 / (32.0 * 32.0);
/// Brick files grow by windows of this size, which no small record crosses.
const WINDOW_BYTES: f64 = (256_u32 << 10) as f64;
/// Pairs of regions and corners behind sheets; many only where the soup is smaller than cells.
const REGION_BYTES_PER_FACE: f64 = 24.0;
/// A vertex in text, and what a line of a face has besides digits.
const LINE_BYTES: f64 = 66.0;
const FACE_LINE_BYTES: f64 = 5.0;
/// A rim edge with its order and its share; a sample of it and a contact; a triangle of a wall with
/// its corners and miters.
const RIM_BYTES: f64 = 140.0;
const SAMPLE_BYTES: f64 = 68.0;
const WALL_BYTES: f64 = 400.0;
/// Bricks near a sample: most are near to one.
const NEAR_BRICKS: f64 = 1.6;
/// A place that the outside touches, and how many of a triangle and brick are kept; what else it
/// touches; the inside corners of a brick; a piece of an edge that may part two materials.
const PLACE_BYTES: f64 = 32.0;
const PLACES: f64 = 2.0;
const TOUCHED_BYTES: f64 = 8.0;
const INSIDE_BYTES: f64 = 4104.0;
const BORDER_PIECE_BYTES: f64 = 28.0;
/// Hash of a vertex, and its position in the table of the reader.
const HASH_BYTES: f64 = 8.0;
const POSITION_BYTES: f64 = 24.0;
/// What a proof writes of each triangle when too many vertices are under way at one time: corners,
/// numbers and fans; without numbers in the file also a sort of the positions.
const TAPE_BYTES: f64 = 130.0;
const UNNUMBERED_TAPE_BYTES: f64 = 200.0;
/// A triangle in the cells where pairs meet: 24 bytes, more where parcels are small, a fifth of them
/// in several cells.
pub const CELL_TRIANGLE_BYTES: f64 = 60.0;
/// A triangle that is compared: on tape, as a run of its own, that with its place along a curve, and the
/// boxes around it.
const MEASURED_BYTES: f64 = 80.0;
const RUN_BYTES: f64 = 72.0;
const MEASURED_SORT_BYTES: f64 = 88.0;
const BOX_BYTES: f64 = 56.0 * 8.0 / 7.0;
/// The edges of a triangle while sharp ones are sought, those of flat pairs, and all of them sharp.
pub const MEASURED_EDGES_BYTES: f64 = 3.0 * 24.0;
const MEASURED_PAIRS_BYTES: f64 = 1.5 * 16.0;
const MEASURED_CREASES_BYTES: f64 = 1.5 * 96.0;
/// Samples and corners of a surface, sorted and in order, and their distances.
const MEASURED_SAMPLES_BYTES: f64 = 2.0 * SAMPLES as f64 * (2.0 * 112.0 + 16.0);
/// A vertex under way takes so much of the proof's memory, growth included.
pub const FAN_BYTES: f64 = 250.0;
/// The look of a triangle, and the sort that finds it: three sides, with room for their order.
const LOOK_BYTES: f64 = 8.0;
const SIDE_BYTES: f64 = 3.0 * 88.0;
/// The origin of an added triangle, the source of a crossing.
const ORIGIN_BYTES: f64 = 4.0;
const SOURCE_BYTES: f64 = 4.0;
/// What a surface that gets attributes lies in before it is written: a vertex, a triangle with its
/// corners, a place where sources are asked; of these at most three for a triangle.
const DRAWN_VERTEX_BYTES: f64 = 24.0;
const DRAWN_TRIANGLE_BYTES: f64 = 16.0;
const DRAWN_CORNERS_BYTES: f64 = 3.0 * 44.0;
const DRAWN_PLACES_BYTES: f64 = 3.0 * 40.0;
/// What sources answer, and what corners get.
const VALUES_BYTES: f64 = 3.0 * 32.0;
const ANSWERS_BYTES: f64 = 3.0 * 40.0;
/// Copies of a vertex, or of a corner's attributes at a vertex, at most: three faces meet at the
/// corners of a cube, two at its edges.
const COPIES: f64 = 2.0;
/// Lock, manifest, headers, and what file systems round up.
const SMALL_FILES_BYTES: f64 = (128_u32 << 10) as f64;

/// Upper bounds of the bytes in the work folder during each step, the output's included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiskSteps {
    /// The file is read into the soup.
    pub read: u64,
    /// Triangles are sorted into bins.
    pub bin: u64,
    /// Duplicates are settled.
    pub settle: u64,
    /// Sheets become walls, holes are filled.
    pub mend: u64,
    /// Bins become hits.
    pub scan: u64,
    /// Odd faces become flips.
    pub patch: u64,
    /// Regions are joined.
    pub flood: u64,
    /// Bodies are looked at from outside, borders between materials are found; what is thickened is
    /// counted with as many triangles as mending may add.
    pub revise: u64,
    /// Regions become signs.
    pub relabel: u64,
    /// The threshold is chosen: as the next two at one time; 0 without `--max-triangles`.
    pub choose: u64,
    /// Cells get their vertices.
    pub place: u64,
    /// Surfaces in one cell are kept apart.
    pub separate: u64,
    /// The surface is drawn, where it gets attributes.
    pub draw: u64,
    /// The surface is written.
    pub write: u64,
    /// The written file is proved.
    pub prove: u64,
    /// It is compared with the soup.
    pub measure: u64,
}

impl DiskSteps {
    /// The largest of them.
    #[must_use]
    pub fn peak(&self) -> u64 {
        let Self { read, bin, settle, mend, scan, patch, flood, revise, .. } = *self;
        let Self { relabel, choose, place, separate, draw, write, prove, measure, .. } = *self;
        let before = [read, bin, settle, mend, scan, patch, flood, revise];
        let after = [relabel, choose, place, separate, draw, write, prove, measure];
        before.into_iter().chain(after).max().unwrap_or(0)
    }
}

/// What an estimate of the disk rests on.
pub struct DiskModel<'e> {
    pub sums: &'e SoupSums,
    pub counts: &'e Counts,
    /// Side of a cell, model units.
    pub cell: f64,
    pub plan: &'e MemoryPlan,
    pub format: Format,
    /// Whether triangles of the output have materials.
    pub has_surfaces: bool,
    /// What they have besides.
    pub attributes: Attributes,
    /// What the reader of the input spilled.
    pub reader_bytes: u64,
}

/// Sizes of the files of a run.
pub struct FileSizes {
    pub hits: f64,
    pub signs: f64,
    pub cells: f64,
    /// Cells that are made anew: all of them where clusters are everywhere.
    pub surface: f64,
    pub output: f64,
    /// Faces that wait until all vertices are written.
    pub aside: f64,
}

impl DiskModel<'_> {
    /// Adds up the files of each step.
    pub fn steps(&self, files: &FileSizes) -> DiskSteps {
        let most = &self.counts.at_most;
        let triangles = self.sums.finite_triangles() as f64;
        let share = self.plan.share_bytes as f64;
        let attributes = self.if_mapped(ATTRIBUTE_BYTES * self.sums.stats.triangles as f64);
        let looks = self.if_mapped(LOOK_BYTES * triangles);
        let sides = self.if_mapped(
            spilled(SIDE_BYTES * triangles, 1.0, share / 2.0) + 3.0 * LABEL_BYTES * triangles,
        );
        let origins = self.if_mapped(ORIGIN_BYTES * most.added_triangles as f64);
        let kept = attributes + looks + origins + SMALL_FILES_BYTES;
        let (drawn, drawing, painting) = self.painted(share);
        let soup = SOUP_BYTES * triangles;
        let pairs = most.brick_triangles as f64;
        let bins = SOUP_BYTES * pairs + BIN_ENTRY_BYTES * self.counts.bricks as f64;
        let runs = spilled(BIN_SORT_BYTES * pairs, ORDER_BYTES / BIN_SORT_BYTES, share);
        let drops = DROP_BYTES * pairs;
        let added = SOUP_BYTES * most.added_triangles as f64;
        let odd = most.odd_faces as f64;
        // Sorted by place, written once, sorted by component.
        let faces = FACE_BYTES * odd + 2.0 * spilled(FACE_BYTES * odd, 0.0, share / 4.0);
        let flips = FLIP_BYTES * BORDER_SHARE * most.flips as f64;
        let regions = REGION_BYTES_PER_FACE * odd;
        let FileSizes { hits, signs, cells, surface, output, aside } = *files;
        DiskSteps {
            read: (kept + soup + sides + self.reader_bytes as f64) as u64,
            bin: (kept + soup + bins + runs) as u64,
            settle: (kept
                + soup
                + bins
                + drops
                + self.edge_sorts(pairs).max(self.fins(pairs, drops))) as u64,
            mend: (kept + soup + bins + 2.0 * drops + added + self.mending(pairs, drops)) as u64,
            scan: (kept + soup + bins + drops + added + hits) as u64,
            patch: (kept + soup + bins + drops + added + hits + faces + 2.0 * flips) as u64,
            flood: (kept + soup + bins + drops + added + hits + flips + regions) as u64,
            revise: (kept
                + soup
                + bins
                + 2.0 * (drops + added)
                + hits
                + flips
                + regions
                + self.revising(pairs)) as u64,
            relabel: (kept + soup + hits + flips + regions + signs) as u64,
            choose: (kept + soup + hits + flips + signs + cells + 2.0 * surface) as u64,
            place: (kept + soup + hits + flips + signs + cells) as u64,
            // Two looks, or the last one and the surface.
            separate: (kept + soup + hits + signs + cells + 2.0 * surface) as u64,
            draw: (kept + soup + hits + signs + cells + surface + drawn + drawing) as u64,
            write: (kept + soup + signs + cells + surface + drawn + painting + output + aside)
                as u64,
            prove: (kept + soup + cells + surface + drawn + output + self.proof()) as u64,
            measure: (kept + soup + output + self.measuring(triangles)) as u64,
        }
    }

    /// The sizes of brick files and output.
    pub fn files(&self) -> FileSizes {
        let most = &self.counts.at_most;
        let (vertices, triangles) = (most.vertices as f64, most.triangles as f64);
        let pairs = most.brick_triangles as f64;
        let edges = BORDER_SHARE * (most.hits as f64).min(3.0 * self.boxed_cells());
        let kept = BORDER_SHARE * (most.hits as f64).min(3.0 * MOST_KEPT * self.boxed_cells());
        let crossings = BORDER_SHARE * most.crossings as f64;
        let hits = HIT_EDGE_BYTES * edges + KEPT_HIT_BYTES * kept + PLANE_BYTES * pairs.min(kept);
        let signs = CROSSING_BYTES * crossings + PLANE_BYTES * pairs.min(kept).min(crossings);
        let (surface, face_surface) =
            if self.has_surfaces { (SURFACE_BYTES, FACE_SURFACE_BYTES) } else { (0.0, 0.0) };
        let cells = (VERTEX_BYTES + CELL_BYTES) * vertices
            + (OFFSET_BYTES + surface + self.if_mapped(SURFACE_BYTES + SOURCE_BYTES))
                * most.crossings as f64;
        let face = face_bytes(self.format, vertices) + face_surface;
        let [vertex_more, face_more] = self.more_bytes(vertices);
        let (face, more) = (face + face_more, vertex_more * vertices);
        let (output, aside) = match self.format {
            Format::Ply => (24.0 * vertices + face * triangles, face * triangles),
            Format::Off => (LINE_BYTES * vertices + face * triangles, face * triangles),
            Format::Obj => (LINE_BYTES * vertices + face * triangles, 0.0),
            Format::Stl => (face * triangles, 0.0),
            // Text that is packed to less than half; records aside.
            Format::ThreeMf => {
                (LINE_BYTES / 2.0 * vertices + face * triangles, 25.0 * vertices + 17.0 * triangles)
            }
            Format::Glb => (12.0 * vertices + face * triangles, face * triangles),
        };
        FileSizes {
            hits: self.brick_file(hits),
            signs: self.brick_file(signs),
            cells: self.brick_file(cells),
            surface: self.brick_file(cells),
            output: output + more + 512.0,
            aside: aside + more,
        }
    }
}

impl DiskModel<'_> {
    /// So many bytes where triangles have texture coordinates or colours.
    fn if_mapped(&self, bytes: f64) -> f64 {
        if self.attributes.uvs || self.attributes.colours { bytes } else { 0.0 }
    }

    /// What a surface that gets attributes takes before it is written; besides, what is sorted while
    /// it is drawn, and while it is written.
    fn painted(&self, share: f64) -> (f64, f64, f64) {
        if !self.attributes.any() {
            return (0.0, 0.0, 0.0);
        }
        let most = &self.counts.at_most;
        let (vertices, triangles) = (most.vertices as f64, most.triangles as f64);
        let corners = DRAWN_CORNERS_BYTES * triangles;
        let places = self.if_mapped(DRAWN_PLACES_BYTES * triangles);
        let drawn = DRAWN_VERTEX_BYTES * vertices + DRAWN_TRIANGLE_BYTES * triangles;
        let sorts = spilled(corners, 0.0, share / 4.0) + spilled(places, 0.0, share / 4.0);
        let values = self.if_mapped(spilled(VALUES_BYTES * triangles, 0.0, share / 3.0));
        let answers = spilled(ANSWERS_BYTES * triangles, 0.0, share / 3.0);
        (drawn + corners + places, sorts, values + answers)
    }

    /// What the attributes of a vertex and of a triangle take in the output, or beside it.
    fn more_bytes(&self, vertices: f64) -> [f64; 2] {
        let Attributes { uvs, colours, normals } = self.attributes;
        let of = |has: bool, bytes: f64| if has { bytes } else { 0.0 };
        let digits = vertices.max(1.0).log10().floor() + 2.0;
        match self.format {
            Format::Obj => [
                of(colours, 24.0) + COPIES * (of(uvs, 32.0) + of(normals, 44.0)),
                3.0 * (of(uvs, digits) + of(normals, digits + 1.0)),
            ],
            Format::Ply => [of(colours, 4.0), of(uvs, 29.0)],
            Format::Glb if self.attributes.any() => {
                let each = 12.0 + of(uvs, 8.0) + of(colours, 4.0) + of(normals, 12.0);
                [COPIES * each, 0.0]
            }
            Format::ThreeMf => {
                [of(colours, 40.0), of(uvs, 3.0 * 64.0 + 24.0 + 3.0 * 16.0) + of(colours, 40.0)]
            }
            Format::Glb | Format::Off | Format::Stl => [0.0, 0.0],
        }
    }

    /// Cells in the box of the model, as far as they can be hit.
    fn boxed_cells(&self) -> f64 {
        self.counts.boxed_cells as f64
    }

    /// A brick file with so many bytes of lists.
    fn brick_file(&self, lists: f64) -> f64 {
        let bricks = self.counts.bricks.max(1) as f64;
        let records = lists + ARCHIVE_BYTES * bricks;
        // What is left of a window when the next record does not fit: half of one, or, where
        // records are larger than half a window, as much again as they take.
        let waste = (records / bricks / WINDOW_BYTES).min(1.0);
        records * (1.0 + waste) + WINDOW_BYTES + DIRECTORY_BYTES * bricks
    }

    /// Triangles in the largest bin, at most.
    pub fn largest_bin(&self) -> f64 {
        let pairs = self.counts.at_most.brick_triangles as f64;
        pairs.min(CROWDED * pairs / self.counts.bricks.max(1) as f64)
    }

    /// Sorts of the edges of the largest bins, one for each worker.
    fn edge_sorts(&self, pairs: f64) -> f64 {
        let largest = self.largest_bin();
        if largest <= SMALL_BIN {
            return 0.0;
        }
        let threads = self.plan.threads as f64;
        let share = self.plan.share_bytes as f64 / 6.0 / threads;
        pairs.min(threads * largest) / largest * spilled(EDGE_SORT_BYTES * largest, 0.0, share)
    }

    /// What is written while fins are sought, where the soup is open.
    fn fins(&self, pairs: f64, drops: f64) -> f64 {
        let triangles = self.sums.finite_triangles() as f64;
        // On edges of one triangle, and on those of three and more beside them.
        let borders = BORDER_BYTES * (BORDERS_PER_RIM * self.sums.rims.edges).min(3.0 * triangles);
        if borders == 0.0 {
            return 0.0;
        }
        let (largest, threads) = (self.largest_bin(), self.plan.threads as f64);
        let share = self.plan.share_bytes as f64;
        let edges = spilled(EDGE_SORT_BYTES * largest, 0.0, share / 8.0 / threads);
        let sorts = pairs.min(threads * largest) / largest.max(1.0) * edges
            + spilled(JOINT_BYTES * triangles, 0.0, share / 8.0)
            + spilled(borders, 0.0, share / 8.0);
        let labels = spilled(LABEL_BYTES * triangles, 0.0, share / 8.0);
        let sheets = spilled(SHEET_BYTES * triangles.min(borders / BORDER_BYTES), 0.0, share / 8.0);
        sorts + borders + 3.0 * labels + sheets + 2.0 * drops
    }

    /// What is written while bodies and borders are looked at: places and what they belong to, the
    /// inside corners of bricks, pieces of edges.
    fn revising(&self, pairs: f64) -> f64 {
        let share = self.plan.share_bytes as f64;
        spilled(PLACE_BYTES * PLACES * pairs, 0.0, share / 8.0)
            + spilled(TOUCHED_BYTES * pairs, 0.0, share / 16.0)
            + spilled(INSIDE_BYTES * self.counts.bricks as f64, 0.0, share)
            + if self.has_surfaces { self.brick_file(BORDER_PIECE_BYTES * pairs) } else { 0.0 }
    }

    /// What is written while sheets are mended, where the soup is open.
    fn mending(&self, pairs: f64, drops: f64) -> f64 {
        let edges = self.fins(pairs, drops);
        if edges == 0.0 {
            return 0.0;
        }
        let (sums, cell) = (self.sums, self.cell);
        let triangles = sums.finite_triangles() as f64;
        let rims = (BORDERS_PER_RIM * sums.rims.edges).min(3.0 * triangles);
        let samples = NEAR_BRICKS * (rims + BORDERS_PER_RIM * sums.rims.length / cell);
        let share = self.plan.share_bytes as f64;
        let added = BIN_SORT_BYTES * self.counts.at_most.added_triangles as f64;
        edges
            + RIM_BYTES * rims
            + spilled(SAMPLE_BYTES * samples, 0.0, share / 4.0)
            + spilled(WALL_BYTES * triangles, 0.0, share / 8.0)
            + spilled(added, ORDER_BYTES / BIN_SORT_BYTES, share / 4.0)
    }

    /// What the comparison and the reader of the written file spill: the output on tape, boxes around its
    /// triangles and those of the soup, of which none lies beside the one before it, and what makes
    /// these boxes.
    fn measuring(&self, triangles: f64) -> f64 {
        let share = self.plan.share_bytes as f64 / 4.0 * 3.0;
        let most = &self.counts.at_most;
        let boxes = |count: f64| spilled(BOX_BYTES * count, 0.0, share / 16.0);
        let order = ORDER_BYTES / MEASURED_SORT_BYTES;
        let sorted = |count: f64| {
            spilled(RUN_BYTES * count, 0.0, share / 16.0)
                + spilled(MEASURED_SORT_BYTES * count, order, share / 8.0)
        };
        let positions = match self.format.has_indices() {
            true => spilled(POSITION_BYTES * most.vertices as f64, 0.0, share / 8.0),
            false => 0.0,
        };
        let samples = 2.0 * spilled(MEASURED_SAMPLES_BYTES, 0.0, share / 16.0);
        let written = most.triangles as f64;
        let creases = |count: f64| spilled(MEASURED_CREASES_BYTES * count, 0.0, share / 16.0);
        let larger = triangles.max(written);
        let edges = spilled(MEASURED_EDGES_BYTES * larger, 0.0, share / 32.0)
            + spilled(MEASURED_PAIRS_BYTES * larger, 0.0, share / 32.0);
        let creases = creases(triangles) + creases(written) + edges;
        let tape = spilled(MEASURED_BYTES * written, 0.0, share / 8.0);
        tape + boxes(triangles) + boxes(written) + sorted(larger) + positions + samples + creases
    }

    /// What the proof and the reader of the written file spill.
    fn proof(&self) -> f64 {
        let most = &self.counts.at_most;
        let vertices = most.vertices as f64;
        let share = self.plan.share_bytes as f64;
        let (positions, tape) = if self.format.has_indices() {
            (spilled(POSITION_BYTES * vertices, 0.0, share / 8.0), TAPE_BYTES)
        } else {
            (0.0, UNNUMBERED_TAPE_BYTES)
        };
        let hashes = spilled(HASH_BYTES * vertices, 0.0, share / 8.0);
        let scattered = FAN_BYTES * self.counts.open_vertices as f64 > share / 4.0;
        let tape = if scattered { tape * most.triangles as f64 } else { 0.0 };
        let cells = spilled(CELL_TRIANGLE_BYTES * most.triangles as f64, 0.0, share / 20.0);
        positions + hashes + tape + cells
    }
}

/// Bytes that leave memory when they exceed `share`, with so much more of it for each of them.
fn spilled(bytes: f64, overhead: f64, share: f64) -> f64 {
    if bytes * (1.0 + overhead) > share { bytes } else { 0.0 }
}

/// A triangle in the output, among so many vertices.
fn face_bytes(format: Format, vertices: f64) -> f64 {
    let digits = vertices.max(1.0).log10().floor() + 1.0;
    match format {
        Format::Ply => 13.0,
        Format::Glb => 12.0,
        Format::Stl => 50.0,
        Format::Obj | Format::Off => 3.0 * digits + FACE_LINE_BYTES,
        Format::ThreeMf => (3.0 * digits + 40.0) / 2.0,
    }
}
