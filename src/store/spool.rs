//! Spools: fixed records in file order, written once and read back in ranges.
//!
//! Invariant:  every block of records has a digest, and is checked when a record of it is read for
//!             the first time.
//! Memory:     one block for a writer, two for a reader; 16 bytes a block of 128 KiB.
//! Fails:      [`StoreError::Damaged`] when the bytes are not those that were written.

use std::marker::PhantomData;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Pod;

use crate::store::{
    DIGEST_BYTES, Digest, FORMAT_VERSION, FileState, Scratch, ScratchFile, StoreError, digest,
    part_digest,
};

const MAGIC: [u8; 8] = *b"BRMDSPOL";
const HEADER_BYTES: u64 = 64;
const BLOCK_BYTES: usize = 64 << 10;

/// Records that share a digest.
const fn block_records<R>() -> usize {
    BLOCK_BYTES / size_of::<R>()
}

/// Appends records to a spool.
pub struct SpoolWriter<R: Pod> {
    file: ScratchFile,
    name: String,
    block: Vec<R>,
    len: u64,
    digests: Vec<Digest>,
}

impl<R: Pod> SpoolWriter<R> {
    /// Starts the spool `name`, replacing an older one.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let block = Vec::with_capacity(block_records::<R>());
        let (file, name) = (scratch.create(name)?, name.to_owned());
        Ok(Self { file, name, block, len: 0, digests: Vec::new() })
    }

    /// Appends a record.
    ///
    /// # Errors
    /// The disk is full.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        self.block.push(record);
        self.len += 1;
        if self.block.len() == block_records::<R>() { self.flush() } else { Ok(()) }
    }

    /// The number of records so far.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether nothing was appended.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    fn flush(&mut self) -> Result<(), StoreError> {
        if self.block.is_empty() {
            return Ok(());
        }
        let first = self.len - self.block.len() as u64;
        let bytes: &[u8] = bytemuck::cast_slice(&self.block);
        self.digests.push(part_digest(bytes));
        self.file.write_at(bytes, offset_of::<R>(first))?;
        self.block.clear();
        Ok(())
    }

    /// Completes the spool.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(mut self) -> Result<Spool<R>, StoreError> {
        self.flush()?;
        let digests: &[u8] = bytemuck::cast_slice(&self.digests);
        let end = offset_of::<R>(self.len);
        self.file.write_at(digests, end)?;
        let mut header = header::<R>();
        header[16..24].copy_from_slice(&self.len.to_le_bytes());
        header[24..40].copy_from_slice(&digest(digests));
        self.file.write_at(&header, 0)?;
        let state = FileState {
            name: self.name,
            len_bytes: end + digests.len() as u64,
            records: self.len,
            root: digest(digests),
        };
        Ok(Spool::new(self.file, state, self.digests))
    }
}

