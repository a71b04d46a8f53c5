//! Numbers the vertices of a file without indices: one number for every distinct position.
//!
//! In:         the corners on the tape.
//! Out:        their vertex numbers on the tape; [`Numbered`].
//! Invariant:  numbers ascend with the first corner at a position, whatever the share; between
//!             them may be gaps.
//! Memory:     `share_bytes`: a hash table while it fits, two external sorts beyond.
//! Fails:      only as [`StoreError`]; more than 2^32 - 1 corners are refused beyond the table.

use bytemuck::{Pod, Zeroable};

use crate::monitor::Monitor;
use crate::store::{Record, Scratch, Sorted, Sorter, StoreError};
use crate::verify::intake::is_finite;
use crate::verify::positions::{PositionIndex, PositionKey, key_of};
use crate::verify::tape::{Tape, stop_if_asked};

/// How the positions were numbered.
pub(crate) struct Numbered {
    /// Distinct positions.
    pub(crate) vertices: u64,
    /// All numbers are below.
    pub(crate) space: u64,
}

/// Bytes that the hash table takes per position, while it grows.
const ENTRY_BYTES: u64 = 72;

/// Puts vertex numbers beside all corners.
pub(crate) fn number_positions(
    tape: &mut Tape,
    scratch: &Scratch,
    share_bytes: u64,
    monitor: &dyn Monitor,
) -> Result<Numbered, StoreError> {
    let most = share_bytes / ENTRY_BYTES;
    let mut index = PositionIndex::new();
    let mut keys: Vec<PositionKey> = Vec::new();
    let mut recent = ([[u64::MAX; 3]; 3], [0_u32; 3]);
    let mut start = 0;
    let mut buffer = Vec::new();
    let mut numbered = Vec::new();
    while start < tape.len() {
        stop_if_asked(monitor)?;
        let block = tape.corners(start, &mut buffer)?;
        start += block.len() as u64;
        numbered.clear();
        for corners in block {
            if !is_finite(corners) {
                numbered.push([0; 3]);
                continue;
            }
            let now = corners.map(key_of);
            let ids = now.map(|key| {
                // Neighbours in a file mostly share corners.
                if let Some(at) = recent.0.iter().position(|&k| k == key) {
                    return recent.1[at];
                }
                let next = keys.len() as u32;
                let id = index.find_or_enter(key, next, &keys);
                if id == next {
                    keys.push(key);
                }
                id
            });
            recent = (now, ids);
            numbered.push(ids);
        }
        if keys.len() as u64 > most {
            drop((index, keys));
            return number_by_sorting(tape, scratch, share_bytes, monitor);
        }
        numbered.iter().try_for_each(|&ids| tape.push_ids(ids))?;
    }
    Ok(Numbered { vertices: keys.len() as u64, space: keys.len() as u64 })
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    key: PositionKey,
    corner: u64,
}

impl Record for Placed {
    type Key = (PositionKey, u64);
    fn key(&self) -> Self::Key {
        (self.key, self.corner)
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct CornerNumber {
    corner: u32,
    number: u32,
}

impl Record for CornerNumber {
    type Key = u32;
    fn key(&self) -> Self::Key {
        self.corner
    }
}

/// The number of a position is its first corner's.
fn number_by_sorting(
    tape: &mut Tape,
    scratch: &Scratch,
    share_bytes: u64,
    monitor: &dyn Monitor,
) -> Result<Numbered, StoreError> {
    let limit = u64::from(u32::MAX);
    if tape.len() * 3 > limit {
        return Err(StoreError::TooMany { what: "Corners of a file without indices", limit });
    }
    let mut by_place = Sorter::new(scratch, share_bytes / 2);
    let mut start = 0;
    let mut buffer = Vec::new();
    while start < tape.len() {
        stop_if_asked(monitor)?;
        let block = tape.corners(start, &mut buffer)?;
        for (corners, first) in block.iter().zip((start * 3..).step_by(3)) {
            if is_finite(corners) {
                for (&position, corner) in corners.iter().zip(first..) {
                    by_place.push(Placed { key: key_of(position), corner })?;
                }
            }
        }
        start += block.len() as u64;
    }
    let mut placed = by_place.finish()?;
    let mut by_corner = Sorter::new(scratch, share_bytes / 2);
    let mut current = None;
    let mut vertices = 0;
    while let Some(Placed { key, corner }) = placed.next()? {
        let number = match current {
            Some((same, number)) if same == key => number,
            _ => {
                vertices += 1;
                corner as u32
            }
        };
        current = Some((key, number));
        by_corner.push(CornerNumber { corner: corner as u32, number })?;
    }
    drop(placed);
    write_numbers(tape, by_corner.finish()?)?;
    Ok(Numbered { vertices, space: tape.len() * 3 })
}

/// Completes the tape; part of it may have its numbers from the table already, and those are
/// numbers of another kind.
fn write_numbers(tape: &mut Tape, mut sorted: Sorted<CornerNumber>) -> Result<(), StoreError> {
    tape.clear_ids();
    let mut next = sorted.next()?;
    for triangle in 0..tape.len() {
        let first = (triangle * 3) as u32;
        let mut ids = [0; 3];
        while let Some(CornerNumber { corner, number }) = next
            && corner < first + 3
        {
            ids[(corner - first) as usize] = number;
            next = sorted.next()?;
        }
        tape.push_ids(ids)?;
    }
    Ok(())
}
