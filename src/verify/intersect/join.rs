//! The order of the cells: those that fit in memory go to the workers, crowded ones are divided.
//!
//! In:         triangles by cell.
//! Out:        the intersecting pairs of all cells.
//! Invariant:  a cell whose division does not help, since its triangles are wide or all at one
//!             place, is joined chunk by chunk, each with each.
//! Memory:     tasks under way, cells that are divided, and the pairs of wide triangles; see
//!             [`Shares`].

use std::sync::{Mutex, PoisonError};

use rayon::ThreadPool;

use crate::defect::Marks;
use crate::monitor::Monitor;
use crate::store::{Scratch, Sequence, Sorter, StoreError, ordered};
use crate::verify::intersect::cell::{Cell, CellTask, Workbench};
use crate::verify::intersect::crowd::{Crowd, append, task_of};
use crate::verify::intersect::grid::{Grid, cell_of_key, extent_of};
use crate::verify::intersect::judge::{Found, WidePairs};
use crate::verify::intersect::parcels::{Packed, Packer, Parcel};
use crate::verify::intersect::reach::Reach;
use crate::verify::tape::stop_if_asked;

/// What a triangle takes at most in a worker, and in the tasks that wait for it.
const TASK_BYTES: u64 = 500;
/// More triangles at one time make no worker faster.
const MOST_TRIANGLES: u64 = 16 << 10;
const LEAST_TRIANGLES: u64 = 48;
/// Of a parcel: a chunk of several must fit.
const MOST_PARCEL_TRIANGLES: usize = 2048;
/// Cells inside of each other.
const MOST_LEVELS: usize = 10;
/// Divisions that did not help, one inside of the other, until chunks are joined.
const MOST_STALLS: u32 = 3;
/// A division makes at most 2^bits cells a side.
const MOST_BITS: u32 = 6;

/// How the memory is shared out.
#[derive(Clone, Copy)]
pub(crate) struct Shares {
    /// For triangles that arrive.
    pub(crate) early_bytes: u64,
    /// Triangles that a worker takes at one time.
    pub(crate) cell_triangles: u64,
}

impl Shares {
    pub(crate) fn new(share_bytes: u64, threads: usize) -> Self {
        let early_bytes = share_bytes / 4;
        let task = share_bytes / 8 * 3 / threads as u64 / TASK_BYTES;
        Self { early_bytes, cell_triangles: task.clamp(LEAST_TRIANGLES, MOST_TRIANGLES) }
    }

    /// Triangles of a parcel.
    pub(crate) fn parcel_triangles(&self) -> usize {
        (self.cell_triangles as usize / 4).min(MOST_PARCEL_TRIANGLES)
    }

    /// For cells that are divided, so many inside of each other.
    fn level_bytes(&self, depth: usize) -> u64 {
        self.early_bytes >> depth
    }

    fn wide_pair_bytes(&self) -> u64 {
        self.early_bytes / 4
    }
}

/// What a join works with.
pub(crate) struct Join<'p> {
    pub(crate) scratch: &'p Scratch,
    /// Who wants to know of all pairs.
    pub(crate) marks: Option<&'p Marks>,
    pub(crate) shares: Shares,
    pub(crate) monitor: &'p dyn Monitor,
}

impl Join<'_> {
    /// Joins the cells of a grid, put together to cells `1 << shift` times as wide.
    pub(crate) fn run(
        self,
        grid: Grid,
        shift: u32,
        packer: Packer,
        pool: &ThreadPool,
    ) -> Result<Found, StoreError> {
        let Self { monitor, marks, .. } = self;
        let wide: WidePairs = Mutex::new(Sorter::new(self.scratch, self.shares.wide_pair_bytes()));
        let mut found = Found::new();
        let mut cells = Cells::new(self, Level::new(grid, shift, packer)?);
        ordered(
            pool,
            || cells.next_task(),
            Workbench::default,
            |bench, task: CellTask| bench.join(&task, &wide, marks),
            |of_cell| {
                found.add(&of_cell);
                monitor.advance(of_cell.triangles);
                Ok(())
            },
        )?;
        let mut pairs = wide.into_inner().unwrap_or_else(PoisonError::into_inner).finish()?;
        let mut last = None;
        while let Some(next) = pairs.next()? {
            if last != Some(next.pair) {
                found.count(next.pair, next.place, next.meeting);
                last = Some(next.pair);
            }
        }
        Ok(found)
    }
}

/// The cells of one grid.
struct Level {
    grid: Grid,
    shift: u32,
    packed: Packed,
    next: Option<Parcel>,
    /// The cells that this grid divides, from the inside out.
    around: Vec<Cell>,
    /// Triangles in the divided cell.
    triangles: u64,
    stalls: u32,
}

/// The parcels of a cell.
pub(crate) struct Group {
    /// The cell, and behind it those that it lies in.
    pub(crate) cells: Vec<Cell>,
    pub(crate) parcels: Sequence<Parcel>,
    triangles: u64,
    extents: f64,
}

