//! Finds the sharp edges of a surface: those of exactly two triangles that leave the plane of each
//! other by more than 30 degrees.
//!
//! In:         a tape.
//! Out:        [`Creases`], in no order that means anything, the same whatever the memory.
//! Invariant:  two edges are one if and only if their ends are equal, exactly; copies of a triangle
//!             count once. How the triangles face does not matter. Triangles without area have no
//!             part in this.
//! Memory:     an eighth of the share.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::deviate::Means;
use crate::deviate::creases::{Crease, Creases, SHARP_COSINE_SQUARED};
use crate::deviate::reading::{BLOCK, Tape, Triangle, hash_of};
use crate::store::{Record, Sorter, StoreError};

/// What two normals may lack of being opposite, beyond 30 degrees, before both triangles are read:
/// they are rounded to single precision.
const ROUNDED: f32 = 1e-3;

/// An edge of a triangle.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    /// Of its ends, the lower one first.
    hash: u64,
    triangle: u32,
    /// Unit normal of the triangle, as it is where its third corner is to the left of the way from
    /// the lower end to the other: whichever way triangles face, those of a flat edge are opposite.
    normal: [f32; 3],
}

impl Record for EdgeUse {
    type Key = (u64, u32);
    fn key(&self) -> Self::Key {
        (self.hash, self.triangle)
    }
}

/// Finds the sharp edges of a surface.
pub(crate) fn find_creases(tape: &Tape, means: &Means<'_>) -> Result<Creases, StoreError> {
    let mut sorter = Sorter::new(means.scratch, means.share_bytes / 16);
    tape.triangles.each_block(BLOCK, |block| {
        means.stop_if_asked()?;
        for triangle in block {
            let normal = triangle.normal();
            if normal != DVec3::ZERO {
                let edges = [0, 1, 2].map(|side| EdgeUse::new(triangle, side, normal));
                sorter.extend(&edges)?;
            }
        }
        Ok(())
    })?;
    let mut finder = Finder {
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
    fn new(triangle: &Triangle, side: usize, normal: DVec3) -> Self {
        let ([lower, upper], is_turned) = ends(triangle, side);
        let normal = if is_turned { -normal } else { normal };
        Self {
            hash: hash_of(lower.iter().chain(&upper)),
            triangle: triangle.number,
            normal: normal.normalize_or_zero().as_vec3().to_array(),
        }
    }

    /// Whether the edge that both are of is surely not sharp.
    fn is_flat_with(&self, other: &Self) -> bool {
        let [one, other] = [self, other].map(|edge| Vec3::from(edge.normal));
        let straight = -one.dot(other) - ROUNDED;
        straight > 0.0 && straight * straight >= SHARP_COSINE_SQUARED as f32
    }
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
struct Finder<'t> {
    tape: &'t Tape,
    creases: Creases,
    /// The first uses of a hash, at most two: most edges are flat, and their triangles are not read.
    waiting: Vec<EdgeUse>,
    open: Vec<Open>,
    room: Vec<Triangle>,
}

impl Finder<'_> {
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
                if hash_of(ends.iter().flatten()) == edge.hash {
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
