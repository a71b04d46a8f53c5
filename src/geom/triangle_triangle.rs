//! Whether two triangles on the lattice meet where they should not, exactly.
//!
//! In:         two triangles that are not degenerate, with an id for each corner; all corners
//!             within [`REACH`](crate::geom::orientation::REACH) of each other along each axis.
//!             Equal ids mean one vertex, so one place.
//! Out:        whether they have a point in common that is not of the vertex or edge they share.
//!             Touching counts, and so does a common place under different ids.
//! Invariant:  exact; the same for both orders of the triangles, and for any order of corners.
//! Units:      lattice units.
//! Fails:      never; what a degenerate triangle gets means nothing.
//! Source:     Guigue and Devillers 2003, Fast and robust triangle-triangle overlap test using
//!             orientation predicates; the cases with shared vertices are ours.
//!
//! ```text
//! ids shared   question
//! 0            boxes, sides of corners, then two orientations: do the intervals overlap that
//!              both triangles cut from the common line of their planes?
//! 1            that line passes through the vertex: do both triangles leave along the same ray?
//! 2            folded flat upon each other?
//! 3            yes
//! ```
//!
//! Coplanar triangles are seen along an axis that their normal is not perpendicular to.

use crate::geom::orientation::{Plane, orientation};

/// A triangle on the lattice that knows its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Where the corners are.
    pub corners: [[i64; 3]; 3],
    /// Which vertices they are, three different ones.
    pub ids: [u64; 3],
}

/// Whether the triangles meet anywhere but in the vertex or edge they share by id. Touching counts.
#[must_use]
pub fn meets_improperly(a: &Triangle, b: &Triangle) -> bool {
    let mut shared = 0_u32;
    for i in 0..3 {
        for j in 0..3 {
            shared |= u32::from(a.ids[i] == b.ids[j]) << (3 * i + j);
        }
    }
    let pair = |bits: u32| {
        let at = bits.trailing_zeros() as usize;
        debug_assert_eq!(a.corners[at / 3], b.corners[at % 3], "a vertex in two places");
        (at / 3, at % 3)
    };
    match shared.count_ones() {
        0 => may_touch(&a.corners, &b.corners) && meets(a.corners, b.corners),
        1 => {
            let (i, j) = pair(shared);
            meets_beyond_vertex(from(i, &a.corners), from(j, &b.corners))
        }
        2 => {
            let (first, second) = (pair(shared), pair(shared & (shared - 1)));
            let edge = [a.corners[first.0], a.corners[second.0]];
            let apex_a = a.corners[3 - first.0 - second.0];
            let apex_b = b.corners[3 - first.1 - second.1];
            folds_flat(edge, apex_a, apex_b)
        }
        _ => true,
    }
}

/// The corners in the same turn, begun at the `first`.
#[inline]
fn from(first: usize, corners: &[[i64; 3]; 3]) -> [[i64; 3]; 3] {
    const NEXT: [usize; 5] = [0, 1, 2, 0, 1];
    [corners[first], corners[NEXT[first + 1]], corners[NEXT[first + 2]]]
}

/// Whether the boxes of the triangles have a point in common.
#[inline]
fn may_touch(a: &[[i64; 3]; 3], b: &[[i64; 3]; 3]) -> bool {
    // No branches, since nothing foretells them.
    (0..3).fold(true, |all, axis| {
        let span = |t: &[[i64; 3]; 3]| {
            let [p, q, r] = [t[0][axis], t[1][axis], t[2][axis]];
            (p.min(q).min(r), p.max(q).max(r))
        };
        let ((a_lo, a_hi), (b_lo, b_hi)) = (span(a), span(b));
        all & (a_lo <= b_hi) & (b_lo <= a_hi)
    })
}

/// Whether two triangles have a point in common.
fn meets(a: [[i64; 3]; 3], b: [[i64; 3]; 3]) -> bool {
    let plane_b = Plane::through(b[0], b[1], b[2]);
    let Some(apex_a) = apex(a.map(|corner| plane_b.side(corner))) else { return false };
    let plane_a = Plane::through(a[0], a[1], a[2]);
    let Some(apex_b) = apex(b.map(|corner| plane_a.side(corner))) else { return false };
    let (Apex::Alone { at: i, above: a_above }, Apex::Alone { at: j, above: b_above }) =
        (apex_a, apex_b)
    else {
        return meets_in_plane(a, b, plane_b.normal());
    };
    let ([p, mut q, mut r], [s, mut t, mut u]) = (from(i, &a), from(j, &b));
    // Turn each triangle over that has the other's apex below it. Then the line of the planes runs
    // such that pr comes before pq, and st before su.
    if !b_above {
        (q, r) = (r, q);
    }
    if !a_above {
        (t, u) = (u, t);
    }
    (orientation(p, q, s, t) <= 0) & (orientation(p, r, s, u) >= 0)
}

/// How a triangle lies to the plane of another that it is not clear of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Apex {
    /// All of it in the plane.
    Flat,
    /// One corner on one side, or on the plane; the others on the other, at most one on the plane.
    /// So the two edges of that corner cross the plane in one point each.
    Alone { at: usize, above: bool },
}

/// The corner that is alone on its side; `None` when all are strictly on one.
#[inline]
fn apex(sides: [i32; 3]) -> Option<Apex> {
    let code = (sides[0] + 1) + 3 * (sides[1] + 1) + 9 * (sides[2] + 1);
    APEXES[code as usize]
}

