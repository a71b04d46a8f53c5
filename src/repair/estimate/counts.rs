//! How many edges, bricks, vertices and triangles a grid will have, from the sums of the soup.
//!
//! What the triangles alone decide is an expectation over all places of the grid: edges hit, and
//! bricks touched. What patches and signs decide is bounded: a closed soup gives no more crossings
//! than hits, since each lies on a hit edge. Along rims, patches and plates add to them.

use serde::{Deserialize, Serialize};

use crate::ingest::{Rims, SoupSums};
use crate::octree::{Domain, SIDE};

/// Room for the place of the grid: a share of the hits, and so many times the root of them.
const HIT_SHARE: f64 = 0.05;
const HIT_ROOTS: f64 = 9.0;
/// The same for pairs of a triangle and a brick that it touches.
const PAIR_SHARE: f64 = 0.1;
/// A rim of one cell's length pierces 1 face where it is axis-parallel, 1.73 at most.
const FACES_PER_RIM_CELL: f64 = 1.5;
/// An edge that is flipped or hit has four faces.
const FACES_PER_EDGE: f64 = 4.0;
/// A patch follows the cuts of an octree: about twice the least surface that its rim spans.
const PATCH_DETOUR: f64 = 2.0;
/// Patches that run along sheets and bridge between them cross about as many edges as the sheets.
const PATCH_PER_HIT: f64 = 1.3;
/// Or somewhat more than half of what the sides of the model's box would.
const PATCH_PER_BOX_SIDE: f64 = 0.6;
/// A generic surface crosses this many edges for each square of the grid in its area.
const CROSSINGS_PER_AREA: f64 = 1.5;
/// Triangles come in Morton order: what is written ends along a half, a quarter and an eighth of the
/// model at a time, together so many sections through it.
const OPEN_SECTIONS: f64 = 1.5;

/// A wall has two faces in place of one, somewhat larger at creases.
const WALL_FACES: f64 = 2.2;
/// Triangles at the end of a wall, and of a fill, for each edge of a rim.
const TRIANGLES_PER_RIM: f64 = 4.0;
/// Bricks that such a triangle touches, on top of those that the rim's triangle does.
const BRICKS_PER_END: f64 = 1.5;

/// The counts of one grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Edges of the grid that triangles hit, each as often as it is hit.
    pub hits: u64,
    /// Cells with a marked edge.
    pub leaf_cells: u64,
    /// Triangles, once for every brick that they touch.
    pub brick_triangles: u64,
    /// Bricks that a triangle touches, at most.
    pub bricks: u64,
    /// Cells in the box of the model.
    pub boxed_cells: u64,
    /// Vertices of the output of which only some triangles are written, at one time.
    pub open_vertices: u64,
    /// Upper bounds.
    pub at_most: Bounds,
}

/// What the counts of a run should not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// As [`Counts::hits`].
    pub hits: u64,
    /// As [`Counts::brick_triangles`].
    pub brick_triangles: u64,
    /// Triangles of walls and fills, once for every brick that they touch.
    pub added_triangles: u64,
    /// Faces that the open soup leaves odd.
    pub odd_faces: u64,
    /// Edges that patches flip.
    pub flips: u64,
    /// Marked edges once signs are known: the polygons of the output.
    pub crossings: u64,
    /// Vertices of the output.
    pub vertices: u64,
    /// Triangles of the output.
    pub triangles: u64,
}

