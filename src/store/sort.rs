//! External sort of fixed records: in memory while they fit the share, in merged runs beyond.
//!
//! In:         records, in any order.
//! Out:        the same records by ascending key.
//! Invariant:  keys are total (records with equal keys are interchangeable), so the result does not
//!             depend on the share.
//! Memory:     `share_bytes`, at least one page per merged run.
//! Fails:      only as [`StoreError`].
//! Source:     Knuth, The Art of Computer Programming 3, 5.4 (multiway merging).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use bytemuck::Pod;

use crate::store::{Scratch, ScratchFile, StoreError};

/// A fixed-size record with a total sort key.
pub trait Record: Pod + Send + Sync {
    /// What it is sorted by. Two records with equal keys must be interchangeable.
    type Key: Ord + Copy + Send + Sync;
    /// The record's key.
    fn key(&self) -> Self::Key;
}

/// Smallest read buffer of a run in a merge.
const PAGE_BYTES: usize = 4096;
/// Records of this size and more are sorted by their keys and moved once.
const WIDE_BYTES: usize = 64;
/// Largest read buffer of a run in a merge: more would only leave the cache.
const MERGE_BYTES: usize = 256 << 10;
/// Wide records are gathered into blocks of this size on their way to the disk.
const GATHER_BYTES: usize = 64 << 10;

/// Collects records and sorts them.
pub struct Sorter<R: Record> {
    scratch: Scratch,
    share_bytes: usize,
    buffer: Vec<R>,
    runs: Runs,
}

#[derive(Default)]
struct Runs {
    file: Option<Arc<ScratchFile>>,
    end: u64,
    extents: Vec<(u64, u64)>,
}

impl<R: Record> Sorter<R> {
    /// A sorter that keeps at most `share_bytes` in memory.
    #[must_use]
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let least = 4 * PAGE_BYTES.max(size_of::<R>());
        let share_bytes = usize::try_from(share_bytes).unwrap_or(usize::MAX).max(least);
        Self { scratch: scratch.clone(), share_bytes, buffer: Vec::new(), runs: Runs::default() }
    }

    /// Adds a record.
    ///
    /// # Errors
    /// A full buffer cannot be written.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        if self.buffer.len() == self.buffer.capacity() {
            self.make_room()?;
        }
        self.buffer.push(record);
        Ok(())
    }

    /// Adds many records.
    ///
    /// # Errors
    /// A full buffer cannot be written.
    pub fn extend(&mut self, records: &[R]) -> Result<(), StoreError> {
        let mut left = records;
        while !left.is_empty() {
            if self.buffer.len() == self.buffer.capacity() {
                self.make_room()?;
            }
            let room = self.buffer.capacity() - self.buffer.len();
            let (now, later) = left.split_at(room.min(left.len()));
            self.buffer.extend_from_slice(now);
            left = later;
        }
        Ok(())
    }

    /// Whether nothing was added.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.buffer.is_empty() && self.runs.extents.is_empty()
    }

    /// Grows the buffer up to its share, and spills it once the share is full.
    fn make_room(&mut self) -> Result<(), StoreError> {
        let order_bytes = if is_wide::<R>() { size_of::<(R::Key, u32)>() } else { 0 };
        let most = (self.share_bytes / (size_of::<R>() + order_bytes)).min(u32::MAX as usize);
        let now = self.buffer.capacity();
        if now < most {
            // Growth by doubling would hold old and new at once: near the end it goes in one step.
            let next = if now * 4 >= most { most } else { (now * 2).max(64).min(most) };
            self.buffer.reserve_exact(next - self.buffer.len());
            return Ok(());
        }
        self.spill()
    }

    fn spill(&mut self) -> Result<(), StoreError> {
        if is_wide::<R>() {
            self.spill_gathered()?;
        } else {
            self.buffer.sort_unstable_by_key(Record::key);
            let start = self.runs.end;
            self.runs.write(&self.scratch, bytemuck::cast_slice(&self.buffer))?;
            self.runs.extents.push((start, self.buffer.len() as u64));
        }
        self.buffer.clear();
        self.scratch.count_spill();
        Ok(())
    }

    /// Writes the records in order, gathered block by block.
    fn spill_gathered(&mut self) -> Result<(), StoreError> {
        let start = self.runs.end;
        let mut block = Vec::with_capacity(GATHER_BYTES / size_of::<R>());
        for (_, at) in order_of(&self.buffer) {
            block.push(self.buffer[at as usize]);
            if block.len() == block.capacity() {
                self.runs.write(&self.scratch, bytemuck::cast_slice(&block))?;
                block.clear();
            }
        }
        self.runs.write(&self.scratch, bytemuck::cast_slice(&block))?;
        self.runs.extents.push((start, self.buffer.len() as u64));
        Ok(())
    }

    /// Ends the input and starts the sorted stream.
    ///
    /// # Errors
    /// Runs cannot be written or read.
    pub fn finish(mut self) -> Result<Sorted<R>, StoreError> {
        if self.runs.extents.is_empty() {
            if is_wide::<R>() {
                let order = order_of(&self.buffer).into_iter();
                return Ok(Sorted { source: SortedSource::Ordered(self.buffer, order) });
            }
            self.buffer.sort_unstable_by_key(Record::key);
            return Ok(Sorted { source: SortedSource::Memory(self.buffer.into_iter()) });
        }
        if !self.buffer.is_empty() {
            self.spill()?;
        }
        self.buffer = Vec::new();
        let fan_in = (self.share_bytes / PAGE_BYTES.max(size_of::<R>())).max(2);
        while self.runs.extents.len() > fan_in {
            self.cascade(fan_in)?;
        }
        let merge = Merge::new(self.runs, self.share_bytes)?;
        Ok(Sorted { source: SortedSource::Merge(Box::new(merge)) })
    }

    /// Merges groups of `fan_in` runs into longer runs, in a new file.
    fn cascade(&mut self, fan_in: usize) -> Result<(), StoreError> {
        let old = std::mem::take(&mut self.runs);
        for group in old.extents.chunks(fan_in - 1) {
            let part = Runs { file: old.file.clone(), end: old.end, extents: group.to_vec() };
            let mut merge = Merge::<R>::new(part, self.share_bytes)?;
            let start = self.runs.end;
            let mut count = 0;
            let mut block: Vec<R> = Vec::with_capacity(PAGE_BYTES.div_ceil(size_of::<R>()));
            while let Some(record) = merge.next()? {
                block.push(record);
                count += 1;
                if block.len() == block.capacity() {
                    self.runs.write(&self.scratch, bytemuck::cast_slice(&block))?;
                    block.clear();
                }
            }
            self.runs.write(&self.scratch, bytemuck::cast_slice(&block))?;
            self.runs.extents.push((start, count));
        }
        Ok(())
    }
}

