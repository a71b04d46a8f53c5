//! A sequence of fixed records that is written once and read in order as often as needed.
//!
//! Memory: `share_bytes`; beyond that the records lie in a scratch file.

use bytemuck::Pod;

use crate::store::{Scratch, ScratchFile, StoreError};

/// Bytes that a sequence on disk keeps back before it writes.
const BLOCK_BYTES: usize = 64 << 10;

/// Records that are read at a time.
const PEEKED: usize = 1024;

/// Records in the order in which they came.
pub struct Sequence<R: Pod> {
    scratch: Scratch,
    share_bytes: usize,
    resident: Vec<R>,
    file: Option<ScratchFile>,
    written: u64,
}

impl<R: Pod> Sequence<R> {
    /// An empty sequence that keeps at most `share_bytes` in memory.
    #[must_use]
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let share_bytes = usize::try_from(share_bytes).unwrap_or(usize::MAX).max(size_of::<R>());
        let scratch = scratch.clone();
        Self { scratch, share_bytes, resident: Vec::new(), file: None, written: 0 }
    }

    /// The number of records.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.written + self.resident.len() as u64
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether all records are in memory.
    #[must_use]
    pub fn is_resident(&self) -> bool {
        self.file.is_none()
    }

    /// Appends a record.
    ///
    /// # Errors
    /// The scratch disk fails.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        if self.resident.len() == self.resident.capacity() {
            self.make_room()?;
        }
        self.resident.push(record);
        Ok(())
    }

    /// Appends records.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn extend(&mut self, records: &[R]) -> Result<(), StoreError> {
        let mut left = records;
        while !left.is_empty() {
            if self.resident.len() == self.resident.capacity() {
                self.make_room()?;
            }
            let room = self.resident.capacity() - self.resident.len();
            let (now, later) = left.split_at(room.min(left.len()));
            self.resident.extend_from_slice(now);
            left = later;
        }
        Ok(())
    }

    fn make_room(&mut self) -> Result<(), StoreError> {
        let bytes = if self.file.is_some() { self.block_bytes() } else { self.share_bytes };
        let most = bytes / size_of::<R>();
        let now = self.resident.capacity();
        if now < most {
            let next = if now * 4 >= most { most } else { (now * 2).max(64).min(most) };
            self.resident.reserve_exact(next - self.resident.len());
            return Ok(());
        }
        self.flush()?;
        if now * size_of::<R>() > self.block_bytes() {
            let records = (self.block_bytes() / size_of::<R>()).max(1);
            self.resident = Vec::with_capacity(records);
        }
        Ok(())
    }

    fn block_bytes(&self) -> usize {
        self.share_bytes.min(BLOCK_BYTES)
    }

    fn flush(&mut self) -> Result<(), StoreError> {
        if self.file.is_none() {
            self.file = Some(self.scratch.anonymous("sequence")?);
        }
        let file = self.file.as_ref().expect("the file was opened above");
        let offset = self.written * size_of::<R>() as u64;
        file.write_at(bytemuck::cast_slice(&self.resident), offset)?;
        self.written += self.resident.len() as u64;
        self.resident.clear();
        Ok(())
    }

    /// Forgets all records.
    pub fn clear(&mut self) {
        self.resident.clear();
        self.written = 0;
    }

    /// At most `count` records from number `start` on; `buffer` is room for those on disk.
    ///
    /// Fewer come where the part on disk ends, none only at the end.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn block<'a>(
        &'a self,
        start: u64,
        count: usize,
        buffer: &'a mut Vec<R>,
    ) -> Result<&'a [R], StoreError> {
        if let (Some(file), true) = (&self.file, start < self.written) {
            let there = (self.written - start).min(count as u64) as usize;
            buffer.resize(there, R::zeroed());
            let offset = start * size_of::<R>() as u64;
            file.read_at(bytemuck::cast_slice_mut(buffer), offset)?;
            return Ok(buffer);
        }
        let from = ((start - self.written) as usize).min(self.resident.len());
        Ok(&self.resident[from..self.resident.len().min(from + count)])
    }

    /// Shows all records in order, in blocks of at most `count`.
    ///
    /// # Errors
    /// The scratch disk fails, or `visit` does.
    pub fn each_block(
        &self,
        count: usize,
        mut visit: impl FnMut(&[R]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut start = 0;
        let mut buffer = Vec::new();
        while start < self.len() {
            let block = self.block(start, count, &mut buffer)?;
            start += block.len() as u64;
            visit(block)?;
        }
        Ok(())
    }
}

/// Reads a sequence record by record.
pub struct SequencePeek<'s, R: Pod> {
    sequence: &'s Sequence<R>,
    /// Records from number `first` on, and room for others.
    block: Vec<R>,
    room: Vec<R>,
    first: u64,
    at: usize,
}

impl<'s, R: Pod> SequencePeek<'s, R> {
    /// All of `sequence`, from its first record.
    #[must_use]
    pub fn new(sequence: &'s Sequence<R>) -> Self {
        Self { sequence, block: Vec::new(), room: Vec::new(), first: 0, at: 0 }
    }

    /// The next record with its number, `None` at the end.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn peek(&mut self) -> Result<Option<(u64, R)>, StoreError> {
        if self.at == self.block.len() {
            self.first += self.block.len() as u64;
            let next = self.sequence.block(self.first, PEEKED, &mut self.room)?;
            self.block.clear();
            self.block.extend_from_slice(next);
            self.at = 0;
        }
        Ok(self.block.get(self.at).map(|record| (self.first + self.at as u64, *record)))
    }

    /// Passes over the record that [`SequencePeek::peek`] told.
    pub fn pass(&mut self) {
        self.at += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_on_disk_reads_like_one_in_memory() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        for share_bytes in [0, 100, 4096, 1 << 20] {
            let mut sequence = Sequence::<u64>::new(&scratch, share_bytes);
            (0..5000).for_each(|i| sequence.push(i).expect("push works"));
            assert_eq!(sequence.file.is_some(), share_bytes <= 4096);
            let (mut seen, mut buffer) = (Vec::new(), Vec::new());
            while (seen.len() as u64) < sequence.len() {
                let block = sequence.block(seen.len() as u64, 37, &mut buffer).expect("read works");
                assert!(!block.is_empty() && block.len() <= 37);
                seen.extend_from_slice(block);
            }
            assert_eq!(seen, (0..5000).collect::<Vec<_>>());
            let mut peek = SequencePeek::new(&sequence);
            for expected in 0..5000 {
                assert_eq!(peek.peek().expect("read works"), Some((expected, expected)));
                peek.pass();
            }
            assert_eq!(peek.peek().expect("read works"), None);
        }
    }
}
