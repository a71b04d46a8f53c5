//! Creases in blocks of cells: whether one is kept though the block is one vertex.
//!
//! In:         a block with two groups of planes.
//! Out:        whether their crease passes it from end to end, with surface in every cell on its way.
//! Invariant:  where it ends in a corner near the block, or passes a cell that no edge tells of, vertices of
//!             leaf cells are asked to be there (`reach`), and the block is left to them.
//! Units:      cells, from the brick's min corner.
//! Memory:     none.
//! Fails:      never.
//! Source:     ours.

use glam::DVec3;

use crate::contour::mdc::block_planes::BlockPlanes;
use crate::contour::mdc::cluster::{Block, CellPlane};
use crate::contour::mdc::workspace::Workspace;
use crate::octree::SIDE;

/// How far apart the places are where a crease is looked at.
const CREASE_STEP_CELLS: f64 = 0.2;

impl Workspace {
    /// Whether the block of `side` cells from `low` has no crease, or one that its vertex keeps.
    pub(super) fn keeps_crease(
        &self,
        (low, side): ([usize; 3], usize),
        block: &Block,
        found: &BlockPlanes,
        planes: &[CellPlane],
    ) -> bool {
        let Some(clustering) = &self.clustering else { return false };
        let Some(crease) = block.crease(planes, self.crease_cosine) else { return true };
        self.is_on_surface((low, side), crease)
            && self.has_no_corner((low, side), block, found, clustering.cosine_squared())
    }

    /// Whether the crease at `at` passes only cells with surface in a block and the cells around it. Where it
    /// passes others, vertices want to reach it, and stay those of leaf cells.
    fn is_on_surface(&self, (low, side): ([usize; 3], usize), [at, along]: [DVec3; 2]) -> bool {
        let low = low.map(|c| c as i32);
        let reach = (side as f64 * 0.5 + 1.0) * DVec3::ONE.length();
        let centre = DVec3::from(low.map(f64::from)) + side as f64 * 0.5;
        let start = at + along * along.dot(centre - at);
        let steps = (reach / CREASE_STEP_CELLS) as i32;
        let mut last = None;
        (-steps..=steps).all(|step| {
            let point = start + along * (f64::from(step) * CREASE_STEP_CELLS);
            // Rounded down: nothing that is near lies below -1.
            let cell = point.to_array().map(|c| (c + 2.0) as i32 - 2);
            if last.replace(cell) == Some(cell) {
                return true;
            }
            let is_near = (0..3).all(|a| (low[a] - 1..=low[a] + side as i32).contains(&cell[a]));
            !is_near || self.has_surface(cell)
        })
    }

    /// Whether the surface passes a cell, as far as the corners of the brick tell.
    fn has_surface(&self, cell: [i32; 3]) -> bool {
        let last = SIDE as i32;
        // Most are in the brick, and all their corners at once.
        if cell.iter().all(|c| (0..last).contains(c)) {
            return !matches!(self.signs.cell_mask(cell.map(|c| c as usize)), 0 | 255);
        }
        let corners = (0..8).filter_map(|corner| {
            let at: [i32; 3] = std::array::from_fn(|a| cell[a] + (corner >> a & 1));
            let is_here = at.iter().all(|c| (0..=last).contains(c));
            is_here.then(|| self.signs.get(at.map(|c| c as usize)))
        });
        let [mut is_inside, mut is_outside] = [false; 2];
        corners.for_each(|inside| {
            is_inside |= inside;
            is_outside |= !inside;
        });
        is_inside && is_outside
    }

    /// Whether no plane in the cells around a block with a crease differs from both of its own: then it does not
    /// end there in a corner.
    fn has_no_corner(
        &self,
        (low, side): ([usize; 3], usize),
        block: &Block,
        found: &BlockPlanes,
        cosine_squared: f64,
    ) -> bool {
        let [from, to] = [0, 1].map(|end| {
            low.map(|c| if end == 0 { c.saturating_sub(1) } else { (c + side + 1).min(SIDE) })
        });
        let mut last = 0;
        (0..3).all(|axis| {
            // Edges along an axis end where the last cell does.
            let last_of = |a: usize| if a == axis { to[a] - 1 } else { to[a] };
            (from[2]..=last_of(2)).all(|z| {
                (from[1]..=last_of(1)).all(|y| {
                    self.each_crossing_in_row(axis, [y, z], from[0]..=last_of(0), |_, crossing| {
                        let number = crossing.normal;
                        let is_known = number == last;
                        last = number;
                        is_known
                            || found.has(number)
                            || number != 0
                                && block.is_along(self.normals[number as usize], cosine_squared)
                    })
                })
            })
        })
    }
}
