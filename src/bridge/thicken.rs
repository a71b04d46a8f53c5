//! Thickens what the grid would lose: walls thinner than a cell, and sheets left open that no
//! opening told of.
//!
//! A triangle gets a slab around it, two cells thick by default, besides what is there, where it
//! loses more than a few of its hits; small triangles are judged together, those of one sheet in
//! one brick.
//!
//! In:         the mended soup in bins, and the hits that were lost, by triangle.
//! Out:        bins of all that is added to the soup: walls and fills of before, and the slabs.
//! Invariant:  every slab is closed; what is there stays.
//! Units:      model units; hits count edges of the grid.
//! Memory:     the share; tables over triangles spill.
//! Fails:      [`StoreError`].
//! Source:     ours.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::bridge::sheets::{MOST_TRIANGLES, Sheets};
use crate::bridge::walls::Slab;
use crate::bridge::{Added, Like, MendOptions};
use crate::octree::points::is_owned;
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, LostHits, Panes, SoupEdges, SoupTriangle,
    write_bins,
};
use crate::store::{Resources, Sorted, Sorter, Spool, StoreError, Table};

/// Spools of the triangles that are added in the end, and of their bins; they live within a step.
pub const THICKENED: [&str; 2] = ["thickened.spool", "thickened.entries"];

/// Spool of the triangles that slabs come from, as [`crate::bridge::ORIGINS`] for what was added
/// before.
pub const SLAB_ORIGINS: &str = "slabs.origins";

/// Share of its hits that a wall loses when it is thin: of a plate that is t cells thick 1 - t.
const LOST_SHARE: f64 = 0.15;

/// Share of its hits that a large triangle of a torn piece has to lose to be taken for a part of it.
const BRINK_SHARE: f64 = 0.03;

/// Fewer lost hits than this are those of a tip or an edge.
const LEAST_LOST: f64 = 4.0;

/// A triangle that should have fewer hits tells nothing by itself.
const LEAST_HITS: f64 = 8.0;

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
    triangles: Spool<SoupTriangle>,
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

/// Hits of a triangle, or of a sheet's triangles in one brick.
#[derive(Clone, Copy, Debug, Default)]
struct Hits {
    expected: f64,
    lost: f64,
}

impl Hits {
    fn add(&mut self, other: Self) {
        self.expected += other.expected;
        self.lost += other.lost;
    }

    /// Whether a triangle of this piece is torn. A large one tells for itself, unless it is on the
    /// brink.
    fn tears(self, alone: Self) -> bool {
        let is_large = alone.expected >= LEAST_HITS;
        let takes_part = !is_large || alone.lost >= BRINK_SHARE * alone.expected;
        is_large && alone.are_torn() || takes_part && self.are_torn()
    }

    fn are_torn(self) -> bool {
        self.lost >= LEAST_LOST && self.lost >= LOST_SHARE * self.expected
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
    let pairs = SoupEdges::find(soup, domain, Panes::Apart, resources)?.pairs;
    let mut sheets = Sheets::join(pairs, first, resources)?;
    let mut losses = Losses::new(lost, first, resources)?;
    let mut added = Added::new(domain, first, options, SLAB_ORIGINS, resources)?;
    let mut stats = ThickenStats::default();
    // Walls and fills are as thick as they should be.
    let is_judged = |triangle: &SoupTriangle, brick: u64| {
        u64::from(triangle.source) < given && is_owned(triangle, domain, brick)
    };
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        let mut pieces: BTreeMap<u32, Hits> = BTreeMap::new();
        bin.each(soup, |triangle| {
            if is_judged(triangle, bin.brick.0) {
                let sheet = sheets.side_of(triangle.source)?.first;
                let hits = losses.hits_of(triangle, domain)?;
                pieces.entry(sheet).or_default().add(hits);
            }
            Ok(())
        })?;
        pieces.retain(|_, hits| hits.lost > 0.0);
        if pieces.is_empty() {
            continue;
        }
        stats.pieces += pieces.values().filter(|hits| hits.are_torn()).count() as u64;
        bin.each(soup, |triangle| {
            if !is_judged(triangle, bin.brick.0) {
                return Ok(());
            }
            let Some(piece) = pieces.get(&sheets.side_of(triangle.source)?.first) else {
                return Ok(());
            };
            if piece.tears(losses.hits_of(triangle, domain)?) {
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

/// How many edges of the grid a triangle hits on average.
fn expected_hits(triangle: &SoupTriangle, domain: &Domain) -> f64 {
    let [p, q, r] = triangle.corners.map(DVec3::from);
    let projected = 0.5 * (q - p).cross(r - p).abs().element_sum();
    projected / (domain.cell_size() * domain.cell_size())
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

/// The lost hits of every triangle.
struct Losses {
    counts: Table<u32>,
}

impl Losses {
    fn new(
        lost: Sorter<LostHits>,
        triangles: u64,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let mut counts = Table::new(resources.scratch, resources.share_bytes / 8);
        let mut sorted: Sorted<LostHits> = lost.finish()?;
        let mut next = sorted.next()?;
        for source in 0..triangles {
            let mut count = 0;
            while let Some(lost) = next
                && u64::from(lost.source) == source
            {
                count += lost.count;
                next = sorted.next()?;
            }
            counts.push(count)?;
        }
        Ok(Self { counts })
    }

    fn hits_of(&mut self, triangle: &SoupTriangle, domain: &Domain) -> Result<Hits, StoreError> {
        let lost = f64::from(self.counts.get(triangle.source.into())?);
        Ok(Hits { expected: expected_hits(triangle, domain), lost })
    }
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
