//! The soup by bricks: bins, what does not count in them, and what was added.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::monitor::Resident;
use crate::octree::{
    BinTriangle, BrickKey, DropRecord, SoupBlock, SoupSpool, SoupTriangle, SoupWriter,
};
use crate::store::{Record, Resources, Sorter, Spool, SpoolPeek, SpoolWriter, StoreError};

/// Triangles between two entries that are rather read in vain than passed over.
const MOST_BETWEEN: u64 = 64;
/// Triangles that are read for several entries at one time.
const MOST_IN_SPAN: u64 = 1024;

/// Triangles of a brick that lie one after the other in a spool.
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

impl Record for BinEntry {
    type Key = (u64, u64);
    fn key(&self) -> Self::Key {
        (self.brick, self.first)
    }
}

/// For each brick the triangles that touch it, by source number.
#[derive(Clone, Copy)]
pub struct BinSpools<'b> {
    /// The triangles, by source number within the entries of a brick.
    pub triangles: &'b SoupSpool,
    /// Where they lie, by ascending brick key and first triangle.
    pub entries: &'b Spool<BinEntry>,
}

/// The triangles of one brick.
#[derive(Clone, Debug)]
pub struct Bin {
    /// The brick.
    pub brick: BrickKey,
    /// How many triangles lie in it.
    pub count: u64,
    /// Numbers of its entries.
    entries: Range<u64>,
}

/// The bins of [`BinSpools`] by ascending brick key.
pub struct Bins<'b> {
    entries: SpoolPeek<'b, BinEntry>,
    next: u64,
}

impl<'b> BinSpools<'b> {
    /// All bins.
    #[must_use]
    pub fn bins(&self) -> Bins<'b> {
        Bins { entries: SpoolPeek::new(self.entries), next: 0 }
    }

    /// How many bins there are.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn count(&self) -> Result<u64, StoreError> {
        let mut bins = self.bins();
        let mut count = 0;
        while bins.next()?.is_some() {
            count += 1;
        }
        Ok(count)
    }

    /// Visits the triangles of a bin block by block, by ascending source number. `resident` counts those that
    /// are in memory at one time.
    ///
    /// # Errors
    /// The scratch disk fails, or as `visit`.
    pub fn each_block(
        &self,
        bin: &Bin,
        resident: Option<&Resident>,
        mut visit: impl FnMut(&[SoupTriangle]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let Range { start, end } = bin.entries;
        let mut entries = SpoolPeek::range(self.entries, start, end - start);
        let mut reader = self.triangles.reader(0, 0);
        let mut block = SoupBlock::default();
        let mut span = Span::default();
        while let Some(entry) = entries.next()? {
            span.take(entry, &mut entries)?;
            let first = span.entries[0].first;
            if span.entries.len() == 1 {
                reader.turn_to(first, entry.count);
                while let Some(block) = reader.next_block()? {
                    let _block = resident.map(|resident| resident.hold(block.len()));
                    visit(block)?;
                }
                continue;
            }
            self.triangles.read(first, (span.end - first) as usize, &mut block)?;
            let _block = resident.map(|resident| resident.hold(block.len()));
            for entry in &span.entries {
                let at = (entry.first - first) as usize;
                visit(&block[at..at + entry.count as usize])?;
            }
        }
        Ok(())
    }
}

/// Entries of a brick that are read at one time, with what lies between them.
#[derive(Default)]
struct Span {
    entries: Vec<BinEntry>,
    /// Behind the last triangle.
    end: u64,
}

impl Span {
    /// Goes on with `first` and those of the next entries that are near.
    fn take(
        &mut self,
        first: BinEntry,
        entries: &mut SpoolPeek<BinEntry>,
    ) -> Result<(), StoreError> {
        self.entries.clear();
        self.entries.push(first);
        self.end = first.first + first.count;
        while let Some(next) = entries.peek()? {
            let end = next.first + next.count;
            if next.first - self.end > MOST_BETWEEN || end - first.first > MOST_IN_SPAN {
                break;
            }
            entries.next()?;
            self.entries.push(next);
            self.end = end;
        }
        Ok(())
    }
}

impl Bins<'_> {
    /// The key of the next bin.
    fn peek(&mut self) -> Result<Option<u64>, StoreError> {
        Ok(self.entries.peek()?.map(|entry| entry.brick))
    }

    /// The next bin.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn next(&mut self) -> Result<Option<Bin>, StoreError> {
        let Some(brick) = self.peek()? else { return Ok(None) };
        let mut bin = Bin::none(BrickKey(brick));
        bin.entries = self.next..self.next;
        while let Some(entry) = self.entries.peek()?.filter(|entry| entry.brick == brick) {
            self.entries.next()?;
            bin.entries.end += 1;
            bin.count += entry.count;
        }
        self.next = bin.entries.end;
        Ok(Some(bin))
    }
}

impl Bin {
    /// A brick without triangles.
    fn none(brick: BrickKey) -> Self {
        Self { brick, count: 0, entries: 0..0 }
    }
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
    /// Its triangles.
    triangles: Bin,
    /// Numbers of the drops that say which of them to leave out.
    drops: Range<u64>,
    /// The triangles that were added.
    added: Bin,
}

/// The bins by ascending brick key.
pub struct BinWalk<'b> {
    bins: Bins<'b>,
    drops: SpoolPeek<'b, DropRecord>,
    next_drop: u64,
    added: Option<Bins<'b>>,
}

impl<'b> BinnedSoup<'b> {
    /// Walks all bins.
    #[must_use]
    pub fn walk(&self) -> BinWalk<'b> {
        BinWalk {
            bins: self.bins.bins(),
            drops: SpoolPeek::new(self.drops),
            next_drop: 0,
            added: self.added.map(|added| added.bins()),
        }
    }
}

impl BinWalk<'_> {
    /// The next bin.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn next_bin(&mut self) -> Result<Option<SoupBin>, StoreError> {
        let of_input = self.bins.peek()?;
        let of_added = match &mut self.added {
            Some(added) => added.peek()?,
            None => None,
        };
        let Some(key) = of_input.iter().chain(&of_added).copied().min() else { return Ok(None) };
        let brick = BrickKey(key);
        let mut bin =
            SoupBin { brick, triangles: Bin::none(brick), drops: 0..0, added: Bin::none(brick) };
        if of_input == Some(key)
            && let Some(triangles) = self.bins.next()?
        {
            bin.triangles = triangles;
            let first = self.next_drop;
            self.next_drop += self.drops.skip_while(|drop| drop.brick == key)?;
            bin.drops = first..self.next_drop;
        }
        if of_added == Some(key)
            && let Some(walk) = &mut self.added
            && let Some(added) = walk.next()?
        {
            bin.added = added;
        }
        Ok(Some(bin))
    }
}

impl SoupBin {
    /// How many triangles lie in it, with those that do not count.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.triangles.count + self.added.count
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
        let Range { start, end } = self.drops;
        let mut drops = SpoolPeek::range(soup.drops, start, end - start);
        soup.bins.each_block(&self.triangles, resident, |block| {
            for triangle in block {
                // Both lists ascend by source number.
                if drops.peek()?.is_some_and(|drop| drop.source == triangle.source) {
                    drops.next()?;
                    continue;
                }
                visit(triangle)?;
            }
            Ok(())
        })?;
        let Some(added) = soup.added else { return Ok(()) };
        added.each_block(&self.added, resident, |block| block.iter().try_for_each(&mut visit))
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
) -> Result<(SoupSpool, Spool<BinEntry>), StoreError> {
    let mut triangles = SoupWriter::create(resources.scratch, triangles)?;
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
