//! Compares two surfaces: every sample with what the other one has nearest to it.
//!
//! Invariant:  samples are added up in their order along the curve, whoever measured them.
//! Memory:     half of the share.

use glam::DVec3;

use crate::deviate::creases::{CreaseSample, Creases};
use crate::deviate::deviation::{
    CreaseReport, Deviation, Distances, LostReport, Normals, Separation,
};
use crate::deviate::nearest::{Near, Walker};
use crate::deviate::quantiles::{Value, quantiles};
use crate::deviate::samples::Sample;
use crate::deviate::sight::Sight;
use crate::deviate::tree::{Curve, Tree};
use crate::deviate::{DeviationOptions, Means, Surface};
use crate::store::{Sorter, StoreError, ordered};

/// Samples that a worker takes at a time.
const CHUNK: usize = 256;
/// Of so many samples of an area within the tolerance, one is looked at: whether it is seen. Those
/// beyond all are.
const WITHIN_PER_LOOK: u64 = 8;

/// Compares a file with its original.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn compare(
    original: &Surface,
    file: &Surface,
    options: &DeviationOptions,
    means: &Means<'_>,
) -> Result<Deviation, StoreError> {
    let there = Tally::measure((original, file), true, options, means)?;
    let back = Tally::measure((file, original), false, options, means)?;
    let creases = match (&original.creases, &file.creases) {
        (Some(before), Some(now)) => {
            Some(compare_creases((original, before), now, options, means)?)
        }
        _ => None,
    };
    let [low, high] = original.bounds.map(DVec3::from);
    let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
    Ok(Deviation {
        tolerance: options.tolerance,
        cell_size: options.cell_size,
        diagonal: low.distance(high),
        lost: LostReport {
            visible_share: share(there.seen, there.samples).min(1.0),
            share: share(there.seen_beyond, there.seen),
            largest: there.largest_seen,
        },
        invented_share: share(back.beyond, back.samples),
        original_to_file: there.finish(options)?,
        file_to_original: back.finish(options)?,
        creases,
    })
}

/// What a worker needs: the other surface, and the own one to look through.
struct Space<'s> {
    walker: Walker<'s>,
    sight: Option<Sight<'s>>,
}

impl<'s> Space<'s> {
    fn new((own, other): (&'s Surface, &'s Tree), looks: bool, means: &Means<'_>) -> Self {
        let share_bytes = means.share_bytes / 8 / means.pool.current_num_threads() as u64;
        let sight = looks.then(|| {
            let extent = Curve::new(own.bounds).extent;
            Sight::new(Walker::new(&own.tree, share_bytes), extent)
        });
        Self { walker: Walker::new(other, share_bytes), sight }
    }

    fn sees(&mut self, point: DVec3, normal: DVec3, inward: DVec3) -> Result<bool, StoreError> {
        self.sight.as_mut().map_or(Ok(false), |sight| sight.sees(point, normal, inward))
    }
}

/// A sample, what is nearest to it, and whether it is seen.
struct Answer {
    sample: Sample,
    near: Near,
    is_seen: bool,
}

/// What the samples of one surface add up to.
struct Tally {
    samples: u64,
    corners: u64,
    sum: f64,
    sum_of_squares: f64,
    largest: Option<Separation>,
    distances: Sorter<Value>,
    angles: Sorter<Value>,
    angle_count: u64,
    /// Samples farther away than the tolerance.
    beyond: u64,
    /// Samples that are seen, those within the tolerance by the few that were looked at.
    seen: u64,
    seen_beyond: u64,
    largest_seen: Option<Separation>,
}

impl Tally {
    /// Measures all samples of one surface; `looks` whether they are seen.
    fn measure(
        (from, to): (&Surface, &Surface),
        looks: bool,
        options: &DeviationOptions,
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        let sorter = || Sorter::new(means.scratch, means.share_bytes / 32);
        let mut tally = Self {
            samples: 0,
            corners: 0,
            sum: 0.0,
            sum_of_squares: 0.0,
            largest: None,
            distances: sorter(),
            angles: sorter(),
            angle_count: 0,
            beyond: 0,
            seen: 0,
            seen_beyond: 0,
            largest_seen: None,
        };
        let tolerance = options.tolerance;
        let mut start = 0;
        let mut room = Vec::new();
        ordered(
            means.pool,
            || {
                means.stop_if_asked()?;
                if start == from.samples.len() {
                    return Ok(None);
                }
                let chunk = from.samples.block(start, CHUNK, &mut room)?.to_vec();
                start += chunk.len() as u64;
                Ok(Some(chunk))
            },
            || Space::new((from, &to.tree), looks, means),
            |space, chunk: Vec<Sample>| {
                let answers = chunk.into_iter().map(|sample| answer(space, sample, tolerance));
                answers.collect::<Result<Vec<_>, _>>()
            },
            |answers| {
                means.monitor.advance(answers.len() as u64);
                answers.iter().try_for_each(|answer| tally.add(answer, tolerance))
            },
        )?;
        Ok(tally)
    }

