//! Brick files: variable records under ascending keys, read through windows of the file.
//!
//! In:         one byte record per brick, keys ascending.
//! Out:        the same records by number or by key; each is checked against its hash once.
//! Invariant:  a record never crosses a window unless it is larger than one, and starts at a
//!             multiple of 16 bytes, as rkyv archives need it.
//! Memory:     the directory (40 bytes a record), and at most `cached_windows` windows besides
//!             those that a [`View`] holds.
//! Fails:      [`StoreError::Damaged`] when the bytes are not those that were written.

use std::collections::HashMap;
use std::ops::Deref;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use memmap2::{Mmap, MmapMut};
use rkyv::util::AlignedVec;

use crate::store::mapped::MappedFile;
use crate::store::{FORMAT_VERSION, Scratch, StoreError};

/// Records start at multiples of this.
const ALIGN_BYTES: u64 = 16;
/// Room of the file header; see docs/format.md.
const HEADER_BYTES: u64 = 64;
const MAGIC: [u8; 8] = *b"BRMDBRIK";
/// Window of a mapped brick file. A multiple of every page size in use.
const WINDOW_BYTES: u64 = 256 << 10;

/// Where the bytes of a brick file lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backing {
    /// In a memory-mapped scratch file.
    Mapped,
    /// In memory; for tests and for comparing.
    Memory,
}

/// One record of a brick file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct DirectoryEntry {
    /// The caller's key, ascending in the file.
    pub key: u64,
    /// Where the record starts.
    pub offset: u64,
    /// Its length.
    pub len_bytes: u32,
    /// The caller's flags.
    pub flags: u32,
    /// The first half of the record's blake3 hash.
    pub hash: [u8; 16],
}

fn hash_of(bytes: &[u8]) -> [u8; 16] {
    let mut half = [0; 16];
    half.copy_from_slice(&blake3::hash(bytes).as_bytes()[..16]);
    half
}

/// Writes a brick file, record by record.
pub struct BrickWriter {
    scratch: Scratch,
    name: String,
    directory: Vec<DirectoryEntry>,
    target: Target,
}

enum Target {
    Mapped { file: MappedFile, window: Option<MmapMut>, window_start: u64, end: u64 },
    Memory(Vec<Arc<AlignedVec>>),
}

impl BrickWriter {
    /// Starts the brick file `name` in the scratch folder, or in memory.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str, backing: Backing) -> Result<Self, StoreError> {
        let target = match backing {
            Backing::Memory => Target::Memory(Vec::new()),
            Backing::Mapped => {
                let file = MappedFile::create(&scratch.path(name))?;
                let mut window = file.map_new(0, WINDOW_BYTES as usize)?;
                window[..8].copy_from_slice(&MAGIC);
                window[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
                window[12..16].copy_from_slice(&(WINDOW_BYTES as u32).to_le_bytes());
                Target::Mapped { file, window: Some(window), window_start: 0, end: HEADER_BYTES }
            }
        };
        let (scratch, name) = (scratch.clone(), name.to_owned());
        Ok(Self { scratch, name, directory: Vec::new(), target })
    }

    /// Appends the record of `key`, which is above all earlier keys.
    ///
    /// # Errors
    /// The disk is full.
    pub fn append(&mut self, key: u64, flags: u32, bytes: &[u8]) -> Result<(), StoreError> {
        let ascending = self.directory.last().is_none_or(|last| last.key < key);
        assert!(ascending, "brick keys ascend, {key} does not");
        let len_bytes = u32::try_from(bytes.len()).map_err(|_| StoreError::TooMany {
            what: "Bytes in a brick",
            limit: u32::MAX.into(),
        })?;
        let offset = match &mut self.target {
            Target::Memory(records) => {
                let mut record = AlignedVec::with_capacity(bytes.len());
                record.extend_from_slice(bytes);
                records.push(Arc::new(record));
                records.len() as u64 - 1
            }
            Target::Mapped { file, window, window_start, end } => {
                let mut offset = end.next_multiple_of(ALIGN_BYTES);
                let len = bytes.len() as u64;
                let capacity = window.as_ref().map_or(0, |w| w.len() as u64);
                if offset + len > *window_start + capacity {
                    offset = end.next_multiple_of(WINDOW_BYTES);
                    let span = len.max(1).next_multiple_of(WINDOW_BYTES);
                    *window = None;
                    *window = Some(file.map_new(offset, span as usize)?);
                    *window_start = offset;
                }
                let at = (offset - *window_start) as usize;
                let map = window.as_mut().expect("a window covers the record");
                map[at..at + bytes.len()].copy_from_slice(bytes);
                *end = offset + len;
                offset
            }
        };
        self.scratch.count_written(bytes.len() as u64);
        let hash = hash_of(bytes);
        self.directory.push(DirectoryEntry { key, offset, len_bytes, flags, hash });
        Ok(())
    }

