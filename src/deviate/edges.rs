//! Finds the sharp edges of a surface: those of exactly two triangles that leave the plane of each
//! other by more than 30 degrees.
//!
//! In:         triangles, in file order, and the tape that they are on.
//! Out:        [`Creases`], in no order that means anything, the same whatever the memory.
//! Invariant:  two edges are one if and only if their ends are equal, exactly; copies of a triangle
//!             count once. How the triangles face does not matter. Triangles without area have no
//!             part in this.
//! Memory:     an eighth of the share, and a megabyte: most edges are flat, and have both triangles near
//!             each other in the file. Such pairs meet in a table, and only where an edge turns out to
//!             have more triangles than that is it looked at again.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::deviate::Means;
use crate::deviate::creases::{Crease, Creases, SHARP_COSINE_SQUARED};
use crate::deviate::reading::Tape;
use crate::deviate::triangles::{BLOCK, Blocks, Measured, Triangle, hash_of};
use crate::geom::mix;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// What two normals may lack of being opposite, beyond 30 degrees, before both triangles are read:
/// they are rounded to single precision.
const ROUNDED: f32 = 1e-3;

/// In [`EdgeUse::triangle`]: no triangle, since a file has fewer.
const NOBODY: u32 = u32::MAX;

/// An edge of a triangle.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    /// Of its ends, the lower one first.
    hash: u64,
    triangle: u32,
    /// Unit normal of the triangle, as it is where its third corner is to the left of the way from
    /// the lower end to the other: whichever way triangles face, those of a flat edge are opposite.
    /// Zero where the triangle has to be asked.
    normal: [f32; 3],
}

impl Record for EdgeUse {
    type Key = (u64, u32);
    fn key(&self) -> Self::Key {
        (self.hash, self.triangle)
    }
}

/// Two triangles of a flat edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Pair {
    hash: u64,
    triangles: [u32; 2],
}

/// Edges whose second triangle has not come yet, as many as the table has places: an even number.
const WAITING: usize = 1 << 14;
/// Marks of the edges that are sorted, by their hashes.
const MARKS: usize = 1 << 22;

/// Finds the sharp edges of a surface while it is read.
pub(crate) struct EdgeFinder<'m> {
    means: &'m Means<'m>,
    /// Uses of edges at the place of their hash; those of no triangle are none.
    waiting: Vec<EdgeUse>,
    pairs: Sequence<Pair>,
    sorter: Sorter<EdgeUse>,
    marks: Vec<u64>,
}

impl<'m> EdgeFinder<'m> {
    /// No edges yet.
    pub(crate) fn new(means: &'m Means<'m>) -> Self {
        Self {
            means,
            waiting: vec![EdgeUse { hash: 0, triangle: NOBODY, normal: [0.0; 3] }; WAITING],
            pairs: Sequence::new(means.scratch, means.share_bytes / 32),
            sorter: Sorter::new(means.scratch, means.share_bytes / 32),
            marks: vec![0; MARKS / 64],
        }
    }

    /// Takes in the edges of the next triangle.
    pub(crate) fn add(&mut self, measured: &Measured) -> Result<(), StoreError> {
        if measured.normal == DVec3::ZERO {
            return Ok(());
        }
        for edge in EdgeUse::of(measured) {
            let Some(other) = self.meet(edge)? else { continue };
            if edge.is_flat_with(&other) {
                let triangles = [other.triangle, edge.triangle];
                self.pairs.push(Pair { hash: edge.hash, triangles })?;
            } else {
                self.sort(other)?;
                self.sort(edge)?;
            }
        }
        Ok(())
    }

    /// Takes out the use of the same edge that waits, or lets this one wait.
    fn meet(&mut self, edge: EdgeUse) -> Result<Option<EdgeUse>, StoreError> {
        let place = edge.hash as usize % WAITING;
        // Either of two places serves. An edge that waits keeps its place as long as the other is free.
        let places = [place, place ^ 1];
        for place in places {
            let other = self.waiting[place];
            if other.hash == edge.hash && other.triangle != NOBODY {
                self.waiting[place].triangle = NOBODY;
                return Ok(Some(other));
            }
        }
        let [one, other] = places.map(|place| self.waiting[place].triangle);
        // The one that waits longest goes.
        let is_first = one == NOBODY || other != NOBODY && one < other;
        let place = places[usize::from(!is_first)];
        let gone = std::mem::replace(&mut self.waiting[place], edge);
        if gone.triangle != NOBODY {
            self.sort(gone)?;
        }
        Ok(None)
    }

    fn sort(&mut self, edge: EdgeUse) -> Result<(), StoreError> {
        let (word, bit) = mark_of(edge.hash);
        self.marks[word] |= bit;
        self.sorter.push(edge)
    }

    /// All sharp edges of the triangles, which are on this tape.
    pub(crate) fn finish(mut self, tape: &Tape) -> Result<Creases, StoreError> {
        for place in 0..WAITING {
            if self.waiting[place].triangle != NOBODY {
                self.sort(self.waiting[place])?;
            }
        }
        let Self { means, pairs, mut sorter, marks, .. } = self;
        pairs.each_block(BLOCK, |block| {
            means.stop_if_asked()?;
            let is_marked = |pair: &&Pair| {
                let (word, bit) = mark_of(pair.hash);
                marks[word] & bit != 0
            };
            for Pair { hash, triangles } in block.iter().filter(is_marked) {
                for triangle in *triangles {
                    sorter.push(EdgeUse { hash: *hash, triangle, normal: [0.0; 3] })?;
                }
            }
            Ok(())
        })?;
        drop((pairs, marks));
        judge(sorter, tape, means)
    }
}

