//! Whether a place of a surface can be seen from outside.
//!
//! Invariant:  a place is seen if along one of [`DIRECTIONS`] fixed directions no triangle that stops
//!             light lies before it, on either side of its own triangle. Triangles of transparent
//!             materials stop none.
//! Source:     Swinbank and Purser 2006, Fibonacci grids (directions evenly spread).

use glam::DVec3;

use crate::deviate::nearest::{Walker, is_met};
use crate::deviate::triangles::Triangle;
use crate::store::StoreError;

/// Directions that are looked along.
pub(crate) const DIRECTIONS: usize = 64;
/// Rays begin so far off the surface, as a share of the model's extent: rounding must not hit the
/// triangle that they come from, nor one in its place.
const CLEARANCE: f64 = 1e-5;
/// Rays that leave a surface flatter than this are not looked along, sine of the angle.
const LEAST_RISE: f64 = 0.0175;
/// Cosine and sine of the golden angle, 180 (3 - sqrt 5) degrees.
const TURN: [f64; 2] = [-0.737_368_878_078_319_6, 0.675_490_294_261_523_6];

/// Directions evenly spread over the sphere, none along an axis.
pub(crate) fn directions() -> [DVec3; DIRECTIONS] {
    // The first one is turned by about half a radian, so that no part of any is zero.
    let [mut x, mut y] = [0.8, 0.6];
    std::array::from_fn(|i| {
        let z = (2 * i + 1) as f64 / DIRECTIONS as f64 - 1.0;
        let radius = (1.0 - z * z).sqrt();
        let direction = DVec3::new(x * radius, y * radius, z);
        [x, y] = [x * TURN[0] - y * TURN[1], x * TURN[1] + y * TURN[0]];
        direction
    })
}

/// Looks from places of one surface; each worker has its own.
pub(crate) struct Sight<'t> {
    walker: Walker<'t>,
    clearance: f64,
    directions: [DVec3; DIRECTIONS],
    /// What stopped the last ray along each: it may well stop the next.
    blockers: Vec<Option<Triangle>>,
}

impl<'t> Sight<'t> {
    /// Looks through `walker`, of a model so large.
    pub(crate) fn new(walker: Walker<'t>, extent: f64) -> Self {
        let clearance = extent * CLEARANCE;
        Self { walker, clearance, directions: directions(), blockers: vec![None; DIRECTIONS] }
    }

    /// Whether `point` of a triangle with this unit normal is seen; `inward` leads from a border of
    /// the triangle into it, and is zero elsewhere.
    pub(crate) fn sees(
        &mut self,
        point: DVec3,
        normal: DVec3,
        inward: DVec3,
    ) -> Result<bool, StoreError> {
        for (direction, blocker) in self.directions.iter().zip(&mut self.blockers) {
            let rise = direction.dot(normal);
            if rise.abs() < LEAST_RISE {
                continue;
            }
            let origin = point + (normal * rise.signum() + inward) * self.clearance;
            if blocker.is_some_and(|triangle| is_met(origin, *direction, &triangle)) {
                continue;
            }
            *blocker = self.walker.blocker(origin, *direction)?;
            if blocker.is_none() {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_spread_evenly_and_lie_along_no_axis() {
        let all = directions();
        for (i, one) in all.iter().enumerate() {
            assert!((one.length() - 1.0).abs() < 1e-9);
            assert!(one.abs().min_element() > 1e-3, "{one}");
            // Sixty-four caps of 0.25 in radius do not fill half of a sphere.
            assert!(all[..i].iter().all(|other| one.distance(*other) > 0.25), "{i}");
        }
        assert!(all.iter().sum::<DVec3>().length() < 1.0);
    }
}