    /// Ends the file and opens it for reading with at most `cached_windows` windows kept mapped.
    ///
    /// # Errors
    /// The directory cannot be written.
    pub fn finish(self, cached_windows: usize) -> Result<BrickFile, StoreError> {
        let bytes = match self.target {
            Target::Memory(records) => Bytes::Memory(records),
            Target::Mapped { file, window, .. } => {
                drop(window);
                let path = self.scratch.path(&format!("{}.directory", self.name));
                let entries: &[u8] = bytemuck::cast_slice(&self.directory);
                std::fs::write(&path, entries).map_err(|e| StoreError::io("write", &path, e))?;
                self.scratch.count_written(entries.len() as u64);
                Bytes::mapped(file, cached_windows)
            }
        };
        Ok(BrickFile::new(self.scratch, self.directory, bytes))
    }
}

/// A finished brick file. Shared freely between threads.
pub struct BrickFile {
    scratch: Scratch,
    directory: Vec<DirectoryEntry>,
    checked: Vec<AtomicU64>,
    bytes: Bytes,
}

enum Bytes {
    Mapped { file: MappedFile, cache: Mutex<WindowCache> },
    Memory(Vec<Arc<AlignedVec>>),
}

impl Bytes {
    fn mapped(file: MappedFile, capacity: usize) -> Self {
        let cache = WindowCache { windows: HashMap::new(), clock: 0, capacity: capacity.max(1) };
        Self::Mapped { file, cache: Mutex::new(cache) }
    }
}

struct WindowCache {
    windows: HashMap<u64, (Arc<Mmap>, u64)>,
    clock: u64,
    capacity: usize,
}

