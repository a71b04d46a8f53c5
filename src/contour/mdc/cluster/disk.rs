//! Whether the surface in a block of cells is one disk that meets each side of the block in one arc at most,
//! told by the signs of the block's corners at once.
//!
//! In:         the corners of a block of at most [`MOST_CELLS`] cells a side.
//! Out:        how often it crosses the edges of the block, if it is such a disk, and no cell has several
//!             pieces of it or an ambiguous face.
//! Invariant:  the same as by joining the cells one after the other ([`Node::is_simple`]).
//! Units:      counts.
//! Memory:     none.
//! Fails:      never.
//! Source:     the criterion of Schaefer, Ju, Warren 2007, section 4; by bits is ours.

use crate::contour::mdc::cluster::block::BLOCK_LEVEL;
use crate::contour::mdc::cluster::node::{EdgeCounts, Node};
use crate::contour::mdc::table::edge_at_corner;
use crate::octree::{CornerBits, LINES};

/// Most cells along a side of a block.
const MOST_CELLS: usize = 1 << BLOCK_LEVEL;
/// Most corners along a side.
const CORNERS: usize = MOST_CELLS + 1;

/// How far apart the bits of neighbours along each axis are: the corner at x, y, z is bit x + 5 y + 25 z, and
/// so is the cell, the face or the edge from it.
const STEPS: [usize; 3] = [1, CORNERS, CORNERS * CORNERS];

/// The bits from `first` up to before `end` along each axis.
const fn bits(first: [usize; 3], end: [usize; 3]) -> u128 {
    let mut bits = 0;
    let mut number = 0;
    while number < CORNERS * CORNERS * CORNERS {
        let mut is_in = true;
        let mut axis = 0;
        while axis < 3 {
            let at = number / STEPS[axis] % CORNERS;
            is_in = is_in && first[axis] <= at && at < end[axis];
            axis += 1;
        }
        bits |= (is_in as u128) << number;
        number += 1;
    }
    bits
}

/// What a block has, as bits.
struct Places {
    cells: u128,
    /// Faces across each axis.
    faces: [u128; 3],
    /// Those between two cells.
    inner_faces: [u128; 3],
    /// Edges along each axis that lie on no side of the block.
    inner_edges: [u128; 3],
    /// Edges along each axis on the four edges of the block along it, the lower ones first.
    outer_edges: [[u128; 4]; 3],
}

const fn places(side: usize) -> Places {
    let none = [0; 3];
    let mut all = Places {
        cells: bits([0; 3], [side; 3]),
        faces: none,
        inner_faces: none,
        inner_edges: none,
        outer_edges: [[0; 4]; 3],
    };
    let mut axis = 0;
    while axis < 3 {
        let (mut first, mut end) = ([0; 3], [side; 3]);
        end[axis] = side + 1;
        all.faces[axis] = bits(first, end);
        (first[axis], end[axis]) = (1, side);
        all.inner_faces[axis] = bits(first, end);
        let mut first = [1; 3];
        first[axis] = 0;
        all.inner_edges[axis] = bits(first, [side; 3]);
        let mut ends = 0;
        while ends < 4 {
            let mut first = [0; 3];
            first[(axis + 1) % 3] = side * (ends & 1);
            first[(axis + 2) % 3] = side * (ends >> 1);
            let mut end = [first[0] + 1, first[1] + 1, first[2] + 1];
            end[axis] = side;
            all.outer_edges[axis][ends] = bits(first, end);
            ends += 1;
        }
        axis += 1;
    }
    all
}

/// The corners of a block of `SIDE` cells a side: those that are inside.
struct Block<const SIDE: usize>(u128);

/// The crossings of the edges of the block of two or four cells a side from `low`, if the surface in it is one
/// disk that meets each side of the block in one arc at most, and meets each cell and each face once at most.
pub fn disk_in_block(signs: &CornerBits, low: [usize; 3], side: usize) -> Option<EdgeCounts> {
    if side == MOST_CELLS {
        return Block::<MOST_CELLS>::of(signs, low).disk();
    }
    assert_eq!(side, MOST_CELLS / 2, "blocks have two or four cells a side");
    Block::<{ MOST_CELLS / 2 }>::of(signs, low).disk()
}

impl<const SIDE: usize> Block<SIDE> {
    const PLACES: Places = places(SIDE);

