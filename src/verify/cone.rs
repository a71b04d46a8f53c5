//! The cone of a triangle from a fixed point: volume, area and a bound on the rounding.
//!
//! Units:      model units, squared and cubed.
//! Source:     Neumaier 1974 (compensated sums); Shewchuk 1997 (the filter's bound).

use crate::verify::exact::two_sum;

/// A sum that carries its rounding error along (Neumaier 1974).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Compensated {
    sum: f64,
    rest: f64,
}

impl Compensated {
    #[inline]
    pub(crate) fn add(&mut self, term: f64) {
        let (sum, rest) = two_sum(self.sum, term);
        self.sum = sum;
        self.rest += rest;
    }

    /// Adds all that another sum has seen.
    pub(crate) fn join(&mut self, other: Self) {
        self.add(other.sum);
        self.rest += other.rest;
    }

    pub(crate) fn value(&self) -> f64 {
        self.sum + self.rest
    }
}

/// Error of a cone's volume and of compensated sums of them per magnitude: 16 roundings of one
/// unit in the last place, where 8 of half a unit can happen.
pub(crate) const CONE_BOUND: f64 = 16.0 * f64::EPSILON;
/// Below this, products may have been flushed to zero.
pub(crate) const LEAST_VOLUME: f64 = 1.0e-270;
/// Relative error bound of a 2 x 2 determinant of differences.
const ORIENT_BOUND: f64 = 3.4e-16;

/// A triangle seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// Six times its signed volume.
    pub(crate) volume: f64,
    /// The sum of the magnitudes of all products that make up `volume`.
    pub(crate) magnitude: f64,
    /// The square of twice the triangle's area.
    pub(crate) square: f64,
    /// Whether the triangle has an area; from [`Cone::of`] beyond all doubt of rounding.
    pub(crate) has_area: bool,
}

impl Cone {
    /// The cone from `origin`.
    #[inline]
    pub(crate) fn of(&[a, b, c]: &[[f64; 3]; 3], origin: [f64; 3]) -> Self {
        let from = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        // Edges as differences of what the file says keep the error small far from the origin.
        let [u, v, reach] = [from(b, a), from(c, a), from(a, origin)];
        let mut cone = Self { volume: 0.0, magnitude: 0.0, square: 0.0, has_area: false };
        for (axis, i, j) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let (left, right) = (u[i] * v[j], u[j] * v[i]);
            let normal = left - right;
            let magnitude = left.abs() + right.abs();
            cone.has_area |= normal.abs() > ORIENT_BOUND * magnitude;
            cone.volume += reach[axis] * normal;
            cone.magnitude += reach[axis].abs() * magnitude;
            cone.square += normal * normal;
        }
        cone
    }
}
