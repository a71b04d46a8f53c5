//! Whether two triangles meet anywhere but in what they share: filters first, exact signs if in
//! doubt.
//!
//! In:         two triangles with areas, by the numbers and places of their vertices.
//! Invariant:  exact. A filter only ever says that they do not meet: it names a plane or a line
//!             through what they share that separates them beyond all doubt of rounding.

use crate::defect::Meeting;
use crate::geom::signs::{Point, Signs};
use crate::verify::intersect::exact_pair::meet;
use crate::verify::intersect::filters::{Normal, along, minus, side, turn};
use crate::verify::intersect::meeting::meeting;

/// A triangle as the tests see it.
#[derive(Clone, Copy)]
pub(crate) struct Face {
    /// Its vertices.
    pub(crate) vertices: [u32; 3],
    /// The axis along which it is seen widest, as far as rounding tells.
    pub(crate) axis: u8,
    /// Whether all its corners are tame, see [`Signs`].
    pub(crate) tame: bool,
}

impl Face {
    pub(crate) fn of(vertices: [u32; 3], normal: &Normal, tame: bool) -> Self {
        Self { vertices, axis: normal.axis(), tame }
    }
}

/// How corners of two triangles are the same.
#[derive(Clone, Copy)]
struct Match {
    /// The corners of the first, those that are shared in front.
    first: [u8; 3],
    /// The corners of the second, those that are shared in front in the same order.
    second: [u8; 3],
    shared: u8,
}

/// By bits: whether corner `i` of the first and `j` of the second are the same, at `3 * i + j`.
static MATCHES: [Match; 512] = {
    let mut matches = [Match { first: [0, 1, 2], second: [0, 1, 2], shared: 0 }; 512];
    let mut equal = 0;
    while equal < 512 {
        matches[equal] = match_of(equal);
        equal += 1;
    }
    matches
};

const fn match_of(equal: usize) -> Match {
    let mut found = Match { first: [0, 1, 2], second: [0, 1, 2], shared: 0 };
    let mut i = 0;
    while i < 3 {
        let at = found.shared as usize;
        let mut j = at;
        while j < 3 {
            if equal >> (3 * i + found.second[j] as usize) & 1 == 1 {
                // Later corners of the first have not moved yet.
                found.first.swap(at, i);
                found.second.swap(at, j);
                found.shared += 1;
                break;
            }
            j += 1;
        }
        i += 1;
    }
    found
}

/// Which corners of two triangles are the same vertex.
#[derive(Clone, Copy)]
pub(crate) struct Sharing(u16);

impl Sharing {
    /// Of two triangles.
    #[inline]
    pub(crate) fn of(a: &Face, b: &Face) -> Self {
        // This is hard to foresee: no branches here.
        let same = |i: usize, j: usize| u16::from(a.vertices[i] == b.vertices[j]) << (3 * i + j);
        let equal = same(0, 0) | same(0, 1) | same(0, 2) | same(1, 0) | same(1, 1) | same(1, 2);
        Self(equal | same(2, 0) | same(2, 1) | same(2, 2))
    }

    /// How many corners.
    #[inline]
    pub(crate) fn count(self) -> usize {
        usize::from(MATCHES[usize::from(self.0)].shared)
    }
}

/// Whether two triangles intersect; `positions` are those of all vertices.
#[inline]
pub(crate) fn intersect(sharing: Sharing, a: &Face, b: &Face, positions: &[Point]) -> bool {
    let Match { first, second, shared } = MATCHES[usize::from(sharing.0)];
    let p = first.map(|i| positions[a.vertices[usize::from(i)] as usize]);
    let q = second.map(|j| positions[b.vertices[usize::from(j)] as usize]);
    let shared = usize::from(shared);
    let signs = Signs { tame: a.tame && b.tame };
    if signs.tame {
        let axes = [usize::from(a.axis), usize::from(b.axis)];
        let apart = match shared {
            0 => are_apart(p, q, axes),
            1 => are_apart_at_vertex(p, q, axes),
            2 => are_apart_at_edge(p, q, axes),
            _ => false,
        };
        if apart {
            return false;
        }
    }
    meet(signs, p, q, shared)
}

