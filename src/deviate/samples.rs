//! Samples of a surface: points spread evenly over its area, and corners of its triangles.
//!
//! Invariant:  depends on the triangles and their order alone. A run of triangles has the share of the
//!             samples that it has of the area, but for rounding, and so have its triangles of these;
//!             where they lie in one follows from its number.
//! Memory:     two sixteenths of the share.
//! Source:     Turk 1990, Generating random points in triangles.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::pages::Pages;
use crate::deviate::reading::Tape;
use crate::deviate::runs::Run;
use crate::deviate::tree::Curve;
use crate::deviate::triangles::{BLOCK, Blocks, Triangle, hash_of};
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
    pub(crate) fn take(&mut self, size: f64) -> Range<u64> {
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
    let mut taker = Taker {
        curve: Curve::new(tape.bounds),
        stride: (3 * tape.triangles.len()).div_ceil(count.max(1)),
        sorter: Sorter::new(means.scratch, means.share_bytes / 16),
    };
    let mut spread = Spread::new(count, tape.area);
    let mut triangles = Pages::new(&tape.triangles, 0);
    tape.runs.each_block(BLOCK, |block| {
        means.stop_if_asked()?;
        for Run { node, area, .. } in block {
            let numbers = spread.take(*area);
            let first = u64::from(node.first);
            let is_asked = first.next_multiple_of(taker.stride) < first + u64::from(node.count);
            // Most runs are not even read.
            if is_asked || !numbers.is_empty() {
                taker.take(triangles.group(node.first, node.count)?, *area, numbers)?;
            }
        }
        Ok(())
    })?;
    each_place_once(taker.sorter, means)
}

/// Takes samples of one run after another.
struct Taker {
    curve: Curve,
    /// Of so many triangles one has its corners measured.
    stride: u64,
    sorter: Sorter<Sample>,
}

impl Taker {
    /// Samples with these numbers, spread over triangles that have an area together.
    fn take(
        &mut self,
        triangles: &[Triangle],
        area: f64,
        numbers: Range<u64>,
    ) -> Result<(), StoreError> {
        let mut spread = Spread::new(numbers.end - numbers.start, area);
        let (mut from, mut left) = (numbers.start, triangles.len());
        for triangle in triangles {
            let normal = triangle.normal();
            let upto = numbers.start + spread.take(normal.length() / 2.0).end;
            left -= 1;
            // Rounding must not lose the last one.
            let upto = if left == 0 { numbers.end } else { upto.min(numbers.end) };
            let normal = normal.normalize_or_zero();
            for (at, number) in (0..).zip(from..upto) {
                let point = point_within(triangle, at);
                self.push((point, normal, DVec3::ZERO), number, 0)?;
            }
            from = upto;
            if u64::from(triangle.number).is_multiple_of(self.stride) {
                let [a, b, c] = triangle.points();
                let middle = (a + b + c) / 3.0;
                for (at, corner) in (0..).zip([a, b, c]) {
                    let inward = (middle - corner).normalize_or_zero();
                    let number = u64::from(triangle.number) * 3 + at;
                    self.push((corner, normal, inward), number, 1)?;
                }
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        (point, normal, inward): (DVec3, DVec3, DVec3),
        number: u64,
        corner: u64,
    ) -> Result<(), StoreError> {
        let place = match corner {
            1 => hash_of(&point.to_array()),
            _ => 0,
        };
        self.sorter.push(Sample {
            key: self.curve.key(point),
            place,
            number,
            point: point.into(),
            normal: normal.into(),
            inward: inward.into(),
            corner,
        })
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
