//! Cracks wider than a cell: strips between the rims of a shell that face each other.
//!
//! Narrower cracks do not bother the scan, and a shell without a wide one is left as it is.
//!
//! In:         the rims of one shell.
//! Out:        strips, and the rims that are left: open ones, and short loops between strips.
//! Invariant:  mod 2, rims and strips together are bounded by what is left.
//! Memory:     the rims of the shell cut into pieces, at most [`MOST_PIECES`].

use std::collections::BTreeMap;

use glam::DVec3;

use crate::bridge::loops::ShellRim;
use crate::bridge::pair::{self, join_rims};
use crate::bridge::rims::{HELD, NEW, RimEdge};
use crate::bridge::shells::Cover;
use crate::octree::Domain;
use crate::octree::points::pack_point;

/// Less length of wide cracks than this is left to the patch.
const LEAST_CELLS: f64 = 4.0;

/// A shell has cracks where this share of its rims faces others across wide ones. Where less does,
/// rims that pass each other by chance are more likely.
const PULLED_SHARE: f64 = 0.5;

/// Pieces of half a gap beyond which the cracks of a shell are left to the patch.
const MOST_PIECES: f64 = 200_000.0;

/// What closes the cracks of a shell.
pub struct Strips {
    pub triangles: Vec<[DVec3; 3]>,
    /// The rims that are left.
    pub rims: Vec<ShellRim>,
    /// Length of the rims that were joined, both sides, model units.
    pub length: f64,
}

/// What becomes of the cracks of a shell.
pub enum Cracks {
    /// There are none that the scan would see.
    Narrow,
    /// So much length of wide ones, model units, is left to the patch.
    TooLong(f64),
    /// They are joined.
    Joined(Strips),
}

/// Joins the rims of a shell.
pub fn join_cracks(rims: &[ShellRim], max_gap: f64, domain: &Domain) -> Cracks {
    let wide: f64 = rims.iter().map(|rim| rim.edge.length() * rim.cover.wide).sum();
    let length: f64 = rims.iter().map(|rim| rim.edge.length()).sum();
    let is_pulled_apart = wide >= PULLED_SHARE * length;
    if wide < LEAST_CELLS * domain.cell_size() || !is_pulled_apart {
        return Cracks::Narrow;
    }
    if length / max_gap > MOST_PIECES {
        return Cracks::TooLong(wide);
    }
    let mut left = BTreeMap::new();
    for rim in rims.iter().filter(|rim| rim.edge.flags & HELD == 0) {
        toggle(&mut left, *rim);
    }
    let edges: Vec<pair::RimEdge> = left
        .values()
        .filter(|rim| rim.cover.faced > 0.0)
        .map(|rim| {
            let (ends, opposite) = (rim.edge.ends(), rim.edge.opposite());
            pair::RimEdge { ends, opposite, sheet: rim.edge.sheet }
        })
        .collect();
    let strips = join_rims(&edges, max_gap);
    let Some(ShellRim { edge: first, .. }) = rims.first().copied() else {
        return Cracks::Narrow;
    };
    for triangle in &strips.triangles {
        for i in 0..3 {
            let ends = [triangle[i], triangle[(i + 1) % 3]];
            let packed = ends.map(|end| pack_point(domain.snap(end.to_array()).map(|c| c as u32)));
            if packed[0] == packed[1] {
                continue;
            }
            let corners = [ends[0], ends[1], triangle[(i + 2) % 3]].map(|c| c.to_array());
            let edge = RimEdge { corners, flags: NEW, ..first };
            toggle(&mut left, ShellRim { edge, ends: packed, cover: Cover::default() });
        }
    }
    let rims = left.into_values().map(|rim| ShellRim { cover: Cover::default(), ..rim }).collect();
    Cracks::Joined(Strips { triangles: strips.triangles, rims, length: strips.length })
}

/// Edges count mod 2.
fn toggle(left: &mut BTreeMap<[u128; 2], ShellRim>, rim: ShellRim) {
    let [a, b] = rim.ends;
    let key = [a.min(b), a.max(b)];
    if left.remove(&key).is_none() {
        left.insert(key, rim);
    }
}