/// How two triangles that intersect meet.
#[cold]
pub(crate) fn meeting_of(sharing: Sharing, a: &Face, b: &Face, positions: &[Point]) -> Meeting {
    let Match { first, second, shared } = MATCHES[usize::from(sharing.0)];
    if shared == 3 {
        return Meeting::Duplicate;
    }
    let p = first.map(|i| positions[a.vertices[usize::from(i)] as usize]);
    let q = second.map(|j| positions[b.vertices[usize::from(j)] as usize]);
    meeting(Signs { tame: a.tame && b.tame }, p, q)
}

/// With a common edge: seen from somewhere they lie on both sides of it, or they fold there.
#[inline]
fn are_apart_at_edge(p: [Point; 3], q: [Point; 3], axes: [usize; 2]) -> bool {
    let (edge, a, b) = (minus(p[1], p[0]), minus(p[2], p[0]), minus(q[2], p[0]));
    turn(axes[0], edge, a) * turn(axes[0], edge, b) < 0 || side(edge, a, b) != 0
}

/// With a common vertex: a plane through it separates them.
#[inline]
fn are_apart_at_vertex(p: [Point; 3], q: [Point; 3], axes: [usize; 2]) -> bool {
    let [a, b] = [minus(p[1], p[0]), minus(p[2], p[0])];
    let [c, d] = [minus(q[1], p[0]), minus(q[2], p[0])];
    // Between the middles of both.
    let (m, n): (Point, Point) =
        (std::array::from_fn(|i| a[i] + b[i]), std::array::from_fn(|i| c[i] + d[i]));
    let length = |v: Point| v[0].abs() + v[1].abs() + v[2].abs();
    let (m_length, n_length) = (length(m), length(n));
    let between = std::array::from_fn(|i| m[i] * n_length - n[i] * m_length);
    if along(a, between) > 0
        && along(b, between) > 0
        && along(c, between) < 0
        && along(d, between) < 0
    {
        return true;
    }
    if are_apart_in_sight(axes[0], [a, b], [c, d]) {
        return true;
    }
    let of_first = side(a, b, c);
    if of_first != 0 && of_first == side(a, b, d) {
        return true;
    }
    let of_second = side(c, d, a);
    if of_second != 0 && of_second == side(c, d, b) {
        return true;
    }
    axes[1] != axes[0] && are_apart_in_sight(axes[1], [a, b], [c, d])
}

/// Seen along an axis, the line of an edge from the common vertex separates them.
#[inline]
fn are_apart_in_sight(axis: usize, [a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let (ab, cd) = (turn(axis, a, b), turn(axis, c, d));
    let [ac, ad, bc, bd] = [turn(axis, a, c), turn(axis, a, d), turn(axis, b, c), turn(axis, b, d)];
    ab != 0 && (ac == -ab && ad == -ab || bc == ab && bd == ab)
        || cd != 0 && (ac == cd && bc == cd || ad == -cd && bd == -cd)
}

/// With nothing in common: the plane of one, or in sight the line of an edge.
#[inline]
fn are_apart(p: [Point; 3], q: [Point; 3], axes: [usize; 2]) -> bool {
    let on_one_side = |p: [Point; 3], q: [Point; 3]| {
        let (u, v) = (minus(p[1], p[0]), minus(p[2], p[0]));
        let first = side(u, v, minus(q[0], p[0]));
        first != 0
            && first == side(u, v, minus(q[1], p[0]))
            && first == side(u, v, minus(q[2], p[0]))
    };
    let beyond_an_edge = |axis: usize, p: [Point; 3], q: [Point; 3]| {
        [[0, 1, 2], [1, 2, 0], [2, 0, 1]].iter().any(|&[i, j, k]| {
            let edge = minus(p[j], p[i]);
            let inside = turn(axis, edge, minus(p[k], p[i]));
            inside != 0 && q.iter().all(|&x| turn(axis, edge, minus(x, p[i])) == -inside)
        })
    };
    on_one_side(p, q)
        || on_one_side(q, p)
        || beyond_an_edge(axes[0], p, q)
        || beyond_an_edge(axes[0], q, p)
        || axes[1] != axes[0] && (beyond_an_edge(axes[1], p, q) || beyond_an_edge(axes[1], q, p))
}