    #[inline]
    fn of(signs: &CornerBits, low: [usize; 3]) -> Self {
        let of_row = (1 << (SIDE + 1)) - 1;
        let mut corners = 0;
        for z in 0..=SIDE {
            let first = (low[2] + z) * LINES + low[1];
            let rows = &signs.rows[first..=first + SIDE];
            let mut plane = 0;
            for (y, row) in rows.iter().enumerate() {
                plane |= (row >> low[0] & of_row) << (STEPS[1] * y);
            }
            corners |= u128::from(plane) << (STEPS[2] * z);
        }
        Self(corners)
    }

    #[inline]
    fn disk(&self) -> Option<EdgeCounts> {
        let edges = self.edges();
        let is_simple = Node::disk(edges).is_simple() && !self.meets_any_twice();
        (is_simple && self.is_disk()).then_some(edges)
    }

    /// How often the edges of the block are crossed.
    #[inline]
    fn edges(&self) -> EdgeCounts {
        let mut edges = EdgeCounts::default();
        for (axis, step) in STEPS.into_iter().enumerate() {
            let crossed = self.0 ^ self.0 >> step;
            for ends in 0..4 {
                let along = crossed & Self::PLACES.outer_edges[axis][ends];
                // Seldom more than one.
                let count = match along & along.wrapping_sub(1) {
                    0 => u64::from(along != 0),
                    _ => u64::from(along.count_ones()),
                };
                let corner = (ends & 1) << ((axis + 1) % 3) | (ends >> 1) << ((axis + 2) % 3);
                edges.add_to(edge_at_corner(corner as u8, axis as u8), count);
            }
        }
        edges
    }

    /// Whether a face is ambiguous, or a cell has two pieces all the same: then two corners across from each
    /// other are alone on their side.
    #[inline]
    fn meets_any_twice(&self) -> bool {
        let c = self.0;
        let ambiguous = (0..3).map(|axis| {
            let [u, v] = [STEPS[(axis + 1) % 3], STEPS[(axis + 2) % 3]];
            (c ^ c >> u) & (c ^ c >> v) & !(c ^ c >> (u + v)) & Self::PLACES.faces[axis]
        });
        let ambiguous = ambiguous.fold(0, |all, faces| all | faces);
        let of_cell: [u128; 8] = std::array::from_fn(|corner| {
            c >> (0..3).map(|a| (corner >> a & 1) * STEPS[a]).sum::<usize>()
        });
        let pairs: [[u128; 2]; 4] = std::array::from_fn(|i| [of_cell[i], of_cell[7 - i]]);
        let apart = (0..4).map(|one| {
            let others = (0..4).filter(|other| *other != one).map(|other| pairs[other]);
            let (any, all) = others.fold((0, !0), |(any, all), [a, b]| (any | a | b, all & a & b));
            let [a, b] = pairs[one];
            a & b & !any | !(a | b) & all
        });
        let apart = apart.fold(0, |all, cells| all | cells);
        (ambiguous | apart & Self::PLACES.cells) != 0
    }

    /// The places from which, a step along some axes, corners of both signs are reached.
    #[inline]
    fn mixed(&self, axes: &[usize]) -> u128 {
        let (mut any, mut all) = (self.0, self.0);
        for axis in axes {
            any |= any >> STEPS[*axis];
            all &= all >> STEPS[*axis];
        }
        any & !all
    }

    /// Whether the surface is one disk, if it is one in each of its cells.
    #[inline]
    fn is_disk(&self) -> bool {
        let places = Self::PLACES;
        let cells = self.mixed(&[0, 1, 2]) & places.cells;
        let faces = [[1, 2], [2, 0], [0, 1]].map(|axes| self.mixed(&axes));
        let faces = [0, 1, 2].map(|axis| faces[axis] & places.inner_faces[axis]);
        let inner_edges: u32 =
            (0..3).map(|axis| (self.mixed(&[axis]) & places.inner_edges[axis]).count_ones()).sum();
        let inner_faces: u32 = faces.iter().map(|faces| faces.count_ones()).sum();
        // Every cell has a disk, disks share the arcs on inner faces, and these the crossings of inner edges.
        let euler = (cells.count_ones() + inner_edges) as i32 - inner_faces as i32;
        euler == 1 && is_connected(cells, faces)
    }
}

/// Whether all cells are reached from one of them through these faces.
fn is_connected(cells: u128, faces: [u128; 3]) -> bool {
    let mut reached = cells & cells.wrapping_neg();
    loop {
        let mut next = reached;
        for (faces, step) in faces.into_iter().zip(STEPS) {
            next |= (next << step) & faces | (next & faces) >> step;
        }
        if next == reached {
            return reached == cells;
        }
        reached = next;
    }
}
