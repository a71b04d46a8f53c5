//! Settles duplicates and finds rims, bin by bin.
//!
//! XOR parity cancels an exact double sheet, so of the copies of a triangle one counts or none,
//! decided per connected patch of copies; the rule stands in `facts`.
//!
//! In:         bins. Every triangle with a given edge or with given corners lies in the bin of the
//!             brick that holds the lower end, so each bin decides what it owns.
//! Out:        [`Settled`]: per bin the triangles that do not count, and the rims of the soup.
//! Invariant:  the answer depends on the triangles alone, not on their order or on any share.
//! Memory:     the share; tables over all triangles exist only when there are duplicates. What a
//!             bin finds goes straight into sorts that all bins share.

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::ingest::bins::Bins;
use crate::ingest::examine::Examiner;
use crate::ingest::facts::{
    Copied, Fact, JOINED, RIM_ALONE_CLOSED, RIM_ALONE_OPEN, RIM_EVEN, RIM_FOLDED, counts_once,
};
use crate::ingest::fins::FinStats;
use crate::octree::{Domain, DropRecord};
use crate::store::{
    FileState, Outbox, Resources, Sorter, Spool, SpoolWriter, StoreError, Table, Unite, ordered,
};

/// Spool of the triangles that do not count.
pub const DROPS: &str = "drops.spool";

/// What was found out about duplicates and rims.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SettleStats {
    /// Triangles that had a copy before them in the file.
    pub duplicate_triangles: u64,
    /// Distinct triangles dropped with all copies: interfaces of abutting solids, and folds.
    pub interface_triangles: u64,
    /// Edges of the snapped soup, duplicates settled, that an odd number of triangles meets.
    pub rim_edges: u64,
    /// Their length, model units.
    pub rim_length: f64,
    /// Triangles without area on the lattice.
    pub degenerate_triangles: u64,
    /// Sheets that were taken out.
    pub fins: FinStats,
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

/// Sorts of one bin that are alive at one time.
const BIN_SORTS: u64 = 2;

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
    let scratch = resources.scratch;
    let workers = resources.pool.current_num_threads() as u64;
    let share_bytes = resources.share_bytes / 2 / workers / BIN_SORTS;
    let copies = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
    let facts = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
    let mut stats = SettleStats {
        duplicate_triangles: bins.left_out.triangles,
        degenerate_triangles: bins.left_out.degenerate_triangles,
        ..SettleStats::default()
    };
    let spools = bins.spools();
    let mut walk = spools.bins();
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            walk.next()
        },
        || {
            let (copies, facts) = (Outbox::new(&copies), Outbox::new(&facts));
            Examiner { bins, domain, scratch, share_bytes, copies, facts }
        },
        |examiner, bin| examiner.examine(&bin),
        |found: SettleStats| {
            stats.rim_edges += found.rim_edges;
            stats.rim_length += found.rim_length;
            stats.degenerate_triangles += found.degenerate_triangles;
            Ok(())
        },
    )?;
    let (copies, facts) = (unlock(copies), unlock(facts));
    let mut drops = Sorter::<DropRecord>::new(scratch, resources.share_bytes / 4);
    if !copies.is_empty() {
        let mut verdicts = Verdicts::judge(facts, triangles, resources, &mut stats)?;
        collect_drops(copies, &mut verdicts, &mut drops, &mut stats)?;
    }
    let mut spool = SpoolWriter::create(scratch, DROPS)?;
    let mut sorted = drops.finish()?;
    while let Some(record) = sorted.next()? {
        spool.push(record)?;
    }
    Ok(Settled { drops: spool.finish()?, stats })
}

fn unlock<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// What becomes of each patch of groups: tables over source numbers, one for the smallest member.
struct Verdicts {
    patches: Unite,
    kinds: Table<u32>,
}

impl Verdicts {
    /// Brings the facts of each patch together, and counts the rims that its verdict leaves open.
    fn judge(
        facts: Sorter<Fact>,
        triangles: u64,
        resources: &Resources,
        stats: &mut SettleStats,
    ) -> Result<Self, StoreError> {
        let share = resources.share_bytes / 4;
        let mut patches = Unite::new(resources.scratch, share, triangles)?;
        let mut spool = SpoolWriter::<Fact>::create(resources.scratch, "facts.spool")?;
        let mut sorted = facts.finish()?;
        while let Some(fact) = sorted.next()? {
            if fact.kind == JOINED {
                patches.unite(fact.group, fact.value as u32)?;
            } else {
                spool.push(fact)?;
            }
        }
        let told = spool.finish()?;
        let mut kinds = Table::<u32>::new(resources.scratch, share);
        for _ in 0..triangles {
            kinds.push(0)?;
        }
        let mut verdicts = Self { patches, kinds };
        each(&told, |fact| {
            let patch = u64::from(verdicts.patches.find(fact.group)?);
            let before = verdicts.kinds.get(patch)?;
            verdicts.kinds.set(patch, before | fact.kind)
        })?;
        // One triangle of each group on an edge that is otherwise even leaves it open.
        let open_when_once = RIM_EVEN | RIM_FOLDED | RIM_ALONE_OPEN | RIM_ALONE_CLOSED;
        each(&told, |fact| {
            if fact.kind & open_when_once != 0 && verdicts.counts_once(fact.group)? {
                stats.add_rim(f64::from_bits(fact.value));
            }
            Ok(())
        })?;
        Ok(verdicts)
    }

    /// Whether of an even group one triangle counts.
    fn counts_once(&mut self, group: u32) -> Result<bool, StoreError> {
        let patch = u64::from(self.patches.find(group)?);
        Ok(counts_once(self.kinds.get(patch)?))
    }
}

fn each(
    spool: &Spool<Fact>,
    mut visit: impl FnMut(&Fact) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut reader = spool.reader(0, spool.len());
    while let Some(block) = reader.next_block()? {
        block.iter().try_for_each(&mut visit)?;
    }
    Ok(())
}

/// The copies of one group in one brick.
struct Run {
    brick: u64,
    group: u32,
    copies: u64,
}

/// Turns copies into drops: all but the first, and the first as well where none counts.
fn collect_drops(
    copies: Sorter<Copied>,
    verdicts: &mut Verdicts,
    drops: &mut Sorter<DropRecord>,
    stats: &mut SettleStats,
) -> Result<(), StoreError> {
    let mut sorted = copies.finish()?;
    let mut next = sorted.next()?;
    let mut before = None;
    while let Some(first) = next {
        let mut run = Run { brick: first.brick, group: first.group, copies: 0 };
        while let Some(copy) = next
            && (copy.group, copy.brick) == (run.group, run.brick)
        {
            run.copies += 1;
            if copy.source != run.group {
                drops.push(DropRecord { brick: copy.brick, source: copy.source, unused: 0 })?;
            }
            next = sorted.next()?;
        }
        let goes = run.copies.is_multiple_of(2) && !verdicts.counts_once(run.group)?;
        if goes {
            drops.push(DropRecord { brick: run.brick, source: run.group, unused: 0 })?;
        }
        // A group lies in many bins; it is counted in the first of them.
        if before != Some(run.group) {
            stats.duplicate_triangles += run.copies - 1;
            stats.interface_triangles += u64::from(goes);
            before = Some(run.group);
        }
    }
    Ok(())
}
