//! The deviation: how far two surfaces lie apart, what of one the other lacks, and which creases it
//! kept.
//!
//! In:         two surfaces as [`MeshSource`]s, or a soup that was read before, each read once into a
//!             [`Surface`]: triangles in a tree of boxes, samples spread evenly over their area, and
//!             their sharp edges.
//! Out:        a [`Deviation`]: distances both ways, normals, what is lost and invented, creases. Or, of a
//!             [`Target`], the distance of whatever points are asked for, or the [`Piece`]s of
//!             another surface that lie farther from it than some length.
//! Invariant:  depends on the two files and the [`DeviationOptions`] alone: not on the share, and
//!             not on threads. The distance of a sample is that to the nearest of all triangles.
//! Units:      model units, the same in both files; angles in degrees.
//! Memory:     about half of the share for each surface while it is read, half for both together
//!             while they are compared; beyond that, scratch files without names: 108 bytes a
//!             triangle, 300 where none lies beside the one before it in the file, 80 less of a soup,
//!             which stays where it is, and up to 96 more while sharp edges are sought.
//! Fails:      [`DeviateError`]: a source, the scratch disk, or a request to stop. Surfaces that
//!             have no area, or are too large for their squares, give no deviation.
//! Source:     Cignoni, Rocchini, Scopigno 1998, Metro (distances by samples); Roussopoulos, Kelley,
//!             Vincent 1995 (nearest neighbours in a tree of boxes); Lauterbach et al. 2009 (trees
//!             of boxes in Morton order).

mod apart;
#[cfg(test)]
mod apart_tests;
mod compare;
mod creases;
mod deviation;
mod edges;
mod error;
mod nearest;
mod pages;
mod parts;
mod pieces;
mod quantiles;
mod reading;
mod runs;
mod samples;
mod sight;
mod surface;
mod target;
#[cfg(test)]
mod tests;
mod tree;
mod triangles;

pub use apart::Gap;
pub use compare::compare;
pub use deviation::{CreaseReport, Deviation, Distances, LostReport, Normals, Separation};
pub use error::DeviateError;
pub use parts::PartsSeen;
pub use pieces::Piece;
pub use surface::{Surface, SurfaceOptions};
pub use target::Target;

use rayon::ThreadPool;

#[cfg(doc)]
use crate::mesh::MeshSource;
use crate::monitor::Monitor;
use crate::store::{Scratch, StoreError};

/// How to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationOptions {
    /// Samples of sharp edges, where they are sought.
    pub crease_samples: u64,
    /// What lies farther away than this is lost or invented, model units.
    pub tolerance: f64,
    /// Side of a cell of the grid that the file was made in, where one is known; model units.
    pub cell_size: Option<f64>,
}

/// What a comparison may use.
#[derive(Clone, Copy)]
pub struct Means<'m> {
    /// Where files without names lie.
    pub scratch: &'m Scratch,
    /// The worker threads.
    pub pool: &'m ThreadPool,
    /// Memory for sorts, sequences and pages, all of them together.
    pub share_bytes: u64,
    /// Who hears of progress, and may stop the work.
    pub monitor: &'m dyn Monitor,
}

impl Means<'_> {
    /// Ends the work when the caller wants that.
    fn stop_if_asked(&self) -> Result<(), StoreError> {
        if self.monitor.cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
    }
}
