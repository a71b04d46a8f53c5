//! Groups of records of a sequence, through a few pages where it lies on disk.

use bytemuck::Pod;

use crate::deviate::tree::GROUP;
use crate::store::{Sequence, StoreError};

/// Records of a page, some groups.
pub(crate) const PAGE: u64 = 8 * GROUP;

/// A reader of groups; each worker has its own.
pub(crate) struct Pages<'s, R: Pod> {
    sequence: &'s Sequence<R>,
    /// Number of a page, and its records, at the number's place modulo their count.
    slots: Vec<(u64, Vec<R>)>,
    room: Vec<R>,
}

impl<'s, R: Pod> Pages<'s, R> {
    /// A reader that holds about `share_bytes`, one page at least.
    pub(crate) fn new(sequence: &'s Sequence<R>, share_bytes: u64) -> Self {
        let pages = sequence.len().div_ceil(PAGE);
        let most = (share_bytes / (PAGE * size_of::<R>() as u64)).clamp(1, pages.max(1));
        let count = if sequence.is_resident() { 0 } else { most as usize };
        Self { sequence, slots: vec![(u64::MAX, Vec::new()); count], room: Vec::new() }
    }

    /// The `count` records from number `start` on, which lie on one page.
    #[inline]
    pub(crate) fn group(&mut self, start: u32, count: u32) -> Result<&[R], StoreError> {
        let (start, count) = (u64::from(start), count as usize);
        if self.slots.is_empty() {
            return self.sequence.block(start, count, &mut self.room);
        }
        let page = start / PAGE;
        let slot = (page % self.slots.len() as u64) as usize;
        if self.slots[slot].0 != page {
            let records = &mut self.slots[slot].1;
            records.clear();
            let end = (page * PAGE + PAGE).min(self.sequence.len());
            let mut at = page * PAGE;
            while at < end {
                let block = self.sequence.block(at, (end - at) as usize, &mut self.room)?;
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
