//! Scan conversion: bins become bricks of crossings.
//!
//! In:         the bins of the soup, without what was dropped and with what was added.
//! Out:        a brick file of [`HitBrick`]s, one per brick with at least one hit; flag
//!             [`HAS_ODD_FACES`] where the surface is open.
//! Invariant:  every hit is decided exactly on the snapped corners, under one symbolic translation
//!             of the whole grid; a soup that is closed mod 2 leaves no odd face.
//! Units:      lattice units.
//! Memory:     per worker one block of triangles and of drops, [`CHUNK_HITS`] hits and the brick
//!             under way.
//! Fails:      only as [`StoreError`]; geometry cannot fail here.
//! Source:     Ju 2004 (scan conversion of edges); parity in place of "was hit" is ours, as is the
//!             translated grid (simulation of simplicity, Edelsbrunner and Mücke 1990).

mod collect;
mod convert;
#[cfg(test)]
mod oracle_tests;

use serde::{Deserialize, Serialize};

use crate::monitor::{Counter, Gauge, Resident};
use crate::octree::{
    AXIS_EDGES, BinnedSoup, BrickKey, Domain, EdgeBits, HitBrick, SIDE, SoupBin, encode,
};
use crate::scan::collect::Collector;
use crate::scan::convert::Converter;
use crate::store::{BrickFile, BrickPass, Resources, StoreError, ordered_by_weight};

pub use collect::CHUNK_HITS;

/// Name of the brick file that scan leaves.
pub const HITS: &str = "hits.bricks";
/// Directory flag of bricks that see an odd face.
pub const HAS_ODD_FACES: u32 = 1;

/// What a triangle of a bin may take on its way into a record: its plane, its hits, the archive.
const TRIANGLE_BYTES: u64 = 80;
/// More triangles than this leave no more in a brick: three to an edge.
const MOST_HEAVY_TRIANGLES: u64 = 3 * 3 * AXIS_EDGES as u64;

/// Counts of scan conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanStats {
    /// Triangles scanned, once per brick.
    pub triangles: u64,
    /// Bricks with hits.
    pub bricks: u64,
    /// Hits on edges that a brick owns.
    pub hits: u64,
    /// Owned edges with at least one hit.
    pub hit_edges: u64,
    /// Owned edges with more than one hit: features below a cell.
    pub multi_edges: u64,
    /// Cells with a marked edge.
    pub leaf_cells: u64,
    /// Bricks that see an odd face.
    pub open_bricks: u64,
}

impl ScanStats {
    fn add(&mut self, other: &Self) {
        self.triangles += other.triangles;
        self.bricks += other.bricks;
        self.hits += other.hits;
        self.hit_edges += other.hit_edges;
        self.multi_edges += other.multi_edges;
        self.leaf_cells += other.leaf_cells;
        self.open_bricks += other.open_bricks;
    }
}

/// A scanned brick on its way to the file.
struct Scanned {
    brick: BrickKey,
    bytes: rkyv::util::AlignedVec,
    flags: u32,
    stats: ScanStats,
}

/// Scans all bins.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn scan(
    soup: &BinnedSoup,
    domain: &Domain,
    resources: &Resources,
) -> Result<(BrickFile, ScanStats), StoreError> {
    let mut pass = BrickPass::<ScanStats>::start(HITS, resources)?;
    let mut walk = soup.walk();
    for _ in 0..pass.items() {
        walk.next_bin()?;
    }
    let resident = Resident::new(Gauge::ResidentTriangles, resources.monitor);
    let bricks = Resident::new(Gauge::ResidentBricks, resources.monitor);
    let weigh = |bin: &SoupBin| bin.count().min(MOST_HEAVY_TRIANGLES) * TRIANGLE_BYTES;
    let scanned = ordered_by_weight(
        resources.pool,
        resources.scales(weigh),
        || if resources.monitor.cancelled() { Err(StoreError::Cancelled) } else { walk.next_bin() },
        || Workspace::new(domain),
        |space, bin| {
            let _brick = bricks.hold(1);
            space.scan_brick(soup, &bin, &resident)
        },
        |scanned| {
            resources.monitor.count(Counter::TrianglesScanned, scanned.stats.triangles);
            pass.counts.add(&scanned.stats);
            if scanned.stats.bricks > 0 {
                pass.append(scanned.brick.0, scanned.flags, &scanned.bytes)?;
            }
            pass.item_done()
        },
    );
    pass.end(scanned, StoreError::is_stop)
}

struct Workspace {
    converter: Converter,
    collector: Collector,
    marks: EdgeBits,
}

impl Workspace {
    fn new(domain: &Domain) -> Self {
        Self {
            converter: Converter::new(domain),
            collector: Collector::new(f64::from(domain.cell_units)),
            marks: EdgeBits::default(),
        }
    }

    fn scan_brick(
        &mut self,
        soup: &BinnedSoup,
        bin: &SoupBin,
        resident: &Resident,
    ) -> Result<Scanned, StoreError> {
        self.converter.enter(bin.brick);
        self.collector.clear();
        let mut stats = ScanStats::default();
        bin.each_held(soup, Some(resident), |triangle| {
            stats.triangles += 1;
            self.converter.convert(triangle, &mut self.collector);
            Ok(())
        })?;
        let brick = self.collector.finish();
        if brick.edges.is_empty() {
            let bytes = rkyv::util::AlignedVec::new();
            return Ok(Scanned { brick: bin.brick, bytes, flags: 0, stats });
        }
        let open = self.measure(&brick, &mut stats);
        let flags = if open { HAS_ODD_FACES } else { 0 };
        Ok(Scanned { brick: bin.brick, bytes: encode(&brick), flags, stats })
    }

    /// Counts what the brick owns; whether it sees an odd face.
    fn measure(&mut self, brick: &HitBrick, stats: &mut ScanStats) -> bool {
        self.marks.clear();
        for edge in &brick.edges {
            let (_, at) = crate::octree::edge_position(edge.edge());
            if at.iter().all(|&c| c < SIDE) {
                stats.hit_edges += 1;
                stats.multi_edges += u64::from(edge.class() > 1);
            }
            if edge.class() & 1 == 1 {
                self.marks.toggle(edge.edge());
            }
        }
        for z in 0..SIDE {
            for y in 0..SIDE {
                stats.leaf_cells += u64::from(self.marks.cells_touched(z, y).count_ones());
            }
        }
        stats.hits += self.collector.owned_hits();
        stats.bricks = 1;
        let open = !self.marks.is_closed();
        stats.open_bricks = u64::from(open);
        open
    }
}