const APEXES: [Option<Apex>; 27] = {
    let mut apexes = [None; 27];
    let mut code = 0;
    while code < 27 {
        let sides = [code % 3, code / 3 % 3, code / 9];
        // How many corners are below, on and above, and which one is the last of them.
        let (mut count, mut last, mut corner) = ([0; 3], [0; 3], 0);
        while corner < 3 {
            count[sides[corner]] += 1;
            last[sides[corner]] = corner;
            corner += 1;
        }
        apexes[code] = match count {
            [3, ..] | [.., 3] => None,
            [_, 3, _] => Some(Apex::Flat),
            [.., 1] => Some(Apex::Alone { at: last[2], above: true }),
            [1, ..] => Some(Apex::Alone { at: last[0], above: false }),
            // One corner touches; it counts as being opposite to the other two.
            [below, ..] => Some(Apex::Alone { at: last[1], above: below == 2 }),
        };
        code += 1;
    }
    apexes
};

/// Whether two triangles have more in common than their first corner, which is one vertex.
///
/// The line of their planes runs through the vertex v. A triangle leaves v along it iff its other
/// corners p, q are not strictly on one side of the other's plane. With normals n = p × q and m,
/// and sides s = p · m, t = q · m, the line's direction n × m is s q - t p: for s ≥ 0 ≥ t the
/// triangle leaves forwards, for s ≤ 0 ≤ t backwards.
fn meets_beyond_vertex(a: [[i64; 3]; 3], b: [[i64; 3]; 3]) -> bool {
    let plane_b = Plane::through(b[0], b[1], b[2]);
    let sides_a = [plane_b.side(a[1]), plane_b.side(a[2])];
    if sides_a[0] * sides_a[1] > 0 {
        return false;
    }
    if sides_a == [0, 0] {
        return meets_beyond_vertex_in_plane(a, b, plane_b.normal());
    }
    let plane_a = Plane::through(a[0], a[1], a[2]);
    let sides_b = [plane_a.side(b[1]), plane_a.side(b[2])];
    if sides_b[0] * sides_b[1] > 0 {
        return false;
    }
    // The other triangle sees the planes in the other order, hence the line reversed.
    (sides_a[0] > sides_a[1]) == (sides_b[0] < sides_b[1])
}

/// Whether two triangles with a common edge lie in one plane, on the same side of that edge.
fn folds_flat(edge: [[i64; 3]; 2], apex_a: [i64; 3], apex_b: [i64; 3]) -> bool {
    let plane = Plane::through(edge[0], edge[1], apex_a);
    if plane.side(apex_b) != 0 {
        return false;
    }
    // Parallel normals: one component tells whether they agree.
    let axis = seen_along(plane.normal());
    let other = Plane::through(edge[0], edge[1], apex_b);
    (plane.normal()[axis] > 0) == (other.normal()[axis] > 0)
}

/// The first axis along which a plane with this normal is not seen edge-on.
#[inline]
fn seen_along(normal: [i64; 3]) -> usize {
    match normal {
        [0, 0, _] => 2,
        [0, ..] => 1,
        _ => 0,
    }
}

/// Points seen along an axis: the coordinates that remain.
#[inline]
fn flatten(corners: [[i64; 3]; 3], axis: usize) -> [[i64; 2]; 3] {
    // One copy for each axis, so that none picks coordinates by a number known only then.
    match axis {
        0 => corners.map(|[_, y, z]| [y, z]),
        1 => corners.map(|[x, _, z]| [z, x]),
        _ => corners.map(|[x, y, _]| [x, y]),
    }
}

/// Twice the area of the triangle of three points: positive when they turn left.
#[inline]
fn turn(p: [i64; 2], q: [i64; 2], r: [i64; 2]) -> i64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Whether two triangles in one plane have a point in common: no edge has the other triangle
/// strictly outside. No branches, since nothing foretells them.
fn meets_in_plane(a: [[i64; 3]; 3], b: [[i64; 3]; 3], normal: [i64; 3]) -> bool {
    let axis = seen_along(normal);
    let (a, b) = (flatten(a, axis), flatten(b, axis));
    let parts = |one: &[[i64; 2]; 3], other: &[[i64; 2]; 3]| {
        let left = turn(one[0], one[1], one[2]).signum();
        let outside = |p, q| other.iter().fold(true, |all, &c| all & (turn(p, q, c) * left < 0));
        outside(one[0], one[1]) | outside(one[1], one[2]) | outside(one[2], one[0])
    };
    !parts(&a, &b) && !parts(&b, &a)
}

/// As [`meets_beyond_vertex`], for triangles in one plane: a side of one at the vertex runs in the
/// angle of the other, or along it.
fn meets_beyond_vertex_in_plane(a: [[i64; 3]; 3], b: [[i64; 3]; 3], normal: [i64; 3]) -> bool {
    let axis = seen_along(normal);
    let ([v, p, q], [_, s, t]) = (flatten(a, axis), flatten(b, axis));
    let (a_left, b_left) = (turn(v, p, q).signum(), turn(v, s, t).signum());
    let [ps, pt, qs, qt] = [turn(v, p, s), turn(v, p, t), turn(v, q, s), turn(v, q, t)];
    let s_in_a = (ps * a_left >= 0) & (qs * a_left <= 0);
    let in_b = |to_s: i64, to_t: i64| (to_s * b_left <= 0) & (to_t * b_left >= 0);
    // If t were in a and s not, p or q would be in b.
    s_in_a | in_b(ps, pt) | in_b(qs, qt)
}
