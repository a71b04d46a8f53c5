//! Exact signs of orientation for any finite coordinates.
//!
//! Invariant:  -1, 0 or 1, never a guess. Points are tame when all their coordinates are zero or of
//!             a magnitude between 2^-200 and 2^200: then no product of three differences, and no
//!             rounding error of one, leaves the range of f64.
//! Source:     Shewchuk 1997 (adaptive precision), by `robust`.

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::geom::wide::{wide_orient2d, wide_orient3d};

/// A position, model units.
pub type Point = [f64; 3];

const TAME: std::ops::RangeInclusive<f64> = {
    let most = f64::from_bits((1023 + 200) << 52);
    1.0 / most..=most
};

/// Whether adaptive f64 arithmetic is exact on a point.
#[inline]
#[must_use]
pub fn is_tame(p: &Point) -> bool {
    p.iter().all(|x| *x == 0.0 || TAME.contains(&x.abs()))
}

/// Signs over points that are all tame, or not.
#[derive(Clone, Copy)]
pub struct Signs {
    /// Whether all points that are asked about are tame.
    pub tame: bool,
}

/// The coordinates that stay when one axis is dropped.
pub const PLANES: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

fn sign_of(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

impl Signs {
    /// On which side of the plane of `a`, `b` and `c` a point lies; 0 in the plane.
    #[must_use]
    pub fn side(self, [a, b, c]: [Point; 3], p: Point) -> i32 {
        if self.tame {
            let at = |[x, y, z]: Point| Coord3D { x, y, z };
            sign_of(orient3d(at(a), at(b), at(c), at(p)))
        } else {
            wide_orient3d(a, b, c, p)
        }
    }

    /// Which way `a`, `b`, `c` turn when `axis` is dropped; 0 on a line.
    #[must_use]
    pub fn turn(self, axis: usize, a: Point, b: Point, c: Point) -> i32 {
        let [u, v] = PLANES[axis];
        if self.tame {
            let at = |p: Point| Coord { x: p[u], y: p[v] };
            sign_of(orient2d(at(a), at(b), at(c)))
        } else {
            let at = |p: Point| [p[u], p[v]];
            wide_orient2d(at(a), at(b), at(c))
        }
    }
}
