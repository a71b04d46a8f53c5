//! Samples of a surface: points spread evenly over its area, and corners of its triangles.
//!
//! Invariant:  depends on the triangles and their order alone. A triangle has the share of the
//!             samples that it has of the area, but for rounding; where they lie in it follows from
//!             its number.
//! Memory:     two sixteenths of the share.
//! Source:     Turk 1990, Generating random points in triangles.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::reading::{BLOCK, Tape, Triangle, hash_of};
use crate::deviate::tree::Curve;
use crate::geom::mix;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// A point of a surface that is measured.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sample {
    /// Where it lies on the curve, so that neighbours are measured one after the other.
    key: u64,
    /// Of corners a hash of the place: one place has one.
    place: u64,
    number: u64,
    pub(crate) point: [f64; 3],
    /// The unit normal of the triangle; zero where it has none.
    pub(crate) normal: [f64; 3],
    /// From a corner towards the middle of its triangle, a unit long; else zero.
    pub(crate) inward: [f64; 3],
    /// 1 for corners, 0 for samples of the area.
    corner: u64,
}

impl Sample {
    pub(crate) fn is_corner(&self) -> bool {
        self.corner == 1
    }

    /// Whether this is one of each `count` samples of the area.
    pub(crate) fn is_one_of(&self, count: u64) -> bool {
        self.corner == 0 && self.number.is_multiple_of(count)
    }
}

impl Record for Sample {
    type Key = (u64, u64, u64, u64);
    fn key(&self) -> Self::Key {
        (self.key, self.corner, self.place, self.number)
    }
}

/// Spreads numbers evenly over what comes: each thing gets as many as its size is worth.
pub(crate) struct Spread {
    per_size: f64,
    sum: f64,
}

impl Spread {
    /// `count` numbers over things with this size together.
    pub(crate) fn new(count: u64, size: f64) -> Self {
        // The first one lies in the middle of its stretch.
        Self { per_size: count as f64 / size, sum: 0.5 }
    }

    /// How many a thing of this size gets, and the numbers passed before it.
    pub(crate) fn take(&mut self, size: f64) -> std::ops::Range<u64> {
        let before = self.sum as u64;
        self.sum += size * self.per_size;
        before..self.sum as u64
    }
}

/// Takes `count` samples of the area, and at most as many corners, in their order along the curve.
pub(crate) fn take_samples(
    tape: &Tape,
    count: u64,
    means: &Means<'_>,
) -> Result<Sequence<Sample>, StoreError> {
    let curve = Curve::new(tape.bounds);
    let stride = (3 * tape.triangles.len()).div_ceil(count.max(1));
    let mut spread = Spread::new(count, tape.area);
    let mut sorter = Sorter::new(means.scratch, means.share_bytes / 16);
    tape.triangles.each_block(BLOCK, |block| {
        means.stop_if_asked()?;
        for triangle in block {
            let normal = triangle.normal();
            let numbers = spread.take(normal.length() / 2.0);
            let normal = normal.normalize_or_zero();
            for (at, number) in (0..).zip(numbers) {
                let point = point_within(triangle, at);
                sorter.push(sample(&curve, (point, normal, DVec3::ZERO), number, 0))?;
            }
            if u64::from(triangle.number).is_multiple_of(stride) {
                let [a, b, c] = triangle.points();
                let middle = (a + b + c) / 3.0;
                for (at, corner) in (0..).zip([a, b, c]) {
                    let inward = (middle - corner).normalize_or_zero();
                    let number = u64::from(triangle.number) * 3 + at;
                    sorter.push(sample(&curve, (corner, normal, inward), number, 1))?;
                }
            }
        }
        Ok(())
    })?;
    each_place_once(sorter, means)
}

fn sample(
    curve: &Curve,
    (point, normal, inward): (DVec3, DVec3, DVec3),
    number: u64,
    corner: u64,
) -> Sample {
    let place = match corner {
        1 => hash_of(&point.to_array()),
        _ => 0,
    };
    Sample {
        key: curve.key(point),
        place,
        number,
        point: point.into(),
        normal: normal.into(),
        inward: inward.into(),
        corner,
    }
}

/// A point of a triangle; `at` tells those of one triangle apart.
pub(crate) fn point_within(triangle: &Triangle, at: u64) -> DVec3 {
    let bits = mix(u64::from(triangle.number) << 32 ^ at);
    // 53 bits make a share.
    let share = |bits: u64| (bits >> 11) as f64 / (1_u64 << 53) as f64;
    let (u, v) = (share(bits), share(mix(bits)));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let [a, b, c] = triangle.points();
    a + (b - a) * u + (c - a) * v
}

/// All in order, but corners in the place of another.
fn each_place_once(
    sorter: Sorter<Sample>,
    means: &Means<'_>,
) -> Result<Sequence<Sample>, StoreError> {
    let mut list = Sequence::new(means.scratch, means.share_bytes / 16);
    let mut sorted = sorter.finish()?;
    let mut last: Option<Sample> = None;
    while let Some(sample) = sorted.next()? {
        let is_again = last.is_some_and(|last| {
            last.is_corner() && sample.is_corner() && last.point == sample.point
        });
        if !is_again {
            list.push(sample)?;
        }
        last = Some(sample);
    }
    Ok(list)
}
