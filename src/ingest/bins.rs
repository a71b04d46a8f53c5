//! Second pass: every triangle into the bins of the bricks that it touches.

use crate::ingest::area::{AreaHistogram, SoupMeasure};
use crate::ingest::crowds::{CrowdFilter, LeftOut};
use crate::ingest::soup::Soup;
use crate::monitor::{Gauge, Resident};
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, DropRecord, SoupTriangle,
    for_each_touched_brick, write_bins,
};
use crate::store::{FileState, Resources, Sorter, Spool, StoreError, ordered};

/// Spool of the binned triangles, by brick and source number.
pub const BINS: &str = "bins.spool";
/// Spool of the bins themselves.
pub const BIN_ENTRIES: &str = "bins.entries";
/// Triangles per work item.
const ITEM_TRIANGLES: usize = 2048;

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

    /// The soup without what `drops` leaves out.
    #[must_use]
    pub fn without<'b>(&'b self, drops: &'b Spool<DropRecord>) -> BinnedSoup<'b> {
        BinnedSoup { bins: self.spools(), drops, added: None }
    }

    /// The bins as they are.
    #[must_use]
    pub fn spools(&self) -> BinSpools<'_> {
        BinSpools { triangles: &self.triangles, entries: &self.entries }
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
    let (mut next, mut looks) = (0, Vec::new());
    let resident = Resident::new(Gauge::ResidentTriangles, resources.monitor);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            let mut triangles = Vec::new();
            soup.spool.read(next, ITEM_TRIANGLES, &mut triangles)?;
            soup.looks.put_on(next, &mut triangles, &mut looks)?;
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
    let (triangles, entries) = write_bins(sorter, [BINS, BIN_ENTRIES], resources)?;
    Ok((Bins { triangles, entries, left_out: filter.left_out() }, histogram.finish()))
}
