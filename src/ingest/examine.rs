//! What one bin says about copies and rims.
//!
//! In:      the triangles of a bin.
//! Out:     counts of the bin; copies and facts about their patches into sorts that all bins share.
//! Memory:  the bin's keys while it is small; beyond, the share of a worker. Copies are streamed,
//!          however many there are of one triangle.

use crate::ingest::bins::Bins;
use crate::ingest::duplicates::SettleStats;
use crate::ingest::edges::judge_edges;
use crate::ingest::facts::{Copied, DIFFERS, Fact};
use crate::ingest::packed::{
    EdgeUse, KeySet, Member, NO_GROUP, NO_WIDTH, Triple, given_edge, given_triangle, mix,
    pack_corners, turn_of,
};
use crate::octree::points::{Point, is_degenerate, length_of, pack_ends, snapped, unpack_ends};
use crate::octree::{Bin, BrickKey, Domain, SoupTriangle};
use crate::store::{Outbox, Scratch, Sorter, StoreError};

/// Where a worker puts what it finds, and what it may use.
pub(crate) struct Examiner<'e> {
    pub(crate) bins: &'e Bins,
    pub(crate) domain: &'e Domain,
    pub(crate) scratch: &'e Scratch,
    /// Share of each sort of one bin; two are alive at one time.
    pub(crate) share_bytes: u64,
    pub(crate) copies: Outbox<'e, Copied>,
    pub(crate) facts: Outbox<'e, Fact>,
}

/// The lattice points that a brick owns.
struct Owned {
    low: Point,
    side: u32,
}

impl Owned {
    fn new(domain: &Domain, brick: BrickKey) -> Self {
        let side = domain.brick_units() as u32;
        Self { low: brick.position().map(|c| c * side), side }
    }

    #[inline]
    fn holds(&self, point: Point) -> bool {
        // What lies below wraps around.
        (0..3).all(|a| point[a].wrapping_sub(self.low[a]) < self.side)
    }

    /// Whether it holds the lowest of these points.
    #[inline]
    fn holds_lowest(&self, points: &[Point]) -> bool {
        points.iter().min().is_some_and(|lowest| self.holds(*lowest))
    }
}

/// The edges of a triangle with ascending corners that have a length, their lower ends first.
#[inline]
fn edges_of([p, q, r]: [Point; 3]) -> impl Iterator<Item = [Point; 2]> {
    [[p, q], [q, r], [p, r]].into_iter().filter(|[lower, upper]| lower != upper)
}

/// Two hashes of a corner.
#[inline]
fn hashes_of([x, y, z]: Point) -> [u64; 2] {
    let word = u64::from(x) | u64::from(y) << 32;
    [mix(&[word, z.into()]), mix(&[z.into(), word])]
}

/// A hash of what has corners with these hashes, whatever their order.
#[inline]
fn hash_of(corners: &[u64]) -> u64 {
    let fold = |how: fn(u64, u64) -> u64| corners.iter().copied().fold(0, how);
    mix(&[fold(u64::wrapping_add), fold(|a, b| a ^ b)])
}

/// Tells whether any of the edges that were added came an odd number of times: those that came twice
/// cancel out in the sums of their hashes. There are two of 64 bits, so that chance does not cancel any.
#[derive(Default)]
struct Parity([u64; 2]);

impl Parity {
    /// Adds an edge between corners with these hashes.
    #[inline]
    fn add(&mut self, from: [u64; 2], to: [u64; 2]) {
        for i in 0..2 {
            self.0[i] ^= hash_of(&[from[i], to[i]]);
        }
    }

    fn has_odd(&self) -> bool {
        self.0 != [0; 2]
    }
}

/// Bins of at most this many triangles are examined by hashing, larger ones by sorting.
const SMALL_BIN: u64 = 1 << 15;

