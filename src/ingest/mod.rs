//! Takes a file in: triangles on the lattice, in the bins of the bricks that they touch.
//!
//! In:         a [`crate::mesh::MeshSource`].
//! Out:        [`Soup`] (a spool of finite triangles, box, names, counts; texture coordinates and
//!             colours where the output takes them, and the looks that part them), then [`Bins`] (the same
//!             triangles once per brick that they touch, by brick and source number), then
//!             [`Settled`] (which copies of duplicates count, and how much of the soup is open).
//! Invariant:  a triangle lies in the bin of every brick whose closed box it meets; of copies, one
//!             that counts does.
//! Units:      model units in the spool, lattice units for all decisions.
//! Memory:     the share of [`crate::store::Resources`]; nothing grows with the input.
//! Fails:      [`IngestError`]; triangles with NaN or infinite corners are dropped and counted.
//! Source:     Ju 2004, Robust repair of polygonal models, section 3 (embedding), on a lattice.

mod area;
mod bins;
mod charts;
mod converted;
mod crowds;
mod duplicates;
mod edges;
mod error;
mod examine;
mod facts;
mod fins;
mod looks;
mod names;
mod packed;
mod rims;
mod scatter;
mod scattered;
#[cfg(test)]
mod settle_tests;
mod soup;
mod sums;

pub use area::SoupMeasure;
pub use bins::{BIN_ENTRIES, BINS, Bins, fill_bins};
pub use converted::Converted;
pub use crowds::LeftOut;
pub use duplicates::{DROPS, SettleStats, Settled, settle};
pub use error::IngestError;
pub use fins::{FinStats, SheetRule, drop_fins};
pub use looks::{LOOK_MATERIALS, LOOKS};
pub use names::{PART_NAMES, names_of_parts};
pub use rims::Rims;
pub use scatter::{SCATTERED, scatter};
pub use scattered::{PartSource, PlacedSource, Scattered};
pub use soup::{ATTRIBUTES, SOUP, Soup, SoupFacts, SoupStats, read_soup};
pub use sums::{SoupSums, sum_up};
