//! Settles duplicates and finds rims, bin by bin.
//!
//! XOR parity cancels an exact double sheet, so of the copies of a triangle one counts or none,
//! decided per connected patch of duplicates: none where the patch is the interface of two solids
//! (all along its rim other triangles meet it, in even number and not zero), else one.
//!
//! In:         bins. Every triangle with a given edge or with given corners lies in the bin of the
//!             brick that holds the lower end, so each bin decides what it owns.
//! Out:        [`Settled`]: per bin the triangles that do not count, and the rims of the soup.
//! Invariant:  the answer depends on the snapped triangles alone.
//! Memory:     the share; tables over all triangles exist only when there are duplicates.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::ingest::bins::{BinEntry, Bins};
use crate::octree::{BrickKey, Domain, LATTICE_BITS, SoupTriangle};
use crate::store::{
    Record, Resources, Scratch, Sorter, Spool, SpoolWriter, StoreError, Table, Unite, ordered,
};

/// Spool of the triangles that do not count.
pub const DROPS: &str = "drops.spool";

/// A triangle that does not count in a bin: a copy that was settled away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct DropRecord {
    /// Key of the brick.
    pub brick: u64,
    /// Source number.
    pub source: u32,
    /// Zero.
    pub unused: u32,
}

impl Record for DropRecord {
    type Key = (u64, u32);
    fn key(&self) -> (u64, u32) {
        (self.brick, self.source)
    }
}

/// What was found out about duplicates and rims.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SettleStats {
    /// Triangles that had a copy before them in the file.
    pub duplicate_triangles: u64,
    /// Distinct triangles dropped with all copies: interfaces of abutting solids.
    pub interface_triangles: u64,
    /// Edges of the snapped soup that an odd number of triangles meets.
    pub rim_edges: u64,
    /// Their length, model units.
    pub rim_length: f64,
    /// Triangles without area on the lattice.
    pub degenerate_triangles: u64,
}

/// Which copies count.
pub struct Settled {
    /// Triangles to leave out, by brick and source number.
    pub drops: Spool<DropRecord>,
    /// Counts.
    pub stats: SettleStats,
}

impl Settled {
    /// Opens the drops that an earlier run left.
    ///
    /// # Errors
    /// They are missing or damaged.
    pub fn open(resources: &Resources, stats: SettleStats) -> Result<Self, StoreError> {
        Ok(Self { drops: Spool::open(resources.scratch, DROPS)?, stats })
    }
}

type Point = [u32; 3];

/// A triangle by its sorted corners.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Triple {
    corners: [u64; 4],
    source: u64,
}

impl Record for Triple {
    type Key = ([u64; 4], u64);
    fn key(&self) -> Self::Key {
        (self.corners, self.source)
    }
}

/// An edge of a triangle, and the group of duplicates that the triangle is in.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    ends: [u64; 3],
    group: u32,
    source: u32,
}

const NO_GROUP: u32 = u32::MAX;

impl Record for EdgeUse {
    type Key = ([u64; 3], u32, u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.group, self.source)
    }
}

/// Three corners of 84 bits, one bit short of four words: comparing words is comparing corners.
fn pack_corners([p, q, r]: [Point; 3]) -> [u64; 4] {
    let [p, q, r] = [p, q, r].map(pack_point);
    let mask = (1 << 63) - 1;
    [
        (p >> 21) as u64,
        ((p << 42 | q >> 42) & mask) as u64,
        ((q << 21 | r >> 63) & mask) as u64,
        (r & mask) as u64,
    ]
}

/// Two ends of 84 bits in three words of 56.
fn pack_ends([p, q]: [Point; 2]) -> [u64; 3] {
    let [p, q] = [p, q].map(pack_point);
    let mask = (1 << 56) - 1;
    [(p >> 28) as u64, ((p << 28 | q >> 56) & mask) as u64, (q & mask) as u64]
}

fn pack_point(point: Point) -> u128 {
    point.iter().fold(0, |bits, &c| bits << LATTICE_BITS | u128::from(c))
}

fn unpack_ends([high, middle, low]: [u64; 3]) -> [Point; 2] {
    let mask = (1_u128 << LATTICE_BITS) - 1;
    let unpack = |bits: u128| [2, 1, 0].map(|i| (bits >> (i * LATTICE_BITS) & mask) as u32);
    let first = u128::from(high) << 28 | u128::from(middle) >> 28;
    let second = u128::from(middle & ((1 << 28) - 1)) << 56 | u128::from(low);
    [unpack(first), unpack(second)]
}

/// A copy: group (its smallest source), brick, source.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Copy3 {
    brick: u64,
    group: u32,
    source: u32,
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
struct Fact {
    group: u32,
    /// Another group at the same edge, or [`RIM_INTERFACE`], [`RIM_KEEP`].
    what: u32,
}

/// The edge is on the patch's rim, and the other triangles there are even and not zero.
const RIM_INTERFACE: u32 = u32::MAX;
/// The edge is on the patch's rim, and the other triangles there are odd or none.
const RIM_KEEP: u32 = u32::MAX - 1;
/// Both kinds as bits of the verdict table.
const SAW_INTERFACE: u32 = 1;
const SAW_KEEP: u32 = 2;

impl Record for Fact {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.group, self.what)
    }
}

