//! Triangles by cells: those of one cell that came near each other lie in one parcel.
//!
//! In:         triangles with their cells, in any order.
//! Out:        parcels by ascending cell, each with its own list of vertices.
//! Memory:     its share; beyond that parcels lie in a scratch file, about 24 bytes a triangle where
//!             neighbours in the file are neighbours in space, 92 at most. Smaller shares make
//!             smaller parcels.
//! Fails:      only as [`StoreError`].

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};

use crate::geom::signs::Point;
use crate::store::{Record, Scratch, Sequence, Sorted, Sorter, StoreError};
use crate::verify::intersect::arrival::{Arrival, Unpacked};
use crate::verify::intersect::grid::{extent_of, key_of_cell};
use crate::verify::positions::{hash, key_of};
use crate::verify::slots::mix;

/// Vertices of a parcel: three of their places fit in 32 bits.
pub(crate) const MOST_VERTICES: usize = 1024;
/// Slots that remember where the latest vertices of a parcel are.
const RECENT: usize = 256;
const NOT_RECENT: u16 = u16::MAX;
/// What an open parcel takes at first, and for each vertex and triangle, growth included.
const OPEN_BYTES: u64 = 1024;
const VERTEX_BYTES: u64 = 56;
const TRIANGLE_BYTES: u64 = 16;
/// Words of a position and of a triangle.
pub(crate) const POSITION_WORDS: usize = 6;
pub(crate) const TRIANGLE_WORDS: usize = 2;

/// Where a parcel lies, and what is in it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Parcel {
    /// The key of its cell.
    pub(crate) key: u64,
    /// Its first word.
    start: u64,
    /// The smallest number of a triangle.
    first: u64,
    /// The sum of the longest sides of the boxes of its triangles.
    pub(crate) extents: f64,
    vertices: u32,
    pub(crate) triangles: u32,
    /// 1 if no cell that its own may be put together with has the same triangles.
    pub(crate) is_final: u64,
}

impl Record for Parcel {
    type Key = (u64, u64);
    fn key(&self) -> Self::Key {
        (self.key, self.start)
    }
}

impl Parcel {
    /// The vertices in its list.
    pub(crate) fn vertices(&self) -> usize {
        self.vertices as usize
    }

    /// The words that it takes.
    pub(crate) fn words(&self, named: bool) -> usize {
        self.vertices as usize * (POSITION_WORDS + usize::from(named))
            + self.triangles as usize * TRIANGLE_WORDS
    }

    /// What lies in its words.
    pub(crate) fn unpack<'w>(&self, named: bool, words: &'w [u32]) -> Unpacked<'w> {
        let (positions, rest) = words.split_at(self.vertices as usize * POSITION_WORDS);
        let (names, triangles) = rest.split_at(self.vertices as usize * usize::from(named));
        Unpacked::new(positions, names, triangles, self.first)
    }
}

/// A parcel that is being filled.
struct Open {
    cell: [u32; 3],
    first: u64,
    extents: f64,
    positions: Vec<Point>,
    names: Vec<u32>,
    triangles: Vec<[u32; 2]>,
    recent: [u16; RECENT],
}

impl Open {
    fn new(cell: [u32; 3]) -> Self {
        let (positions, names, triangles) = (Vec::new(), Vec::new(), Vec::new());
        let recent = [NOT_RECENT; RECENT];
        Self { cell, first: 0, extents: 0.0, positions, names, triangles, recent }
    }

    /// The place of a vertex in the parcel, where it may come twice.
    #[inline]
    fn place(&mut self, name: Option<u32>, position: Point) -> u32 {
        let spread = name.map_or_else(|| hash(key_of(position)), mix);
        let slot = (spread >> 40) as usize % RECENT;
        let known = usize::from(self.recent[slot]);
        if known < self.positions.len()
            && name.map_or(self.positions[known] == position, |name| self.names[known] == name)
        {
            return known as u32;
        }
        let place = self.positions.len();
        self.recent[slot] = place as u16;
        self.positions.push(position);
        self.names.extend(name);
        place as u32
    }

    fn clear(&mut self) {
        self.extents = 0.0;
        self.positions.clear();
        self.names.clear();
        self.triangles.clear();
        self.recent = [NOT_RECENT; RECENT];
    }
}

/// Fills parcels.
pub(crate) struct Packer {
    words: Sequence<u32>,
    parcels: Sorter<Parcel>,
    open: Vec<Open>,
    of_cell: HashMap<u64, usize>,
    latest: usize,
    open_bytes: u64,
    most_open_bytes: u64,
    most_triangles: usize,
    named: bool,
    is_final: u64,
}

/// Filled parcels.
pub(crate) struct Packed {
    words: Sequence<u32>,
    parcels: Sorted<Parcel>,
    pub(crate) named: bool,
}

