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

mod parts;

use serde::{Deserialize, Serialize};

use crate::ingest::bins::Bins;
use crate::ingest::duplicates::{DROPS, SettleStats, Settled};
use crate::ingest::fins::parts::Parts;
use crate::octree::{BinnedSoup, Domain, DropRecord, Panes, SoupEdges, TrianglePair};
use crate::store::{Resources, Sorter, SpoolWriter, StoreError, Unite};

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
    let soup = bins.without(&settled.drops);
    let SoupEdges { pairs, borders } = SoupEdges::find(&soup, domain, Panes::Joined, resources)?;
    let mut sheets = Unite::new(resources.scratch, share, triangles)?;
    let mut sorted = pairs.finish()?;
    while let Some(TrianglePair { one, other, .. }) = sorted.next()? {
        sheets.unite(one, other)?;
    }
    let unit = domain.cell_size() / f64::from(domain.cell_units);
    let mut parts = Parts::new(sheets.finish()?, unit, resources)?;
    parts.take_borders(borders)?;
    if !parts.may_have_fins(rule)? {
        parts.end()?;
        return Ok(settled);
    }
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        let brick = bin.brick.0;
        bin.each(&soup, |triangle| parts.add_area(triangle, domain, brick))?;
    }
    let stats = parts.decide(rule, area)?;
    if stats.triangles == 0 {
        parts.end()?;
        return Ok(settled);
    }
    let drops = all_drops(&soup, &mut parts, resources)?;
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

/// The drops of before, and those of the sheets that go.
fn all_drops(
    soup: &BinnedSoup,
    parts: &mut Parts,
    resources: &Resources,
) -> Result<Sorter<DropRecord>, StoreError> {
    let mut drops = Sorter::<DropRecord>::new(resources.scratch, resources.share_bytes / 4);
    let mut reader = soup.drops.reader(0, soup.drops.len());
    while let Some(block) = reader.next_block()? {
        drops.extend(block)?;
    }
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        bin.each(soup, |triangle| {
            if parts.goes(triangle.source)? {
                let (brick, source) = (bin.brick.0, triangle.source);
                drops.push(DropRecord { brick, source, unused: 0 })?;
            }
            Ok(())
        })?;
    }
    Ok(drops)
}