impl Examiner<'_> {
    /// Finds the copies in the bin, and the open edges that it owns.
    pub(crate) fn examine(&mut self, bin: &Bin) -> Result<SettleStats, StoreError> {
        if bin.count <= SMALL_BIN
            && let Some(stats) = self.examine_small(bin)?
        {
            return Ok(stats);
        }
        self.examine_sorted(bin)
    }

    /// Visits the triangles of a bin.
    fn each(
        &self,
        bin: &Bin,
        mut visit: impl FnMut(&SoupTriangle) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        self.bins.spools().each_block(bin, None, |block| block.iter().try_for_each(&mut visit))
    }

    /// Lattice units in model units.
    fn unit(&self) -> f64 {
        self.domain.cell_size() / f64::from(self.domain.cell_units)
    }

    /// The counts of a bin without copies; `None` when there may be copies.
    fn examine_small(&self, bin: &Bin) -> Result<Option<SettleStats>, StoreError> {
        let owned = Owned::new(self.domain, bin.brick);
        let mut stats = SettleStats::default();
        let mut seen = KeySet::with_capacity_and_hasher(bin.count as usize, Default::default());
        let mut parity = Parity::default();
        let mut has_copies = false;
        self.each(bin, |triangle| {
            let corners = snapped(self.domain, triangle);
            let is_held = corners.map(|corner| owned.holds(corner));
            if is_degenerate(corners) && owned.holds_lowest(&corners) {
                stats.degenerate_triangles += 1;
            }
            let hashes = corners.map(hashes_of);
            has_copies |= !seen.insert(hash_of(&hashes.map(|[first, _]| first)));
            for [i, j] in [[0, 1], [1, 2], [2, 0]] {
                let is_owned = match (is_held[i], is_held[j]) {
                    (true, true) => true,
                    (false, false) => false,
                    _ => owned.holds_lowest(&[corners[i], corners[j]]),
                };
                if is_owned && corners[i] != corners[j] {
                    parity.add(hashes[i], hashes[j]);
                }
            }
            Ok(())
        })?;
        if has_copies {
            return Ok(None);
        }
        if parity.has_odd() {
            self.find_rims(bin, &owned, &mut stats)?;
        }
        Ok(Some(stats))
    }

    /// Counts the open edges of a bin without copies. Edges are put in and taken out again: what stays
    /// is odd.
    fn find_rims(
        &self,
        bin: &Bin,
        owned: &Owned,
        stats: &mut SettleStats,
    ) -> Result<(), StoreError> {
        let mut odd: KeySet<[u64; 3]> = KeySet::default();
        self.each(bin, |triangle| {
            let mut corners = snapped(self.domain, triangle);
            corners.sort_unstable();
            for ends in edges_of(corners).filter(|ends| owned.holds(ends[0])) {
                let key = pack_ends(ends);
                if !odd.remove(&key) {
                    odd.insert(key);
                }
            }
            Ok(())
        })?;
        let mut odd: Vec<[u64; 3]> = odd.into_iter().collect();
        odd.sort_unstable();
        odd.iter().for_each(|&ends| stats.add_rim(length_of(unpack_ends(ends), self.unit())));
        Ok(())
    }

    /// Examines a bin of any size, or one with copies.
    fn examine_sorted(&mut self, bin: &Bin) -> Result<SettleStats, StoreError> {
        let mut stats = SettleStats::default();
        let members = self.find_copies(bin, &mut stats)?;
        let edges = self.collect_edges(bin, members)?;
        judge_edges(edges, self.unit(), &mut self.facts, &mut stats)?;
        self.copies.send()?;
        self.facts.send()?;
        Ok(stats)
    }

    /// Tells of every member of every group of two or more, and lists them for the second look.
    fn find_copies(
        &mut self,
        bin: &Bin,
        stats: &mut SettleStats,
    ) -> Result<Sorter<Member>, StoreError> {
        let owned = Owned::new(self.domain, bin.brick);
        let mut triples = Sorter::<Triple>::new(self.scratch, self.share_bytes);
        self.each(bin, |triangle| {
            let mut corners = snapped(self.domain, triangle);
            corners.sort_unstable();
            if owned.holds(corners[0]) && is_degenerate(corners) {
                stats.degenerate_triangles += 1;
            }
            let given = given_triangle(&triangle.corners);
            let source = u64::from(triangle.source);
            triples.push(Triple { corners: pack_corners(corners), given, source })
        })?;
        let mut members = Sorter::<Member>::new(self.scratch, self.share_bytes);
        let mut sorted = triples.finish()?;
        let mut first: Option<Triple> = None;
        let (mut in_group, mut differs) = (false, false);
        while let Some(triple) = sorted.next()? {
            let Some(known) = first.filter(|known| known.corners == triple.corners) else {
                first = Some(triple);
                (in_group, differs) = (false, false);
                continue;
            };
            let group = known.source as u32;
            if !in_group {
                self.add_copy(bin.brick.0, group, group, &mut members)?;
                in_group = true;
            }
            self.add_copy(bin.brick.0, group, triple.source as u32, &mut members)?;
            if !differs && triple.given != known.given {
                self.facts.push(Fact { group, kind: DIFFERS, value: 0 })?;
                differs = true;
            }
        }
        Ok(members)
    }

    fn add_copy(
        &mut self,
        brick: u64,
        group: u32,
        source: u32,
        members: &mut Sorter<Member>,
    ) -> Result<(), StoreError> {
        members.push(Member { source, group })?;
        self.copies.push(Copied { brick, group, source })
    }

    /// The uses of all edges that the bin owns.
    fn collect_edges(
        &self,
        bin: &Bin,
        members: Sorter<Member>,
    ) -> Result<Sorter<EdgeUse>, StoreError> {
        let owned = Owned::new(self.domain, bin.brick);
        let mut edges = Sorter::<EdgeUse>::new(self.scratch, self.share_bytes);
        let mut members = members.finish()?;
        let mut member = members.next()?;
        self.each(bin, |triangle| {
            let mut group = NO_GROUP;
            // Both ascend by source number.
            if let Some(listed) = member
                && listed.source == triangle.source
            {
                group = listed.group;
                member = members.next()?;
            }
            self.push_edges(&owned, triangle, group, &mut edges)
        })?;
        Ok(edges)
    }

    fn push_edges(
        &self,
        owned: &Owned,
        triangle: &SoupTriangle,
        group: u32,
        edges: &mut Sorter<EdgeUse>,
    ) -> Result<(), StoreError> {
        let corners = snapped(self.domain, triangle);
        let has_width = (0..3).all(|i| corners[i] != corners[(i + 1) % 3]);
        let group = if has_width { group } else { NO_WIDTH };
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let ends = [a.min(b), a.max(b)];
            if a != b && owned.holds(ends[0]) {
                let given = given_edge(triangle.corners[i], triangle.corners[(i + 1) % 3]);
                let turn = turn_of(ends, corners[(i + 2) % 3]);
                edges.push(EdgeUse { ends: pack_ends(ends), given, group, turn })?;
            }
        }
        Ok(())
    }
}
