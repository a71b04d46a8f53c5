//! Contacts: where a rim is covered, by another rim that faces it or by a face that it ends on.
//!
//! In:         rims, their samples by brick, and the bins.
//! Out:        a sort of [`Contact`]s by rim and sample.
//! Invariant:  a contact is a fact about two places no farther apart than the reach; nothing
//!             depends on which brick it was found in.
//! Units:      model units.
//! Memory:     the samples of the bricks under way, at most [`MOST_SAMPLES`] each; where a brick has
//!             more, whole lots of them count as covered.

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::bridge::MendOptions;
use crate::bridge::rims::RimEdge;
use crate::bridge::samples::{RimSample, sample_rims};
use crate::bridge::sheets::Sheets;
use crate::geom::closest_on_triangle;
use crate::octree::{BinWalk, BinnedSoup, Domain, SoupBin, SoupTriangle};
use crate::store::{Outbox, Record, Resources, Sorted, Sorter, Spool, StoreError, ordered};

/// More rim than this in one brick is no opening but a tangle.
const MOST_SAMPLES: usize = 1 << 16;

/// Cosine between the ways out of two rims of one sheet below which they face each other.
const FACING: f64 = -0.5;

/// Cosine between the ways out of two rims above which they lie side by side, as those of two
/// layers do.
const SIDE_BY_SIDE: f64 = 0.5;

/// Sine between the way out of a rim and a face above which the rim ends on the face.
const ACROSS: f64 = 0.3;

/// A rim that is closer than this to another surface lies on it, as a decal or a near-double does.
const LYING_CELLS: f64 = 0.5;

/// No more sheets than this are told of one sample.
const MOST_SHEETS: usize = 4;

/// A sample that is covered. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Contact {
    /// Number of the rim edge, and of the sample on it.
    pub rim: u32,
    pub index: u32,
    /// Number of the sheet whose rim covers it; [`ON_FACE`] where it ends on a face, [`LYING`] where
    /// it lies on one, [`GLAZED`] where a pane is beside it.
    pub sheet: u32,
    /// How far the rim that covers it is, in cells; 0 for faces.
    pub apart: f32,
}

/// In [`Contact::sheet`]: the rim ends on a face.
pub const ON_FACE: u32 = u32::MAX;
/// In [`Contact::sheet`]: the rim lies on a face.
pub const LYING: u32 = u32::MAX - 1;

/// In [`Contact::sheet`]: a pane closes the opening there, through which one looks.
pub const GLAZED: u32 = u32::MAX - 2;

impl Record for Contact {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.rim, self.index, self.sheet)
    }
}

/// A brick with samples.
struct Near {
    bin: SoupBin,
    samples: Vec<RimSample>,
}

/// Finds all contacts, and how many samples count as covered since too many lie in one brick.
pub fn find_contacts(
    soup: &BinnedSoup,
    rims: &Spool<RimEdge>,
    sheets: &mut Sheets,
    options: &MendOptions,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Sorter<Contact>, u64), StoreError> {
    let samples = sample_rims(rims, options.max_gap, domain, resources)?;
    let contacts = Mutex::new(Sorter::new(resources.scratch, resources.share_bytes / 4));
    let mut samples = samples.finish()?;
    let next = samples.next()?;
    let mut bricks =
        NearBricks { walk: soup.walk(), samples, next, crowd: Outbox::new(&contacts), crowded: 0 };
    let sheets = Mutex::new(sheets);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            bricks.next_brick()
        },
        || Outbox::new(&contacts),
        |outbox, near: Near| {
            let lying = LYING_CELLS * domain.cell_size();
            let grid = SampleGrid::new(&near.samples, options.max_gap, lying);
            let cell = domain.cell_size();
            for (sample, found) in near.samples.iter().zip(grid.facing_rims()) {
                let (rim, index) = (sample.rim, sample.index);
                for (sheet, apart) in found {
                    let apart = (apart / cell) as f32;
                    outbox.push(Contact { rim, index, sheet, apart })?;
                }
            }
            near.bin.each(soup, |triangle| {
                for (sample, ends) in grid.samples_near(triangle) {
                    if ends != Ends::Beside && covers(&sheets, triangle.source, sample, ends)? {
                        let (rim, index) = (sample.rim, sample.index);
                        let sheet = match ends {
                            _ if triangle.is_pane() && sample.is_pane == 0 => GLAZED,
                            Ends::Lying => LYING,
                            _ => ON_FACE,
                        };
                        outbox.push(Contact { rim, index, sheet, apart: 0.0 })?;
                    }
                }
                Ok(())
            })?;
            outbox.send()
        },
        |()| Ok(()),
    )?;
    let crowded = bricks.crowded;
    drop(bricks);
    Ok((contacts.into_inner().unwrap_or_else(PoisonError::into_inner), crowded))
}

