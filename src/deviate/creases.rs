//! Sharp edges: edges of exactly two triangles that leave the plane of each other by more than 30
//! degrees.
//!
//! In:         a tape.
//! Out:        [`Creases`]: both ends of each, and the third corners of its triangles.
//! Invariant:  two edges are one if and only if their ends are equal, exactly; copies of a triangle
//!             count once. How the triangles face does not matter. Triangles without area have no
//!             part in this.
//! Memory:     three sixteenths of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::reading::{BLOCK, Tape, Triangle};
use crate::deviate::samples::Spread;
use crate::deviate::tree::{Curve, Tree, TreeBuilder};
use crate::geom::mix;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// Square of the cosine of 30 degrees.
const SHARP_COSINE_SQUARED: f64 = 0.75;

/// An edge of a triangle.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    hash: u64,
    ends: [[f64; 3]; 2],
    third: [f64; 3],
    triangle: u32,
    side: u32,
}

impl Record for EdgeUse {
    type Key = (u64, u32, u32);
    fn key(&self) -> Self::Key {
        (self.hash, self.triangle, self.side)
    }
}

/// A sharp edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Crease {
    ends: [[f64; 3]; 2],
    /// The other corners of its two triangles.
    thirds: [[f64; 3]; 2],
}

impl Crease {
    fn length(&self) -> f64 {
        let [from, to] = self.ends.map(DVec3::from);
        from.distance(to)
    }
}

/// All sharp edges of a surface.
pub(crate) struct Creases {
    list: Sequence<Crease>,
    pub(crate) length: f64,
}

/// An edge whose triangles come: up to three of them that differ.
struct Open {
    ends: [[f64; 3]; 2],
    thirds: Vec<[f64; 3]>,
}

/// Finds the sharp edges of a surface.
pub(crate) fn find_creases(tape: &Tape, means: &Means<'_>) -> Result<Creases, StoreError> {
    let mut sorter = Sorter::new(means.scratch, means.share_bytes / 8);
    tape.triangles.each_block(BLOCK, |block| {
        means.stop_if_asked()?;
        for triangle in block.iter().filter(|triangle| triangle.normal() != DVec3::ZERO) {
            for side in 0..3 {
                sorter.push(edge_use(triangle, side))?;
            }
        }
        Ok(())
    })?;
    let list = Sequence::new(means.scratch, means.share_bytes / 16);
    let mut creases = Creases { list, length: 0.0 };
    let mut open: Vec<Open> = Vec::new();
    let mut hash = 0;
    let mut sorted = sorter.finish()?;
    let mut count = 0_u64;
    while let Some(edge) = sorted.next()? {
        if count.is_multiple_of(1 << 16) {
            means.stop_if_asked()?;
        }
        count += 1;
        if edge.hash != hash {
            creases.close(&mut open)?;
            hash = edge.hash;
        }
        match open.iter_mut().find(|open| open.ends == edge.ends) {
            Some(open) if open.thirds.len() < 3 && !open.thirds.contains(&edge.third) => {
                open.thirds.push(edge.third);
            }
            Some(_) => {}
            None => open.push(Open { ends: edge.ends, thirds: vec![edge.third] }),
        }
    }
    creases.close(&mut open)?;
    Ok(creases)
}

fn edge_use(triangle: &Triangle, side: usize) -> EdgeUse {
    // There is one zero.
    let corner = |at: usize| triangle.corners[(side + at) % 3].map(|x| x + 0.0);
    let (from, to) = (corner(0), corner(1));
    let ends = if from <= to { [from, to] } else { [to, from] };
    let hash = ends.iter().flatten().fold(0, |hash, x| mix(hash ^ x.to_bits()));
    EdgeUse { hash, ends, third: corner(2), triangle: triangle.number, side: side as u32 }
}

impl Creases {
    /// Judges the edges of one hash.
    fn close(&mut self, open: &mut Vec<Open>) -> Result<(), StoreError> {
        for Open { ends, thirds } in open.drain(..) {
            if let [one, other] = thirds[..] {
                let crease = Crease { ends, thirds: [one, other] };
                if is_sharp(&crease) {
                    self.length += crease.length();
                    self.list.push(crease)?;
                }
            }
        }
        Ok(())
    }

