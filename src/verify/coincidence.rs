//! Finds vertices of an indexed file that lie in one place, exactly.
//!
//! In:         the whole triangles of the tape.
//! Out:        how many vertices lie where one with a smaller number lies, and the first of them.
//! Memory:     `share_bytes`: a hash table while it fits, an external sort beyond.
//! Fails:      only as [`StoreError`].

use bytemuck::{Pod, Zeroable};

use crate::defect::Smallest;
use crate::monitor::Monitor;
use crate::store::{Record, Scratch, Sorter, StoreError};
use crate::verify::positions::{PositionIndex, PositionKey, key_of};
use crate::verify::tape::Tape;

/// The vertices in the places of others.
pub(crate) struct Coincidence {
    pub(crate) vertices: u64,
    /// By vertex: the smallest vertex in the same place, and the place.
    pub(crate) places: Smallest<u32, (u32, PositionKey)>,
}

/// Bytes that the hash table takes per vertex.
const ENTRY_BYTES: u64 = 56;
/// No finite coordinate has these bits.
const UNUSED: PositionKey = [u64::MAX; 3];

/// Compares all vertices that whole triangles use; their numbers are below `space`.
pub(crate) fn find_coincident(
    tape: &Tape,
    space: u64,
    scratch: &Scratch,
    share_bytes: u64,
    monitor: &dyn Monitor,
) -> Result<Coincidence, StoreError> {
    if space * ENTRY_BYTES > share_bytes {
        return find_by_sorting(tape, scratch, share_bytes, monitor);
    }
    let mut keys = vec![UNUSED; space as usize];
    tape.each(monitor, |triangle| {
        if triangle.is_whole() {
            for (&id, &corner) in triangle.ids.iter().zip(triangle.corners) {
                keys[id as usize] = key_of(corner);
            }
        }
        Ok(true)
    })?;
    let mut found = Coincidence { vertices: 0, places: Smallest::new() };
    let mut index = PositionIndex::new();
    for (vertex, &key) in (0_u32..).zip(&keys).filter(|&(_, &key)| key != UNUSED) {
        found.compare(index.find_or_enter(key, vertex, &keys), vertex, key);
    }
    Ok(found)
}

impl Coincidence {
    fn compare(&mut self, first: u32, vertex: u32, key: PositionKey) {
        if first != vertex {
            self.vertices += 1;
            self.places.offer(vertex, (first, key));
        }
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    key: PositionKey,
    vertex: u64,
}

impl Record for Placed {
    type Key = (PositionKey, u64);
    fn key(&self) -> Self::Key {
        (self.key, self.vertex)
    }
}

fn find_by_sorting(
    tape: &Tape,
    scratch: &Scratch,
    share_bytes: u64,
    monitor: &dyn Monitor,
) -> Result<Coincidence, StoreError> {
    let mut sorter = Sorter::new(scratch, share_bytes);
    // Triangles near each other in the file share vertices: most repetitions end here.
    let mut recent = [u32::MAX; 1024];
    tape.each(monitor, |triangle| {
        if triangle.is_whole() {
            for (&id, &corner) in triangle.ids.iter().zip(triangle.corners) {
                let slot = &mut recent[id as usize % 1024];
                if *slot != id {
                    *slot = id;
                    sorter.push(Placed { key: key_of(corner), vertex: u64::from(id) })?;
                }
            }
        }
        Ok(true)
    })?;
    let mut found = Coincidence { vertices: 0, places: Smallest::new() };
    let mut sorted = sorter.finish()?;
    let mut group = (UNUSED, 0, 0);
    while let Some(Placed { key, vertex }) = sorted.next()? {
        let vertex = vertex as u32;
        if key != group.0 {
            group = (key, vertex, vertex);
        } else if vertex != group.2 {
            group.2 = vertex;
            found.compare(group.1, vertex, key);
        }
    }
    Ok(found)
}
