//! The parts of a file that is being written: where each begins, and its name.
//!
//! Memory: a share for their records, one for their names; more is spilled.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::io::scene::NONE;
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// Memory for each of the tables.
const SHARE_BYTES: u64 = 64 << 10;

/// Where a part begins.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Start {
    vertex: u64,
    triangle: u64,
    /// Of what waits aside.
    byte: u64,
    /// In the scene.
    number: u32,
    name: u32,
}

/// A part that was written.
#[derive(Clone, Debug)]
pub(crate) struct WrittenPart {
    pub(crate) name: String,
    pub(crate) vertices: Range<u64>,
    pub(crate) triangles: Range<u64>,
    /// Of what waits aside.
    pub(crate) bytes: Range<u64>,
}

/// What there is of a file, or was where a part began.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extent {
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
    /// Of what waits aside.
    pub(crate) bytes: u64,
}

/// All parts so far.
pub(crate) struct PartsWritten {
    scratch: Scratch,
    starts: Table<Start>,
    names: Dictionary,
}

impl PartsWritten {
    pub(crate) fn new(scratch: &Scratch) -> Self {
        Self {
            scratch: scratch.clone(),
            starts: Table::new(scratch, SHARE_BYTES),
            names: Dictionary::new(scratch, SHARE_BYTES),
        }
    }

    /// Begins a part behind what there is.
    pub(crate) fn begin(
        &mut self,
        (number, name): (u32, &str),
        there: Extent,
    ) -> Result<(), StoreError> {
        let name = self.names.number(name.as_bytes())?;
        let Extent { vertices: vertex, triangles: triangle, bytes: byte } = there;
        self.starts.push(Start { vertex, triangle, byte, number, name })
    }

    /// Begins the only part of a file that is told of none.
    pub(crate) fn begin_only(&mut self) -> Result<(), StoreError> {
        if self.starts.is_empty() { self.begin((0, ""), Extent::default()) } else { Ok(()) }
    }

    pub(crate) fn len(&self) -> u64 {
        self.starts.len()
    }

    /// The vertices in front of the last part.
    pub(crate) fn first_vertex(&mut self) -> Result<u64, StoreError> {
        match self.starts.len().checked_sub(1) {
            Some(last) => Ok(self.starts.get(last)?.vertex),
            None => Ok(0),
        }
    }

    /// A part of a file of which there is `whole`.
    pub(crate) fn get(&mut self, part: u64, whole: Extent) -> Result<WrittenPart, StoreError> {
        let start = self.starts.get(part)?;
        let end = match part + 1 < self.starts.len() {
            true => {
                let Start { vertex, triangle, byte, .. } = self.starts.get(part + 1)?;
                Extent { vertices: vertex, triangles: triangle, bytes: byte }
            }
            false => whole,
        };
        let name = String::from_utf8_lossy(&self.names.name(start.name)?).into_owned();
        Ok(WrittenPart {
            name,
            vertices: start.vertex..end.vertices,
            triangles: start.triangle..end.triangles,
            bytes: start.byte..end.bytes,
        })
    }

    /// By number in the scene the place in the file, or [`NONE`].
    pub(crate) fn places(&mut self) -> Result<Table<u32>, StoreError> {
        let mut places = Table::new(&self.scratch, SHARE_BYTES);
        for place in 0..self.starts.len() {
            let number = u64::from(self.starts.get(place)?.number);
            while places.len() <= number {
                places.push(NONE)?;
            }
            places.set(number, place as u32)?;
        }
        Ok(places)
    }
}
