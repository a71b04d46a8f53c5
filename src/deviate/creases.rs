//! Sharp edges of a surface, as they were found: a tree around them and samples along them.
//!
//! Memory:     an eighth of the share: the list, and the samples while they are sorted.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::reading::TapeWriter;
use crate::deviate::samples::Spread;
use crate::deviate::tree::{Curve, Tree};
use crate::deviate::triangles::BLOCK;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// Square of the cosine of 30 degrees.
pub(crate) const SHARP_COSINE_SQUARED: f64 = 0.75;

/// A sharp edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Crease {
    pub(crate) ends: [[f64; 3]; 2],
    /// The other corners of its two triangles.
    pub(crate) thirds: [[f64; 3]; 2],
}

impl Crease {
    fn length(&self) -> f64 {
        let [from, to] = self.ends.map(DVec3::from);
        from.distance(to)
    }

    /// Whether the second triangle leaves the plane of the first by more than 30 degrees.
    pub(crate) fn is_sharp(&self) -> bool {
        let [from, to] = self.ends.map(DVec3::from);
        let along = to - from;
        let square = along.length_squared();
        // From the edge into each triangle, at a right angle.
        let [one, other] = self.thirds.map(|third| {
            let way = DVec3::from(third) - from;
            way - along * (way.dot(along) / square)
        });
        let straight = -one.dot(other);
        straight <= 0.0
            || straight * straight
                < SHARP_COSINE_SQUARED * one.length_squared() * other.length_squared()
    }
}

/// All sharp edges of a surface.
pub(crate) struct Creases {
    list: Sequence<Crease>,
    pub(crate) length: f64,
}

impl Creases {
    pub(crate) fn new(means: &Means<'_>) -> Self {
        Self { list: Sequence::new(means.scratch, means.share_bytes / 16), length: 0.0 }
    }

    pub(crate) fn push(&mut self, crease: Crease) -> Result<(), StoreError> {
        self.length += crease.length();
        self.list.push(crease)
    }

    /// A tree around them, as triangles with two corners in one place.
    pub(crate) fn tree(&self, means: &Means<'_>) -> Result<Tree<'static>, StoreError> {
        let mut tape = TapeWriter::new(means);
        self.list.each_block(BLOCK, |block| {
            means.stop_if_asked()?;
            let mut ends = block.iter().map(|crease| crease.ends);
            ends.try_for_each(|[from, to]| tape.push(&[from, to, to], false).map(drop))
        })?;
        Tree::around(tape.finish()?, means)
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
            assert_eq!(crease.is_sharp(), expected, "{degrees}");
            let sample = CreaseSample::new(&crease, 0.5, 0, &Curve::new([[-5.0; 3], [5.0; 3]]));
            let [into_one, into_other] = sample.inwards.map(DVec3::from);
            assert!(into_one.distance(DVec3::NEG_Y) < 1e-12);
            assert!(into_other.distance(DVec3::new(0.0, angle.cos(), angle.sin())) < 1e-12);
        }
    }
}
