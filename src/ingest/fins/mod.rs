//! Takes out fins: flat sheets that hang from a surface by an edge; on demand free sheets as well.
//!
//! A sheet is a set of triangles joined across the edges that exactly two of them meet. A flat one
//! is a fin if it hangs on an edge of something else, by less than half of its border, is open on
//! the rest, and leaves that edge closed when it goes: so a fin that is gone opens nothing. A shelf
//! that is held on three sides is no fin, and neither are walls around an opening, which are not
//! flat. What has many triangles or much area was made on purpose.
//!
//! In:         bins, and what is settled about copies in them.
//! Out:        [`Settled`] with the triangles of fins among the drops.
//! Invariant:  the answer does not depend on any share or thread; on the order of the triangles
//!             only by the rounding of areas and lengths.
//! Units:      lattice units; areas and lengths in model units.
//! Memory:     the share; tables over all triangles, only where the soup is open.
//! Fails:      [`StoreError`].
//! Source:     ours.

mod edges;
mod parts;

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::ingest::bins::Bins;
use crate::ingest::duplicates::{DROPS, SettleStats, Settled};
use crate::ingest::facts::Outbox;
use crate::ingest::fins::edges::{BorderUse, EdgeFinder, Pair};
use crate::ingest::fins::parts::Parts;
use crate::ingest::kept::KeptBins;
use crate::octree::{Domain, DropRecord};
use crate::store::{Resources, Sorter, SpoolWriter, StoreError, Unite, ordered};

/// What becomes of sheets without thickness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SheetRule {
    /// Free ones become plates, fins go.
    #[default]
    Thicken,
    /// Flat free ones and fins go.
    Remove,
    /// All become plates.
    KeepFins,
}

/// Sheets that were taken out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FinStats {
    /// Fins.
    pub fins: u64,
    /// Free sheets.
    pub free_sheets: u64,
    /// Triangles of both.
    pub triangles: u64,
    /// Area of both, model units squared.
    pub area: f64,
}

/// Sorts of one bin and of all that are alive at one time.
const SORTS: u64 = 4;

/// Adds the triangles of fins to the drops of `settled`; of free sheets where `rule` says so.
/// `triangles` is the number of source numbers, `area` that of the soup.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn drop_fins(
    bins: &Bins,
    settled: Settled,
    rule: SheetRule,
    domain: &Domain,
    (triangles, area): (u64, f64),
    resources: &Resources,
) -> Result<Settled, StoreError> {
    if rule == SheetRule::KeepFins || settled.stats.rim_edges == 0 {
        return Ok(settled);
    }
    let share = resources.share_bytes / 4;
    let (pairs, borders) = find_edges(bins, &settled, domain, resources)?;
    let mut sheets = Unite::new(resources.scratch, share, triangles)?;
    let mut sorted = pairs.finish()?;
    while let Some(Pair { one, other }) = sorted.next()? {
        sheets.unite(one, other)?;
    }
    let unit = domain.cell_size() / f64::from(domain.cell_units);
    let mut parts = Parts::new(sheets.finish()?, unit, resources)?;
    parts.take_borders(borders)?;
    if !parts.may_have_fins(rule)? {
        parts.end()?;
        return Ok(settled);
    }
    let mut kept = KeptBins::new(bins, &settled);
    while let Some(bin) = kept.next_bin()? {
        let brick = bin.entry.brick;
        bin.each(bins, &settled, |triangle| parts.add_area(triangle, domain, brick))?;
    }
    let stats = parts.decide(rule, area)?;
    if stats.triangles == 0 {
        parts.end()?;
        return Ok(settled);
    }
    let drops = all_drops(bins, &settled, &mut parts, resources)?;
    parts.end()?;
    let stats = SettleStats { fins: stats, ..settled.stats };
    drop(settled);
    let mut spool = SpoolWriter::create(resources.scratch, DROPS)?;
    let mut sorted = drops.finish()?;
    while let Some(record) = sorted.next()? {
        spool.push(record)?;
    }
    Ok(Settled { drops: spool.finish()?, stats })
}

/// The edges of all bins: those that join two triangles, and all others.
fn find_edges(
    bins: &Bins,
    settled: &Settled,
    domain: &Domain,
    resources: &Resources,
) -> Result<(Sorter<Pair>, Sorter<BorderUse>), StoreError> {
    let scratch = resources.scratch;
    let workers = resources.pool.current_num_threads() as u64;
    let share_bytes = resources.share_bytes / 2 / workers / SORTS;
    let pairs = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
    let borders = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
    let mut kept = KeptBins::new(bins, settled);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            kept.next_bin()
        },
        || {
            let (pairs, borders) = (Outbox::new(&pairs), Outbox::new(&borders));
            EdgeFinder { bins, settled, domain, scratch, share_bytes, pairs, borders }
        },
        |finder, bin| finder.find(&bin),
        |()| Ok(()),
    )?;
    let pairs = pairs.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((pairs, borders.into_inner().unwrap_or_else(PoisonError::into_inner)))
}

/// The drops of before, and those of the sheets that go.
fn all_drops(
    bins: &Bins,
    settled: &Settled,
    parts: &mut Parts,
    resources: &Resources,
) -> Result<Sorter<DropRecord>, StoreError> {
    let mut drops = Sorter::<DropRecord>::new(resources.scratch, resources.share_bytes / 4);
    let mut reader = settled.drops.reader(0, settled.drops.len());
    while let Some(block) = reader.next_block()? {
        drops.extend(block)?;
    }
    let mut kept = KeptBins::new(bins, settled);
    while let Some(bin) = kept.next_bin()? {
        bin.each(bins, settled, |triangle| {
            if parts.goes(triangle.source)? {
                let brick = bin.entry.brick;
                drops.push(DropRecord { brick, source: triangle.source, unused: 0 })?;
            }
            Ok(())
        })?;
    }
    Ok(drops)
}
