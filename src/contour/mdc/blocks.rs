//! Blocks of four or two cells a side in which the surface is smooth and simple: most of them, away from features.
//! They become clusters as a whole, and their cells need no vertices.
//!
//! In:         the cells of a block that the surface passes, and the crossings of its brick and of edges that
//!             leave it.
//! Out:        the block among the leaves of the cut, and its cells in the record; or nothing, and then its
//!             cells are placed one by one.
//! Invariant:  all cells of a block that is taken are plain, as `plain` has it: no normal on their edges or
//!             on those that leave the block differs by half the crease angle from that of the block.
//! Units:      cells, from the brick's min corner.
//! Memory:     20 bytes a crossing, with the leaves.
//! Fails:      as for features.
//! Source:     ours.

use std::ops::RangeInclusive;

use glam::DVec3;

use crate::contour::mdc::cell::{components_of, place_of};
use crate::contour::mdc::cluster::{
    Block, BlockPlace, Leaves, MOST_CELLS, PlaneHit, disk_in_block,
};
use crate::contour::mdc::features::Place;
use crate::contour::mdc::plain::later;
use crate::contour::mdc::table::AMBIGUOUS_FACES;
use crate::contour::mdc::workspace::{EdgeCrossing, Workspace};
use crate::contour::{ContourError, ContourStats, SurfaceDetail};
use crate::octree::{CellBrick, LINES, ROWS, SIDE};

/// Blocks with fewer cells are left to these.
const FEWEST_CELLS: u32 = 4;

/// How far apart the places are where a crease is looked at.
const CREASE_STEP_CELLS: f64 = 0.2;

/// Edges that leave a block through its sides.
const MOST_LEAVING: usize = 6 * (MOST_CELLS + 1) * (MOST_CELLS + 1);

/// Numbers of the normals on edges that leave a block.
struct Leaving {
    numbers: [u32; MOST_LEAVING],
    count: usize,
}

impl Leaving {
    #[inline]
    fn note(&mut self, number: u32) {
        // Neighbours are often of one triangle.
        if self.count == 0 || self.numbers[self.count - 1] != number {
            self.numbers[self.count] = number;
            self.count += 1;
        }
    }
}

