//! Whether the surface in a block of cells is one disk that meets each side of the block in one arc at most,
//! told by the signs of the block's corners at once.
//!
//! In:         the corners of a block of at most [`MOST_CELLS`] cells a side, none of which has several pieces
//!             of surface or an ambiguous face.
//! Out:        how often it crosses the edges of the block, if it is such a disk.
//! Invariant:  the same as by joining the cells one after the other ([`Node::is_simple`]).
//! Units:      counts.
//! Memory:     none.
//! Fails:      never.
//! Source:     the criterion of Schaefer, Ju, Warren 2007, section 4; by bits is ours.

use crate::contour::mdc::cluster::block::BLOCK_LEVEL;
use crate::contour::mdc::cluster::node::{EdgeCounts, Node};
use crate::contour::mdc::table::edge_at_corner;
use crate::octree::{CornerBits, LINES};

/// Most cells along a side of a block: its cells are the bits of a word.
pub const MOST_CELLS: usize = 1 << BLOCK_LEVEL;
/// Most corners along a side.
const CORNERS: usize = MOST_CELLS + 1;

/// The corners of a block, row by row: bits along x.
struct Rows {
    rows: [[u64; CORNERS]; CORNERS],
    /// Cells along a side.
    side: usize,
    /// A bit for every cell of a row.
    cells: u64,
    /// The corners of a row that are not on a side of the block.
    inner: u64,
}

/// Cells, and the inner faces through which the surface passes from them to the next along each axis; bit
/// x + 4 y + 16 z.
#[derive(Default)]
struct Passed {
    cells: u64,
    faces: [u64; 3],
    /// Inner edges that are crossed.
    inner_edges: u32,
}

/// The crossings of the edges of the block of `side` cells from `low`, if the surface in it is one disk that
/// meets each side of the block in one arc at most.
pub fn disk_in_block(signs: &CornerBits, low: [usize; 3], side: usize) -> Option<EdgeCounts> {
    let rows = Rows::of(signs, low, side);
    let edges = rows.block_edges();
    if !Node::disk(edges).is_simple() {
        return None;
    }
    let passed = Passed::of(&rows);
    let faces: u32 = passed.faces.iter().map(|faces| faces.count_ones()).sum();
    // Every cell has a disk, disks share the arcs on inner faces, and these the crossings of inner edges.
    let euler = (passed.cells.count_ones() + passed.inner_edges) as i32 - faces as i32;
    (euler == 1 && passed.is_connected()).then_some(edges)
}

impl Rows {
    fn of(signs: &CornerBits, low: [usize; 3], side: usize) -> Self {
        let mut rows = [[0; CORNERS]; CORNERS];
        let corners = (1 << (side + 1)) - 1;
        for (z, plane) in rows[..=side].iter_mut().enumerate() {
            for (y, row) in plane[..=side].iter_mut().enumerate() {
                *row = signs.rows[(low[2] + z) * LINES + low[1] + y] >> low[0] & corners;
            }
        }
        let cells = (1 << side) - 1;
        Self { rows, side, cells, inner: cells & !1 }
    }

    /// How often the edges of the block are crossed.
    fn block_edges(&self) -> EdgeCounts {
        let (rows, side) = (&self.rows, self.side);
        let mut edges = EdgeCounts::default();
        let mut add = |axis: u8, corner: u8, count: u64| {
            edges.add_to(edge_at_corner(corner, axis), count);
        };
        for high_z in [0, 1] {
            for high_y in [0, 1] {
                let row = rows[side * usize::from(high_z)][side * usize::from(high_y)];
                let crossed = (row ^ row >> 1) & self.cells;
                add(0, high_y << 1 | high_z << 2, u64::from(crossed.count_ones()));
            }
        }
        for high in [0, 1] {
            let at = side * usize::from(high);
            for step in 0..side {
                let along_y = rows[at][step] ^ rows[at][step + 1];
                add(1, high << 2, along_y & 1);
                add(1, 1 | high << 2, along_y >> side & 1);
                let along_z = rows[step][at] ^ rows[step + 1][at];
                add(2, high << 1, along_z & 1);
                add(2, 1 | high << 1, along_z >> side & 1);
            }
        }
        edges
    }

    /// The faces between two rows of corners that have both signs.
    fn mixed(&self, one: u64, other: u64) -> u64 {
        let (all, any) = (one & other, one | other);
        (any | any >> 1) & !(all & all >> 1) & self.cells
    }
}

impl Passed {
    fn of(block: &Rows) -> Self {
        let (rows, side) = (&block.rows, block.side);
        let mut passed = Self::default();
        for z in 0..side {
            for y in 0..side {
                let [a, b, c, d] = [rows[z][y], rows[z][y + 1], rows[z + 1][y], rows[z + 1][y + 1]];
                let at = 4 * y + 16 * z;
                let (all, any) = (a & b & c & d, a | b | c | d);
                passed.faces[0] |= ((any & !all & block.inner) >> 1) << at;
                let (all, any) = (all & all >> 1, any | any >> 1);
                passed.cells |= (any & !all & block.cells) << at;
                let (is_last_y, is_last_z) = (y + 1 == side, z + 1 == side);
                if !is_last_y {
                    passed.faces[1] |= block.mixed(b, d) << at;
                    passed.inner_edges += ((b ^ d) & block.inner).count_ones();
                }
                if !is_last_z {
                    passed.faces[2] |= block.mixed(c, d) << at;
                    passed.inner_edges += ((c ^ d) & block.inner).count_ones();
                }
                if !is_last_y && !is_last_z {
                    passed.inner_edges += ((d ^ d >> 1) & block.cells).count_ones();
                }
            }
        }
        passed
    }

    /// Whether all cells are reached from one of them through faces.
    fn is_connected(&self) -> bool {
        let [x, y, z] = self.faces;
        let mut reached = self.cells & self.cells.wrapping_neg();
        loop {
            let mut next = reached;
            next |= (next & x) << 1 | next >> 1 & x;
            next |= (next & y) << 4 | next >> 4 & y;
            next |= (next & z) << 16 | next >> 16 & z;
            if next == reached {
                return reached == self.cells;
            }
            reached = next;
        }
    }
}
