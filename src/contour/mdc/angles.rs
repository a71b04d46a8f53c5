//! The smallest angles of triangles, for the outcome.
//!
//! Source: the series for the mean is formula 4.4.45 of Abramowitz and Stegun 1964, good to a
//!         250th of a degree; the smallest of all angles is exact.

use glam::DVec3;

/// The smallest angle of many triangles.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    least_sine_squared: f64,
}

impl Default for Angles {
    fn default() -> Self {
        Self { least_sine_squared: f64::INFINITY }
    }
}

impl Angles {
    /// Notes a triangle; its smallest angle in degrees.
    #[inline]
    pub fn note(&mut self, corners: [[i32; 3]; 3]) -> f64 {
        let [p, q, r] = corners.map(|corner| DVec3::from(corner.map(f64::from)));
        let (a, b, c) = (q - p, r - q, p - r);
        let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
        // The smallest angle lies between the two longer sides.
        let shortest = aa.min(bb).min(cc);
        let sine_squared = a.cross(b).length_squared() * shortest / (aa * bb * cc);
        self.least_sine_squared = self.least_sine_squared.min(sine_squared);
        // It is at most 60 degrees.
        let sine = sine_squared.sqrt();
        let series = 1.570_728_8 + sine * (-0.212_114_4 + sine * (0.074_261 - 0.018_729_3 * sine));
        (std::f64::consts::FRAC_PI_2 - (1.0 - sine).sqrt() * series).to_degrees()
    }

    /// The smallest angle of all, degrees; 180 without triangles.
    pub fn least_deg(&self) -> f64 {
        if self.least_sine_squared > 1.0 {
            return 180.0;
        }
        self.least_sine_squared.sqrt().asin().to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_angle_is_told_and_added_up() {
        let mut angles = Angles::default();
        assert!((angles.least_deg() - 180.0).abs() < 1e-12);
        assert!((angles.note([[0, 0, 0], [5, 0, 0], [0, 5, 0]]) - 45.0).abs() < 0.01);
        assert!((angles.least_deg() - 45.0).abs() < 1e-9);
        let thin = angles.note([[0, 0, 0], [1_000_000, 0, 0], [500_000, 0, 10]]);
        let expected = (10.0_f64 / 500_000.0).atan().to_degrees();
        assert!((thin - expected).abs() < 0.01 && (angles.least_deg() - expected).abs() < 1e-9);
    }
}