/// How a rim ends near a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// On it, from one side.
    Across,
    /// In it: it lies on the face.
    Lying,
    /// It runs past the face.
    Beside,
}

/// Whether a triangle covers a sample that ends near it. Of two open sheets that lie on each other
/// the first one covers the other, lest both are lost.
fn covers(
    sheets: &Mutex<&mut Sheets>,
    source: u32,
    sample: &RimSample,
    ends: Ends,
) -> Result<bool, StoreError> {
    let mut sheets = sheets.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(match sheets.find(source)? {
        None => true,
        Some((number, _)) if ends == Ends::Lying => number < sample.sheet,
        Some((number, _)) => number != sample.sheet,
    })
}

/// Bricks with triangles and samples.
struct NearBricks<'n> {
    walk: BinWalk<'n>,
    samples: Sorted<RimSample>,
    next: Option<RimSample>,
    crowd: Outbox<'n, Contact>,
    crowded: u64,
}

impl NearBricks<'_> {
    fn next_brick(&mut self) -> Result<Option<Near>, StoreError> {
        while let (Some(bin), Some(first)) = (self.walk.next_bin()?, self.next) {
            // A brick without triangles holds no rim either.
            let mut first = first;
            while first.brick < bin.brick.0 {
                self.next = self.samples.next()?;
                let Some(next) = self.next else {
                    self.crowd.send()?;
                    return Ok(None);
                };
                first = next;
            }
            if first.brick > bin.brick.0 {
                continue;
            }
            let mut samples = Vec::new();
            while let Some(sample) = self.next
                && sample.brick == bin.brick.0
            {
                samples.push(sample);
                self.next = self.samples.next()?;
                if samples.len() == MOST_SAMPLES {
                    self.cover(&samples)?;
                    samples.clear();
                }
            }
            return Ok(Some(Near { bin, samples }));
        }
        self.crowd.send()?;
        Ok(None)
    }

    /// Says of a crowd of samples that they are covered.
    fn cover(&mut self, samples: &[RimSample]) -> Result<(), StoreError> {
        self.crowded += samples.len() as u64;
        samples.iter().try_for_each(|sample| {
            let (rim, index) = (sample.rim, sample.index);
            // As if a rim of its own sheet faced it.
            self.crowd.push(Contact { rim, index, sheet: sample.sheet, apart: 0.0 })
        })
    }
}

/// Samples of a brick by small cubes, as wide as the reach.
struct SampleGrid<'s> {
    samples: &'s [RimSample],
    reach: f64,
    lying: f64,
    /// Cube and number of each sample, by cube.
    cubes: Vec<([i64; 3], u32)>,
}

impl<'s> SampleGrid<'s> {
    fn new(samples: &'s [RimSample], reach: f64, lying: f64) -> Self {
        let cube = |sample: &RimSample| sample.at.map(|c| (c / reach).floor() as i64);
        let mut cubes: Vec<_> =
            samples.iter().enumerate().map(|(i, sample)| (cube(sample), i as u32)).collect();
        cubes.sort_unstable();
        Self { samples, reach, lying, cubes }
    }