/// Whether records are moved once, by an order of their keys.
const fn is_wide<R>() -> bool {
    size_of::<R>() >= WIDE_BYTES
}

/// The keys of all records in order, with their places.
fn order_of<R: Record>(records: &[R]) -> Vec<(R::Key, u32)> {
    let mut order: Vec<_> = (0..).zip(records).map(|(at, record)| (record.key(), at)).collect();
    order.sort_unstable_by_key(|entry| entry.0);
    order
}

impl Runs {
    fn write(&mut self, scratch: &Scratch, bytes: &[u8]) -> Result<(), StoreError> {
        if self.file.is_none() {
            self.file = Some(Arc::new(scratch.anonymous("sort")?));
        }
        let file = self.file.as_ref().expect("the file was opened above");
        file.write_at(bytes, self.end)?;
        self.end += bytes.len() as u64;
        Ok(())
    }
}

/// Records by ascending key.
pub struct Sorted<R: Record> {
    source: SortedSource<R>,
}

enum SortedSource<R: Record> {
    Memory(std::vec::IntoIter<R>),
    Ordered(Vec<R>, std::vec::IntoIter<(R::Key, u32)>),
    Merge(Box<Merge<R>>),
}

impl<R: Record> Sorted<R> {
    /// The next record, `None` at the end.
    ///
    /// # Errors
    /// A run cannot be read.
    #[inline]
    #[expect(clippy::should_implement_trait, reason = "an iterator could not fail in the open")]
    pub fn next(&mut self) -> Result<Option<R>, StoreError> {
        match &mut self.source {
            SortedSource::Memory(records) => Ok(records.next()),
            SortedSource::Ordered(records, order) => {
                Ok(order.next().map(|(_, at)| records[at as usize]))
            }
            SortedSource::Merge(merge) => merge.next(),
        }
    }
}

struct Merge<R: Record> {
    file: Arc<ScratchFile>,
    cursors: Vec<Cursor<R>>,
    /// The run whose next record is the next of all.
    current: Option<usize>,
    /// The next keys of the other runs.
    heap: BinaryHeap<Reverse<(R::Key, usize)>>,
    block_records: usize,
}

struct Cursor<R> {
    offset: u64,
    left: u64,
    block: Vec<R>,
    at: usize,
}

