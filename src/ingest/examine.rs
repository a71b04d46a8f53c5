//! What one bin says about duplicates and rims.
//!
//! In:      the triangles of a bin.
//! Out:     [`BinFindings`]: copies, facts about their patches, open edges.
//! Memory:  the bin's keys while it is small; beyond, the share of a worker.

use crate::ingest::bins::{BinEntry, Bins};
use crate::ingest::duplicates::SettleStats;
use crate::ingest::packed::{
    EdgeUse, KeySet, NO_GROUP, Point, Triple, pack_corners, pack_ends, unpack_ends,
};
use crate::octree::{BrickKey, Domain, SoupTriangle};
use crate::store::{Record, Scratch, Sorter, StoreError};

use bytemuck::{Pod, Zeroable};

/// A copy: group (its smallest source), brick, source.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Copy3 {
    pub(crate) brick: u64,
    pub(crate) group: u32,
    pub(crate) source: u32,
}

impl Record for Copy3 {
    type Key = (u32, u64, u32);
    fn key(&self) -> Self::Key {
        (self.group, self.brick, self.source)
    }
}

/// What an edge says about a group: joined to another, or a verdict on the rim.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Fact {
    pub(crate) group: u32,
    /// Another group at the same edge, or [`RIM_INTERFACE`], [`RIM_KEEP`].
    pub(crate) what: u32,
}

/// The edge is on the patch's rim, and the other triangles there are even and not zero.
pub(crate) const RIM_INTERFACE: u32 = u32::MAX;
/// The edge is on the patch's rim, and the other triangles there are odd or none.
pub(crate) const RIM_KEEP: u32 = u32::MAX - 1;
/// Both kinds as bits of the verdict table.
pub(crate) const SAW_INTERFACE: u32 = 1;
pub(crate) const SAW_KEEP: u32 = 2;

impl Record for Fact {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.group, self.what)
    }
}

/// What one bin finds.
#[derive(Default)]
pub(crate) struct BinFindings {
    pub(crate) copies: Vec<Copy3>,
    pub(crate) facts: Vec<Fact>,
    pub(crate) stats: SettleStats,
}

fn snapped(domain: &Domain, triangle: &SoupTriangle) -> [Point; 3] {
    triangle.corners.map(|c| domain.snap(c).map(|q| q as u32))
}

fn owner(domain: &Domain, point: Point) -> u64 {
    let brick = domain.brick_units() as u32;
    BrickKey::new(point.map(|c| c / brick)).0
}

/// Bins of at most this many triangles are examined by hashing, larger ones by sorting.
const SMALL_BIN: u64 = 1 << 15;

