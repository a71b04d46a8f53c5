//! Whether two triangles meet anywhere but in what they share, by exact signs alone.
//!
//! In:         two triangles with areas, and how many of their first corners are the same vertices.
//! Invariant:  exact. Touching and coplanar overlap count.
//!
//! Two convex sets that meet in more than a shared vertex meet in a segment from there, which ends
//! where one of the two triangles ends: on an edge opposite to the vertex. Without a shared vertex
//! an edge of one meets the other.

use crate::geom::signs::{Point, Signs};

/// Whether they meet; the first `shared` corners are the same in both.
#[cold]
pub(crate) fn meet(signs: Signs, a: [Point; 3], b: [Point; 3], shared: usize) -> bool {
    match shared {
        0 => [[0, 1], [1, 2], [2, 0]]
            .iter()
            .any(|&[i, j]| reaches(signs, [a[i], a[j]], b) || reaches(signs, [b[i], b[j]], a)),
        1 => reaches(signs, [a[1], a[2]], b) || reaches(signs, [b[1], b[2]], a),
        2 => signs.side(a, b[2]) == 0 && folds_back(signs, a, b[2]),
        // The same triangle twice.
        _ => true,
    }
}

/// Whether `p`, in the plane of the triangle, lies on the side of its first edge where it lies too.
fn folds_back(signs: Signs, a: [Point; 3], p: Point) -> bool {
    let axis = upright(signs, a);
    signs.turn(axis, a[0], a[1], a[2]) == signs.turn(axis, a[0], a[1], p)
}

/// An axis along which the triangle does not vanish.
fn upright(signs: Signs, [a, b, c]: [Point; 3]) -> usize {
    let found = (0..3).find(|&axis| signs.turn(axis, a, b, c) != 0);
    found.expect("a triangle with an area has a shadow along some axis")
}

/// Whether a segment and a triangle have a point in common.
fn reaches(signs: Signs, [p, q]: [Point; 2], triangle: [Point; 3]) -> bool {
    let (from, to) = (signs.side(triangle, p), signs.side(triangle, q));
    if from == 0 && to == 0 {
        return reaches_in_plane(signs, [p, q], triangle);
    }
    if from == to {
        return false;
    }
    let [a, b, c] = triangle;
    let sides = [[a, b], [b, c], [c, a]].map(|[s, t]| signs.side([p, q, s], t));
    sides.iter().all(|&side| side >= 0) || sides.iter().all(|&side| side <= 0)
}

/// The same, all in one plane.
fn reaches_in_plane(signs: Signs, [p, q]: [Point; 2], triangle: [Point; 3]) -> bool {
    let axis = upright(signs, triangle);
    let turn = |a, b, c| signs.turn(axis, a, b, c);
    let [a, b, c] = triangle;
    let holds = |x: Point| {
        let turns = [turn(a, b, x), turn(b, c, x), turn(c, a, x)];
        turns.iter().all(|&turn| turn >= 0) || turns.iter().all(|&turn| turn <= 0)
    };
    if holds(p) || holds(q) {
        return true;
    }
    // Both ends are outside, so a segment that reaches the triangle crosses its rim.
    [[a, b], [b, c], [c, a]].iter().any(|&[s, t]| {
        let (s_side, t_side) = (turn(p, q, s), turn(p, q, t));
        let (p_side, q_side) = (turn(s, t, p), turn(s, t, q));
        if p_side == 0 && q_side == 0 {
            // On the line of this edge, and its ends are no place where a segment could pass: it
            // covers the edge or misses it. If it covers it, it crosses another edge at an end.
            return false;
        }
        s_side * t_side <= 0 && p_side * q_side <= 0
    })
}
