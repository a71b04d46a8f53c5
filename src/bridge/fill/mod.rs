//! Fills one loop of rim edges with triangles, as the surface around it suggests.
//!
//! A loop in a plane is filled flat. Creases that run into the opening on both sides are joined by
//! an edge, those that meet in a point are led to it, and every part is filled on its own
//! (`crease.rs`). Anything else is cut into few triangles (`coarse.rs`), which are refined
//! (`refine.rs`) on a surface through the rim that goes on as the rim's triangles do
//! (`surface.rs`).
//!
//! Triangles run along with the loop: the one at rim edge `i` goes from point `i` to point `i + 1`.
//! No function of the system's mathematical library is called, so all machines agree; square roots
//! are exact by IEEE 754.

mod coarse;
mod crease;
mod flat;
mod outline;
mod part;
mod refine;
mod spline;
mod surface;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::bridge::fill::coarse::least_area;
use crate::bridge::fill::part::{Fills, Part};

/// Triangles that refining may make of one loop; edges get longer instead.
pub const MOST_TRIANGLES: usize = 16_384;
/// Edges of the longest loop that is not in a plane and filled nevertheless.
pub const LONGEST_LOOP: usize = 16_384;

/// A simple closed loop of rim edges: edge `i` goes from point `i` to point `i + 1`.
#[derive(Clone, Debug, Default)]
pub struct RimLoop {
    /// The corners, no two of them alike.
    pub points: Vec<DVec3>,
    /// For each edge the third corner of the triangle that it belongs to; `None` where there is no
    /// single one, or where the surface is not to be continued.
    pub opposite: Vec<Option<DVec3>>,
}

/// How loops are filled.
#[derive(Clone, Copy, Debug)]
pub struct FillOptions {
    /// The side of a cell, model units.
    pub cell: f64,
    /// Smaller angles between triangles are noise.
    pub crease_deg: f64,
}

/// What a fill looks like; of several parts the last of these counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FillKind {
    /// In one plane, or in one for each part between creases.
    Flat,
    /// Goes on as the surface around it does.
    Smooth,
    /// As few triangles as the rim allows: too small to be refined, or nothing better was found.
    Coarse,
}

/// The triangles that close a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// They run along with the loop.
    pub triangles: Vec<[DVec3; 3]>,
    /// What was made of it.
    pub kind: FillKind,
    /// Edges that continue a crease of the surface around.
    pub creases: u32,
}

/// Closes a loop; `None` for one that has less than three edges, has corners that are not finite,
/// or is not in a plane and longer than [`LONGEST_LOOP`].
pub fn fill_loop(rim: &RimLoop, options: &FillOptions) -> Option<Fill> {
    let count = rim.points.len();
    let usable = count >= 3 && rim.opposite.len() == count && options.cell > 0.0;
    if !usable || !rim.points.iter().all(|point| point.is_finite()) {
        return None;
    }
    let mut fills = Fills::new(rim, options);
    let mut is_filled = fills.fill(Part::whole(rim));
    if is_filled && !fills.is_manifold() {
        // The parts on both sides of an arc have the same chord of it.
        fills = Fills::without_arcs(rim, options);
        is_filled = fills.fill(Part::whole(rim));
    }
    is_filled.then(|| fills.finish())
}

/// The area that the loop spans, without filling it: of the smallest fill with no new corners, of a
/// rim that is thinned out if it is long.
pub fn fill_area(rim: &RimLoop) -> f64 {
    let finite = rim.points.iter().all(|point| point.is_finite());
    if rim.points.len() < 3 || !finite { 0.0 } else { least_area(&rim.points) }
}
