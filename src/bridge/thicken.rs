//! Thickens what the grid would lose: walls thinner than a cell, and sheets left open that no
//! opening told of.
//!
//! A triangle gets a slab around it, two cells thick by default, besides what is there, where it
//! loses more than a few of its hits; small triangles are judged together, those in one brick that
//! are joined across edges in bricks that lose hits.
//!
//! In:         the mended soup in bins, and the hits that were lost, by triangle.
//! Out:        bins of all that is added to the soup: walls and fills of before, and the slabs.
//! Invariant:  every slab is closed; what is there stays.
//! Units:      model units; hits count edges of the grid.
//! Memory:     the share; tables over triangles spill.
//! Fails:      [`StoreError`].
//! Source:     ours.

use glam::DVec3;

use crate::bridge::losses::Losses;
use crate::bridge::sheets::{MOST_TRIANGLES, Sheets};
use crate::bridge::walls::Slab;
use crate::bridge::{Added, Like, MendOptions};
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, LostHits, Panes, SoupBin, SoupEdges,
    SoupSpool, SoupTriangle, write_bins,
};
use crate::store::{Resources, Sorter, Spool, StoreError};

/// Spools of the triangles that are added in the end, and of their bins; they live within a step.
pub const THICKENED: [&str; 2] = ["thickened.spool", "thickened.entries"];

/// Spool of the triangles that slabs come from, as [`crate::bridge::ORIGINS`] for what was added
/// before.
pub const SLAB_ORIGINS: &str = "slabs.origins";

/// What was thickened.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ThickenStats {
    /// Pieces of sheets, each in one brick, that lose hits.
    pub pieces: u64,
    /// Triangles that got a slab.
    pub triangles: u64,
    /// Triangles of slabs; their source numbers follow upon those of walls and fills.
    pub added_triangles: u64,
    /// Their area, model units squared.
    pub area: f64,
    /// Corners of the box around them, model units; empty when there is none.
    pub bounds: Option<[[f64; 3]; 2]>,
}

/// All that is added to a soup.
pub struct Thickened {
    triangles: SoupSpool,
    entries: Spool<BinEntry>,
    /// See [`SLAB_ORIGINS`].
    pub origins: Spool<u32>,
}

impl Thickened {
    /// The soup with it.
    #[must_use]
    pub fn soup<'b>(&'b self, soup: &BinnedSoup<'b>) -> BinnedSoup<'b> {
        let added = BinSpools { triangles: &self.triangles, entries: &self.entries };
        BinnedSoup { added: Some(added), ..*soup }
    }
}

/// Thickens what loses hits; `given` is the number of source numbers of the input, `first` the
/// first one that is free. `None` where there is nothing to thicken.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn thicken(
    soup: &BinnedSoup,
    lost: Sorter<LostHits>,
    options: &MendOptions,
    domain: &Domain,
    (given, first): (u64, u64),
    resources: &Resources,
) -> Result<Option<(Thickened, ThickenStats)>, StoreError> {
    if first > MOST_TRIANGLES {
        resources.monitor.note("too many triangles to thicken those that are thin");
        return Ok(None);
    }
    let mut losses = Losses::new(lost, domain, (given, first), resources)?;
    let hurt = losses.hurt_bricks(soup, resources)?;
    if hurt.is_empty() {
        return Ok(None);
    }
    let is_hurt = |bin: &SoupBin| hurt.contains(&bin.brick.0);
    let pairs = SoupEdges::find_in(soup, domain, Panes::Apart, is_hurt, resources)?.pairs;
    let mut sheets = Sheets::join(pairs, first, resources)?;
    let mut added = Added::new(domain, first, options, SLAB_ORIGINS, resources)?;
    let mut stats = ThickenStats::default();
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        if !is_hurt(&bin) {
            continue;
        }
        let pieces = losses.pieces_of(&bin, soup, &mut sheets)?;
        if pieces.is_empty() {
            continue;
        }
        stats.pieces += pieces.values().filter(|hits| hits.are_torn()).count() as u64;
        bin.each(soup, |triangle| {
            if !losses.is_judged(triangle, bin.brick) {
                return Ok(());
            }
            let Some(piece) = pieces.get(&sheets.side_of(triangle.source)?.first) else {
                return Ok(());
            };
            if piece.tears(losses.hits_of(triangle)?) {
                stats.add(triangle);
                surround(triangle, options, &mut added)?;
            }
            Ok(())
        })?;
    }
    if stats.triangles == 0 {
        return Ok(None);
    }
    stats.added_triangles = added.next - first;
    add_all(soup, &mut added.bins)?;
    let (triangles, entries) = write_bins(added.bins, THICKENED, resources)?;
    let origins = added.origins.finish()?;
    Ok(Some((Thickened { triangles, entries, origins }, stats)))
}

/// Puts a slab around a triangle.
fn surround(
    triangle: &SoupTriangle,
    options: &MendOptions,
    added: &mut Added,
) -> Result<(), StoreError> {
    let [p, q, r] = triangle.corners.map(DVec3::from);
    let normal = (q - p).cross(r - p).normalize_or_zero();
    let half = 0.5 * options.thickness;
    let slab = Slab::new(triangle, [normal; 3], [-half, half], &options.bounds.grown(half));
    let SoupTriangle { part, material, source, .. } = *triangle;
    let like = Like { part, material, of: source, from: source };
    slab.push([true; 3], false, added, like)
}

/// What was added before is added again.
fn add_all(soup: &BinnedSoup, bins: &mut Sorter<BinTriangle>) -> Result<(), StoreError> {
    let Some(before) = soup.added else { return Ok(()) };
    let mut entries = before.entries.reader(0, before.entries.len());
    while let Some(block) = entries.next_block()? {
        for entry in block {
            let mut triangles = before.triangles.reader(entry.first, entry.count);
            while let Some(block) = triangles.next_block()? {
                for triangle in block {
                    bins.push(BinTriangle { brick: entry.brick, triangle: *triangle })?;
                }
            }
        }
    }
    Ok(())
}

impl ThickenStats {
    fn add(&mut self, triangle: &SoupTriangle) {
        let [p, q, r] = triangle.corners.map(DVec3::from);
        self.triangles += 1;
        self.area += 0.5 * (q - p).cross(r - p).length();
        let (lo, hi) = (p.min(q).min(r), p.max(q).max(r));
        let [low, high] = self.bounds.unwrap_or([lo.to_array(), hi.to_array()]);
        let bounds = [lo.min(DVec3::from(low)), hi.max(DVec3::from(high))];
        self.bounds = Some(bounds.map(|corner| corner.to_array()));
    }
}
