//! Borders between materials: which edges of the soup may be one, cell by cell.
//!
//! In:         the soup as it was scanned last, by bricks, and its hits.
//! Out:        [`BORDERS`]: of every brick with hits of several materials, the pieces of edges in
//!             the cells that have such hits. Contouring picks those that part the materials and
//!             puts the cell's vertex there; so borders run where they ran, not along the grid.
//! Invariant:  an edge between two triangles of one material that lie in one plane, but for the
//!             crease angle, is none. The result depends on the soup alone.
//! Units:      cells, from the brick's min corner.
//! Memory:     per worker 160 KiB and 2 MiB for 16 384 edges; a brick with more keeps the
//!             first of them, and is counted.
//! Fails:      the scratch disk, or bricks that contradict each other.
//! Source:     ours.

mod edges;
mod mixed;

use serde::{Deserialize, Serialize};

use crate::octree::{BinnedSoup, BorderBrick, BrickError, Domain, SoupBin, decode_hits, encode};
use crate::store::{BrickFile, BrickPass, BrickWriter, Resources, StoreError, ordered_by_weight};
use crate::transfer::edges::{EDGE_BYTES, Edges, MOST_EDGES};
use crate::transfer::mixed::{MIXED_BYTES, MixedCells};

/// Name of the brick file that [`find_borders`] leaves.
pub const BORDERS: &str = "borders.bricks";

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TransferError {
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A brick's record is not what its stage writes.
    #[error(transparent)]
    Brick(#[from] BrickError),
}

impl TransferError {
    /// Whether the work so far is worth keeping.
    #[must_use]
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Store(error) if error.is_stop())
    }
}

/// Counts of borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BorderStats {
    /// Cells with hits of several materials.
    pub mixed_cells: u64,
    /// Pieces of edges in them that may be borders.
    pub pieces: u64,
    /// Bricks with more edges than are looked at.
    pub crowded_bricks: u64,
}

impl BorderStats {
    fn add(&mut self, other: &Self) {
        self.mixed_cells += other.mixed_cells;
        self.pieces += other.pieces;
        self.crowded_bricks += other.crowded_bricks;
    }
}

/// No borders, as a file: for outputs that name no materials, or one.
///
/// # Errors
/// The file cannot be created.
pub fn no_borders(resources: &Resources) -> Result<BrickFile, StoreError> {
    let writer = BrickWriter::create(resources.scratch, BORDERS, resources.backing)?;
    writer.finish(resources.cached_windows)
}

/// Finds the edges that may be borders; edges of triangles that differ by less than `crease_deg`
/// are none. `with_patches`: what closes openings counts as a material of its own.
///
/// # Errors
/// [`TransferError`].
pub fn find_borders(
    soup: &BinnedSoup,
    hits: &BrickFile,
    domain: &Domain,
    (crease_deg, with_patches): (f64, bool),
    resources: &Resources,
) -> Result<(BrickFile, BorderStats), TransferError> {
    let mut pass = BrickPass::<BorderStats>::start(BORDERS, resources)?;
    let mut walk = soup.walk();
    let found = ordered_by_weight(
        resources.pool,
        resources
            .scales(|bin: &SoupBin| MIXED_BYTES + EDGE_BYTES * (3 * bin.count()).min(MOST_EDGES)),
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            Ok(walk.next_bin()?)
        },
        || (MixedCells::new(with_patches), Edges::new(domain, crease_deg, with_patches)),
        |(mixed, edges), bin| look_at(soup, hits, &bin, mixed, edges),
        |found: Option<(u64, BorderBrick, BorderStats)>| {
            if let Some((key, brick, stats)) = found {
                pass.counts.add(&stats);
                pass.append(key, 0, &encode(&brick))?;
            }
            Ok::<(), TransferError>(())
        },
    );
    pass.end(found, TransferError::is_stop)
}

/// The borders of one brick; `None` where no cell has several materials.
fn look_at(
    soup: &BinnedSoup,
    hits: &BrickFile,
    bin: &SoupBin,
    mixed: &mut MixedCells,
    edges: &mut Edges,
) -> Result<Option<(u64, BorderBrick, BorderStats)>, TransferError> {
    let Some(number) = hits.find(bin.brick.0) else { return Ok(None) };
    let view = hits.view(number)?;
    if !mixed.find(decode_hits(&view)?) {
        return Ok(None);
    }
    edges.begin(bin.brick);
    bin.each(soup, |triangle| {
        edges.take(triangle, mixed);
        Ok(())
    })?;
    let borders = edges.borders(mixed);
    let stats = BorderStats {
        mixed_cells: mixed.count(),
        pieces: borders.len() as u64,
        crowded_bricks: u64::from(edges.is_crowded()),
    };
    Ok(Some((bin.brick.0, BorderBrick { borders }, stats)))
}
