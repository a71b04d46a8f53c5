//! The soup by bricks: bins, what does not count in them, and what was added.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::monitor::Resident;
use crate::octree::{BinTriangle, BrickKey, DropRecord, SoupTriangle};
use crate::store::{Resources, Sorter, Spool, SpoolPeek, SpoolWriter, StoreError};

/// Where the triangles of a brick lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BinEntry {
    /// Key of the brick.
    pub brick: u64,
    /// First triangle in the spool.
    pub first: u64,
    /// How many.
    pub count: u64,
}

/// Triangles once per brick that they touch, by brick and source number.
#[derive(Clone, Copy)]
pub struct BinSpools<'b> {
    /// The triangles.
    pub triangles: &'b Spool<SoupTriangle>,
    /// The bins by ascending brick key.
    pub entries: &'b Spool<BinEntry>,
}

/// The bins of a soup, as the stages after ingest see it.
#[derive(Clone, Copy)]
pub struct BinnedSoup<'b> {
    /// The input's triangles.
    pub bins: BinSpools<'b>,
    /// Which of them to leave out, by brick and source number.
    pub drops: &'b Spool<DropRecord>,
    /// Triangles that were added; their source numbers are above all of the input's.
    pub added: Option<BinSpools<'b>>,
}

/// A brick with triangles, and where they lie.
#[derive(Clone, Debug)]
pub struct SoupBin {
    /// The brick.
    pub brick: BrickKey,
    /// Numbers of its triangles.
    pub triangles: Range<u64>,
    /// Numbers of the drops that say which of them to leave out.
    pub drops: Range<u64>,
    /// Numbers of the triangles that were added.
    pub added: Range<u64>,
}

/// The bins by ascending brick key.
pub struct BinWalk<'b> {
    entries: SpoolPeek<'b, BinEntry>,
    drops: SpoolPeek<'b, DropRecord>,
    next_drop: u64,
    added: Option<SpoolPeek<'b, BinEntry>>,
}

impl<'b> BinnedSoup<'b> {
    /// Walks all bins.
    #[must_use]
    pub fn walk(&self) -> BinWalk<'b> {
        BinWalk {
            entries: SpoolPeek::new(self.bins.entries),
            drops: SpoolPeek::new(self.drops),
            next_drop: 0,
            added: self.added.map(|added| SpoolPeek::new(added.entries)),
        }
    }
}

impl BinWalk<'_> {
    /// The next bin.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn next_bin(&mut self) -> Result<Option<SoupBin>, StoreError> {
        let entry = self.entries.peek()?;
        let added = match &mut self.added {
            Some(added) => added.peek()?,
            None => None,
        };
        let Some(key) = entry.iter().chain(&added).map(|entry| entry.brick).min() else {
            return Ok(None);
        };
        let mut bin = SoupBin { brick: BrickKey(key), triangles: 0..0, drops: 0..0, added: 0..0 };
        if let Some(BinEntry { first, count, .. }) = entry.filter(|entry| entry.brick == key) {
            self.entries.next()?;
            bin.triangles = first..first + count;
            let first = self.next_drop;
            self.next_drop += self.drops.skip_while(|drop| drop.brick == key)?;
            bin.drops = first..self.next_drop;
        }
        if let (Some(walk), Some(entry)) = (&mut self.added, added)
            && entry.brick == key
        {
            walk.next()?;
            bin.added = entry.first..entry.first + entry.count;
        }
        Ok(Some(bin))
    }
}

impl SoupBin {
    /// How many triangles lie in it, with those that do not count.
    #[must_use]
    pub fn count(&self) -> u64 {
        (self.triangles.end - self.triangles.start) + (self.added.end - self.added.start)
    }

    /// Visits its triangles that count, by ascending source number.
    ///
    /// # Errors
    /// The scratch disk fails, or as `visit`.
    pub fn each(
        &self,
        soup: &BinnedSoup,
        visit: impl FnMut(&SoupTriangle) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        self.each_held(soup, None, visit)
    }

    /// As [`Self::each`]; `resident` counts the triangles that are in memory at one time.
    ///
    /// # Errors
    /// As [`Self::each`].
    pub fn each_held(
        &self,
        soup: &BinnedSoup,
        resident: Option<&Resident>,
        mut visit: impl FnMut(&SoupTriangle) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let length = |range: &Range<u64>| range.end - range.start;
        let mut drops = SpoolPeek::range(soup.drops, self.drops.start, length(&self.drops));
        let mut reader = soup.bins.triangles.reader(self.triangles.start, length(&self.triangles));
        while let Some(block) = reader.next_block()? {
            let _block = resident.map(|resident| resident.hold(block.len()));
            for triangle in block {
                // Both lists ascend by source number.
                if drops.peek()?.is_some_and(|drop| drop.source == triangle.source) {
                    drops.next()?;
                    continue;
                }
                visit(triangle)?;
            }
        }
        let Some(added) = soup.added else { return Ok(()) };
        let mut reader = added.triangles.reader(self.added.start, length(&self.added));
        while let Some(block) = reader.next_block()? {
            let _block = resident.map(|resident| resident.hold(block.len()));
            block.iter().try_for_each(&mut visit)?;
        }
        Ok(())
    }
}

/// Writes sorted triangles as bins, into spools with these names: triangles, and entries.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn write_bins(
    sorter: Sorter<BinTriangle>,
    [triangles, entries]: [&str; 2],
    resources: &Resources,
) -> Result<(Spool<SoupTriangle>, Spool<BinEntry>), StoreError> {
    let mut triangles = SpoolWriter::create(resources.scratch, triangles)?;
    let mut entries = SpoolWriter::create(resources.scratch, entries)?;
    let mut sorted = sorter.finish()?;
    let mut open: Option<BinEntry> = None;
    while let Some(binned) = sorted.next()? {
        match &mut open {
            Some(entry) if entry.brick == binned.brick => entry.count += 1,
            _ => {
                if resources.monitor.cancelled() {
                    return Err(StoreError::Cancelled);
                }
                let first = triangles.len();
                let entry = BinEntry { brick: binned.brick, first, count: 1 };
                open.replace(entry).map_or(Ok(()), |done| entries.push(done))?;
            }
        }
        triangles.push(binned.triangle)?;
    }
    open.map_or(Ok(()), |done| entries.push(done))?;
    Ok((triangles.finish()?, entries.finish()?))
}