impl BrickFile {
    fn new(scratch: Scratch, directory: Vec<DirectoryEntry>, bytes: Bytes) -> Self {
        let checked = (0..directory.len().div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        Self { scratch, directory, checked, bytes }
    }

    /// Opens a brick file that an earlier run finished.
    ///
    /// # Errors
    /// The file or its directory is missing, of another version, or not a whole number of entries.
    pub fn open(scratch: &Scratch, name: &str, cached_windows: usize) -> Result<Self, StoreError> {
        let path = scratch.path(&format!("{name}.directory"));
        let entries = std::fs::read(&path).map_err(|e| StoreError::io("read", &path, e))?;
        scratch.count_read(entries.len() as u64);
        let entry_bytes = size_of::<DirectoryEntry>();
        if entries.len() % entry_bytes != 0 {
            return Err(damaged(path, 0, "whole directory entries", "a fraction of one"));
        }
        let directory =
            entries.chunks_exact(entry_bytes).map(bytemuck::pod_read_unaligned).collect();
        let file = MappedFile::open(&scratch.path(name))?;
        let header = file.map(0, HEADER_BYTES as usize)?;
        let expected = [&MAGIC[..], &FORMAT_VERSION.to_le_bytes()].concat();
        if header[..12] != expected[..] {
            let found = format!("{:02x?}", &header[..12]);
            return Err(damaged(
                file.path().to_path_buf(),
                0,
                "a brick file of this version",
                &found,
            ));
        }
        Ok(Self::new(scratch.clone(), directory, Bytes::mapped(file, cached_windows)))
    }

    /// The number of records.
    #[must_use]
    pub fn len(&self) -> usize {
        self.directory.len()
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.directory.is_empty()
    }

    /// Keys, lengths and flags, by ascending key.
    #[must_use]
    pub fn directory(&self) -> &[DirectoryEntry] {
        &self.directory
    }

    /// The number of the record with `key`.
    #[must_use]
    pub fn find(&self, key: u64) -> Option<usize> {
        self.directory.binary_search_by_key(&key, |entry| entry.key).ok()
    }

    /// The bytes of record `number`, checked against its hash when touched for the first time.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when they are not what was written; or the map is refused.
    pub fn view(&self, number: usize) -> Result<View, StoreError> {
        let entry = self.directory[number];
        let view = match &self.bytes {
            Bytes::Memory(records) => View {
                holder: Holder::Memory(Arc::clone(&records[number])),
                at: 0,
                len: entry.len_bytes as usize,
            },
            Bytes::Mapped { file, cache } => {
                let start = entry.offset / WINDOW_BYTES * WINDOW_BYTES;
                let at = (entry.offset - start) as usize;
                let span = (at as u64 + u64::from(entry.len_bytes)).next_multiple_of(WINDOW_BYTES);
                let map = self.window(file, cache, start, span)?;
                View { holder: Holder::Mapped(map), at, len: entry.len_bytes as usize }
            }
        };
        self.check(number, &view)?;
        Ok(view)
    }

    fn window(
        &self,
        file: &MappedFile,
        cache: &Mutex<WindowCache>,
        start: u64,
        span: u64,
    ) -> Result<Arc<Mmap>, StoreError> {
        let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.clock += 1;
        let now = cache.clock;
        if let Some((map, used)) = cache.windows.get_mut(&start) {
            *used = now;
            return Ok(Arc::clone(map));
        }
        if cache.windows.len() >= cache.capacity {
            let oldest = cache.windows.iter().min_by_key(|(_, (_, used))| *used);
            let oldest = oldest.map(|(start, _)| *start);
            oldest.and_then(|start| cache.windows.remove(&start));
        }
        let map = Arc::new(file.map(start, span as usize)?);
        self.scratch.count_read(span);
        cache.windows.insert(start, (Arc::clone(&map), now));
        Ok(map)
    }

    fn check(&self, number: usize, bytes: &[u8]) -> Result<(), StoreError> {
        let bit = 1 << (number % 64);
        if self.checked[number / 64].load(Ordering::Relaxed) & bit != 0 {
            return Ok(());
        }
        let entry = self.directory[number];
        let found = hash_of(bytes);
        if found != entry.hash {
            let path = match &self.bytes {
                Bytes::Mapped { file, .. } => file.path().to_path_buf(),
                Bytes::Memory(_) => self.scratch.folder().to_path_buf(),
            };
            let expected = format!("hash {:02x?} of brick {:#x}", entry.hash, entry.key);
            return Err(damaged(path, entry.offset, &expected, &format!("{found:02x?}")));
        }
        self.checked[number / 64].fetch_or(bit, Ordering::Relaxed);
        Ok(())
    }
}

fn damaged(path: PathBuf, offset: u64, expected: &str, found: &str) -> StoreError {
    StoreError::Damaged { path, offset, expected: expected.to_owned(), found: found.to_owned() }
}

/// The bytes of one record; keeps its window mapped.
#[derive(Clone)]
pub struct View {
    holder: Holder,
    at: usize,
    len: usize,
}

#[derive(Clone)]
enum Holder {
    Mapped(Arc<Mmap>),
    Memory(Arc<AlignedVec>),
}

impl Deref for View {
    type Target = [u8];
    fn deref(&self) -> &[u8] {
        let all: &[u8] = match &self.holder {
            Holder::Mapped(map) => map,
            Holder::Memory(record) => record,
        };
        &all[self.at..self.at + self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::FileExt;

    fn record(key: u64) -> Vec<u8> {
        let len = if key.is_multiple_of(97) { 300_000 } else { (key * 7919 % 9000) as usize };
        (0..len).map(|i| (i as u64 * 31 + key) as u8).collect()
    }

    fn written(scratch: &Scratch, backing: Backing) -> BrickFile {
        let mut writer = BrickWriter::create(scratch, "bricks", backing).expect("create works");
        for key in 1..400 {
            writer.append(key * 3, key as u32, &record(key)).expect("append works");
        }
        writer.finish(4).expect("finish works")
    }

    fn check_reads_back(file: &BrickFile) {
        assert_eq!(file.len(), 399);
        for key in (1..400).rev() {
            let number = file.find(key * 3).expect("the key is there");
            let view = file.view(number).expect("the record is whole");
            assert_eq!(view[..], record(key)[..]);
            assert_eq!(view.as_ptr() as usize % 16, 0);
        }
        assert_eq!(file.find(4), None);
    }

    #[test]
    fn records_read_back_from_memory() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        check_reads_back(&written(&Scratch::new(folder.path()), Backing::Memory));
    }

    #[test]
    fn records_read_back_from_mapped_windows_and_after_reopening() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        check_reads_back(&written(&scratch, Backing::Mapped));
        check_reads_back(&BrickFile::open(&scratch, "bricks", 2).expect("open works"));
    }

    #[test]
    fn a_flipped_bit_is_found_at_first_touch() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let offset = written(&scratch, Backing::Mapped).directory()[20].offset + 5;
        let file = std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(scratch.path("bricks"))
            .expect("the file is there");
        let mut byte = [0];
        file.read_exact_at(&mut byte, offset).expect("read works");
        file.write_all_at(&[byte[0] ^ 4], offset).expect("write works");
        let bricks = BrickFile::open(&scratch, "bricks", 2).expect("open works");
        assert!(bricks.view(19).is_ok());
        assert!(matches!(bricks.view(20), Err(StoreError::Damaged { .. })));
    }
}
