//! Vertices that depend on nothing but the crossings of their own cell: most of them. Where clusters are
//! made they are placed after the cut, if they are still in it.
//!
//! In:         a cell with one component, and the crossings of its brick and of edges that leave it.
//! Out:        whether its vertex is plain; later the vertices of plain cells that are in the cut.
//! Invariant:  what is said to be plain has no feature: [`Workspace::near_feature`] and
//!             [`Workspace::toward_feature`] find none. So the brick is the same as if all were placed
//!             at once.
//! Memory:     none.
//! Fails:      as for features.

use crate::contour::mdc::cell::{cell_number, components_of, place_of};
use crate::contour::mdc::features::Place;
use crate::contour::mdc::workspace::Workspace;
use crate::contour::{ContourError, ContourStats};
use crate::geom::qef::Attempt;
use crate::octree::{CellBrick, LINES, SIDE};

/// In place of a coordinate: this vertex is placed once it is known to be in the cut.
const LATER: i32 = i32::MIN;

/// In place of the position of the only vertex of the cell with this rank, while the cut is made.
pub(super) fn later(rank: usize) -> [i32; 3] {
    [LATER, rank as i32, 0]
}

impl Workspace {
    /// Whether the vertex of a component with these normals is plain: no plane on its edges, nor on those
    /// that leave its cell, differs from the first one by more than the crease angle.
    ///
    /// # Errors
    /// [`ContourError`].
    #[inline]
    pub(super) fn is_plain(
        &mut self,
        place: Place,
        at: [usize; 3],
        own: &[u32],
    ) -> Result<bool, ContourError> {
        let is_inner = at.iter().all(|c| (1..SIDE - 1).contains(c));
        if self.is_smooth && is_inner {
            return Ok(true);
        }
        // A patch has no plane.
        if own.contains(&0) {
            return Ok(false);
        }
        let first = own[0];
        if !own[1..].iter().all(|number| self.are_alike(first, *number)) {
            return Ok(false);
        }
        if is_inner {
            return Ok(self.all_leaving_are_alike(at, first));
        }
        for corner in 0..8_usize {
            for axis in 0..3 {
                let number = self.outward(place, at, corner, axis)?;
                if !self.are_alike(first, number) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Whether two normals, by their numbers, differ by less than the crease angle, or one is none.
    #[inline]
    fn are_alike(&self, one: u32, other: u32) -> bool {
        one == other
            || other == 0
            || self.normals[one as usize].dot(self.normals[other as usize]).abs()
                >= self.crease_cosine
    }

    /// The same of all edges that leave a cell, none of which leaves the brick.
    #[inline]
    fn all_leaving_are_alike(&self, at: [usize; 3], first: u32) -> bool {
        let [x, y, z] = at;
        // Bits of a row of edges: of both columns of the cell, or of those beside them.
        let (both, beside) = (0b11, 0b101);
        let is_alike = |axis: usize, [y, z]: [usize; 2], low: usize, bits: u64| {
            let mut left = self.marks.rows(axis)[z * LINES + y] >> low & bits;
            while left != 0 {
                let x = low + left.trailing_zeros() as usize;
                left &= left - 1;
                if !self.are_alike(first, self.crossing(axis, [x, y, z]).normal) {
                    return false;
                }
            }
            true
        };
        [0, 1].iter().all(|i| {
            [0, 1].iter().all(|j| {
                is_alike(0, [y + i, z + j], x - 1, beside)
                    && is_alike(1, [y - 1 + 2 * i, z + j], x, both)
                    && is_alike(2, [y + i, z - 1 + 2 * j], x, both)
            })
        })
    }

    /// Places the plain vertices that are in the cut.
    pub(super) fn place_remaining(&mut self, brick: &mut CellBrick, stats: &mut ContourStats) {
        for number in 0..brick.positions.len() {
            let [mark, rank, _] = brick.positions[number];
            if mark != LATER {
                continue;
            }
            let cell = brick.cells[rank as usize];
            let at = place_of(cell_number(cell));
            let around = self.around(at, components_of(cell).edge_masks[0]);
            match self.attempt(&around) {
                Attempt::Done(solution) => {
                    brick.positions[number] = self.to_lattice(at, solution.position);
                    stats.clamped_vertices += u64::from(solution.clamped);
                }
                Attempt::Waiting(cell) => self.wait(cell, (at, number), brick, stats),
            }
        }
        self.place_waiting(brick, stats);
    }
}