/// Finds the copies and the open edges that the bin owns.
pub(crate) fn examine_bin(
    bins: &Bins,
    entry: BinEntry,
    domain: &Domain,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<BinFindings, StoreError> {
    if entry.count <= SMALL_BIN
        && let Some(found) = examine_small(bins, entry, domain)?
    {
        return Ok(found);
    }
    examine_sorted(bins, entry, domain, scratch, share_bytes)
}

/// The findings of a bin without copies; `None` when there are copies. Edges are put in and taken
/// out again: what stays is odd.
fn examine_small(
    bins: &Bins,
    entry: BinEntry,
    domain: &Domain,
) -> Result<Option<BinFindings>, StoreError> {
    let mut found = BinFindings::default();
    let mut triples = KeySet::with_capacity_and_hasher(entry.count as usize, Default::default());
    let mut odd: KeySet<[u64; 3]> = KeySet::default();
    let mut reader = bins.triangles.reader(entry.first, entry.count);
    while let Some(block) = reader.next_block()? {
        for triangle in block {
            let mut corners = snapped(domain, triangle);
            corners.sort_unstable();
            let [p, q, r] = corners;
            if owner(domain, p) == entry.brick && is_degenerate(corners) {
                found.stats.degenerate_triangles += 1;
            }
            if !triples.insert(pack_corners(corners)) {
                return Ok(None);
            }
            for ends in [[p, q], [q, r], [p, r]] {
                if ends[0] != ends[1] && owner(domain, ends[0]) == entry.brick {
                    let key = pack_ends(ends);
                    if !odd.remove(&key) {
                        odd.insert(key);
                    }
                }
            }
        }
    }
    let mut odd: Vec<[u64; 3]> = odd.into_iter().collect();
    odd.sort_unstable();
    let unit = domain.cell_size() / f64::from(domain.cell_units);
    for ends in odd {
        finish_edge(unpack_ends(ends), 1, &[], unit, &mut found);
    }
    Ok(Some(found))
}

/// Finds the copies and the open edges of a bin of any size, or of one with copies.
fn examine_sorted(
    bins: &Bins,
    entry: BinEntry,
    domain: &Domain,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<BinFindings, StoreError> {
    let mut found = BinFindings::default();
    let mut triples = Sorter::<Triple>::new(scratch, share_bytes);
    let mut reader = bins.triangles.reader(entry.first, entry.count);
    while let Some(block) = reader.next_block()? {
        for triangle in block {
            let mut corners = snapped(domain, triangle);
            corners.sort_unstable();
            if owner(domain, corners[0]) == entry.brick && is_degenerate(corners) {
                found.stats.degenerate_triangles += 1;
            }
            let source = u64::from(triangle.source);
            triples.push(Triple { corners: pack_corners(corners), source })?;
        }
    }
    find_copies(triples, entry.brick, &mut found.copies)?;
    let mut edges = Sorter::<EdgeUse>::new(scratch, share_bytes);
    let mut group_of: Vec<(u32, u32)> = found.copies.iter().map(|c| (c.source, c.group)).collect();
    group_of.sort_unstable();
    let mut reader = bins.triangles.reader(entry.first, entry.count);
    while let Some(block) = reader.next_block()? {
        for triangle in block {
            let source = triangle.source;
            let group = match group_of.binary_search_by_key(&source, |pair| pair.0) {
                Ok(at) => group_of[at].1,
                Err(_) => NO_GROUP,
            };
            let corners = snapped(domain, triangle);
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let ends = [a.min(b), a.max(b)];
                if a != b && owner(domain, ends[0]) == entry.brick {
                    edges.push(EdgeUse { ends: pack_ends(ends), group, source })?;
                }
            }
        }
    }
    judge_edges(edges, domain.cell_size() / f64::from(domain.cell_units), &mut found)?;
    Ok(found)
}

fn is_degenerate(corners: [Point; 3]) -> bool {
    let [p, q, r] = corners.map(|c| c.map(i64::from));
    (0..3).all(|a| {
        let (u, v) = ((a + 1) % 3, (a + 2) % 3);
        (q[u] - p[u]) * (r[v] - p[v]) == (q[v] - p[v]) * (r[u] - p[u])
    })
}

/// Lists every member of every group of two or more.
fn find_copies(
    triples: Sorter<Triple>,
    brick: u64,
    copies: &mut Vec<Copy3>,
) -> Result<(), StoreError> {
    let mut sorted = triples.finish()?;
    let mut first: Option<Triple> = None;
    let mut in_group = false;
    while let Some(triple) = sorted.next()? {
        match first {
            Some(known) if known.corners == triple.corners => {
                let group = known.source as u32;
                if !in_group {
                    copies.push(Copy3 { brick, group, source: group });
                    in_group = true;
                }
                copies.push(Copy3 { brick, group, source: triple.source as u32 });
            }
            _ => {
                first = Some(triple);
                in_group = false;
            }
        }
    }
    Ok(())
}

/// Counts open edges without duplicates, and reports facts about those with duplicates.
fn judge_edges(
    edges: Sorter<EdgeUse>,
    unit: f64,
    found: &mut BinFindings,
) -> Result<(), StoreError> {
    let mut sorted = edges.finish()?;
    let mut ends = [u64::MAX; 3];
    let mut others = 0_u64;
    let mut groups: Vec<u32> = Vec::new();
    loop {
        let edge = sorted.next()?;
        if edge.is_none_or(|edge| edge.ends != ends) {
            finish_edge(unpack_ends(ends), others, &groups, unit, found);
            others = 0;
            groups.clear();
        }
        let Some(edge) = edge else { return Ok(()) };
        ends = edge.ends;
        if edge.group == NO_GROUP {
            others += 1;
        } else if groups.last() != Some(&edge.group) {
            groups.push(edge.group);
        }
    }
}

fn finish_edge(ends: [Point; 2], others: u64, groups: &[u32], unit: f64, found: &mut BinFindings) {
    let square: f64 =
        (0..3).map(|a| f64::from(ends[0][a]) - f64::from(ends[1][a])).map(|d| d * d).sum();
    let length = square.sqrt() * unit;
    // Groups count once each here; an interface that goes altogether leaves its rim even, since
    // the others are even there.
    let interface = others > 0 && others.is_multiple_of(2);
    let odd = !(others + groups.len() as u64).is_multiple_of(2);
    if odd && (groups.is_empty() || !interface) {
        found.stats.rim_edges += 1;
        found.stats.rim_length += length;
    }
    for pair in groups.windows(2) {
        let fact = Fact { group: pair[0], what: pair[1] };
        found.facts.push(fact);
    }
    if groups.len() % 2 == 1 {
        let what = if interface { RIM_INTERFACE } else { RIM_KEEP };
        found.facts.push(Fact { group: groups[0], what });
    }
}
