//! How two triangles that intersect meet: they cross, overlap in a plane, or touch.
//!
//! In:         two triangles with areas that have a point in common beyond what they share.
//! Invariant:  exact, and the same for both orders of the triangles and any order of corners.
//! Source:     Guigue and Devillers 2003 (intervals on the common line of two planes, compared by
//!             orientations alone).

use crate::defect::Meeting;
use crate::geom::signs::{Point, Signs};

/// How they meet; [`Meeting::Duplicate`] is for those who know vertices.
pub(crate) fn meeting(signs: Signs, a: [Point; 3], b: [Point; 3]) -> Meeting {
    let of_a = a.map(|corner| signs.side(b, corner));
    if of_a == [0; 3] {
        return if shares_area(signs, a, b) { Meeting::Overlapping } else { Meeting::Touching };
    }
    let of_b = b.map(|corner| signs.side(a, corner));
    let crosses = straddles(of_a) && straddles(of_b) && shares_segment(signs, (a, of_a), (b, of_b));
    if crosses { Meeting::Crossing } else { Meeting::Touching }
}

/// Whether there are corners on both sides.
fn straddles(sides: [i32; 3]) -> bool {
    sides.contains(&1) && sides.contains(&-1)
}

/// In one plane: no edge has the two triangles on different sides of its line.
fn shares_area(signs: Signs, a: [Point; 3], b: [Point; 3]) -> bool {
    let axis = (0..3).find(|&axis| signs.turn(axis, a[0], a[1], a[2]) != 0);
    let axis = axis.expect("a triangle with an area has a shadow along some axis");
    let parts = |own: [Point; 3], other: [Point; 3]| {
        let inside = signs.turn(axis, own[0], own[1], own[2]);
        [[0, 1], [1, 2], [2, 0]].iter().any(|&[i, j]| {
            other.iter().all(|&corner| signs.turn(axis, own[i], own[j], corner) != inside)
        })
    };
    !parts(a, b) && !parts(b, a)
}

/// Both straddle: whether the intervals that they cut from the common line of their planes overlap
/// in more than a point.
fn shares_segment(
    signs: Signs,
    (a, of_a): ([Point; 3], [i32; 3]),
    (b, of_b): ([Point; 3], [i32; 3]),
) -> bool {
    let (p, alone_p) = lone_first(a, of_a);
    let (q, alone_q) = lone_first(b, of_b);
    // Such that each lone corner lies on the positive side of the other triangle: turning a
    // triangle over changes the sign of its plane.
    let p = if alone_q < 0 { [p[0], p[2], p[1]] } else { p };
    let q = if alone_p < 0 { [q[0], q[2], q[1]] } else { q };
    let one = signs.side([p[0], p[1], q[0]], q[1]);
    let other = signs.side([p[0], p[2], q[2]], q[0]);
    one == other && one < 0
}

/// The corners in turn, from the one that is alone on its side; and that side.
fn lone_first(corners: [Point; 3], sides: [i32; 3]) -> ([Point; 3], i32) {
    let alone = (0..3).find(|&i| sides[i] != 0 && (0..3).all(|j| j == i || sides[j] != sides[i]));
    let i = alone.expect("of three corners on both sides one is alone");
    ([corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]], sides[i])
}
