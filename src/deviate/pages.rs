//! Groups of records, through a few pages where they lie on disk.

use crate::deviate::tree::GROUP;
use crate::deviate::triangles::Blocks;
use crate::store::StoreError;

/// Records of a page, some groups.
pub(crate) const PAGE: u64 = 8 * GROUP;

/// A reader of groups; each worker has its own.
pub(crate) struct Pages<'s, B: Blocks> {
    records: &'s B,
    /// Number of a page, and its records, at the number's place modulo their count.
    slots: Vec<(u64, Vec<B::Record>)>,
    room: Vec<B::Record>,
}

impl<'s, B: Blocks> Pages<'s, B> {
    /// A reader that holds about `share_bytes`, one page at least.
    pub(crate) fn new(records: &'s B, share_bytes: u64) -> Self {
        let pages = records.len().div_ceil(PAGE);
        let most = (share_bytes / (PAGE * size_of::<B::Record>() as u64)).clamp(1, pages.max(1));
        let count = if records.is_resident() { 0 } else { most as usize };
        Self { records, slots: vec![(u64::MAX, Vec::new()); count], room: Vec::new() }
    }

    /// The `count` records from number `start` on, which lie on one page.
    #[inline]
    pub(crate) fn group(&mut self, start: u32, count: u32) -> Result<&[B::Record], StoreError> {
        let (start, count) = (u64::from(start), count as usize);
        if self.slots.is_empty() {
            return self.records.block(start, count, &mut self.room);
        }
        let page = start / PAGE;
        let slot = (page % self.slots.len() as u64) as usize;
        if self.slots[slot].0 != page {
            let records = &mut self.slots[slot].1;
            records.clear();
            let end = (page * PAGE + PAGE).min(self.records.len());
            let mut at = page * PAGE;
            while at < end {
                let block = self.records.block(at, (end - at) as usize, &mut self.room)?;
                records.extend_from_slice(block);
                at += block.len() as u64;
            }
            self.slots[slot].0 = page;
        }
        let records = &self.slots[slot].1;
        let from = (start - page * PAGE) as usize;
        Ok(&records[from..from + count])
    }
}
