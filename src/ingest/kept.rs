//! Walks bins with what does not count in each.

use std::ops::Range;

use crate::ingest::bins::{BinEntry, Bins};
use crate::ingest::duplicates::Settled;
use crate::octree::{DropRecord, SoupTriangle};
use crate::store::{SpoolPeek, StoreError};

/// The bins by ascending brick key.
pub struct KeptBins<'k> {
    entries: SpoolPeek<'k, BinEntry>,
    drops: SpoolPeek<'k, DropRecord>,
    next_drop: u64,
}

/// A bin, and the numbers of its drops.
#[derive(Clone, Debug)]
pub struct KeptBin {
    /// The bin.
    pub entry: BinEntry,
    /// Numbers of the drops that say which triangles to leave out, by source number.
    pub drops: Range<u64>,
}

impl<'k> KeptBins<'k> {
    /// All bins.
    #[must_use]
    pub fn new(bins: &'k Bins, settled: &'k Settled) -> Self {
        let (entries, drops) = (SpoolPeek::new(&bins.entries), SpoolPeek::new(&settled.drops));
        Self { entries, drops, next_drop: 0 }
    }

    /// The next bin.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn next_bin(&mut self) -> Result<Option<KeptBin>, StoreError> {
        let Some(entry) = self.entries.next()? else { return Ok(None) };
        let first = self.next_drop;
        self.next_drop += self.drops.skip_while(|drop| drop.brick == entry.brick)?;
        Ok(Some(KeptBin { entry, drops: first..self.next_drop }))
    }
}

impl KeptBin {
    /// Visits its triangles that count.
    pub(crate) fn each(
        &self,
        bins: &Bins,
        settled: &Settled,
        mut visit: impl FnMut(&SoupTriangle) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let count = self.drops.end - self.drops.start;
        let mut drops = SpoolPeek::range(&settled.drops, self.drops.start, count);
        let mut reader = bins.triangles.reader(self.entry.first, self.entry.count);
        while let Some(block) = reader.next_block()? {
            for triangle in block {
                // Both lists ascend by source number.
                if drops.peek()?.is_some_and(|drop| drop.source == triangle.source) {
                    drops.next()?;
                    continue;
                }
                visit(triangle)?;
            }
        }
        Ok(())
    }
}
