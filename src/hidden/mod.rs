//! Leaves out what nobody sees: bodies that no ray from outside reaches, or hardly any.
//!
//! A *body* is what is judged as one: triangles joined across edges, with the walls, fills and slabs
//! that stand for them. Bodies that are open are judged together with all open ones of their part,
//! so that no piece of a broken surface goes by itself. Of every body some places that the outside
//! touches are looked at; from each of them rays go out over the half space in front, and those
//! that leave the grid count. A body goes if surely less than [`SEEN_SHARE`] of its rays do. What the
//! outside touches nowhere is *sealed*: the fill rule takes care of it, and it is only told of.
//!
//! In:         the soup in bins, the surface that the outside touches, the corners inside.
//! Out:        [`Seen`]: the soup's drops and added triangles without those of hidden bodies.
//! Invariant:  whole bodies go or stay; the answer does not depend on any share or thread.
//! Units:      cells for rays, model units for sizes.
//! Memory:     the share; tables over triangles spill.
//! Fails:      [`crate::store::StoreError`].
//! Source:     Nooruddin, Turk 2003, section 4 (visibility of parts); sampling and the bound of
//!             Wilson 1927 are ours to combine.

mod bodies;
mod removal;
mod votes;

use serde::{Deserialize, Serialize};

pub use bodies::Bodies;
pub use removal::{SEEN, Seen, leave_out};
pub use votes::{Verdict, Verdicts, judge};

/// A body of which less than this share is seen goes.
pub const SEEN_SHARE: f64 = 0.002;

/// What was found hidden. Areas in model units squared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HiddenStats {
    /// Bodies that were looked at.
    pub bodies: u64,
    /// Of these, left out since nobody sees them.
    pub hidden_bodies: u64,
    /// Their triangles.
    pub hidden_triangles: u64,
    /// Their area.
    pub hidden_area: f64,
    /// Bodies that the outside does not touch, which the fill rule fills.
    pub sealed_bodies: u64,
    /// Their triangles.
    pub sealed_triangles: u64,
    /// The largest bodies of both kinds.
    pub largest: Vec<HiddenBody>,
}

/// A body that nobody sees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HiddenBody {
    /// Name of the part that it belongs to; empty where the file has no names.
    pub part: String,
    /// Number of that part.
    pub part_number: u32,
    /// Whether the outside does not even touch it.
    pub is_sealed: bool,
    /// Its triangles.
    pub triangles: u64,
    /// Their area.
    pub area: f64,
    /// Corners of its box, model units.
    pub lo: [f64; 3],
    /// See `lo`.
    pub hi: [f64; 3],
}