impl<R: Record> Merge<R> {
    fn new(runs: Runs, share_bytes: usize) -> Result<Self, StoreError> {
        let file = runs.file.expect("a merge has runs");
        let block_bytes = (share_bytes / runs.extents.len()).min(MERGE_BYTES);
        let block_records = (block_bytes / size_of::<R>()).max(1);
        let cursors = runs
            .extents
            .iter()
            .map(|&(offset, left)| Cursor { offset, left, block: Vec::new(), at: 0 })
            .collect::<Vec<_>>();
        let heap = BinaryHeap::with_capacity(cursors.len());
        let mut merge = Self { file, cursors, current: None, heap, block_records };
        for run in 0..merge.cursors.len() {
            if let Some(key) = merge.head(run)? {
                merge.heap.push(Reverse((key, run)));
            }
        }
        merge.current = merge.heap.pop().map(|Reverse((_, run))| run);
        Ok(merge)
    }

    /// The key of the next record of `run`, whose next block is read when needed.
    #[inline]
    fn head(&mut self, run: usize) -> Result<Option<R::Key>, StoreError> {
        let cursor = &mut self.cursors[run];
        if cursor.at == cursor.block.len() {
            let count = (cursor.left).min(self.block_records as u64) as usize;
            if count == 0 {
                cursor.block = Vec::new();
                cursor.at = 0;
                return Ok(None);
            }
            cursor.block.resize(count, R::zeroed());
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut cursor.block);
            self.file.read_at(bytes, cursor.offset)?;
            cursor.offset += (count * size_of::<R>()) as u64;
            cursor.left -= count as u64;
            cursor.at = 0;
        }
        Ok(Some(cursor.block[cursor.at].key()))
    }

    fn next(&mut self) -> Result<Option<R>, StoreError> {
        let Some(run) = self.current else { return Ok(None) };
        let cursor = &mut self.cursors[run];
        let record = cursor.block[cursor.at];
        cursor.at += 1;
        match self.head(run)? {
            // What follows often comes from the same run: then the heap stays as it is.
            Some(key) => {
                if let Some(mut least) = self.heap.peek_mut()
                    && least.0.0 < key
                {
                    self.current = Some(least.0.1);
                    *least = Reverse((key, run));
                }
            }
            None => self.current = self.heap.pop().map(|Reverse((_, run))| run),
        }
        Ok(Some(record))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    impl Record for u64 {
        type Key = Self;
        fn key(&self) -> Self {
            *self
        }
    }

    /// A record that is sorted by its key and moved once.
    #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(C)]
    struct Wide([u64; 8]);

    impl Record for Wide {
        type Key = u64;
        fn key(&self) -> u64 {
            self.0[3]
        }
    }

    #[test]
    fn wide_records_keep_together_in_memory_and_spilled() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        for share_bytes in [16 << 10, 1 << 30] {
            let mut sorter = Sorter::new(&scratch, share_bytes);
            for i in 0..5000_u64 {
                let key = i.wrapping_mul(0x9E37_79B9_7F4A_7C15);
                sorter.push(Wide(std::array::from_fn(|k| key ^ (k as u64 ^ 3)))).expect("push");
            }
            let mut stream = sorter.finish().expect("finish");
            let mut last = 0;
            let mut count = 0;
            while let Some(Wide(words)) = stream.next().expect("next") {
                assert!(words[3] >= last);
                assert!((0..8).all(|k| words[k] == words[3] ^ (k as u64 ^ 3)));
                last = words[3];
                count += 1;
            }
            assert_eq!(count, 5000);
        }
    }

    fn sorted(values: &[u64], share_bytes: u64) -> (Vec<u64>, u64) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut sorter = Sorter::new(&scratch, share_bytes);
        sorter.extend(values).expect("pushing works");
        let mut stream = sorter.finish().expect("finishing works");
        let mut out = Vec::new();
        while let Some(value) = stream.next().expect("reading works") {
            out.push(value);
        }
        (out, scratch.spilled_runs())
    }

    #[test]
    fn a_share_of_sixteen_kib_spills_cascades_and_sorts_alike() {
        let values: Vec<u64> =
            (0..50_000_u64).map(|i| i.wrapping_mul(0x9E37_79B9_7F4A_7C15)).collect();
        let (small, spilled) = sorted(&values, 16 << 10);
        let (large, kept) = sorted(&values, 1 << 30);
        assert_eq!(small, large);
        assert!(small.is_sorted());
        assert!(spilled > 16, "more runs than can be merged at once, got {spilled}");
        assert_eq!(kept, 0);
    }

    proptest! {
        #[test]
        fn sorting_keeps_every_record(values in proptest::collection::vec(any::<u64>(), 0..5000)) {
            let mut expected = values.clone();
            expected.sort_unstable();
            prop_assert_eq!(sorted(&values, 16 << 10).0, expected);
        }
    }
}
