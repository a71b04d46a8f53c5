//! The only place that maps files, and the only `unsafe` of the library.
//!
//! Only scratch files of our own are mapped, for reading, in windows whose blocks were reserved: a page
//! that is not there would kill the process (SIGBUS), and a whole-file map would count as resident.

#![expect(unsafe_code, reason = "memory maps are unsafe by nature; see the invariants below")]

use memmap2::{Mmap, MmapOptions};

use crate::store::{ScratchFile, StoreError};

/// Maps `len` bytes at `offset` for reading. Pages come as they are looked at: to ask for all at once takes
/// longer.
///
/// # Errors
/// [`StoreError::Damaged`] when the file is shorter than that; or the map is refused.
pub fn map(file: &ScratchFile, offset: u64, len: usize) -> Result<Mmap, StoreError> {
    let end = file.len_bytes()?;
    if offset.saturating_add(len as u64) > end {
        let expected = format!("{len} bytes at {offset}");
        return Err(StoreError::damaged(file.path(), end, expected, "the end of the file"));
    }
    // SAFETY: the file is ours alone (the work folder is locked), its blocks exist, the length was checked,
    // and nobody truncates a scratch file in use.
    unsafe { MmapOptions::new().offset(offset).len(len).map(file.file()) }
        .map_err(|e| StoreError::io("map", file.path(), e))
}
