//! Headers and directory of a brick file; see docs/format.md.

use bytemuck::{Pod, Zeroable};

use crate::store::{Digest, FORMAT_VERSION, FileState, Scratch, ScratchFile, StoreError, digest};

/// Records start at multiples of this.
pub(crate) const ALIGN_BYTES: u64 = 16;
/// Room of the headers of the file and of its directory; see docs/format.md.
pub(crate) const HEADER_BYTES: u64 = 64;
pub(crate) const MAGIC: [u8; 8] = *b"BRMDBRIK";
pub(crate) const DIRECTORY_MAGIC: [u8; 8] = *b"BRMDDIRY";
pub(crate) const ENTRY_BYTES: u64 = size_of::<DirectoryEntry>() as u64;
/// Window of a mapped brick file. A multiple of every page size in use.
pub(crate) const WINDOW_BYTES: u64 = 256 << 10;

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
    /// The record's digest.
    pub hash: Digest,
}

/// The name of the directory of a brick file.
#[must_use]
pub fn directory_name(name: &str) -> String {
    format!("{name}.directory")
}

pub(crate) fn header(magic: [u8; 8], number: u32) -> [u8; HEADER_BYTES as usize] {
    let mut header = [0; HEADER_BYTES as usize];
    header[..8].copy_from_slice(&magic);
    header[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
    header[12..16].copy_from_slice(&number.to_le_bytes());
    header
}

pub(crate) fn check_header(
    file: &ScratchFile,
    magic: [u8; 8],
    number: u32,
) -> Result<(), StoreError> {
    let mut found = [0; HEADER_BYTES as usize];
    file.read_at(&mut found, 0)?;
    if found[..16] == header(magic, number)[..16] {
        return Ok(());
    }
    let found = format!("{:02x?}", &found[..16]);
    Err(StoreError::damaged(file.path(), 0, "the header of this version", found))
}

/// The directory of a brick file, as far as `state` says.
pub(crate) fn read_directory(
    scratch: &Scratch,
    state: &FileState,
) -> Result<Vec<DirectoryEntry>, StoreError> {
    let file = scratch.open(&directory_name(&state.name))?;
    check_header(&file, DIRECTORY_MAGIC, ENTRY_BYTES as u32)?;
    let there = file.len_bytes()?;
    let wanted = state.records.checked_mul(ENTRY_BYTES).and_then(|b| b.checked_add(HEADER_BYTES));
    if wanted.is_none_or(|wanted| wanted > there) {
        let expected = format!("{} entries", state.records);
        return Err(StoreError::damaged(file.path(), there, expected, "the end of the file"));
    }
    let mut directory = vec![DirectoryEntry::zeroed(); state.records as usize];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut directory);
    file.read_at(bytes, HEADER_BYTES)?;
    let found = digest(bytes);
    if found != state.root {
        let expected = format!("a directory with digest {:02x?}", state.root);
        return Err(StoreError::damaged(file.path(), 0, expected, format!("{found:02x?}")));
    }
    Ok(directory)
}
