//! Sheets: triangles joined across edges of two, each on one of the sheet's two sides.
//!
//! Every triangle has two sides, which are united separately; so a sheet tells which of its
//! triangles are turned over against its first one, and whether it has one side only.
//!
//! In:         pairs of triangles at edges of two.
//! Out:        [`Sheets`].
//! Memory:     12 bytes a triangle, in tables that spill.

use crate::bridge::PASSING;
use crate::octree::{BorderUse, TrianglePair};
use crate::store::{Labels, Resources, Sorter, Spool, SpoolWriter, StoreError, Table, Unite};

/// Sides are numbered by 32 bits.
pub const MOST_TRIANGLES: u64 = 1 << 31;

/// Where a triangle lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The first triangle of its sheet.
    pub first: u32,
    /// Whether it is turned over against that one.
    pub is_turned: bool,
    /// Whether the sheet has one side only, so that nothing can be said of turns.
    pub is_one_sided: bool,
}

/// See the module.
pub struct Sheets {
    sides: Labels,
    /// Of each first triangle one more than the number of its sheet; 0 if that has no rim.
    numbers: Table<u32>,
    count: u32,
}

impl Sheets {
    /// Joins `triangles` triangles.
    pub fn join(
        pairs: Sorter<TrianglePair>,
        triangles: u64,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let share_bytes = resources.share_bytes / 8;
        let mut sides = Unite::new(resources.scratch, share_bytes, 2 * triangles)?;
        let mut sorted = pairs.finish()?;
        while let Some(TrianglePair { one, other, turned }) = sorted.next()? {
            sides.unite(2 * one, 2 * other + turned)?;
            sides.unite(2 * one + 1, 2 * other + 1 - turned)?;
        }
        let mut numbers = Table::new(resources.scratch, share_bytes);
        for _ in 0..triangles {
            numbers.push(0)?;
        }
        Ok(Self { sides: sides.finish()?, numbers, count: 0 })
    }

    /// The side of a triangle.
    pub fn side_of(&mut self, source: u32) -> Result<Side, StoreError> {
        let (front, back) = (self.sides.label(2 * source)?, self.sides.label(2 * source + 1)?);
        let first = front.min(back) / 2;
        Ok(Side { first, is_turned: front > back, is_one_sided: front == back })
    }

    /// The number of a triangle's sheet, and its side; `None` for sheets that have no rim.
    pub fn find(&mut self, source: u32) -> Result<Option<(u32, Side)>, StoreError> {
        let side = self.side_of(source)?;
        let number = self.numbers.get(u64::from(side.first))?.checked_sub(1);
        Ok(number.map(|number| (number, side)))
    }

    /// The number of a sheet, which is given one when it has none.
    pub fn enter(&mut self, first: u32) -> Result<u32, StoreError> {
        if let Some(known) = self.numbers.get(u64::from(first))?.checked_sub(1) {
            return Ok(known);
        }
        self.count += 1;
        self.numbers.set(u64::from(first), self.count)?;
        Ok(self.count - 1)
    }

    /// How many sheets have a number.
    pub fn count(&self) -> u64 {
        u64::from(self.count)
    }
}

/// Writes borders down, by edge.
pub fn spool_borders(
    borders: Sorter<BorderUse>,
    resources: &Resources,
) -> Result<Spool<BorderUse>, StoreError> {
    let mut spool = SpoolWriter::create(resources.scratch, PASSING[0])?;
    let mut sorted = borders.finish()?;
    while let Some(border) = sorted.next()? {
        spool.push(border)?;
    }
    spool.finish()
}
