//! Second pass: every triangle into the bins of the bricks that it touches.

use bytemuck::{Pod, Zeroable};

use crate::ingest::area::{AreaHistogram, SoupMeasure};
use crate::ingest::crowds::{CrowdFilter, LeftOut};
use crate::ingest::soup::Soup;
use crate::ingest::touch::for_each_touched_brick;
use crate::monitor::{Gauge, Resident};
use crate::octree::{BinTriangle, Domain, SoupTriangle};
use crate::store::{FileState, Resources, Sorter, Spool, SpoolWriter, StoreError, ordered};

/// Spool of the binned triangles, by brick and source number.
pub const BINS: &str = "bins.spool";
/// Spool of the bins themselves.
pub const BIN_ENTRIES: &str = "bins.entries";
/// Triangles per work item.
const ITEM_TRIANGLES: usize = 2048;

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
    /// What is in no bin.
    pub left_out: LeftOut,
}

impl Bins {
    /// Opens the bins that an earlier run left, from which it left out so much.
    ///
    /// # Errors
    /// They are missing or damaged.
    pub fn open(
        resources: &Resources,
        files: &[FileState],
        left_out: LeftOut,
    ) -> Result<Self, StoreError> {
        Ok(Self {
            triangles: Spool::open(resources.scratch, FileState::find(files, BINS)?)?,
            entries: Spool::open(resources.scratch, FileState::find(files, BIN_ENTRIES)?)?,
            left_out,
        })
    }

    /// The files, as they have to be found again.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        vec![self.triangles.state().clone(), self.entries.state().clone()]
    }
}

/// Sorts the triangles of `soup` into bins. Of triangles that come in crowds, pairs are left out.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn fill_bins(
    soup: &Soup,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Bins, SoupMeasure), StoreError> {
    let mut histogram = AreaHistogram::new(soup.facts.bounds);
    let mut filter = CrowdFilter::new(domain);
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
            triangles.iter().for_each(|triangle| histogram.add(triangle));
            let is_last = triangles.is_empty();
            if is_last {
                triangles = filter.finish();
            } else {
                filter.thin_out(&mut triangles);
            }
            let held = resident.hold(triangles.len());
            Ok((!is_last || !triangles.is_empty()).then_some((triangles, held)))
        },
        || (),
        |(), (triangles, held): (Vec<SoupTriangle>, _)| {
            let mut binned = Vec::with_capacity(triangles.len() * 5 / 4);
            for triangle in &triangles {
                let corners = triangle.corners.map(|c| domain.snap(c));
                for_each_touched_brick(domain, corners, &mut |key| {
                    binned.push(BinTriangle { brick: key.0, triangle: *triangle });
                    Ok::<(), StoreError>(())
                })?;
            }
            Ok((binned, held))
        },
        |(binned, _held)| sorter.extend(&binned),
    )?;
    let mut bins = write_bins(sorter, resources)?;
    bins.left_out = filter.left_out();
    Ok((bins, histogram.finish()))
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
                if resources.monitor.cancelled() {
                    return Err(StoreError::Cancelled);
                }
                let first = triangles.len();
                let entry = BinEntry { brick: binned.brick, first, count: 1 };
                open.replace(entry).map_or(Ok(()), |done| entries.push(done))?;
            }
        }
        triangles.push(binned.triangle)?;
    }
    open.map_or(Ok(()), |done| entries.push(done))?;
    let (triangles, entries) = (triangles.finish()?, entries.finish()?);
    Ok(Bins { triangles, entries, left_out: LeftOut::default() })
}
