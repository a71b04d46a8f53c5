//! Decides what is inside: a sign at every corner, and one crossing on every marked edge.
//!
//! In:         the brick file of scan, and the flips of patch.
//! Out:        [`Flooded`], what the outside reaches; then a brick file of
//!             [`crate::octree::SignBrick`]s, one per brick with a marked edge.
//! Invariant:  signs are a function of the grid's corners, marks are their differences, so the
//!             result is closed whatever the hits were; the border of the grid is outside.
//! Units:      cells; corners are counted as cells.
//! Memory:     the share for unions and sorts, 24 bytes a brick for the index.
//! Fails:      [`SignError`]: the scratch disk, or bricks that contradict each other.
//! Source:     Ju 2004, section 5 (sign generation); the region graph and its barrier are ours.

mod exposed;
mod exterior;
mod flooded;
mod graph;
mod hit_edges;
mod load;
mod panes;
mod parity;
mod relabel;
mod thin;
mod tips;
mod walls;
mod winding;

use serde::{Deserialize, Serialize};

use crate::monitor::Monitor;
use crate::octree::{BrickError, BrickIndex, Domain, Flips};
use crate::sign::graph::build_graph;
use crate::sign::parity::base_parities;
use crate::sign::relabel::relabel;
use crate::store::{BrickFile, Resources, StoreError};

pub use exposed::{Exposed, find_exposed};
pub use flooded::{FLOODED, Flooded, FloodedBrick, REGIONS};
pub use graph::PASSING;
pub use thin::find_lost;
pub use winding::VoteStats;

/// Name of the brick file that sign generation leaves.
pub const SIGNS: &str = "signs.bricks";

/// What can go wrong while signs are decided.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SignError {
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A brick's record is not what its stage writes.
    #[error(transparent)]
    Brick(#[from] BrickError),
    /// Two stages contradict each other: a bug, or a disk that lies.
    #[error("Brick {brick:?}: expected {expected}, found otherwise")]
    Contradiction {
        /// Position of the brick.
        brick: [u32; 3],
        /// What holds for every sound set of bricks.
        expected: &'static str,
    },
}

/// What counts as inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FillRule {
    /// All that the exterior cannot reach past any hit.
    #[default]
    Solid,
    /// Where the winding number is not zero, by the votes of triangles; keeps cavities.
    Nonzero,
    /// Ju's parity: inside after an odd number of walls.
    Evenodd,
}

/// What the flood found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FloodStats {
    /// Connected volumes that the outside does not reach.
    pub closed_volumes: u64,
    /// Votes on winding numbers, with the fill rule `nonzero`.
    pub votes: VoteStats,
}

/// Counts of sign generation. Volumes are in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SignStats {
    /// Bricks with a marked edge.
    pub bricks: u64,
    /// Regions of all bricks.
    pub regions: u64,
    /// Corners inside, in the bricks that were looked at.
    pub inside_corners: u64,
    /// Marked edges: the polygons of the result.
    pub crossings: u64,
    /// Of these, crossed by a patch and by no triangle.
    pub patch_crossings: u64,
    /// Cells with corners on both sides: the leaves.
    pub leaf_cells: u64,
    /// Inside although parity says outside: overlaps, cavities and sealed parts.
    pub filled_cells: u64,
    /// Of these, open to the outside but for walls closer than a cell.
    pub sealed_by_resolution_cells: u64,
    /// Edges with hits whose both ends are outside: features thinner than a cell.
    pub thin_edges: u64,
    /// Corners taken off since they would have been specks.
    pub tip_corners: u64,
    /// Edges with hits whose both ends are inside: surface hidden in the solid.
    pub buried_edges: u64,
    /// Ambiguous faces that a wall of about a cell passes along.
    pub walled_faces: u64,
}

impl SignStats {
    fn add(&mut self, other: &Self) {
        self.bricks += other.bricks;
        self.inside_corners += other.inside_corners;
        self.crossings += other.crossings;
        self.patch_crossings += other.patch_crossings;
        self.leaf_cells += other.leaf_cells;
        self.filled_cells += other.filled_cells;
        self.sealed_by_resolution_cells += other.sealed_by_resolution_cells;
        self.thin_edges += other.thin_edges;
        self.tip_corners += other.tip_corners;
        self.buried_edges += other.buried_edges;
        self.walled_faces += other.walled_faces;
    }
}

impl SignError {
    /// Whether the work so far is worth keeping.
    #[must_use]
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Store(error) if error.is_stop())
    }
}

/// Finds what the outside reaches, and with [`FillRule::Nonzero`] the winding numbers. With
/// [`FillRule::Solid`] the outside goes on behind panes, where the soup has any.
///
/// # Errors
/// [`SignError`].
pub fn flood(
    hits: &BrickFile,
    flips: &Flips,
    (rule, has_panes): (FillRule, bool),
    domain: &Domain,
    resources: &Resources,
) -> Result<(Flooded, FloodStats), SignError> {
    let mut graph =
        build_graph(hits, flips, (rule, has_panes && rule == FillRule::Solid), resources)?;
    let keys = graph.bricks.iter().map(|brick| brick.key).collect();
    let index = BrickIndex::new(keys, domain.bricks_per_side());
    let mut exterior = graph.flood(&index, resources)?;
    let parities = base_parities(&graph.bricks);
    let votes = exterior.vote_stats();
    let closed_volumes = exterior.closed_volumes(graph.region_count())?;
    if votes.fell_back {
        let note = "triangles contradict each other in where is inside: filled as solid";
        resources.monitor.note(note);
    }
    let flooded =
        Flooded::write(&graph.bricks, &parities, graph.odd_regions(), exterior, resources)?;
    Ok((flooded, FloodStats { closed_volumes, votes }))
}

/// Decides all signs.
///
/// # Errors
/// [`SignError`].
pub fn assign_signs(
    (hits, borders): (&BrickFile, Option<&BrickFile>),
    flips: &Flips,
    flooded: &Flooded,
    (rule, domain): (FillRule, &Domain),
    resources: &Resources,
) -> Result<(BrickFile, SignStats), SignError> {
    let (file, stats) = relabel((hits, borders), flips, flooded, (rule, domain), resources)?;
    note_fill(&stats, resources.monitor);
    Ok((file, stats))
}

fn note_fill(stats: &SignStats, monitor: &dyn Monitor) {
    if stats.sealed_by_resolution_cells > 0 {
        monitor.note(&format!(
            "{} cells were filled because walls closer than a cell seal them",
            stats.sealed_by_resolution_cells
        ));
    }
}
