//! How much of its hits each triangle lost, and each piece of a sheet.
//!
//! In:         the hits that were lost, by triangle; the bins of the soup.
//! Out:        [`Losses`].
//! Units:      hits count edges of the grid.
//! Memory:     8 bytes a triangle, in a table that spills; numbers of bricks and of a brick's pieces.
//! Fails:      [`StoreError`].
//! Source:     ours.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::bridge::sheets::Sheets;
use crate::octree::points::is_owned;
use crate::octree::{BinnedSoup, BrickKey, Domain, LostHits, SoupBin, SoupTriangle};
use crate::store::{Resources, Sorted, Sorter, StoreError, Table};

/// Share of its hits that a wall loses when it is thin: of a plate that is t cells thick 1 - t.
const LOST_SHARE: f64 = 0.15;

/// The same of hits away from any rim, each of which is a hole in the wall.
const LOST_INNER_SHARE: f64 = 0.01;

/// The same of a large triangle by itself, and how many it has to lose: around a few holes in a large
/// wall only its triangles get thicker, not all of a brick's piece.
const PIERCED_SHARE: f64 = 0.001;
const LEAST_PIERCED: f64 = 2.0;

/// Share of its hits that a large triangle of a torn piece has to lose to be taken for a part of it.
const BRINK_SHARE: f64 = 0.03;

/// Fewer lost hits than this are those of a tip or an edge.
const LEAST_LOST: f64 = 4.0;

/// A triangle that should have fewer hits tells nothing by itself.
const LEAST_HITS: f64 = 8.0;

/// Hits of a triangle, or of a sheet's triangles in one brick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hits {
    expected: f64,
    pub(crate) lost: f64,
    inner: f64,
}

impl Hits {
    fn add(&mut self, other: Self) {
        self.expected += other.expected;
        self.lost += other.lost;
        self.inner += other.inner;
    }

    /// Whether a triangle of this piece is torn. A large one tells for itself, unless it is on the
    /// brink.
    pub(crate) fn tears(self, alone: Self) -> bool {
        let is_large = alone.expected >= LEAST_HITS;
        let takes_part = !is_large || alone.lost >= BRINK_SHARE * alone.expected;
        alone.is_torn_alone() || takes_part && self.are_torn()
    }

    /// Whether this is all of a large triangle that is torn.
    fn is_torn_alone(self) -> bool {
        let is_pierced = self.inner >= LEAST_PIERCED && self.inner >= PIERCED_SHARE * self.expected;
        self.expected >= LEAST_HITS && (self.are_torn() || is_pierced)
    }

    pub(crate) fn are_torn(self) -> bool {
        self.lost >= LEAST_LOST && self.lost >= LOST_SHARE * self.expected
            || self.inner >= LEAST_LOST && self.inner >= LOST_INNER_SHARE * self.expected
    }
}

/// How many edges of the grid a triangle hits on average.
fn expected_hits(triangle: &SoupTriangle, domain: &Domain) -> f64 {
    let [p, q, r] = triangle.corners.map(DVec3::from);
    let projected = 0.5 * (q - p).cross(r - p).abs().element_sum();
    projected / (domain.cell_size() * domain.cell_size())
}

/// The lost hits of every triangle.
pub(crate) struct Losses<'d> {
    /// All lost hits of each, and the inner ones.
    counts: Table<[u32; 2]>,
    domain: &'d Domain,
    given: u64,
}

impl<'d> Losses<'d> {
    /// Of `triangles` triangles; the first `given` are those of the input.
    pub(crate) fn new(
        lost: Sorter<LostHits>,
        domain: &'d Domain,
        (given, triangles): (u64, u64),
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let mut all = Table::new(resources.scratch, resources.share_bytes / 8);
        let mut sorted: Sorted<LostHits> = lost.finish()?;
        let mut next = sorted.next()?;
        for source in 0..triangles {
            let mut counts = [0, 0];
            while let Some(lost) = next
                && u64::from(lost.source) == source
            {
                counts[0] += lost.count;
                counts[1] += lost.inner;
                next = sorted.next()?;
            }
            all.push(counts)?;
        }
        Ok(Self { counts: all, domain, given })
    }

    /// Whether a triangle is judged in this brick. Walls and fills are as thick as they should be.
    pub(crate) fn is_judged(&self, triangle: &SoupTriangle, brick: BrickKey) -> bool {
        u64::from(triangle.source) < self.given && is_owned(triangle, self.domain, brick.0)
    }

    /// The hits of a triangle.
    pub(crate) fn hits_of(&mut self, triangle: &SoupTriangle) -> Result<Hits, StoreError> {
        let [lost, inner] = self.counts.get(triangle.source.into())?.map(f64::from);
        Ok(Hits { expected: expected_hits(triangle, self.domain), lost, inner })
    }

    /// Those of the sheets in a brick that lost some, by the first triangle of the sheet.
    pub(crate) fn pieces_of(
        &mut self,
        bin: &SoupBin,
        soup: &BinnedSoup,
        sheets: &mut Sheets,
    ) -> Result<BTreeMap<u32, Hits>, StoreError> {
        let mut pieces: BTreeMap<u32, Hits> = BTreeMap::new();
        bin.each(soup, |triangle| {
            if self.is_judged(triangle, bin.brick) {
                let sheet = sheets.side_of(triangle.source)?.first;
                pieces.entry(sheet).or_default().add(self.hits_of(triangle)?);
            }
            Ok(())
        })?;
        pieces.retain(|_, hits| hits.lost > 0.0);
        Ok(pieces)
    }

    /// The bricks that lost enough hits for a piece that is torn.
    pub(crate) fn hurt_bricks(
        &mut self,
        soup: &BinnedSoup,
        resources: &Resources,
    ) -> Result<BTreeSet<u64>, StoreError> {
        let mut hurt = BTreeSet::new();
        let mut walk = soup.walk();
        while let Some(bin) = walk.next_bin()? {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            let mut lost = 0.0;
            bin.each(soup, |triangle| {
                let [count, _] = self.counts.get(triangle.source.into())?;
                if count > 0 && self.is_judged(triangle, bin.brick) {
                    lost += f64::from(count);
                }
                Ok(())
            })?;
            if lost >= LEAST_PIERCED {
                hurt.insert(bin.brick.0);
            }
        }
        Ok(hurt)
    }
}
