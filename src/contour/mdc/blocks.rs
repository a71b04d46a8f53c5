//! Blocks of four or two cells a side in which the surface is simple: most of them, away from corners. They
//! become clusters as a whole, and their cells need no vertices.
//!
//! In:         the cells of a block that the surface passes, and the crossings of its brick and of edges that
//!             leave it.
//! Out:        the block among the leaves of the cut, and its cells in the record; or nothing, and then its
//!             cells are placed one by one.
//! Invariant:  the normals on the edges of a block that is taken, and on those that leave it, are one group
//!             or two, as clusters have them. Where the two meet in a crease, no vertex of its cells wants
//!             to be elsewhere for it (`block_creases`). So no feature is lost that its cells would keep.
//! Units:      cells, from the brick's min corner.
//! Memory:     20 bytes a crossing, with the leaves.
//! Fails:      as for features.
//! Source:     ours.

use std::ops::RangeInclusive;

use crate::contour::mdc::cell::{components_of, place_of};
use crate::contour::mdc::cluster::{BlockPlace, Leaves, MOST_CELLS, PlaneHit, disk_in_block};
use crate::contour::mdc::features::Place;
use crate::contour::mdc::plain::later;
use crate::contour::mdc::table::AMBIGUOUS_FACES;
use crate::contour::mdc::workspace::{EdgeCrossing, Workspace};
use crate::contour::{ContourError, ContourStats, SurfaceDetail};
use crate::octree::{CellBrick, LINES, ROWS, SIDE};

/// Blocks with fewer cells are left to these.
const FEWEST_CELLS: u32 = 4;

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
            let is_fine = are_along && self.keeps_crease((low, side), &made, planes);
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
    pub(super) fn each_crossing_in_row(
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
            let crossing = crossings.next().expect("marks are of crossings");
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