    fn add(&mut self, answer: &Answer, tolerance: f64) -> Result<(), StoreError> {
        let Answer { sample, near, is_seen } = answer;
        let distance = near.distance_squared.sqrt();
        let (position, nearest) = (sample.point, near.point.into());
        let separation = Separation { distance, position, nearest };
        raise(&mut self.largest, separation);
        if *is_seen {
            raise(&mut self.largest_seen, separation);
        }
        if sample.is_corner() {
            self.corners += 1;
            return Ok(());
        }
        self.samples += 1;
        self.sum += distance;
        self.sum_of_squares += near.distance_squared;
        self.distances.push(Value::new(distance))?;
        if near.cosine >= 0.0 {
            self.angle_count += 1;
            self.angles.push(Value::new(near.cosine.acos().to_degrees()))?;
        }
        let is_beyond = u64::from(distance > tolerance);
        self.beyond += is_beyond;
        if *is_seen {
            self.seen += if is_beyond == 1 { 1 } else { WITHIN_PER_LOOK };
            self.seen_beyond += is_beyond;
        }
        Ok(())
    }

    fn finish(self, options: &DeviationOptions) -> Result<Distances, StoreError> {
        let count = self.samples.max(1) as f64;
        let [p999] = quantiles(self.distances, self.samples, [0.999])?;
        let [median_deg, p99_deg] = quantiles(self.angles, self.angle_count, [0.5, 0.99])?;
        let (mean, rms) = (self.sum / count, (self.sum_of_squares / count).sqrt());
        let largest = self.largest.map_or(0.0, |largest| largest.distance);
        let in_cells = |cell: f64| [mean, rms, p999, largest].map(|length| length / cell);
        Ok(Distances {
            samples: self.samples,
            corners: self.corners,
            mean,
            rms,
            p999,
            largest: self.largest,
            in_cells: options.cell_size.map(in_cells),
            normals: Normals { median_deg, p99_deg },
        })
    }
}

/// Keeps the larger distance, of equals the first.
fn raise(largest: &mut Option<Separation>, found: Separation) {
    if largest.is_none_or(|largest| found.distance > largest.distance) {
        *largest = Some(found);
    }
}

fn answer(space: &mut Space<'_>, sample: Sample, tolerance: f64) -> Result<Answer, StoreError> {
    let (point, normal) = (DVec3::from(sample.point), DVec3::from(sample.normal));
    let near = space.walker.nearest(point, normal)?;
    let near = near.expect("a surface with an area has a triangle");
    let is_asked = near.distance_squared.sqrt() > tolerance || sample.is_one_of(WITHIN_PER_LOOK);
    let is_seen = is_asked && space.sees(point, normal, DVec3::from(sample.inward))?;
    Ok(Answer { sample, near, is_seen })
}

/// Follows the sharp edges of the original along those of the file.
fn compare_creases(
    (original, before): (&Surface, &Creases),
    now: &Creases,
    options: &DeviationOptions,
    means: &Means<'_>,
) -> Result<CreaseReport, StoreError> {
    let mut report = CreaseReport {
        length: before.length,
        visible_length: 0.0,
        file_length: now.length,
        kept_share: None,
        largest: None,
    };
    if report.length == 0.0 {
        return Ok(report);
    }
    let tree = now.tree(means)?;
    let samples = before.samples(original.bounds, options.crease_samples, means)?;
    let mut samples = samples.finish()?;
    let (mut all, mut seen, mut kept) = (0_u64, 0_u64, 0_u64);
    ordered(
        means.pool,
        || {
            means.stop_if_asked()?;
            let mut chunk = Vec::with_capacity(CHUNK);
            while chunk.len() < CHUNK
                && let Some(sample) = samples.next()?
            {
                chunk.push(sample);
            }
            Ok(Some(chunk).filter(|chunk| !chunk.is_empty()))
        },
        || Space::new((original, &tree), true, means),
        |space, chunk: Vec<CreaseSample>| {
            chunk.iter().map(|sample| on_crease(space, sample)).collect::<Result<Vec<_>, _>>()
        },
        |answers| {
            for (is_seen, separation) in answers {
                all += 1;
                seen += u64::from(is_seen);
                if let Some(separation) = separation {
                    kept += u64::from(separation.distance <= options.tolerance);
                    raise(&mut report.largest, separation);
                }
            }
            Ok(())
        },
    )?;
    report.visible_length = report.length * (seen as f64 / all.max(1) as f64);
    report.kept_share = (seen > 0).then(|| kept as f64 / seen as f64);
    Ok(report)
}

/// Whether both sides of a sharp edge are seen, and then what is nearest of those of the file.
fn on_crease(
    space: &mut Space<'_>,
    sample: &CreaseSample,
) -> Result<(bool, Option<Separation>), StoreError> {
    let point = DVec3::from(sample.point);
    for (normal, inward) in sample.normals.iter().zip(&sample.inwards) {
        if !space.sees(point, DVec3::from(*normal), DVec3::from(*inward))? {
            return Ok((false, None));
        }
    }
    let near = space.walker.nearest(point, DVec3::ZERO)?;
    let separation = near.map(|near| Separation {
        distance: near.distance_squared.sqrt(),
        position: sample.point,
        nearest: near.point.into(),
    });
    Ok((true, separation))
}