fn header<R>() -> [u8; HEADER_BYTES as usize] {
    let mut header = [0; HEADER_BYTES as usize];
    header[..8].copy_from_slice(&MAGIC);
    header[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
    header[12..16].copy_from_slice(&(size_of::<R>() as u32).to_le_bytes());
    header
}

/// Where record `number` starts.
fn offset_of<R>(number: u64) -> u64 {
    HEADER_BYTES + number * size_of::<R>() as u64
}

/// A finished spool. Shared freely between threads.
pub struct Spool<R: Pod> {
    file: ScratchFile,
    state: FileState,
    digests: Vec<Digest>,
    checked: Vec<AtomicU64>,
    records: PhantomData<R>,
}

impl<R: Pod> Spool<R> {
    fn new(file: ScratchFile, state: FileState, digests: Vec<Digest>) -> Self {
        let checked = (0..digests.len().div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        Self { file, state, digests, checked, records: PhantomData }
    }

    /// Opens a spool that an earlier run finished.
    ///
    /// # Errors
    /// It is missing, cut short, of another version or record size, or not what `state` says.
    pub fn open(scratch: &Scratch, state: &FileState) -> Result<Self, StoreError> {
        let file = scratch.open(&state.name)?;
        let blocks = state.records.div_ceil(block_records::<R>() as u64);
        let there = file.len_bytes()?;
        if Self::file_bytes(state.records) != Some(there) || there != state.len_bytes {
            let expected = format!("{} records of {} bytes", state.records, size_of::<R>());
            let found = format!("{there} bytes");
            return Err(StoreError::damaged(file.path(), there, expected, found));
        }
        let mut found = [0; HEADER_BYTES as usize];
        file.read_at(&mut found, 0)?;
        let mut expected = header::<R>();
        expected[16..24].copy_from_slice(&state.records.to_le_bytes());
        expected[24..40].copy_from_slice(&state.root);
        if found != expected {
            let found = format!("{:02x?}", &found[..40]);
            return Err(StoreError::damaged(file.path(), 0, "the header of this spool", found));
        }
        let mut digests = vec![Digest::default(); blocks as usize];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut digests);
        file.read_at(bytes, offset_of::<R>(state.records))?;
        if digest(bytes) != state.root {
            let offset = offset_of::<R>(state.records);
            let expected = format!("digests with digest {:02x?}", state.root);
            return Err(StoreError::damaged(file.path(), offset, expected, "others"));
        }
        Ok(Self::new(file, state.clone(), digests))
    }

    /// The length of a spool of so many records; `None` where no file is as long.
    #[must_use]
    pub fn file_bytes(records: u64) -> Option<u64> {
        let blocks = records.div_ceil(block_records::<R>() as u64);
        let data_bytes = records.checked_mul(size_of::<R>() as u64)?;
        data_bytes.checked_add(HEADER_BYTES + blocks * DIGEST_BYTES as u64)
    }

    /// How it is found again.
    #[must_use]
    pub fn state(&self) -> &FileState {
        &self.state
    }

    /// The number of records.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.state.records
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Replaces `records` by those from `first` on, at most `count` of them.
    ///
    /// # Errors
    /// The disk fails, or the records are not those that were written.
    pub fn read(&self, first: u64, count: usize, records: &mut Vec<R>) -> Result<(), StoreError> {
        let count = (self.len().saturating_sub(first)).min(count as u64);
        records.resize(count as usize, R::zeroed());
        let per_block = block_records::<R>() as u64;
        let end = first + count;
        let mut at = first;
        while at < end {
            let block = at / per_block;
            let block_start = block * per_block;
            let block_end = (block_start + per_block).min(self.len());
            let upto = block_end.min(end);
            let part = &mut records[(at - first) as usize..(upto - first) as usize];
            let is_checked = self.is_checked(block);
            if is_checked || (at == block_start && upto == block_end) {
                self.file.read_at(bytemuck::cast_slice_mut(part), offset_of::<R>(at))?;
                if !is_checked {
                    self.check(block, bytemuck::cast_slice(part))?;
                }
            } else {
                let mut whole = vec![R::zeroed(); (block_end - block_start) as usize];
                self.file
                    .read_at(bytemuck::cast_slice_mut(&mut whole), offset_of::<R>(block_start))?;
                self.check(block, bytemuck::cast_slice(&whole))?;
                part.copy_from_slice(&whole[(at - block_start) as usize..][..part.len()]);
            }
            at = upto;
        }
        Ok(())
    }

    fn is_checked(&self, block: u64) -> bool {
        self.checked[block as usize / 64].load(Ordering::Relaxed) >> (block % 64) & 1 == 1
    }

    fn check(&self, block: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let (expected, found) = (self.digests[block as usize], part_digest(bytes));
        if found != expected {
            let offset = offset_of::<R>(block * block_records::<R>() as u64);
            let expected = format!("a block with digest {expected:02x?}");
            let found = format!("{found:02x?}");
            return Err(StoreError::damaged(self.file.path(), offset, expected, found));
        }
        self.checked[block as usize / 64].fetch_or(1 << (block % 64), Ordering::Relaxed);
        Ok(())
    }

    /// Reads the records `first..first + count` block by block.
    #[must_use]
    pub fn reader(&self, first: u64, count: u64) -> SpoolReader<'_, R> {
        let end = (first + count).min(self.len());
        SpoolReader { spool: self, next: first, end, block: Vec::new() }
    }
}

