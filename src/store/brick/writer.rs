//! Writes a brick file, in windows that can be mapped to read it, or into memory.

use std::sync::Arc;

use rkyv::util::AlignedVec;

use crate::store::brick::file::{BrickFile, Bytes};
use crate::store::brick::layout::{
    ALIGN_BYTES, DIRECTORY_MAGIC, DirectoryEntry, ENTRY_BYTES, HEADER_BYTES, MAGIC, WINDOW_BYTES,
    check_header, directory_name, header, read_directory,
};
use crate::store::{Backing, Digester, FileState, Scratch, ScratchFile, StoreError, part_digest};

/// Writes a brick file, record by record.
pub struct BrickWriter {
    scratch: Scratch,
    name: String,
    directory: Vec<DirectoryEntry>,
    target: Target,
}

enum Target {
    Disk(Box<DiskTarget>),
    Memory(Vec<Arc<AlignedVec>>),
}

/// A brick file on disk that grows.
struct DiskTarget {
    file: ScratchFile,
    /// How far room is reserved.
    reserved: u64,
    end: u64,
    directory_file: ScratchFile,
    /// Entries that are in the file of the directory, and their digest.
    saved: usize,
    digester: Digester,
}

impl DiskTarget {
    fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let file = scratch.create(name)?;
        file.reserve(0, WINDOW_BYTES)?;
        file.write_at(&header(MAGIC, WINDOW_BYTES as u32), 0)?;
        let directory_file = scratch.create(&directory_name(name))?;
        directory_file.write_at(&header(DIRECTORY_MAGIC, ENTRY_BYTES as u32), 0)?;
        let (saved, digester) = (0, Digester::default());
        let (reserved, end) = (WINDOW_BYTES, HEADER_BYTES);
        Ok(Self { file, reserved, end, directory_file, saved, digester })
    }

    /// Goes on behind the last record that counts.
    fn reopen(
        scratch: &Scratch,
        state: &FileState,
        directory: &[DirectoryEntry],
    ) -> Result<Self, StoreError> {
        let file = scratch.open(&state.name)?;
        check_header(&file, MAGIC, WINDOW_BYTES as u32)?;
        let reserved = state.len_bytes.next_multiple_of(WINDOW_BYTES);
        if reserved > state.len_bytes {
            file.reserve(reserved - WINDOW_BYTES, WINDOW_BYTES)?;
        }
        let mut digester = Digester::default();
        digester.update(bytemuck::cast_slice(directory));
        Ok(Self {
            reserved,
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
        if offset + len > self.reserved {
            // A record lies in one window, or begins one.
            offset = self.end.next_multiple_of(WINDOW_BYTES);
            let span = len.max(1).next_multiple_of(WINDOW_BYTES);
            self.file.reserve(offset, span)?;
            self.reserved = offset + span;
        }
        self.file.write_at(bytes, offset)?;
        self.end = offset + len;
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
            Backing::Mapped => Target::Disk(Box::new(DiskTarget::create(scratch, name)?)),
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
        let target = DiskTarget::reopen(scratch, state, &directory)?;
        let (scratch, name) = (scratch.clone(), state.name.clone());
        Ok(Self { scratch, name, directory, target: Target::Disk(Box::new(target)) })
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
            Target::Disk(target) => target.append(bytes)?,
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
            Target::Disk(target) => target.end,
        }
    }

    /// Brings the directory on disk up to date; `None` in memory, where nothing outlives the run.
    ///
    /// # Errors
    /// The disk is full.
    pub fn save(&mut self) -> Result<Option<FileState>, StoreError> {
        match &mut self.target {
            Target::Memory(_) => Ok(None),
            Target::Disk(target) => target.save(&self.name, &self.directory).map(Some),
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
            Target::Disk(target) => Bytes::mapped(target.file, cached_windows),
        };
        Ok(BrickFile::new(self.scratch, state, self.directory, bytes))
    }
}
