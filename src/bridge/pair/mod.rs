//! Joins rims that face each other across a crack by strips of triangles.
//!
//! Rims are cut into pieces of half a gap at most. Each piece looks for the corner of a facing rim
//! from which it is seen under the widest angle: that is the triangle that Delaunay would make in
//! a flat strip, so the pieces on both sides choose triangles that fit. Where they do not, what is
//! left over mod 2 are loops about as long as the gap is wide, which a fill closes.
//!
//! A corner faces a piece if it is within the gap, on the far side of the piece's own triangle,
//! the piece is on the far side of its triangles as well, and the way to it along the rim is much
//! longer than the way across. So the corners and the round ends of an opening are not cut off; a
//! slot that is narrower than the gap is closed.
//!
//! Source: Barequet, Sharir 1995, Filling gaps in the boundary of a polyhedron.

mod near;
mod pieces;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use glam::DVec3;

use crate::bridge::pair::near::Near;
use crate::bridge::pair::pieces::{Piece, Pieces, Side};

/// Pieces of one edge; those of longer edges are longer than half a gap.
pub const MOST_PIECES: usize = 4096;
/// What is faced lies in front, up to 78 degrees to the side ...
const FACING_COSINE: f64 = 0.2;
/// ... or anywhere, if it is closer than this part of the gap and of another sheet: rims that
/// overlap. In one sheet that would be the other side of a narrow bar.
const TOUCHING: f64 = 0.5;
/// The way along a rim is so many times longer than the way across: less than 29 degrees at the
/// tip of a crack.
const DETOUR: f64 = 4.0;
/// Angles whose cosines differ by less are alike.
const ALIKE: f64 = 1e-9;

/// An edge of a rim.
#[derive(Clone, Copy, Debug)]
pub struct RimEdge {
    /// Where it begins and ends, in any order.
    pub ends: [DVec3; 2],
    /// The third corner of its triangle.
    pub opposite: DVec3,
    /// Which connected sheet of triangles it belongs to.
    pub sheet: u32,
}

/// The strips between rims.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strips {
    /// Mod 2, they and the rims are bounded by the rims that face nothing, and by short loops.
    /// Some have no area: they cut edges into pieces.
    pub triangles: Vec<[DVec3; 3]>,
    /// Length of the rims that were joined, on both sides.
    pub length: f64,
}

/// Joins the rims that face each other within `max_gap`; the order of the edges does not matter.
/// No two edges may have the same ends.
pub fn join_rims(rim: &[RimEdge], max_gap: f64) -> Strips {
    let mut strips = Strips::default();
    if max_gap.is_nan() || max_gap <= 0.0 || rim.len() < 2 {
        return strips;
    }
    let pieces = Pieces::cut(rim, max_gap / 2.0);
    // Half a piece farther than the gap, as seen from the middle of a piece.
    let near = Near::new(&pieces.points, 1.25 * max_gap);
    let mut chosen = BTreeSet::new();
    let mut is_used = vec![false; pieces.points.len()];
    for piece in &pieces.pieces {
        if let Some(corner) = widest(piece, &pieces, &near, max_gap) {
            let [a, b] = piece.ends;
            let mut triangle = [a, b, corner];
            triangle.iter().for_each(|&corner| is_used[corner as usize] = true);
            triangle.sort_unstable();
            chosen.insert(triangle);
            strips.length += pieces.at(a).distance(pieces.at(b));
        }
    }
    let place = |triangle: [u32; 3]| triangle.map(|corner| pieces.at(corner));
    strips.triangles.extend(pieces.cuts(&is_used).into_iter().map(place));
    strips.triangles.extend(chosen.into_iter().map(place));
    strips
}

/// The facing corner from which a piece is seen under the widest angle.
fn widest(piece: &Piece, pieces: &Pieces, near: &Near, max_gap: f64) -> Option<u32> {
    let [a, b] = piece.ends;
    let (start, end) = (pieces.at(a), pieces.at(b));
    let farthest_square = (max_gap + start.distance(end)).powi(2);
    let mut best: Option<(f64, u32, u32)> = None;
    near.visit((start + end) / 2.0, |corner| {
        let place = pieces.at(corner);
        let (to_start, to_end) = (start - place, end - place);
        let farthest = to_start.length_squared().max(to_end.length_squared());
        if corner == a || corner == b || farthest > farthest_square {
            return;
        }
        let cosine = to_start.normalize_or_zero().dot(to_end.normalize_or_zero());
        // Of a rectangle both sides see both diagonals; they agree on the one with the lowest end.
        let far = if to_start.length_squared() > to_end.length_squared() { a } else { b };
        let lowest = far.min(corner);
        let is_better = best.is_none_or(|(least, other, _)| {
            cosine < least - ALIKE || cosine < least + ALIKE && lowest < other
        });
        if is_better && faces(piece, corner, pieces, max_gap) {
            best = Some((cosine, lowest, corner));
        }
    });
    best.map(|(_, _, corner)| corner)
}

fn faces(piece: &Piece, corner: u32, pieces: &Pieces, max_gap: f64) -> bool {
    let [start, end] = piece.ends.map(|end| pieces.at(end));
    let place = pieces.at(corner);
    let along = end - start;
    let share = (place - start).dot(along) / along.length_squared();
    let foot = start + share.clamp(0.0, 1.0) * along;
    let across = place - foot;
    let distance = across.length();
    if distance.is_nan() || distance > max_gap {
        return false;
    }
    let least = FACING_COSINE * distance;
    let is_touching = distance <= TOUCHING * max_gap;
    let is_ahead = across.dot(piece.side.outward) >= least;
    let agrees = |side: &Side| {
        let faces_back = is_ahead && -across.dot(side.outward) >= least;
        faces_back || is_touching && side.sheet != piece.side.sheet
    };
    let in_front = pieces.sides[corner as usize].iter().any(agrees);
    in_front && pieces.way(piece, share, corner) >= DETOUR * distance
}