impl Counts {
    /// The counts of `sums` in the grid of `domain`, where sheets become walls of so many cells.
    #[must_use]
    pub fn predict(sums: &SoupSums, domain: &Domain, sheet_cells: f64) -> Self {
        let cell = domain.cell_size();
        let brick = cell * SIDE as f64;
        let extent: [f64; 3] =
            std::array::from_fn(|a| (sums.bounds.hi[a] - sums.bounds.lo[a]) / cell);
        let boxed = Boxed::new(extent, domain.bricks_per_side());
        let triangles = sums.finite_triangles() as f64;
        let hits = sums.projected_area / (cell * cell);
        let touched = triangles + sums.extent / brick + sums.projected_area / (brick * brick);
        let most_touched = triangles * boxed.bricks;
        let pairs = touched.min(most_touched);
        let bricks = pairs.min(boxed.bricks);
        let most_hits = hits * (1.0 + HIT_SHARE) + HIT_ROOTS * hits.sqrt() + 1.0;
        let most_pairs = (pairs * (1.0 + PAIR_SHARE)).min(most_touched);
        let added = Added::around(&sums.rims, sheet_cells, cell, (most_hits, most_pairs));
        let most_hits = most_hits + added.hits;
        let open = Open::around(sums.rims.length / cell, hits, most_hits, &boxed);
        let crossings = (most_hits + open.flips + open.odd_faces).min(3.0 * boxed.cells);
        Self {
            hits: hits as u64,
            leaf_cells: hits.min(boxed.cells) as u64,
            brick_triangles: pairs as u64,
            bricks: bricks as u64,
            boxed_cells: boxed.cells as u64,
            open_vertices: (OPEN_SECTIONS * crossings / boxed.longest) as u64,
            at_most: Bounds {
                hits: most_hits as u64,
                brick_triangles: most_pairs as u64,
                added_triangles: added.pairs as u64,
                odd_faces: open.odd_faces as u64,
                flips: open.flips as u64,
                crossings: crossings as u64,
                // On closed quads Euler's formula gives as many vertices as polygons, and two more
                // for each component; those below a few cells lie along rims.
                vertices: (1.03 * crossings + 0.5 * open.odd_faces + 1000.0) as u64,
                triangles: (2.02 * crossings + 0.2 * open.odd_faces + 500.0) as u64,
            },
        }
    }
}

/// The box of the model in the grid.
struct Boxed {
    /// Cells that it meets.
    cells: f64,
    /// Bricks that it meets.
    bricks: f64,
    /// Cells on three of its sides.
    side_cells: f64,
    /// Cells on its longest edge.
    longest: f64,
}

impl Boxed {
    fn new(extent: [f64; 3], bricks_per_side: u32) -> Self {
        let [x, y, z] = extent;
        let bricks_along =
            |cells: f64| ((cells / SIDE as f64).floor() + 2.0).min(f64::from(bricks_per_side));
        Self {
            cells: extent.iter().map(|cells| cells + 2.0).product(),
            bricks: extent.iter().map(|&cells| bricks_along(cells)).product(),
            side_cells: x * y + y * z + z * x,
            longest: x.max(y).max(z).max(1.0),
        }
    }
}

/// What walls and fills add at most.
struct Added {
    hits: f64,
    pairs: f64,
}

impl Added {
    fn around(rims: &Rims, sheet_cells: f64, cell: f64, (hits, pairs): (f64, f64)) -> Self {
        if rims.edges == 0.0 {
            return Self { hits: 0.0, pairs: 0.0 };
        }
        let ends = CROSSINGS_PER_AREA * sheet_cells * rims.length / cell;
        let at_rims = TRIANGLES_PER_RIM * rims.edges * BRICKS_PER_END;
        Self { hits: WALL_FACES * hits + ends, pairs: WALL_FACES * pairs + at_rims }
    }
}

/// What rims of a length in cells lead to.
struct Open {
    odd_faces: f64,
    flips: f64,
}

impl Open {
    fn around(rim_cells: f64, hits: f64, most_hits: f64, boxed: &Boxed) -> Self {
        if rim_cells == 0.0 {
            return Self { odd_faces: 0.0, flips: 0.0 };
        }
        let odd_faces = (FACES_PER_RIM_CELL * rim_cells + 8.0).min(FACES_PER_EDGE * most_hits);
        // No rim spans more than a circle of its length does.
        let circle = rim_cells * rim_cells / (4.0 * std::f64::consts::PI);
        let spanned = PATCH_DETOUR * CROSSINGS_PER_AREA * circle + odd_faces;
        let along = (PATCH_PER_HIT * hits).max(PATCH_PER_BOX_SIDE * boxed.side_cells);
        Self { odd_faces, flips: spanned.min(along) }
    }
}
