//! The boundary cycles of all 256 sign patterns, in order and with a direction.
//!
//! In:         the signs of a cell's eight corners as a mask.
//! Out:        the edges of every cycle, one after the other.
//! Invariant:  the cycles are those of the leaf table of dual contouring, "separate inside" on all
//!             ambiguous faces: the decision is the face's, so two cells at a face join its edges
//!             the same way. Seen from outside of the solid a cycle runs counterclockwise.
//! Memory:     a table of 256 entries, worked out by the compiler.
//! Source:     Lorensen and Cline 1987; Nielson and Hamann 1991 for the ambiguous faces.
//!
//! Corners, edges and faces are numbered as in [`crate::contour::mdc::table`].

use crate::contour::mdc::table::{edge_at_corner, is_marked};

/// The cycles of one mask, by their smallest edge, which each begins with.
#[derive(Clone, Copy)]
pub struct Cycles {
    count: u8,
    /// Where each cycle ends in `edges`.
    ends: [u8; 4],
    edges: [u8; 12],
}

impl Cycles {
    /// The edges of each cycle.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        let starts = std::iter::once(0).chain(self.ends);
        let ends = &self.ends[..usize::from(self.count)];
        ends.iter().zip(starts).map(|(&end, start)| &self.edges[start.into()..end.into()])
    }
}

/// The cycles of every mask.
pub static CYCLES: [Cycles; 256] = tabulate();

/// The corners of a face in counterclockwise order, seen from outside of the cell.
const fn corners_around(face: u8) -> [u8; 4] {
    let axis = face / 2;
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    if face & 1 == 1 {
        let base = 1 << axis;
        [base, base | u, base | u | v, base | v]
    } else {
        [0, v, u | v, u]
    }
}

/// The edge between two corners that differ along one axis.
const fn edge_between(a: u8, b: u8) -> u8 {
    edge_at_corner(a, (a ^ b).trailing_zeros() as u8)
}

/// Whether corner `i` of a face is inside; they are counted around it more than once.
const fn is_inside(mask: u8, corners: [u8; 4], i: usize) -> bool {
    mask >> corners[i % 4] & 1 == 1
}

/// For every marked edge the one after it in its cycle. A run of inside corners around a face is
/// cut off by the segment from the edge where it begins to the edge where it ends.
const fn followers(mask: u8) -> [u8; 12] {
    let mut next = [0; 12];
    let mut face = 0;
    while face < 6 {
        let corners = corners_around(face);
        let mut i = 0;
        while i < 4 {
            if !is_inside(mask, corners, i) && is_inside(mask, corners, i + 1) {
                let mut end = i + 1;
                while is_inside(mask, corners, end + 1) {
                    end += 1;
                }
                let first = edge_between(corners[i], corners[(i + 1) % 4]);
                next[first as usize] = edge_between(corners[end % 4], corners[(end + 1) % 4]);
            }
            i += 1;
        }
        face += 1;
    }
    next
}

const fn cycles(mask: u8) -> Cycles {
    let next = followers(mask);
    let mut out = Cycles { count: 0, ends: [0; 4], edges: [0; 12] };
    let mut listed = 0;
    let mut seen = 0_u16;
    let mut start = 0;
    while start < 12 {
        let mut edge = start;
        while is_marked(mask, edge) && seen >> edge & 1 == 0 {
            seen |= 1 << edge;
            out.edges[listed] = edge;
            listed += 1;
            edge = next[edge as usize];
            if edge == start {
                out.ends[out.count as usize] = listed as u8;
                out.count += 1;
            }
        }
        start += 1;
    }
    out
}

const fn tabulate() -> [Cycles; 256] {
    let mut table = [cycles(0); 256];
    let mut mask = 0;
    while mask < 256 {
        table[mask] = cycles(mask as u8);
        mask += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::mdc::table::{TABLE, axis_of_edge, corner_of_edge};

    #[test]
    fn the_cycles_are_those_of_the_leaf_table() {
        let mut longest = 0;
        for (mask, cycles) in CYCLES.iter().enumerate() {
            let masks: Vec<u16> =
                cycles.iter().map(|edges| edges.iter().map(|edge| 1 << edge).sum()).collect();
            let expected = &TABLE[mask];
            assert_eq!(masks, expected.edge_masks[..usize::from(expected.count)], "{mask:08b}");
            longest = cycles.iter().map(<[u8]>::len).fold(longest, usize::max);
        }
        assert_eq!(longest, 7);
    }

    #[test]
    fn steps_of_a_cycle_have_the_inside_on_one_side() {
        // A corner alone inside: its three edges in the order in which they turn around it.
        for corner in 0..8_u8 {
            let cycles: Vec<_> = CYCLES[1 << corner].iter().collect();
            let axes = [0, 1, 2].map(|i| axis_of_edge(cycles[0][i]));
            let turns_right = (axes[1] + 3 - axes[0]) % 3 == 1;
            assert_eq!(turns_right, corner.count_ones() % 2 == 0, "{corner}");
            for edge in cycles[0] {
                let ends = [corner_of_edge(*edge, 0), corner_of_edge(*edge, 1)];
                assert!(ends.contains(&corner));
            }
        }
    }
}
