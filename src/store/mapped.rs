//! The only place that maps files, and the only `unsafe` of the library.
//!
//! Only scratch files of our own are mapped, in windows, after their blocks were reserved: a sparse
//! page written on a full disk would kill the process (SIGBUS), and a whole-file map would count
//! as resident.

#![expect(unsafe_code, reason = "memory maps are unsafe by nature; see the invariants below")]

use memmap2::{Mmap, MmapMut, MmapOptions};

use crate::store::{ScratchFile, StoreError};

/// Reserves `len` bytes at `offset` on the disk and maps them for writing.
///
/// # Errors
/// The disk is full, or the map is refused.
pub fn map_new(file: &ScratchFile, offset: u64, len: usize) -> Result<MmapMut, StoreError> {
    file.reserve(offset, len as u64)?;
    // SAFETY: the file is ours alone (the work folder is locked), its blocks exist, and it is
    // never truncated while a map lives.
    unsafe { MmapOptions::new().offset(offset).len(len).map_mut(file.file()) }
        .map_err(|e| StoreError::io("map", file.path(), e))
}

/// Maps `len` bytes at `offset` for reading, with their pages present.
///
/// # Errors
/// [`StoreError::Damaged`] when the file is shorter than that; or the map is refused.
pub fn map(file: &ScratchFile, offset: u64, len: usize) -> Result<Mmap, StoreError> {
    let end = file.len_bytes()?;
    if offset.saturating_add(len as u64) > end {
        let expected = format!("{len} bytes at {offset}");
        return Err(StoreError::damaged(file.path(), end, expected, "the end of the file"));
    }
    // SAFETY: as above; the length was checked, and nobody truncates a scratch file in use.
    unsafe { MmapOptions::new().offset(offset).len(len).populate().map(file.file()) }
        .map_err(|e| StoreError::io("map", file.path(), e))
}