impl Packer {
    /// Parcels of at most so many triangles.
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64, most_triangles: usize) -> Self {
        Self {
            words: Sequence::new(scratch, share_bytes / 2),
            parcels: Sorter::new(scratch, share_bytes / 8),
            open: Vec::new(),
            of_cell: HashMap::new(),
            latest: 0,
            open_bytes: 0,
            most_open_bytes: share_bytes / 4,
            most_triangles,
            named: false,
            is_final: 0,
        }
    }

    /// Puts a triangle into a cell.
    pub(crate) fn add(&mut self, cell: [u32; 3], arrival: &Arrival<'_>) -> Result<(), StoreError> {
        if self.open.get(self.latest).is_none_or(|open| open.cell != cell) {
            self.latest = self.find_or_open(cell)?;
        }
        let open = &mut self.open[self.latest];
        let is_far = !open.triangles.is_empty()
            && (arrival.number < open.first || arrival.number - open.first > u64::from(u32::MAX));
        if open.positions.len() + 3 > MOST_VERTICES
            || open.triangles.len() == self.most_triangles
            || is_far
        {
            self.close(self.latest)?;
        }
        self.named = arrival.names.is_some();
        let open = &mut self.open[self.latest];
        if open.triangles.is_empty() {
            open.first = arrival.number;
        }
        let before = open.positions.len();
        let mut places = 0;
        for (at, &position) in arrival.corners.iter().enumerate() {
            let name = arrival.names.map(|names| names[at]);
            places |= open.place(name, position) << (10 * at);
        }
        open.triangles.push([places, (arrival.number - open.first) as u32]);
        open.extents += extent_of(&arrival.bounds);
        let more = (open.positions.len() - before) as u64;
        self.open_bytes += more * VERTEX_BYTES + TRIANGLE_BYTES;
        if self.open_bytes > self.most_open_bytes {
            self.close_all()?;
        }
        Ok(())
    }

    /// From now on triangles come with the cells that will not be put together any more.
    pub(crate) fn settle_cells(&mut self) -> Result<(), StoreError> {
        self.close_all()?;
        self.is_final = 1;
        Ok(())
    }

    fn find_or_open(&mut self, cell: [u32; 3]) -> Result<usize, StoreError> {
        let key = key_of_cell(cell);
        if let Some(&at) = self.of_cell.get(&key) {
            return Ok(at);
        }
        if self.open_bytes + OPEN_BYTES > self.most_open_bytes {
            self.close_all()?;
        }
        self.open_bytes += OPEN_BYTES;
        self.open.push(Open::new(cell));
        self.of_cell.insert(key, self.open.len() - 1);
        Ok(self.open.len() - 1)
    }

    fn close_all(&mut self) -> Result<(), StoreError> {
        (0..self.open.len()).try_for_each(|at| self.close(at))?;
        self.open.clear();
        self.of_cell.clear();
        self.open_bytes = 0;
        Ok(())
    }

    fn close(&mut self, at: usize) -> Result<(), StoreError> {
        let open = &mut self.open[at];
        if open.triangles.is_empty() {
            return Ok(());
        }
        let (vertices, triangles) = (open.positions.len() as u32, open.triangles.len() as u32);
        let Open { cell, first, extents, .. } = *open;
        let key = key_of_cell(cell);
        let is_final = self.is_final;
        let start = self.words.len();
        let parcel = Parcel { key, start, first, extents, vertices, triangles, is_final };
        self.parcels.push(parcel)?;
        self.words.extend(bytemuck::cast_slice(&open.positions))?;
        self.words.extend(&open.names)?;
        self.words.extend(bytemuck::cast_slice(&open.triangles))?;
        let bytes = u64::from(vertices) * VERTEX_BYTES + u64::from(triangles) * TRIANGLE_BYTES;
        self.open_bytes = self.open_bytes.saturating_sub(bytes);
        open.clear();
        Ok(())
    }

    /// Ends the input.
    pub(crate) fn finish(mut self) -> Result<Packed, StoreError> {
        self.close_all()?;
        let Self { words, parcels, named, .. } = self;
        Ok(Packed { words, parcels: parcels.finish()?, named })
    }
}

impl Packed {
    /// The next parcel in the order of cells.
    pub(crate) fn next(&mut self) -> Result<Option<Parcel>, StoreError> {
        self.parcels.next()
    }

    /// Appends the words of a parcel.
    pub(crate) fn read(&self, parcel: &Parcel, words: &mut Vec<u32>) -> Result<(), StoreError> {
        let mut at = parcel.start;
        let end = at + parcel.words(self.named) as u64;
        let mut buffer = Vec::new();
        while at < end {
            let block = self.words.block(at, (end - at) as usize, &mut buffer)?;
            words.extend_from_slice(block);
            at += block.len() as u64;
        }
        Ok(())
    }
}