impl Level {
    fn new(grid: Grid, shift: u32, packer: Packer) -> Result<Self, StoreError> {
        let mut packed = packer.finish()?;
        let next = packed.next()?;
        Ok(Self { grid, shift, packed, next, around: Vec::new(), triangles: u64::MAX, stalls: 0 })
    }

    fn next_group(&mut self, scratch: &Scratch, share: u64) -> Result<Option<Group>, StoreError> {
        let Some(first) = self.next else { return Ok(None) };
        let key = first.key >> (3 * self.shift);
        let cell = Cell { grid: self.grid, shift: self.shift, at: cell_of_key(key) };
        let cells = std::iter::once(cell).chain(self.around.iter().copied()).collect();
        let parcels = Sequence::new(scratch, share);
        let mut group = Group { cells, parcels, triangles: 0, extents: 0.0 };
        while let Some(parcel) = self.next.filter(|next| next.key >> (3 * self.shift) == key) {
            group.parcels.push(parcel)?;
            group.triangles += u64::from(parcel.triangles);
            group.extents += parcel.extents;
            self.next = self.packed.next()?;
        }
        Ok(Some(group))
    }
}

/// All cells, one after the other.
struct Cells<'p> {
    join: Join<'p>,
    levels: Vec<Level>,
    crowd: Option<Crowd>,
}

impl<'p> Cells<'p> {
    fn new(join: Join<'p>, root: Level) -> Self {
        Self { join, levels: vec![root], crowd: None }
    }

    fn next_task(&mut self) -> Result<Option<CellTask>, StoreError> {
        let Join { scratch, shares, monitor, .. } = self.join;
        loop {
            stop_if_asked(monitor)?;
            let depth = self.levels.len();
            let Some(level) = self.levels.last_mut() else { return Ok(None) };
            if let Some(crowd) = &mut self.crowd {
                if let Some(task) = crowd.next_task(&level.packed, shares.cell_triangles / 2)? {
                    return Ok(Some(task));
                }
                self.crowd = None;
            }
            let Some(group) = level.next_group(scratch, shares.level_bytes(4))? else {
                self.levels.pop();
                continue;
            };
            if group.triangles <= shares.cell_triangles {
                let count = group.parcels.len();
                let mut task = task_of(&level.packed, group.cells.clone());
                append(&mut task, &level.packed, &group.parcels, 0..count)?;
                return Ok(Some(task));
            }
            let stalls = match group.triangles / 3 > level.triangles / 4 {
                true => level.stalls + 1,
                false => 0,
            };
            let bits = group.bits(shares.cell_triangles);
            if bits == 0 || stalls >= MOST_STALLS || depth >= MOST_LEVELS {
                self.crowd = Some(Crowd::new(group));
                continue;
            }
            let share = shares.level_bytes(depth);
            let packer = Packer::new(scratch, share, shares.parcel_triangles());
            let child = group.divide(&level.packed, bits, stalls, packer, monitor)?;
            self.levels.push(child);
        }
    }
}

impl Group {
    /// Into how many cells a side it should be divided, as a power of two; 0 if that is of no use.
    fn bits(&self, cell_triangles: u64) -> u32 {
        let cell = &self.cells[0];
        let side = cell.grid.side() * f64::from(1_u32 << cell.shift);
        let widths = side * self.triangles as f64 / (4.0 * self.extents);
        // As many as a sheet needs, but no finer than the triangles.
        let wanted = (2 * self.triangles / cell_triangles).ilog2().div_ceil(2) + 1;
        let possible = if widths < 2.0 { 0 } else { widths.min(1e9).log2() as u32 };
        wanted.min(possible).min(MOST_BITS)
    }

    /// Puts its triangles into the cells of a finer grid.
    fn divide(
        self,
        packed: &Packed,
        bits: u32,
        stalls: u32,
        mut packer: Packer,
        monitor: &dyn Monitor,
    ) -> Result<Level, StoreError> {
        let grid = self.cells[0].grid_within(bits);
        let (mut parcels, mut words) = (Vec::new(), Vec::new());
        let mut at = 0;
        while let Some(&parcel) = self.parcels.block(at, 1, &mut parcels)?.first() {
            stop_if_asked(monitor)?;
            at += 1;
            words.clear();
            packed.read(&parcel, &mut words)?;
            parcel.unpack(packed.named, &words).try_each_arrival(|arrival| {
                let [low, high] = arrival.bounds;
                if !self.cells[0].takes(&parcel, low) {
                    return Ok(());
                }
                let range = grid.range(low, high);
                if grid.is_wide(extent_of(&arrival.bounds)) {
                    Reach::new(arrival.corners)
                        .try_each(&grid, &range, 0, &mut |cell| packer.add(cell, arrival))
                } else {
                    range.try_each(|cell| packer.add(cell, arrival))
                }
            })?;
        }
        let mut level = Level::new(grid, 0, packer)?;
        level.around = self.cells;
        level.triangles = self.triangles;
        level.stalls = stalls;
        Ok(level)
    }
}
