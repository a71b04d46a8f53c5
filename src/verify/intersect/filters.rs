//! Signs that are beyond all doubt of rounding, in plain f64.
//!
//! In:         tame points, see [`Signs`](crate::geom::signs::Signs), and differences of them.
//! Invariant:  a sign that is not 0 is the exact one.
//! Source:     Shewchuk 1997 for the bounds.

use crate::geom::signs::{PLANES, Point};

/// Error of a 2 x 2 determinant of differences, per magnitude of its products.
const TURN_BOUND: f64 = 3.4e-16;
/// Of a 3 x 3 determinant of differences.
const SIDE_BOUND: f64 = 7.8e-16;
/// Of a product of a difference with any direction.
const DOT_BOUND: f64 = 1.0e-15;

#[inline]
pub(crate) fn minus(p: Point, q: Point) -> Point {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

/// The normal of a triangle, and how far it may be off.
#[derive(Clone, Copy)]
pub(crate) struct Normal {
    pub(crate) towards: Point,
    /// What a sum of its coordinates, each at most once, may be off.
    doubt: f64,
}

impl Normal {
    #[inline]
    pub(crate) fn of([a, b, c]: [Point; 3]) -> Self {
        let (u, v) = (minus(b, a), minus(c, a));
        let product = |i: usize, j: usize| u[i] * v[j];
        let magnitude = |[i, j]: [usize; 2]| product(i, j).abs() + product(j, i).abs();
        Self {
            towards: PLANES.map(|[i, j]| product(i, j) - product(j, i)),
            doubt: SIDE_BOUND
                * (magnitude(PLANES[0]) + magnitude(PLANES[1]) + magnitude(PLANES[2])),
        }
    }

    /// The axis along which the triangle is seen widest, as far as rounding tells.
    #[inline]
    pub(crate) fn axis(&self) -> u8 {
        let n = self.towards.map(f64::abs);
        if n[0] >= n[1] && n[0] >= n[2] { 0 } else { 1 + u8::from(n[2] > n[1]) }
    }

    /// Whether it surely leads the same way as a direction, whose coordinates are whole numbers of
    /// at most this magnitude.
    #[inline]
    pub(crate) fn leads(&self, direction: Point, most: f64) -> bool {
        let product = |i: usize| self.towards[i] * direction[i];
        product(0) + product(1) + product(2) > self.doubt * most
    }
}

/// The sure sign of the turn from `u` to `v` seen along an axis; 0 if in doubt.
#[inline]
pub(crate) fn turn(axis: usize, u: Point, v: Point) -> i32 {
    let [i, j] = PLANES[axis];
    let (left, right) = (u[i] * v[j], u[j] * v[i]);
    sure_sign(left - right, TURN_BOUND * (left.abs() + right.abs()))
}

/// The sure sign of the determinant of three differences; 0 if in doubt.
#[inline]
pub(crate) fn side(u: Point, v: Point, w: Point) -> i32 {
    let mut volume = 0.0;
    let mut magnitude = 0.0;
    for (axis, [i, j]) in PLANES.into_iter().enumerate() {
        let (left, right) = (u[i] * v[j], u[j] * v[i]);
        volume += w[axis] * (left - right);
        magnitude += w[axis].abs() * (left.abs() + right.abs());
    }
    sure_sign(volume, SIDE_BOUND * magnitude)
}

/// A product with a direction, which may be any.
pub(crate) struct SureProduct {
    pub(crate) is_positive: bool,
    /// Whether it is surely that, or surely negative.
    pub(crate) is_sure: bool,
}

impl SureProduct {
    #[inline]
    pub(crate) fn of(u: Point, direction: Point) -> Self {
        let terms = [u[0] * direction[0], u[1] * direction[1], u[2] * direction[2]];
        let magnitude = terms[0].abs() + terms[1].abs() + terms[2].abs();
        let value = terms[0] + terms[1] + terms[2];
        Self { is_positive: value > 0.0, is_sure: value.abs() > DOT_BOUND * magnitude }
    }
}

/// The sure sign of a product with a direction, which may be any; 0 if in doubt.
#[inline]
pub(crate) fn along(u: Point, direction: Point) -> i32 {
    let SureProduct { is_positive, is_sure } = SureProduct::of(u, direction);
    i32::from(is_sure) * (2 * i32::from(is_positive) - 1)
}

#[inline]
fn sure_sign(value: f64, bound: f64) -> i32 {
    i32::from(value > bound) - i32::from(value < -bound)
}
