//! Reads the records of a brick file through cached windows; each is checked once.

use std::collections::HashMap;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use memmap2::Mmap;
use rkyv::util::AlignedVec;

use crate::store::brick::layout::{
    DirectoryEntry, MAGIC, WINDOW_BYTES, check_header, read_directory,
};
use crate::store::mapped::map;
use crate::store::{FileState, Scratch, ScratchFile, StoreError, part_digest};

/// A finished brick file. Shared freely between threads.
pub struct BrickFile {
    scratch: Scratch,
    state: Option<FileState>,
    directory: Vec<DirectoryEntry>,
    checked: Vec<AtomicU64>,
    /// All windows that have records.
    records_bytes: u64,
    bytes: Bytes,
}

pub(crate) enum Bytes {
    Mapped { file: Box<ScratchFile>, cache: Mutex<WindowCache> },
    Memory(Vec<Arc<AlignedVec>>),
}

impl Bytes {
    pub(crate) fn mapped(file: ScratchFile, capacity: usize) -> Self {
        let most_bytes = capacity.max(1) as u64 * WINDOW_BYTES;
        let at_once_bytes = (capacity as u64 / FEWEST_MAPS).clamp(1, MOST_AT_ONCE) * WINDOW_BYTES;
        let windows = HashMap::new();
        let cache = WindowCache { windows, clock: 0, held_bytes: 0, most_bytes, at_once_bytes };
        Self::Mapped { file: Box::new(file), cache: Mutex::new(cache) }
    }
}

/// Windows that are mapped at once where there is room: each map that is let go interrupts all threads.
const MOST_AT_ONCE: u64 = 4;
/// As long as so many maps have room.
const FEWEST_MAPS: u64 = 8;

pub(crate) struct WindowCache {
    windows: HashMap<u64, (Arc<Mmap>, u64)>,
    clock: u64,
    held_bytes: u64,
    most_bytes: u64,
    at_once_bytes: u64,
}

impl WindowCache {
    /// Takes out the windows that were used longest ago, until `span` fits beside the others.
    fn make_room(&mut self, span: u64) -> Vec<Arc<Mmap>> {
        let mut gone = Vec::new();
        while self.held_bytes + span > self.most_bytes {
            let oldest = self.windows.iter().min_by_key(|(_, (_, used))| *used);
            let Some(start) = oldest.map(|(start, _)| *start) else { break };
            if let Some((window, _)) = self.windows.remove(&start) {
                self.held_bytes -= window.len() as u64;
                gone.push(window);
            }
        }
        gone
    }

    /// Where the map begins that has a record, and its length. One that is larger than a window has a map of
    /// its own.
    fn span_of(&self, entry: &DirectoryEntry, file_bytes: u64) -> (u64, u64) {
        let start = entry.offset / self.at_once_bytes * self.at_once_bytes;
        let end = entry.offset + u64::from(entry.len_bytes);
        if end <= start + self.at_once_bytes {
            (start, self.at_once_bytes.min(file_bytes - start))
        } else {
            let start = entry.offset / WINDOW_BYTES * WINDOW_BYTES;
            (start, (end - start).next_multiple_of(WINDOW_BYTES))
        }
    }
}

impl BrickFile {
    pub(crate) fn new(
        scratch: Scratch,
        state: Option<FileState>,
        directory: Vec<DirectoryEntry>,
        bytes: Bytes,
    ) -> Self {
        let checked = (0..directory.len().div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        let end = directory.last().map_or(0, |last| last.offset + u64::from(last.len_bytes));
        let records_bytes = end.next_multiple_of(WINDOW_BYTES);
        Self { scratch, state, directory, checked, records_bytes, bytes }
    }

    /// Opens a brick file that an earlier run finished.
    ///
    /// # Errors
    /// The file or its directory is missing, of another version, or not what `state` says.
    pub fn open(
        scratch: &Scratch,
        state: &FileState,
        cached_windows: usize,
    ) -> Result<Self, StoreError> {
        let directory = read_directory(scratch, state)?;
        let file = scratch.open(&state.name)?;
        check_header(&file, MAGIC, WINDOW_BYTES as u32)?;
        let bytes = Bytes::mapped(file, cached_windows);
        Ok(Self::new(scratch.clone(), Some(state.clone()), directory, bytes))
    }

    /// How it is found again; `None` in memory.
    #[must_use]
    pub fn state(&self) -> Option<&FileState> {
        self.state.as_ref()
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

    /// The length of record `number`.
    #[must_use]
    pub fn record_bytes(&self, number: usize) -> u64 {
        self.directory[number].len_bytes.into()
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
                let (map, start) = self.map_of(&entry, file, cache)?;
                let at = (entry.offset - start) as usize;
                View { holder: Holder::Mapped(map), at, len: entry.len_bytes as usize }
            }
        };
        self.check(number, &view)?;
        Ok(view)
    }

    /// Lets all windows go that nobody looks at: nothing of the file is needed for some time.
    pub fn let_windows_go(&self) {
        if let Bytes::Mapped { cache, .. } = &self.bytes {
            let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
            cache.windows.clear();
            cache.held_bytes = 0;
        }
    }

    /// The map that has a record, and where in the file it begins.
    fn map_of(
        &self,
        entry: &DirectoryEntry,
        file: &ScratchFile,
        cache: &Mutex<WindowCache>,
    ) -> Result<(Arc<Mmap>, u64), StoreError> {
        let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
        let (start, span) = cache.span_of(entry, self.records_bytes);
        cache.clock += 1;
        let now = cache.clock;
        if let Some((map, used)) = cache.windows.get_mut(&start) {
            *used = now;
            return Ok((Arc::clone(map), start));
        }
        let gone = cache.make_room(span);
        let mapped = Arc::new(map(file, start, span as usize)?);
        // One that is larger than all room lives as long as it is looked at.
        if cache.held_bytes + span <= cache.most_bytes {
            cache.held_bytes += span;
            cache.windows.insert(start, (Arc::clone(&mapped), now));
        }
        // To let go of maps takes long, and others wait.
        drop(cache);
        drop(gone);
        self.scratch.count_read(span);
        Ok((mapped, start))
    }

    fn check(&self, number: usize, bytes: &[u8]) -> Result<(), StoreError> {
        let bit = 1 << (number % 64);
        if self.checked[number / 64].load(Ordering::Relaxed) & bit != 0 {
            return Ok(());
        }
        let entry = self.directory[number];
        let found = part_digest(bytes);
        if found != entry.hash {
            let path = match &self.bytes {
                Bytes::Mapped { file, .. } => file.path(),
                Bytes::Memory(_) => self.scratch.folder(),
            };
            let expected = format!("digest {:02x?} of brick {:#x}", entry.hash, entry.key);
            return Err(StoreError::damaged(path, entry.offset, expected, format!("{found:02x?}")));
        }
        self.checked[number / 64].fetch_or(bit, Ordering::Relaxed);
        Ok(())
    }
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
