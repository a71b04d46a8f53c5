//! Second pass: every triangle into the bins of the bricks that it touches.
//!
//! Of a large triangle that comes again and again in a row, the third and later copies lie only in
//! the bins where copies are counted: two are enough to know that there are copies, and one counts
//! at most. So a million sheets in one place are no more work than a million small triangles.

use bytemuck::{Pod, Zeroable};

use crate::ingest::area::{AreaHistogram, SoupMeasure};
use crate::ingest::packed::{KeySet, Point, pack_corners};
use crate::ingest::soup::Soup;
use crate::ingest::touch::for_each_touched_brick;
use crate::monitor::{Gauge, Resident};
use crate::octree::{BinTriangle, BrickKey, Domain, SoupTriangle};
use crate::store::{Resources, Sorter, Spool, SpoolWriter, StoreError, ordered};

/// Spool of the binned triangles, by brick and source number.
pub const BINS: &str = "bins.spool";
/// Spool of the bins themselves.
pub const BIN_ENTRIES: &str = "bins.entries";
/// Triangles per work item.
const ITEM_TRIANGLES: usize = 2048;

/// Triangles whose box is longer than this, all sides together, are large.
const LARGE_BRICKS: i64 = 4;

/// Where the triangles of a brick lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BinEntry {
    /// Key of the brick.
    pub brick: u64,
    /// First triangle in the spool.
    pub first: u64,
    /// How many.
    pub count: u64,
}

/// The bins of all bricks.
pub struct Bins {
    /// The triangles.
    pub triangles: Spool<SoupTriangle>,
    /// The bins by ascending brick key.
    pub entries: Spool<BinEntry>,
}

impl Bins {
    /// Opens the bins that an earlier run left.
    ///
    /// # Errors
    /// They are missing or damaged.
    pub fn open(resources: &Resources) -> Result<Self, StoreError> {
        Ok(Self {
            triangles: Spool::open(resources.scratch, BINS)?,
            entries: Spool::open(resources.scratch, BIN_ENTRIES)?,
        })
    }
}

/// Sorts the triangles of `soup` into bins.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn fill_bins(
    soup: &Soup,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Bins, SoupMeasure), StoreError> {
    let mut histogram = AreaHistogram::new(soup.bounds);
    let mut sorter = Sorter::<BinTriangle>::new(resources.scratch, resources.share_bytes);
    let mut next = 0;
    let resident = Resident::new(Gauge::ResidentTriangles, resources.monitor);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            let mut triangles = Vec::new();
            soup.spool.read(next, ITEM_TRIANGLES, &mut triangles)?;
            next += triangles.len() as u64;
            let held = resident.hold(triangles.len());
            Ok((!triangles.is_empty()).then_some((triangles, held)))
        },
        || (),
        |(), (triangles, held): (Vec<SoupTriangle>, _)| {
            let mut binned = Vec::with_capacity(triangles.len() * 5 / 4);
            let mut copies = Copies::default();
            for triangle in &triangles {
                // In one order, so that copies touch the same bricks down to the last bit.
                let mut corners = triangle.corners.map(|c| domain.snap(c));
                corners.sort_unstable();
                let mut add = |key: BrickKey| {
                    binned.push(BinTriangle { brick: key.0, triangle: *triangle });
                };
                if is_large(domain, corners) && copies.is_third(corners) {
                    counting_bricks(domain, corners).for_each(add);
                } else {
                    for_each_touched_brick(domain, corners, &mut |key| {
                        add(key);
                        Ok::<(), StoreError>(())
                    })?;
                }
            }
            Ok((triangles, binned, held))
        },
        |(triangles, binned, _held)| {
            triangles.iter().for_each(|triangle| histogram.add(triangle));
            sorter.extend(&binned)
        },
    )?;
    Ok((write_bins(sorter, resources)?, histogram.finish()))
}

/// The large triangles of one work item, by their corners.
#[derive(Default)]
struct Copies {
    once: KeySet<[u64; 4]>,
    twice: KeySet<[u64; 4]>,
}

impl Copies {
    /// Whether two triangles with these corners came before.
    fn is_third(&mut self, corners: [[i32; 3]; 3]) -> bool {
        let key = pack_corners(corners.map(unsigned));
        !self.once.insert(key) && !self.twice.insert(key)
    }
}

/// Lattice points of a model are never negative.
fn unsigned(point: [i32; 3]) -> Point {
    point.map(|c| c as u32)
}

/// Whether a triangle may touch more bricks than a few.
fn is_large(domain: &Domain, corners: [[i32; 3]; 3]) -> bool {
    let reach = |axis: usize| {
        let coordinates = corners.map(|c| i64::from(c[axis]));
        coordinates.iter().max().zip(coordinates.iter().min()).map_or(0, |(hi, lo)| hi - lo)
    };
    (0..3).map(reach).sum::<i64>() > LARGE_BRICKS * domain.brick_units()
}

/// The bricks in whose bins copies and triangles without area are counted: the first one that the
/// triangle touches, and the one that holds its lowest corner.
fn counting_bricks(domain: &Domain, corners: [[i32; 3]; 3]) -> impl Iterator<Item = BrickKey> {
    let mut first = None;
    let _: Result<(), ()> = for_each_touched_brick(domain, corners, &mut |key| {
        first = Some(key);
        Err(())
    });
    let brick = domain.brick_units() as u32;
    let lowest = BrickKey::new(unsigned(corners[0]).map(|c| c / brick));
    first.into_iter().chain((first != Some(lowest)).then_some(lowest))
}

fn write_bins(sorter: Sorter<BinTriangle>, resources: &Resources) -> Result<Bins, StoreError> {
    let mut triangles = SpoolWriter::create(resources.scratch, BINS)?;
    let mut entries = SpoolWriter::create(resources.scratch, BIN_ENTRIES)?;
    let mut sorted = sorter.finish()?;
    let mut open: Option<BinEntry> = None;
    while let Some(binned) = sorted.next()? {
        match &mut open {
            Some(entry) if entry.brick == binned.brick => entry.count += 1,
            _ => {
                let first = triangles.len();
                let entry = BinEntry { brick: binned.brick, first, count: 1 };
                open.replace(entry).map_or(Ok(()), |done| entries.push(done))?;
            }
        }
        triangles.push(binned.triangle)?;
    }
    open.map_or(Ok(()), |done| entries.push(done))?;
    Ok(Bins { triangles: triangles.finish()?, entries: entries.finish()? })
}
