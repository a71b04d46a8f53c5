//! Spools: fixed records in file order, written once and read back in ranges.
//!
//! Memory: one block for a writer, one block for a reader.

use std::fs::{File, OpenOptions};
use std::marker::PhantomData;

use bytemuck::Pod;

use crate::store::{FORMAT_VERSION, Scratch, StoreError};

const MAGIC: [u8; 8] = *b"BRMDSPOL";
const HEADER_BYTES: u64 = 64;
const BLOCK_BYTES: usize = 128 << 10;

/// Appends records to a spool.
pub struct SpoolWriter<R: Pod> {
    scratch: Scratch,
    file: File,
    block: Vec<R>,
    len: u64,
}

impl<R: Pod> SpoolWriter<R> {
    /// Starts the spool `name`, replacing an older one.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let path = scratch.path(name);
        let opened =
            OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&path);
        let file = opened.map_err(|e| StoreError::io("create", &path, e))?;
        let block = Vec::with_capacity(BLOCK_BYTES / size_of::<R>());
        Ok(Self { scratch: scratch.clone(), file, block, len: 0 })
    }

    /// Appends a record.
    ///
    /// # Errors
    /// The disk is full.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        self.block.push(record);
        self.len += 1;
        if self.block.len() == self.block.capacity() { self.flush() } else { Ok(()) }
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
        let first = self.len - self.block.len() as u64;
        let offset = HEADER_BYTES + first * size_of::<R>() as u64;
        self.scratch.write_at(&self.file, bytemuck::cast_slice(&self.block), offset)?;
        self.block.clear();
        Ok(())
    }

    /// Completes the spool.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(mut self) -> Result<Spool<R>, StoreError> {
        self.flush()?;
        let mut header = [0; HEADER_BYTES as usize];
        header[..8].copy_from_slice(&MAGIC);
        header[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
        header[12..16].copy_from_slice(&(size_of::<R>() as u32).to_le_bytes());
        header[16..24].copy_from_slice(&self.len.to_le_bytes());
        self.scratch.write_at(&self.file, &header, 0)?;
        Ok(Spool { scratch: self.scratch, file: self.file, len: self.len, records: PhantomData })
    }
}

/// A finished spool. Shared freely between threads.
pub struct Spool<R: Pod> {
    scratch: Scratch,
    file: File,
    len: u64,
    records: PhantomData<R>,
}

impl<R: Pod> Spool<R> {
    /// Opens a spool that an earlier run finished.
    ///
    /// # Errors
    /// It is missing, cut short, or of another version or record size.
    pub fn open(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let path = scratch.path(name);
        let file = File::open(&path).map_err(|e| StoreError::io("open", &path, e))?;
        let mut header = [0; HEADER_BYTES as usize];
        scratch.read_at(&file, &mut header, 0)?;
        let mut expected = [0; 16];
        expected[..8].copy_from_slice(&MAGIC);
        expected[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
        expected[12..].copy_from_slice(&(size_of::<R>() as u32).to_le_bytes());
        let mut len = [0; 8];
        len.copy_from_slice(&header[16..24]);
        let len = u64::from_le_bytes(len);
        let there = file.metadata().map_err(|e| StoreError::io("stat", &path, e))?.len();
        let whole = len.checked_mul(size_of::<R>() as u64).map(|bytes| bytes + HEADER_BYTES);
        if header[..16] != expected || whole != Some(there) {
            return Err(StoreError::Damaged {
                path,
                offset: 0,
                expected: format!("a spool of {} byte records", size_of::<R>()),
                found: format!("{:02x?} in {there} bytes", &header[..24]),
            });
        }
        Ok(Self { scratch: scratch.clone(), file, len, records: PhantomData })
    }

    /// The number of records.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Replaces `records` by those from `first` on, at most `count` of them.
    ///
    /// # Errors
    /// The disk fails.
    pub fn read(&self, first: u64, count: usize, records: &mut Vec<R>) -> Result<(), StoreError> {
        let count = (self.len.saturating_sub(first)).min(count as u64) as usize;
        records.resize(count, R::zeroed());
        let offset = HEADER_BYTES + first * size_of::<R>() as u64;
        self.scratch.read_at(&self.file, bytemuck::cast_slice_mut(records), offset)
    }

    /// Reads the records `first..first + count` block by block.
    #[must_use]
    pub fn reader(&self, first: u64, count: u64) -> SpoolReader<'_, R> {
        let end = (first + count).min(self.len);
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
    /// The next records, `None` at the end.
    ///
    /// # Errors
    /// The disk fails.
    pub fn next_block(&mut self) -> Result<Option<&[R]>, StoreError> {
        let count = (self.end - self.next).min((BLOCK_BYTES / size_of::<R>()) as u64);
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

    #[test]
    fn a_spool_reads_back_in_ranges_and_reopens() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut writer = SpoolWriter::<[u32; 5]>::create(&scratch, "spool").expect("create works");
        for i in 0..30_000 {
            writer.push([i, 1, 2, 3, i * 2]).expect("push works");
        }
        drop(writer.finish().expect("finish works"));
        let spool = Spool::<[u32; 5]>::open(&scratch, "spool").expect("open works");
        let mut reader = spool.reader(9_000, 20_000);
        let mut expected = 9_000;
        while let Some(block) = reader.next_block().expect("read works") {
            for record in block {
                assert_eq!(*record, [expected, 1, 2, 3, expected * 2]);
                expected += 1;
            }
        }
        assert_eq!(expected, 29_000);
        assert!(Spool::<[u32; 4]>::open(&scratch, "spool").is_err());
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
}
