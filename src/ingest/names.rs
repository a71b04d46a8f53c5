//! Names of parts, kept for what is told of them in the end.
//!
//! In:         a source that was read to its end.
//! Out:        a spool of bytes: of every part in order the length of its name (4 bytes, the lowest
//!             first) and the name.
//! Memory:     one name.

use std::collections::{BTreeMap, BTreeSet};

use crate::ingest::error::IngestError;
use crate::mesh::MeshSource;
use crate::store::{FileState, Resources, Spool, SpoolPeek, SpoolWriter, StoreError};

/// Spool of the names.
pub const PART_NAMES: &str = "parts.spool";

/// Writes the names of all parts of a source.
pub(super) fn write_names<S: MeshSource + ?Sized>(
    source: &mut S,
    resources: &Resources,
) -> Result<Spool<u8>, IngestError<S::Error>> {
    let mut spool = SpoolWriter::<u8>::create(resources.scratch, PART_NAMES)?;
    for number in 0..source.part_count() as u32 {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        let name = source.part(number).map_err(IngestError::Source)?.name;
        let length = (name.len() as u32).to_le_bytes();
        length.iter().chain(name.as_bytes()).try_for_each(|&byte| spool.push(byte))?;
    }
    Ok(spool.finish()?)
}

/// The names of the parts with these numbers, as an earlier step wrote them.
///
/// # Errors
/// The spool is missing or damaged.
pub fn names_of_parts(
    numbers: &BTreeSet<u32>,
    files: &[FileState],
    resources: &Resources,
) -> Result<BTreeMap<u32, String>, StoreError> {
    let spool = Spool::<u8>::open(resources.scratch, FileState::find(files, PART_NAMES)?)?;
    let mut bytes = SpoolPeek::new(&spool);
    let mut names = BTreeMap::new();
    let Some(&last) = numbers.last() else { return Ok(names) };
    for number in 0..=last {
        let Some(length) = next_length(&mut bytes)? else { break };
        let mut name = Vec::new();
        for _ in 0..length {
            name.extend(bytes.next()?);
        }
        if numbers.contains(&number) {
            names.insert(number, String::from_utf8_lossy(&name).into_owned());
        }
    }
    Ok(names)
}

fn next_length(bytes: &mut SpoolPeek<u8>) -> Result<Option<u32>, StoreError> {
    let mut length = [0; 4];
    for byte in &mut length {
        let Some(next) = bytes.next()? else { return Ok(None) };
        *byte = next;
    }
    Ok(Some(u32::from_le_bytes(length)))
}