impl Workspace {
    /// Takes a block in, with the cells in it that `touched` has bits for, in Morton order; whether it could.
    ///
    /// # Errors
    /// [`ContourError`].
    pub(super) fn take_block(
        &mut self,
        place: Place,
        block: BlockPlace,
        touched: u64,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<bool, ContourError> {
        if touched.count_ones() < FEWEST_CELLS
            || self.clustering.is_none()
            || brick.banned.binary_search(&block.packed()).is_ok()
            || !self.are_single(block, touched)
        {
            return Ok(false);
        }
        let (low, side) = (place_of(block.first()), block.side());
        let Some(edges) = disk_in_block(&self.signs, low, side) else { return Ok(false) };
        let first_hit = self.leaves.hits.len();
        let mut leaves = std::mem::take(&mut self.leaves);
        let made = self.gather(place, (low, side), &mut leaves)?.and_then(|leaving| {
            let (hits, planes) = (&leaves.hits[first_hit..], &leaves.planes);
            let clustering = self.clustering.as_ref()?;
            let cosine_squared = clustering.cosine_squared();
            let made = clustering.block(block, edges, hits, planes)?;
            let are_along = leaving.numbers[..leaving.count]
                .iter()
                .all(|number| made.is_along(self.normals[*number as usize], cosine_squared));
            let has_crease = |[at, along]: [DVec3; 2]| {
                self.is_on_surface((low, side), at, along) && self.has_no_corner((low, side), &made)
            };
            let is_fine =
                are_along && made.crease(planes, self.crease_cosine).is_none_or(has_crease);
            is_fine.then_some(made)
        });
        let is_taken = made.is_some();
        match made {
            Some(made) => leaves.blocks.push(made),
            None => leaves.hits.truncate(first_hit),
        }
        self.leaves = leaves;
        if is_taken {
            self.add_cells(block, touched, first_hit, brick);
            stats.cells += u64::from(touched.count_ones());
            stats.cell_vertices += u64::from(touched.count_ones());
        }
        Ok(is_taken)
    }

    /// Whether the cells of a block have one piece of surface each, and no ambiguous faces.
    fn are_single(&self, block: BlockPlace, touched: u64) -> bool {
        let mut left = touched;
        while left != 0 {
            let at = place_of(block.first() | left.trailing_zeros() as usize);
            left &= left - 1;
            let mask = self.signs.cell_mask(at);
            let is_single = AMBIGUOUS_FACES[usize::from(mask)] == 0
                && components_of(u32::from(mask) << 15).count == 1;
            if !is_single {
                return false;
            }
        }
        true
    }

    /// Adds the crossings of the block from `low` to `leaves`, each once; the normals of those that leave the
    /// block. `None` if one is of a patch, or not all are of one surface.
    fn gather(
        &mut self,
        place: Place,
        (low, side_cells): ([usize; 3], usize),
        leaves: &mut Leaves,
    ) -> Result<Option<Leaving>, ContourError> {
        let mut leaving = Leaving { numbers: [0; MOST_LEAVING], count: 0 };
        let mut surface = None;
        let has_surfaces = self.surfaces != SurfaceDetail::None;
        let all = self.each_crossing_of_block((low, side_cells), |axis, at, crossing, is_own| {
            if crossing.normal == 0 {
                return false;
            }
            if !is_own {
                leaving.note(crossing.normal);
                return true;
            }
            let mut point = at.map(|c| c as f32);
            point[axis] = (at[axis] as f64 + crossing.offset) as f32;
            leaves.hits.push(PlaneHit { plane: crossing.normal - 1, point });
            let own = self.surfaces.of(crossing.surface);
            !has_surfaces || *surface.get_or_insert(own) == own
        });
        if !all {
            return Ok(None);
        }
        for side in 0..6 {
            let axis = side / 2;
            let is_max = side % 2 == 1;
            let is_beyond = if is_max { low[axis] + side_cells == SIDE } else { low[axis] == 0 };
            if !is_beyond {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let beyond = self.beyond(place, side)?;
            for row in low[v]..=low[v] + side_cells {
                let numbers = &beyond[row * LINES + low[u]..][..=side_cells];
                numbers.iter().filter(|number| **number != 0).for_each(|n| leaving.note(*n));
            }
        }
        Ok(Some(leaving))
    }

    /// Whether the crease at `at` passes only cells with surface in a block and the cells around it. Where it
    /// passes others, vertices want to reach it, and stay those of leaf cells.
    fn is_on_surface(&self, (low, side): ([usize; 3], usize), at: DVec3, along: DVec3) -> bool {
        let low = low.map(|c| c as i32);
        let reach = (side as f64 * 0.5 + 1.0) * DVec3::ONE.length();
        let centre = DVec3::from(low.map(f64::from)) + side as f64 * 0.5;
        let start = at + along * along.dot(centre - at);
        let steps = (reach / CREASE_STEP_CELLS) as i32;
        (-steps..=steps).all(|step| {
            let point = start + along * (f64::from(step) * CREASE_STEP_CELLS);
            let cell = point.to_array().map(|c| (c + 1.0) as i32 - 1);
            let is_near = (0..3).all(|a| (low[a] - 1..=low[a] + side as i32).contains(&cell[a]));
            !is_near || self.has_surface(cell)
        })
    }

    /// Whether the surface passes a cell, as far as the corners of the brick tell.
    fn has_surface(&self, cell: [i32; 3]) -> bool {
        let last = SIDE as i32;
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
    fn has_no_corner(&self, (low, side): ([usize; 3], usize), block: &Block) -> bool {
        let Some(clustering) = &self.clustering else { return false };
        let cosine_squared = clustering.cosine_squared();
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
                            || number != 0
                                && block.is_along(self.normals[number as usize], cosine_squared)
                    })
                })
            })
        })
    }

    /// Shows the crossings on the edges of the block from `low`, and on those of the brick that leave it, until
    /// `visit` has seen enough; whether it saw all.
    #[inline]
    fn each_crossing_of_block(
        &self,
        (low, most): ([usize; 3], usize),
        mut visit: impl FnMut(usize, [usize; 3], EdgeCrossing, bool) -> bool,
    ) -> bool {
        let [x, y, z] = low;
        for axis in 0..3 {
            // Edges along an axis reach one farther on both sides of it.
            let before = |a: usize| low[a] - usize::from(a == axis && low[a] > 0);
            for row_z in before(2)..=z + most {
                for row_y in before(1)..=y + most {
                    let range = before(0)..=x + most;
                    let all = self.each_crossing_in_row(axis, [row_y, row_z], range, |at, c| {
                        let at = [at, row_y, row_z];
                        let is_own = (low[axis]..low[axis] + most).contains(&at[axis]);
                        visit(axis, at, c, is_own)
                    });
                    if !all {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Shows the crossings of a row of edges along `axis` in a range along x, as each of the above.
    #[inline]
    fn each_crossing_in_row(
        &self,
        axis: usize,
        [y, z]: [usize; 2],
        range: RangeInclusive<usize>,
        mut visit: impl FnMut(usize, EdgeCrossing) -> bool,
    ) -> bool {
        let row = z * LINES + y;
        let word = self.marks.rows(axis)[row];
        let first = *range.start();
        let width = range.end() + 1 - first;
        let mut left = word >> first & ((1 << width) - 1);
        if left == 0 {
            return true;
        }
        let below = word & ((1 << first) - 1);
        let rank = self.row_starts[axis * ROWS + row] + below.count_ones();
        let mut crossings = self.crossings[rank as usize..].iter();
        while left != 0 {
            let at = first + left.trailing_zeros() as usize;
            left &= left - 1;
            let Some(crossing) = crossings.next() else { return true };
            if !visit(at, *crossing) {
                return false;
            }
        }
        true
    }

    /// Adds the cells of a block that is taken, whose crossings begin at `first_hit`.
    fn add_cells(
        &mut self,
        block: BlockPlace,
        touched: u64,
        first_hit: usize,
        brick: &mut CellBrick,
    ) {
        let mut left = touched;
        let mut start = first_hit as u32;
        while left != 0 {
            let number = block.first() | left.trailing_zeros() as usize;
            left &= left - 1;
            let at = place_of(number);
            let mask = self.signs.cell_mask(at);
            self.leaves.components.push(brick.positions.len() as u32);
            self.leaves.hit_starts.push(start);
            start = self.leaves.hits.len() as u32;
            brick.positions.push(later(brick.cells.len()));
            self.add_own_edges(at, mask, brick);
            brick.cells.push(number as u32 | u32::from(mask) << 15);
        }
    }
}