    fn in_cube(&self, cube: [i64; 3]) -> impl Iterator<Item = &'s RimSample> {
        let first = self.cubes.partition_point(|entry| entry.0 < cube);
        let samples = self.samples;
        self.cubes[first..]
            .iter()
            .take_while(move |entry| entry.0 == cube)
            .map(move |entry| &samples[entry.1 as usize])
    }

    /// Of each sample the sheets whose rims face it, and how far the nearest of each is. Panes and
    /// opaque sheets do not close each other.
    fn facing_rims(&self) -> impl Iterator<Item = Vec<(u32, f64)>> {
        self.samples.iter().map(|sample| {
            let home = sample.at.map(|c| (c / self.reach).floor() as i64);
            let mut found: Vec<(u32, f64)> = Vec::new();
            for at in 0..27 {
                let cube = [0, 1, 2].map(|a| home[a] + at / 3_i64.pow(a as u32) % 3 - 1);
                for other in self.in_cube(cube).filter(|other| faces(sample, other, self.reach)) {
                    let apart = sample.place().distance(other.place());
                    let of = match [sample.is_pane, other.is_pane] {
                        [0, 1] => GLAZED,
                        [1, 0] => continue,
                        _ => other.sheet,
                    };
                    match found.iter().position(|(sheet, _)| *sheet == of) {
                        Some(known) => found[known].1 = found[known].1.min(apart),
                        None if found.len() < MOST_SHEETS => found.push((of, apart)),
                        None => {}
                    }
                }
            }
            found
        })
    }

    /// The samples within reach of a triangle, and how they end there.
    fn samples_near(&self, triangle: &SoupTriangle) -> Vec<(&'s RimSample, Ends)> {
        let corners = triangle.corners.map(DVec3::from);
        let reach = DVec3::splat(self.reach);
        let lo = corners.iter().fold(DVec3::INFINITY, |lo, c| lo.min(*c)) - reach;
        let hi = corners.iter().fold(DVec3::NEG_INFINITY, |hi, c| hi.max(*c)) + reach;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let look = |sample: &'s RimSample| {
            let at = sample.place();
            if !(at.cmpge(lo).all() && at.cmple(hi).all()) {
                return None;
            }
            let distance = at.distance(closest_on_triangle(at, corners));
            let is_across = sample.out().dot(normal).abs() > ACROSS;
            match distance {
                far if far > self.reach => None,
                _ if is_across => Some((sample, Ends::Across)),
                near if near <= self.lying => Some((sample, Ends::Lying)),
                _ => Some((sample, Ends::Beside)),
            }
        };
        let cubes = |p: DVec3| p.to_array().map(|c| (c / self.reach).floor() as i64);
        let (first, last) = (cubes(lo), cubes(hi));
        let count: f64 = (0..3).map(|a| (last[a] - first[a] + 1) as f64).product();
        if count > self.samples.len() as f64 {
            return self.samples.iter().filter_map(look).collect();
        }
        let mut near = Vec::new();
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    near.extend(self.in_cube([x, y, z]).filter_map(look));
                }
            }
        }
        near
    }
}

/// Whether the rim at `other` closes the one at `sample`.
fn faces(sample: &RimSample, other: &RimSample, reach: f64) -> bool {
    if sample.rim == other.rim {
        return false;
    }
    let apart = other.place() - sample.place();
    if apart.length_squared() > reach * reach {
        return false;
    }
    let cosine = sample.out().dot(other.out());
    if sample.sheet != other.sheet {
        return cosine < SIDE_BY_SIDE;
    }
    // The two rims of a narrow ribbon look away from each other.
    let slack = 0.25 * reach;
    cosine < FACING && apart.dot(sample.out()) > -slack && apart.dot(other.out()) < slack
}
