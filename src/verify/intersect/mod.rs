//! Pairs of triangles that intersect, exactly.
//!
//! Two triangles intersect if they meet anywhere but in vertices and edges that they share; touching
//! and coplanar overlap count. Triangles without area and those with a corner at infinity have no
//! part in this.
//!
//! In:         triangles, one by one in file order.
//! Out:        the number of pairs, and the first of them.
//! Invariant:  a triangle is in every cell of a coarse grid that it meets. Of two that are in all
//!             cells of their boxes, the cell in which the overlap of the boxes starts counts the
//!             pair; with a wide one, the pairs of all cells are sorted and counted once. So counts
//!             and places depend on the file alone: not on the grid, the share or the threads.
//! Memory:     a quarter of `share_bytes` while triangles arrive, all of it in the join.
//! Fails:      only as [`StoreError`].
//! Source:     Dittrich and Seeger 2000 (the cell that counts a pair), Shewchuk 1997 (signs).

mod arrival;
mod boxes;
mod cell;
mod crowd;
mod exact_pair;
#[cfg(test)]
mod fan_tests;
mod filters;
mod flat_fans;
mod grid;
mod join;
mod judge;
mod meeting;
#[cfg(test)]
mod meeting_tests;
mod near;
mod pair;
#[cfg(test)]
mod pair_tests;
mod parcels;
mod reach;
#[cfg(test)]
mod tests;

pub(crate) use judge::Found;

use rayon::ThreadPool;

use crate::defect::Marks;
use crate::geom::signs::Point;
use crate::monitor::Monitor;
use crate::store::{Scratch, StoreError};
use crate::verify::intersect::arrival::Arrival;
use crate::verify::intersect::grid::{Grid, box_of, extent_of};
use crate::verify::intersect::join::{Join, Shares};
use crate::verify::intersect::parcels::Packer;
use crate::verify::intersect::reach::Reach;

/// The first triangles, whose size decides on the grid.
const EARLY: usize = 256;
/// A cell is about as wide as so many triangles in a row, and smaller where memory is.
const MOST_ROW: f64 = 40.0;

/// Triangles on their way into the cells of a grid.
pub(crate) struct Intersections<'p> {
    scratch: &'p Scratch,
    marks: Option<&'p Marks>,
    shares: Shares,
    early: Vec<Early>,
    placed: Option<Placed>,
}

/// One of the first triangles.
struct Early {
    number: u64,
    names: Option<[u32; 3]>,
    corners: [Point; 3],
}

/// Triangles by cell.
struct Placed {
    grid: Grid,
    packer: Packer,
    triangles: u64,
    /// Wide triangles, until it is known how many there are.
    wide: Packer,
    wide_triangles: u64,
    /// About how many cells all wide triangles meet, for cells of `1 << shift` times the width.
    wide_cells: [f64; 21],
}

impl<'p> Intersections<'p> {
    /// No triangles yet.
    pub(crate) fn new(scratch: &'p Scratch, share_bytes: u64, pool: &ThreadPool) -> Self {
        let shares = Shares::new(share_bytes, pool.current_num_threads());
        Self { scratch, marks: None, shares, early: Vec::new(), placed: None }
    }

    /// Marks the triangles of all pairs as well.
    pub(crate) fn marking(self, marks: Option<&'p Marks>) -> Self {
        Self { marks, ..self }
    }

    /// Takes a triangle with an area.
    #[inline]
    pub(crate) fn add(
        &mut self,
        number: u64,
        names: Option<[u32; 3]>,
        corners: &[Point; 3],
    ) -> Result<(), StoreError> {
        if let Some(placed) = &mut self.placed {
            return placed.add(&Arrival::new(number, names, corners));
        }
        self.early.push(Early { number, names, corners: *corners });
        if self.early.len() == EARLY {
            self.placed = Some(self.place_early()?);
        }
        Ok(())
    }

    /// Chooses the grid by the triangles that came first.
    #[cold]
    fn place_early(&mut self) -> Result<Placed, StoreError> {
        let early = std::mem::take(&mut self.early);
        let extents = early.iter().map(|early| extent_of(&box_of(&early.corners)));
        let mean = extents.sum::<f64>() / early.len().max(1) as f64;
        let row = (self.shares.cell_triangles as f64 / 4.0).sqrt().clamp(4.0, MOST_ROW);
        let wide_bytes = self.shares.early_bytes / 8;
        let packer = |bytes| Packer::new(self.scratch, bytes, self.shares.parcel_triangles());
        let mut placed = Placed {
            grid: Grid::around(early.first().map_or([0.0; 3], |e| e.corners[0]), row * mean),
            packer: packer(self.shares.early_bytes - wide_bytes),
            triangles: 0,
            wide: packer(wide_bytes),
            wide_triangles: 0,
            wide_cells: [0.0; 21],
        };
        for Early { number, names, corners } in &early {
            placed.add(&Arrival::new(*number, *names, corners))?;
        }
        Ok(placed)
    }

    /// Tests all pairs that may intersect.
    pub(crate) fn join(
        mut self,
        pool: &ThreadPool,
        monitor: &dyn Monitor,
    ) -> Result<Found, StoreError> {
        let placed = match self.placed.take() {
            Some(placed) => placed,
            None => self.place_early()?,
        };
        let (grid, shift, packer) = placed.settle()?;
        let join = Join { scratch: self.scratch, marks: self.marks, shares: self.shares, monitor };
        join.run(grid, shift, packer, pool)
    }
}

impl Placed {
    #[inline]
    fn add(&mut self, arrival: &Arrival<'_>) -> Result<(), StoreError> {
        self.triangles += 1;
        let range = self.grid.range(arrival.bounds[0], arrival.bounds[1]);
        if self.grid.is_wide(extent_of(&arrival.bounds)) {
            self.wide_triangles += 1;
            for (shift, cells) in (0..).zip(&mut self.wide_cells) {
                let range = range.coarser(shift);
                let sides: [f64; 3] =
                    std::array::from_fn(|i| f64::from(range.high[i] - range.low[i]) + 1.0);
                // It is flat.
                *cells += sides.iter().product::<f64>() / sides.iter().fold(0.0, |m, s| s.max(m));
            }
            return self.wide.add([0; 3], arrival);
        }
        match range.single() {
            Some(cell) => self.packer.add(cell, arrival),
            None => range.try_each(|cell| self.packer.add(cell, arrival)),
        }
    }

    /// Puts wide triangles into cells, which are put together where wide ones would be in too many.
    fn settle(self) -> Result<(Grid, u32, Packer), StoreError> {
        let Self { grid, mut packer, triangles, wide, wide_triangles, wide_cells } = self;
        let most = triangles as f64 + 3.0 * wide_triangles as f64;
        let shift = wide_cells.iter().position(|&cells| cells <= most).unwrap_or(20) as u32;
        packer.settle_cells()?;
        let mut wide = wide.finish()?;
        let mut words = Vec::new();
        while let Some(parcel) = wide.next()? {
            words.clear();
            wide.read(&parcel, &mut words)?;
            parcel.unpack(wide.named, &words).try_each_arrival(|arrival| {
                let [low, high] = arrival.bounds;
                let range = grid.range(low, high).coarser(shift);
                Reach::new(arrival.corners).try_each(&grid, &range, shift, &mut |cell| {
                    packer.add(cell.map(|c| c << shift), arrival)
                })
            })?;
        }
        Ok((grid, shift, packer))
    }
}
