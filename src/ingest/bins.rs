//! Second pass: every triangle into the bins of the bricks that it touches.
//!
//! In:         the soup.
//! Out:        for each brick the triangles that touch it, by source number: as entries of the soup itself
//!             where neighbours follow each other in the file, else as sorted copies.
//! Invariant:  what a bin holds does not depend on which of the two it is.
//! Memory:     the share.
//! Fails:      only as [`StoreError`].

use std::sync::atomic::{AtomicBool, Ordering};

use crate::ingest::area::{AreaHistogram, SoupMeasure};
use crate::ingest::crowds::{CrowdFilter, LeftOut};
use crate::ingest::soup::{SOUP, Soup};
use crate::monitor::{Gauge, Resident};
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, DropRecord, SoupBlock, SoupSpool,
    SoupTriangle, SoupWriter, for_each_touched_brick, write_bins,
};
use crate::store::{FileState, Resources, Sorter, Spool, SpoolWriter, StoreError, ordered};

/// Spool of the binned triangles, by brick and source number.
pub const BINS: &str = "bins.spool";
/// Spool of the bins themselves.
pub const BIN_ENTRIES: &str = "bins.entries";
/// Triangles per work item.
const ITEM_TRIANGLES: usize = 2048;

/// Entries are of the soup itself while they hold so many triangles on average; shorter ones would be read
/// piecemeal.
const FEWEST_IN_ENTRY: u64 = 3;
/// Entries that there may be before that is asked.
const FREE_ENTRIES: u64 = 4096;
/// Entries under way that a triangle may continue.
const OPEN_ENTRIES: usize = 16;

/// The bins of all bricks.
pub struct Bins {
    /// The triangles: sorted copies, or the soup as it is where neighbours follow each other in the file.
    pub triangles: SoupSpool,
    /// Where those of each brick lie, by ascending brick key.
    pub entries: Spool<BinEntry>,
    /// What is in no bin.
    pub left_out: LeftOut,
    /// How the sorted copies are found again; none are there where the soup serves as it is.
    copies: FileState,
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
        let copies = SoupSpool::open(resources.scratch, FileState::find(files, BINS)?)?;
        let entries = Spool::open(resources.scratch, FileState::find(files, BIN_ENTRIES)?)?;
        let state = copies.state().clone();
        let triangles = if copies.is_empty() {
            SoupSpool::open(resources.scratch, FileState::find(files, SOUP)?)?
        } else {
            copies
        };
        Ok(Self { triangles, entries, left_out, copies: state })
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
        vec![self.copies.clone(), self.entries.state().clone()]
    }
}

/// Puts the triangles of `soup` into bins. Of triangles that come in crowds, pairs are left out.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn fill_bins(
    soup: Soup,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Bins, SoupMeasure), StoreError> {
    let Some((entries, measure)) = list_entries(&soup, domain, resources)? else {
        return sort_copies(&soup, domain, resources);
    };
    let none = SoupWriter::create(resources.scratch, BINS)?.finish()?;
    let copies = none.state().clone();
    let bins = Bins { triangles: soup.spool, entries, left_out: LeftOut::default(), copies };
    Ok((bins, measure))
}

/// Lists which triangles of the soup each brick has; `None` where it takes too many entries, or the soup does
/// not serve as it is.
fn list_entries(
    soup: &Soup,
    domain: &Domain,
    resources: &Resources,
) -> Result<Option<(Spool<BinEntry>, SoupMeasure)>, StoreError> {
    if !soup.looks.is_none() {
        return Ok(None);
    }
    let mut histogram = AreaHistogram::new(soup.facts.bounds);
    let mut filter = CrowdFilter::new(domain);
    let mut sorter = Sorter::<BinEntry>::new(resources.scratch, resources.share_bytes);
    let resident = Resident::new(Gauge::ResidentTriangles, resources.monitor);
    let (mut next, mut block) = (0, SoupBlock::default());
    let serves = AtomicBool::new(true);
    let (mut listed, mut held) = (0, 0);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            let first = next;
            soup.spool.read(first, ITEM_TRIANGLES, &mut block)?;
            let mut triangles = block.take();
            next += triangles.len() as u64;
            triangles.iter().for_each(|triangle| histogram.add(triangle));
            let count = triangles.len();
            if filter.thin_out(&mut triangles) {
                serves.store(false, Ordering::Relaxed);
            }
            let goes_on = count > 0 && serves.load(Ordering::Relaxed);
            let held = resident.hold(count);
            Ok(goes_on.then_some((first, triangles, held)))
        },
        || (),
        |(), (first, triangles, _held): (u64, Vec<SoupTriangle>, _)| {
            entries_of(domain, first, &triangles)
        },
        |entries: Vec<BinEntry>| {
            listed += entries.len() as u64;
            held += entries.iter().map(|entry| entry.count).sum::<u64>();
            if listed > FREE_ENTRIES + held / FEWEST_IN_ENTRY {
                serves.store(false, Ordering::Relaxed);
            }
            sorter.extend(&entries)
        },
    )?;
    if !serves.into_inner() {
        return Ok(None);
    }
    let mut spool = SpoolWriter::create(resources.scratch, BIN_ENTRIES)?;
    let mut sorted = sorter.finish()?;
    while let Some(entry) = sorted.next()? {
        spool.push(entry)?;
    }
    Ok(Some((spool.finish()?, histogram.finish())))
}

/// The entries of triangles that lie in the soup from `first` on.
fn entries_of(
    domain: &Domain,
    first: u64,
    triangles: &[SoupTriangle],
) -> Result<Vec<BinEntry>, StoreError> {
    let mut entries: Vec<BinEntry> = Vec::new();
    for (number, triangle) in (first..).zip(triangles) {
        let corners = triangle.corners.map(|c| domain.snap(c));
        for_each_touched_brick(domain, corners, &mut |key| {
            let open = entries.len().saturating_sub(OPEN_ENTRIES);
            let last = entries[open..].iter_mut().rev().find(|entry| entry.brick == key.0);
            match last {
                Some(entry) if entry.first + entry.count == number => entry.count += 1,
                _ => entries.push(BinEntry { brick: key.0, first: number, count: 1 }),
            }
            Ok::<(), StoreError>(())
        })?;
    }
    Ok(entries)
}

/// Sorts copies of the triangles of the soup into bins.
fn sort_copies(
    soup: &Soup,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Bins, SoupMeasure), StoreError> {
    let mut histogram = AreaHistogram::new(soup.facts.bounds);
    let mut filter = CrowdFilter::new(domain);
    let mut sorter = Sorter::<BinTriangle>::new(resources.scratch, resources.share_bytes);
    let (mut next, mut block, mut looks) = (0, SoupBlock::default(), Vec::new());
    let resident = Resident::new(Gauge::ResidentTriangles, resources.monitor);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            soup.spool.read(next, ITEM_TRIANGLES, &mut block)?;
            let mut triangles = block.take();
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
    let copies = triangles.state().clone();
    Ok((Bins { triangles, entries, left_out: filter.left_out(), copies }, histogram.finish()))
}

#[cfg(test)]
mod tests;