/// Reads a range of a spool block by block.
pub struct SpoolReader<'s, R: Pod> {
    spool: &'s Spool<R>,
    next: u64,
    end: u64,
    block: Vec<R>,
}

impl<R: Pod> SpoolReader<'_, R> {
    /// Goes on with the records `first..first + count`.
    pub fn turn_to(&mut self, first: u64, count: u64) {
        self.next = first;
        self.end = (first + count).min(self.spool.len());
    }

    /// The next records, `None` at the end.
    ///
    /// # Errors
    /// The disk fails.
    pub fn next_block(&mut self) -> Result<Option<&[R]>, StoreError> {
        // Up to the end of a block: then whole blocks follow, which are read and checked at once.
        let per_block = block_records::<R>() as u64;
        let count = (self.end - self.next).min(per_block - self.next % per_block);
        if count == 0 {
            return Ok(None);
        }
        self.spool.read(self.next, count as usize, &mut self.block)?;
        self.next += count;
        Ok(Some(&self.block))
    }
}

/// Reads a range of a spool record by record, with a look at the next one.
pub struct SpoolPeek<'s, R: Pod> {
    reader: SpoolReader<'s, R>,
    at: usize,
}

impl<'s, R: Pod> SpoolPeek<'s, R> {
    /// All of `spool`, from its first record.
    #[must_use]
    pub fn new(spool: &'s Spool<R>) -> Self {
        Self::range(spool, 0, spool.len())
    }

    /// The records `first..first + count` of `spool`.
    #[must_use]
    pub fn range(spool: &'s Spool<R>, first: u64, count: u64) -> Self {
        Self { reader: spool.reader(first, count), at: 0 }
    }

    /// The next record, `None` at the end.
    ///
    /// # Errors
    /// The disk fails.
    pub fn peek(&mut self) -> Result<Option<R>, StoreError> {
        if self.at == self.reader.block.len() {
            self.at = 0;
            if self.reader.next_block()?.is_none() {
                self.reader.block.clear();
            }
        }
        Ok(self.reader.block.get(self.at).copied())
    }

    /// Passes over the records before `number`, counted from the first of the spool.
    pub fn pass_to(&mut self, number: u64) {
        let first = self.reader.next - self.reader.block.len() as u64;
        if number < self.reader.next {
            self.at = self.at.max(number.saturating_sub(first) as usize);
        } else {
            self.reader.next = number.min(self.reader.end);
            self.reader.block.clear();
            self.at = 0;
        }
    }

    /// Takes the next record, `None` at the end.
    ///
    /// # Errors
    /// The disk fails.
    #[expect(clippy::should_implement_trait, reason = "an iterator could not fail in the open")]
    pub fn next(&mut self) -> Result<Option<R>, StoreError> {
        let record = self.peek()?;
        self.at += usize::from(record.is_some());
        Ok(record)
    }

    /// Passes over the records that come next and satisfy `belongs`; how many there were.
    ///
    /// # Errors
    /// The disk fails.
    pub fn skip_while(&mut self, belongs: impl Fn(&R) -> bool) -> Result<u64, StoreError> {
        let mut skipped = 0;
        while self.peek()?.as_ref().is_some_and(&belongs) {
            self.at += 1;
            skipped += 1;
        }
        Ok(skipped)
    }