/// What one bin finds.
#[derive(Default)]
struct BinFindings {
    copies: Vec<Copy3>,
    facts: Vec<Fact>,
    stats: SettleStats,
}

/// Share of one bin's sorts within the share of a worker.
const SORT_PARTS: u64 = 3;

/// Settles the duplicates of all bins; `triangles` is the number of source numbers.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn settle(
    bins: &Bins,
    domain: &Domain,
    triangles: u64,
    resources: &Resources,
) -> Result<Settled, StoreError> {
    let workers = resources.pool.current_num_threads() as u64;
    let bin_share = resources.share_bytes / 2 / workers / SORT_PARTS;
    let mut copies = Sorter::<Copy3>::new(resources.scratch, resources.share_bytes / 8);
    let mut facts = Sorter::<Fact>::new(resources.scratch, resources.share_bytes / 8);
    let mut stats = SettleStats::default();
    let mut next = 0;
    let mut entries = Vec::new();
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            bins.entries.read(next, 1, &mut entries)?;
            next += 1;
            Ok(entries.first().copied())
        },
        || (),
        |(), entry| examine_bin(bins, entry, domain, resources.scratch, bin_share),
        |found| {
            copies.extend(&found.copies)?;
            facts.extend(&found.facts)?;
            stats.rim_edges += found.stats.rim_edges;
            stats.rim_length += found.stats.rim_length;
            stats.degenerate_triangles += found.stats.degenerate_triangles;
            Ok(())
        },
    )?;
    let mut drops = Sorter::<DropRecord>::new(resources.scratch, resources.share_bytes / 4);
    if !copies.is_empty() {
        let mut verdicts = judge_patches(facts, triangles, resources)?;
        collect_drops(copies, &mut verdicts, &mut drops, &mut stats)?;
    }
    let mut spool = SpoolWriter::create(resources.scratch, DROPS)?;
    let mut sorted = drops.finish()?;
    while let Some(record) = sorted.next()? {
        spool.push(record)?;
    }
    Ok(Settled { drops: spool.finish()?, stats })
}

fn snapped(domain: &Domain, triangle: &SoupTriangle) -> [Point; 3] {
    triangle.corners.map(|c| domain.snap(c).map(|q| q as u32))
}

fn owner(domain: &Domain, point: Point) -> u64 {
    let brick = domain.brick_units() as u32;
    BrickKey::new(point.map(|c| c / brick)).0
}

/// Finds the copies and the open edges that the bin owns.
fn examine_bin(
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

/// The patches that are interfaces: a table over source numbers, one for the smallest member.
fn judge_patches(
    facts: Sorter<Fact>,
    triangles: u64,
    resources: &Resources,
) -> Result<(Unite, Table<u32>), StoreError> {
    let share = resources.share_bytes / 4;
    let mut patches = Unite::new(resources.scratch, share, triangles)?;
    let mut spool = SpoolWriter::<Fact>::create(resources.scratch, "facts.spool")?;
    let mut sorted = facts.finish()?;
    while let Some(fact) = sorted.next()? {
        if fact.what < RIM_KEEP {
            patches.unite(fact.group, fact.what)?;
        } else {
            spool.push(fact)?;
        }
    }
    let rims = spool.finish()?;
    let mut saw = Table::<u32>::new(resources.scratch, share);
    for _ in 0..triangles {
        saw.push(0)?;
    }
    let mut reader = rims.reader(0, rims.len());
    while let Some(block) = reader.next_block()? {
        for fact in block {
            let patch = u64::from(patches.find(fact.group)?);
            let bit = if fact.what == RIM_KEEP { SAW_KEEP } else { SAW_INTERFACE };
            let before = saw.get(patch)?;
            saw.set(patch, before | bit)?;
        }
    }
    Ok((patches, saw))
}

/// Turns copies into drops: all but the first, or all where the patch is an interface.
fn collect_drops(
    copies: Sorter<Copy3>,
    (patches, saw): &mut (Unite, Table<u32>),
    drops: &mut Sorter<DropRecord>,
    stats: &mut SettleStats,
) -> Result<(), StoreError> {
    let mut sorted = copies.finish()?;
    let mut group = NO_GROUP;
    let mut home = 0;
    let mut interface = false;
    while let Some(copy) = sorted.next()? {
        if copy.group != group {
            group = copy.group;
            home = copy.brick;
            interface = saw.get(u64::from(patches.find(group)?))? == SAW_INTERFACE;
            stats.interface_triangles += u64::from(interface);
        }
        let first = copy.source == group;
        // A copy lies in many bins; it is counted in the first of them.
        stats.duplicate_triangles += u64::from(!first && copy.brick == home);
        if !first || interface {
            drops.push(DropRecord { brick: copy.brick, source: copy.source, unused: 0 })?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        proptest::array::uniform3(0..1_u32 << LATTICE_BITS)
    }

    proptest! {
        #[test]
        fn packed_keys_order_and_unpack_like_points(
            a in proptest::array::uniform3(point()), b in proptest::array::uniform3(point()),
        ) {
            prop_assert_eq!(pack_corners(a).cmp(&pack_corners(b)), a.cmp(&b));
            let (e, f) = ([a[0], a[1]], [b[0], b[1]]);
            prop_assert_eq!(pack_ends(e).cmp(&pack_ends(f)), e.cmp(&f));
            prop_assert_eq!(unpack_ends(pack_ends(e)), e);
        }
    }
}