/// Where the mark of an edge is.
fn mark_of(hash: u64) -> (usize, u64) {
    // Not the bits that tell its place in the table.
    let mark = (hash >> 40) as usize % MARKS;
    (mark / 64, 1 << (mark % 64))
}

/// Judges all edges, those with one hash together.
fn judge(sorter: Sorter<EdgeUse>, tape: &Tape, means: &Means<'_>) -> Result<Creases, StoreError> {
    let mut finder = Judge {
        tape,
        creases: Creases::new(means),
        waiting: Vec::new(),
        open: Vec::new(),
        room: Vec::new(),
    };
    let mut hash = 0;
    let mut sorted = sorter.finish()?;
    let mut count = 0_u64;
    while let Some(edge) = sorted.next()? {
        if count.is_multiple_of(1 << 16) {
            means.stop_if_asked()?;
        }
        count += 1;
        if edge.hash != hash {
            finder.close()?;
            hash = edge.hash;
        }
        finder.add(edge)?;
    }
    finder.close()?;
    Ok(finder.creases)
}

impl EdgeUse {
    /// The three edges of a triangle.
    fn of(measured: &Measured) -> [Self; 3] {
        let Measured { triangle, normal, hashes, .. } = measured;
        let normal = normal.normalize_or_zero().as_vec3();
        [0, 1, 2].map(|side| {
            let (_, is_turned) = ends(triangle, side);
            let (from, to) = (hashes[side], hashes[(side + 1) % 3]);
            Self {
                hash: if is_turned { edge_hash(to, from) } else { edge_hash(from, to) },
                triangle: triangle.number,
                normal: if is_turned { -normal } else { normal }.to_array(),
            }
        })
    }

    /// Whether the edge that both are of is surely not sharp.
    fn is_flat_with(&self, other: &Self) -> bool {
        let [one, other] = [self, other].map(|edge| Vec3::from(edge.normal));
        let straight = -one.dot(other) - ROUNDED;
        straight > 0.0 && straight * straight >= SHARP_COSINE_SQUARED as f32
    }
}

/// The hash of an edge from those of its ends, the lower one first.
fn edge_hash(lower: u64, upper: u64) -> u64 {
    mix(lower.rotate_left(1) ^ upper)
}

/// The ends of a side, the lower one first, and whether that is against the triangle's sense.
fn ends(triangle: &Triangle, side: usize) -> ([[f64; 3]; 2], bool) {
    // There is one zero.
    let [from, to] = [0, 1].map(|at| triangle.corners[(side + at) % 3].map(|x| x + 0.0));
    if from <= to { ([from, to], false) } else { ([to, from], true) }
}

/// An edge whose triangles come: up to three of them that differ.
struct Open {
    ends: [[f64; 3]; 2],
    thirds: Vec<[f64; 3]>,
}

/// Judges edges, all uses of one hash after those of another.
struct Judge<'t> {
    tape: &'t Tape<'t>,
    creases: Creases,
    /// The first uses of a hash, at most two: most edges are flat, and their triangles are not read.
    waiting: Vec<EdgeUse>,
    open: Vec<Open>,
    room: Vec<Triangle>,
}

impl Judge<'_> {
    fn add(&mut self, edge: EdgeUse) -> Result<(), StoreError> {
        self.waiting.push(edge);
        if self.waiting.len() > 2 || !self.open.is_empty() { self.read() } else { Ok(()) }
    }

    /// Reads the triangles of what waits.
    fn read(&mut self) -> Result<(), StoreError> {
        for edge in self.waiting.drain(..) {
            let number = u64::from(edge.triangle);
            let triangle = self.tape.triangles.block(number, 1, &mut self.room)?[0];
            for side in 0..3 {
                let (ends, _) = ends(&triangle, side);
                if edge_hash(hash_of(&ends[0]), hash_of(&ends[1])) == edge.hash {
                    note(&mut self.open, ends, triangle.corners[(side + 2) % 3].map(|x| x + 0.0));
                }
            }
        }
        Ok(())
    }

    /// Judges the edges of the hash that comes to its end.
    fn close(&mut self) -> Result<(), StoreError> {
        match self.waiting[..] {
            [one, other] if !one.is_flat_with(&other) => self.read()?,
            _ => self.waiting.clear(),
        }
        for Open { ends, thirds } in self.open.drain(..) {
            if let [one, other] = thirds[..] {
                let crease = Crease { ends, thirds: [one, other] };
                if crease.is_sharp() {
                    self.creases.push(crease)?;
                }
            }
        }
        Ok(())
    }
}

fn note(open: &mut Vec<Open>, ends: [[f64; 3]; 2], third: [f64; 3]) {
    match open.iter_mut().find(|open| open.ends == ends) {
        Some(open) if open.thirds.len() < 3 && !open.thirds.contains(&third) => {
            open.thirds.push(third);
        }
        Some(_) => {}
        None => open.push(Open { ends, thirds: vec![third] }),
    }
}