    /// A tree around them, as triangles with two corners in one place.
    pub(crate) fn tree(
        &self,
        bounds: [[f64; 3]; 2],
        means: &Means<'_>,
    ) -> Result<Tree, StoreError> {
        let mut builder = TreeBuilder::new(bounds, means);
        let mut number = 0;
        self.list.each_block(BLOCK, |block| {
            for Crease { ends: [from, to], .. } in block {
                builder.add(Triangle { corners: [*from, *to, *to], number, is_pane: 0 })?;
                number += 1;
            }
            Ok(())
        })?;
        builder.finish()
    }

    /// About `count` samples evenly spread over their length.
    pub(crate) fn samples(
        &self,
        bounds: [[f64; 3]; 2],
        count: u64,
        means: &Means<'_>,
    ) -> Result<Sorter<CreaseSample>, StoreError> {
        let curve = Curve::new(bounds);
        let mut sorter = Sorter::new(means.scratch, means.share_bytes / 16);
        let mut spread = Spread::new(count, self.length);
        self.list.each_block(BLOCK, |block| {
            means.stop_if_asked()?;
            for crease in block {
                let numbers = spread.take(crease.length());
                let several = (numbers.end - numbers.start) as f64;
                for (at, number) in (0..).zip(numbers) {
                    let share = (f64::from(at) + 0.5) / several;
                    sorter.push(CreaseSample::new(crease, share, number, &curve))?;
                }
            }
            Ok(())
        })?;
        Ok(sorter)
    }
}

/// Whether the second triangle leaves the plane of the first by more than 30 degrees.
fn is_sharp(crease: &Crease) -> bool {
    let [from, to] = crease.ends.map(DVec3::from);
    let along = to - from;
    let square = along.length_squared();
    // From the edge into each triangle, at a right angle.
    let [one, other] = crease.thirds.map(|third| {
        let way = DVec3::from(third) - from;
        way - along * (way.dot(along) / square)
    });
    let straight = -one.dot(other);
    straight <= 0.0
        || straight * straight
            < SHARP_COSINE_SQUARED * one.length_squared() * other.length_squared()
}

/// A point of a sharp edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CreaseSample {
    key: u64,
    number: u64,
    pub(crate) point: [f64; 3],
    /// Unit normals of the two triangles.
    pub(crate) normals: [[f64; 3]; 2],
    /// From the edge into them, a unit long.
    pub(crate) inwards: [[f64; 3]; 2],
}

impl CreaseSample {
    fn new(crease: &Crease, share: f64, number: u64, curve: &Curve) -> Self {
        let [from, to] = crease.ends.map(DVec3::from);
        let along = (to - from).normalize_or_zero();
        let point = from + (to - from) * share;
        let thirds = crease.thirds.map(DVec3::from);
        let normals = thirds.map(|third| along.cross(third - from).normalize_or_zero());
        let inwards = [0, 1].map(|i| normals[i].cross(along));
        Self {
            key: curve.key(point),
            number,
            point: point.into(),
            normals: normals.map(Into::into),
            inwards: inwards.map(Into::into),
        }
    }
}

impl Record for CreaseSample {
    type Key = (u64, u64);
    fn key(&self) -> Self::Key {
        (self.key, self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_sharp_beyond_thirty_degrees_whichever_way_they_fold() {
        for (degrees, expected) in [
            (0.0, false),
            (29.9, false),
            (-29.9, false),
            (30.1, true),
            (-30.1, true),
            (90.0, true),
            (150.0, true),
            (180.0, true),
        ] {
            let angle = f64::to_radians(degrees);
            let ends = [[0.0; 3], [2.0, 0.0, 0.0]];
            let one = [0.7, -3.0, 0.0];
            let other = [5.0, angle.cos(), angle.sin()];
            let crease = Crease { ends, thirds: [one, other] };
            assert_eq!(is_sharp(&crease), expected, "{degrees}");
            let sample = CreaseSample::new(&crease, 0.5, 0, &Curve::new([[-5.0; 3], [5.0; 3]]));
            let [into_one, into_other] = sample.inwards.map(DVec3::from);
            assert!(into_one.distance(DVec3::NEG_Y) < 1e-12);
            assert!(into_other.distance(DVec3::new(0.0, angle.cos(), angle.sin())) < 1e-12);
        }
    }
}
