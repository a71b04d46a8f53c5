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

use crate::ingest::bins::Bins;
use crate::ingest::examine::{Copy3, Fact, RIM_KEEP, SAW_INTERFACE, SAW_KEEP, examine_bin};
use crate::ingest::packed::NO_GROUP;
use crate::octree::Domain;
use crate::store::{
    FileState, Record, Resources, Sorter, Spool, SpoolWriter, StoreError, Table, Unite, ordered,
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
    pub fn open(
        resources: &Resources,
        files: &[FileState],
        stats: SettleStats,
    ) -> Result<Self, StoreError> {
        Ok(Self { drops: Spool::open(resources.scratch, FileState::find(files, DROPS)?)?, stats })
    }
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
