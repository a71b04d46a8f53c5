//! Samples of rims, by the bricks that they are near to.
//!
//! In:         a spool of [`RimEdge`]s.
//! Out:        a sort of [`RimSample`]s: about one for each cell of length, once per brick within
//!             reach.
//! Memory:     the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::bridge::rims::{HELD, RimEdge};
use crate::octree::{BrickKey, Domain};
use crate::store::{Record, Resources, Sorter, Spool, StoreError};

/// A point of a rim. 64 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct RimSample {
    pub brick: u64,
    /// Number of the rim edge, and of the sample on it.
    pub rim: u32,
    pub index: u32,
    /// Model units.
    pub at: [f64; 3],
    /// Out of the sheet.
    pub out: [f32; 3],
    /// Number of the sheet.
    pub sheet: u32,
    /// 1 where light passes it.
    pub is_pane: u32,
    /// Zero.
    pub unused: u32,
}

impl RimSample {
    pub fn place(&self) -> DVec3 {
        DVec3::from(self.at)
    }

    pub fn out(&self) -> DVec3 {
        DVec3::from(self.out.map(f64::from))
    }
}

impl Record for RimSample {
    type Key = (u64, u32, u32);
    fn key(&self) -> Self::Key {
        (self.brick, self.rim, self.index)
    }
}

/// How many samples an edge of this length has.
pub fn samples_of(length: f64, cell: f64) -> u32 {
    (length / cell).ceil().clamp(1.0, 65_536.0) as u32
}

/// Samples all rims that nothing holds.
pub fn sample_rims(
    rims: &Spool<RimEdge>,
    reach: f64,
    domain: &Domain,
    resources: &Resources,
) -> Result<Sorter<RimSample>, StoreError> {
    let mut samples = Sorter::new(resources.scratch, resources.share_bytes / 4);
    let mut number = 0_u32;
    let mut reader = rims.reader(0, rims.len());
    while let Some(block) = reader.next_block()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        for rim in block {
            if rim.flags & HELD == 0 {
                sample(rim, number, reach, domain, &mut samples)?;
            }
            number += 1;
        }
    }
    Ok(samples)
}

fn sample(
    rim: &RimEdge,
    number: u32,
    reach: f64,
    domain: &Domain,
    samples: &mut Sorter<RimSample>,
) -> Result<(), StoreError> {
    let ([a, b], out) = (rim.ends(), rim.out().as_vec3().to_array());
    let count = samples_of(rim.length(), domain.cell_size());
    for index in 0..count {
        let at = a.lerp(b, (f64::from(index) + 0.5) / f64::from(count));
        let [lo, hi] = bricks_within(at, reach, domain);
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let brick = BrickKey::new([x, y, z]).0;
                    samples.push(RimSample {
                        brick,
                        rim: number,
                        index,
                        at: at.to_array(),
                        out,
                        sheet: rim.sheet,
                        is_pane: u32::from(rim.is_pane()),
                        unused: 0,
                    })?;
                }
            }
        }
    }
    Ok(())
}

/// The range of bricks that hold points no farther than `reach` from `at` along any axis.
fn bricks_within(at: DVec3, reach: f64, domain: &Domain) -> [[u32; 3]; 2] {
    let brick = domain.brick_units();
    let last = i64::from(domain.bricks_per_side()) - 1;
    [-reach, reach].map(|by| {
        let units = domain.snap((at + DVec3::splat(by)).to_array());
        units.map(|c| (i64::from(c) / brick).clamp(0, last) as u32)
    })
}