    /// Takes the records that come next and satisfy `belongs`, as `value` of each.
    ///
    /// # Errors
    /// The disk fails.
    pub fn take_while<V>(
        &mut self,
        belongs: impl Fn(&R) -> bool,
        value: impl Fn(R) -> V,
    ) -> Result<Vec<V>, StoreError> {
        let mut taken = Vec::new();
        while let Some(record) = self.peek()?.filter(&belongs) {
            taken.push(value(record));
            self.at += 1;
        }
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::FileExt;

    fn written(scratch: &Scratch, records: u32) -> Spool<[u32; 4]> {
        let mut writer = SpoolWriter::create(scratch, "spool").expect("create works");
        for i in 0..records {
            writer.push([i, 1, 2, 3]).expect("push works");
        }
        writer.finish().expect("finish works")
    }

    #[test]
    fn a_spool_reads_back_in_ranges_and_reopens() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        for records in [0, 1, 8192, 8193, 30_000] {
            let state = written(&scratch, records).state().clone();
            let spool = Spool::<[u32; 4]>::open(&scratch, &state).expect("open works");
            for (first, count) in [(records / 3, records / 2), (0, records), (records, 1)] {
                let mut reader = spool.reader(first.into(), count.into());
                let mut expected = first;
                while let Some(block) = reader.next_block().expect("read works") {
                    for record in block {
                        assert_eq!(*record, [expected, 1, 2, 3]);
                        expected += 1;
                    }
                }
                assert_eq!(expected, (first + count).min(records));
            }
            assert!(Spool::<[u32; 2]>::open(&scratch, &state).is_err());
        }
    }

    #[test]
    fn every_byte_that_lies_is_found() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let state = written(&scratch, 20_000).state().clone();
        let path = scratch.path("spool");
        let whole = std::fs::read(&path).expect("the file is there");
        let read_all = || -> Result<(), StoreError> {
            let spool = Spool::<[u32; 4]>::open(&scratch, &state)?;
            let mut records = Vec::new();
            // Small ranges, in an odd order.
            for first in (0..20_000).rev().step_by(100) {
                spool.read(first, 100, &mut records)?;
            }
            Ok(())
        };
        read_all().expect("all is well");
        for at in (0..whole.len()).step_by(997).chain(0..40).chain(whole.len() - 48..whole.len()) {
            let file = std::fs::OpenOptions::new().write(true).open(&path).expect("there");
            file.write_all_at(&[whole[at] ^ 16], at as u64).expect("writable");
            assert!(matches!(read_all(), Err(StoreError::Damaged { .. })), "byte {at}");
            file.write_all_at(&[whole[at]], at as u64).expect("writable");
        }
        for len in [0, 63, 64, 4096, whole.len() - 1] {
            std::fs::write(&path, &whole[..len]).expect("writable");
            assert!(matches!(read_all(), Err(StoreError::Damaged { .. })), "cut at {len}");
        }
    }

    #[test]
    fn groups_are_taken_whole_across_blocks() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut writer = SpoolWriter::<[u32; 2]>::create(&scratch, "groups").expect("create works");
        for i in 0..40_000 {
            writer.push([i / 7000, i]).expect("push works");
        }
        let spool = writer.finish().expect("finish works");
        let mut peek = SpoolPeek::new(&spool);
        let mut next = 0;
        while let Some([group, _]) = peek.peek().expect("read works") {
            let taken = peek.take_while(|r| r[0] == group, |r| r[1]).expect("read works");
            assert!(taken.iter().copied().eq(next..next + taken.len() as u32));
            next += taken.len() as u32;
        }
        assert_eq!(next, 40_000);
    }

    #[test]
    fn records_are_passed_over_within_blocks_and_across_them() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let spool = written(&scratch, 30_000);
        let mut peek = SpoolPeek::new(&spool);
        for number in [0, 3, 3, 8191, 8192, 8200, 25_000, 29_999] {
            peek.pass_to(number);
            let found = peek.peek().expect("read works").map(|record| record[0]);
            assert_eq!(found, Some(number as u32));
        }
        peek.pass_to(30_000);
        assert_eq!(peek.peek().expect("read works"), None);
    }
}
