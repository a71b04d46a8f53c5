//! Writes a brick file through mapped windows, or into memory.

use std::sync::Arc;

use memmap2::MmapMut;
use rkyv::util::AlignedVec;

use crate::store::brick::file::{BrickFile, Bytes};
use crate::store::brick::layout::{
    ALIGN_BYTES, DIRECTORY_MAGIC, DirectoryEntry, ENTRY_BYTES, HEADER_BYTES, MAGIC, WINDOW_BYTES,
    check_header, directory_name, header, read_directory,
};
use crate::store::mapped::map_new;
use crate::store::{Backing, Digester, FileState, Scratch, ScratchFile, StoreError, part_digest};

/// Writes a brick file, record by record.
pub struct BrickWriter {
    scratch: Scratch,
    name: String,
    directory: Vec<DirectoryEntry>,
    target: Target,
}

enum Target {
    Mapped(Box<MappedTarget>),
    Memory(Vec<Arc<AlignedVec>>),
}

/// A brick file on disk that grows.
struct MappedTarget {
    file: ScratchFile,
    window: Option<MmapMut>,
    window_start: u64,
    end: u64,
    directory_file: ScratchFile,
    /// Entries that are in the file of the directory, and their digest.
    saved: usize,
    digester: Digester,
}

impl MappedTarget {
    fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let file = scratch.create(name)?;
        let mut window = map_new(&file, 0, WINDOW_BYTES as usize)?;
        window[..HEADER_BYTES as usize].copy_from_slice(&header(MAGIC, WINDOW_BYTES as u32));
        let directory_file = scratch.create(&directory_name(name))?;
        directory_file.write_at(&header(DIRECTORY_MAGIC, ENTRY_BYTES as u32), 0)?;
        let (window, end) = (Some(window), HEADER_BYTES);
        let (saved, digester) = (0, Digester::default());
        Ok(Self { file, window, window_start: 0, end, directory_file, saved, digester })
    }

    /// Goes on behind the last record that counts.
    fn reopen(
        scratch: &Scratch,
        state: &FileState,
        directory: &[DirectoryEntry],
    ) -> Result<Self, StoreError> {
        let file = scratch.open(&state.name)?;
        check_header(&file, MAGIC, WINDOW_BYTES as u32)?;
        let window_start = state.len_bytes / WINDOW_BYTES * WINDOW_BYTES;
        let at_border = window_start == state.len_bytes;
        let window = (!at_border).then(|| map_new(&file, window_start, WINDOW_BYTES as usize));
        let mut digester = Digester::default();
        digester.update(bytemuck::cast_slice(directory));
        Ok(Self {
            window: window.transpose()?,
            window_start,
            end: state.len_bytes,
            directory_file: scratch.open(&directory_name(&state.name))?,
            saved: directory.len(),
            digester,
            file,
        })
    }

    /// Puts a record behind the others; where it starts.
    fn append(&mut self, bytes: &[u8]) -> Result<u64, StoreError> {
        let mut offset = self.end.next_multiple_of(ALIGN_BYTES);
        let len = bytes.len() as u64;
        let capacity = self.window.as_ref().map_or(0, |window| window.len() as u64);
        if offset + len > self.window_start + capacity {
            offset = self.end.next_multiple_of(WINDOW_BYTES);
            let span = len.max(1).next_multiple_of(WINDOW_BYTES);
            self.window = None;
            self.window = Some(map_new(&self.file, offset, span as usize)?);
            self.window_start = offset;
        }
        let at = (offset - self.window_start) as usize;
        let window = self.window.as_mut().expect("a window covers the record");
        window[at..at + bytes.len()].copy_from_slice(bytes);
        self.end = offset + len;
        self.file.scratch().count_written(len);
        Ok(offset)
    }

    /// Brings the directory up to date.
    fn save(&mut self, name: &str, directory: &[DirectoryEntry]) -> Result<FileState, StoreError> {
        let new: &[u8] = bytemuck::cast_slice(&directory[self.saved..]);
        let offset = HEADER_BYTES + self.saved as u64 * ENTRY_BYTES;
        self.directory_file.write_at(new, offset)?;
        self.digester.update(new);
        self.saved = directory.len();
        Ok(FileState {
            name: name.to_owned(),
            len_bytes: self.end,
            records: directory.len() as u64,
            root: self.digester.digest(),
        })
    }
}

impl BrickWriter {
    /// Starts the brick file `name` in the scratch folder, or in memory.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str, backing: Backing) -> Result<Self, StoreError> {
        let target = match backing {
            Backing::Memory => Target::Memory(Vec::new()),
            Backing::Mapped => Target::Mapped(Box::new(MappedTarget::create(scratch, name)?)),
        };
        let (scratch, name) = (scratch.clone(), name.to_owned());
        Ok(Self { scratch, name, directory: Vec::new(), target })
    }

    /// Goes on with a brick file that an earlier run began; what it holds beyond `state` is
    /// written again.
    ///
    /// # Errors
    /// The file or its directory is missing, or not what `state` says.
    pub fn reopen(scratch: &Scratch, state: &FileState) -> Result<Self, StoreError> {
        let directory = read_directory(scratch, state)?;
        let target = MappedTarget::reopen(scratch, state, &directory)?;
        let (scratch, name) = (scratch.clone(), state.name.clone());
        Ok(Self { scratch, name, directory, target: Target::Mapped(Box::new(target)) })
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
            Target::Mapped(target) => target.append(bytes)?,
        };
        let hash = part_digest(bytes);
        self.directory.push(DirectoryEntry { key, offset, len_bytes, flags, hash });
        Ok(())
    }

    /// The size of the file so far; 0 in memory.
    #[must_use]
    pub fn end_bytes(&self) -> u64 {
        match &self.target {
            Target::Memory(_) => 0,
            Target::Mapped(target) => target.end,
        }
    }

    /// Brings the directory on disk up to date; `None` in memory, where nothing outlives the run.
    ///
    /// # Errors
    /// The disk is full.
    pub fn save(&mut self) -> Result<Option<FileState>, StoreError> {
        match &mut self.target {
            Target::Memory(_) => Ok(None),
            Target::Mapped(target) => target.save(&self.name, &self.directory).map(Some),
        }
    }

    /// Ends the file and opens it for reading with at most `cached_windows` windows kept mapped.
    ///
    /// # Errors
    /// The directory cannot be written.
    pub fn finish(mut self, cached_windows: usize) -> Result<BrickFile, StoreError> {
        let state = self.save()?;
        let bytes = match self.target {
            Target::Memory(records) => Bytes::Memory(records),
            Target::Mapped(target) => Bytes::mapped(target.file, cached_windows),
        };
        Ok(BrickFile::new(self.scratch, state, self.directory, bytes))
    }
}
