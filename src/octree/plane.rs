//! Planes of source triangles, and where they cross the edges of the grid.
//!
//! Units: lattice units from the brick's min corner; offsets on an edge are shares of it, 0..1.

use glam::DVec3;

use crate::octree::SourcePlane;

/// An edge offset keeps at least this many lattice units from both ends.
const END_GAP_UNITS: f64 = 4.0;

impl SourcePlane {
    /// The plane through `corners`, in lattice units from the brick's min corner, as seen from
    /// `centre`, the middle of the brick. The normal is zero when the corners span no plane.
    #[must_use]
    pub fn through(corners: [DVec3; 3], centre: DVec3) -> Self {
        let [p, q, r] = corners;
        let cross = (q - p).cross(r - p);
        let length = cross.length();
        let plane = Self::default();
        if !(length.is_finite() && length > 0.0) {
            return plane;
        }
        for axis in 0..3 {
            let alone = (0..3).all(|other| other == axis || cross[other] == 0.0);
            if alone {
                // Axis-parallel: exact, whatever the distance.
                let mut normal = [0.0; 3];
                normal[axis] = 1.0_f32.copysign(cross[axis] as f32);
                return Self { offset: p[axis].copysign_by(cross[axis]), normal, ..plane };
            }
        }
        let normal = cross / length;
        // Single precision turns the plane a little: it turns about its point nearest the brick.
        let nearest = centre - normal * normal.dot(centre - p);
        let normal = normal.as_vec3();
        Self { offset: normal.as_dvec3().dot(nearest), normal: normal.to_array(), ..plane }
    }

    /// The unit normal, zero when there is none.
    #[must_use]
    #[inline]
    pub fn unit_normal(&self) -> DVec3 {
        DVec3::from(self.normal.map(f64::from))
    }

    /// Where the plane crosses the edge along `axis` from brick corner `at`: the share of the
    /// edge, clamped inside of it. The middle where the plane gives no answer.
    #[must_use]
    #[inline]
    pub fn offset_on_edge(&self, axis: usize, at: [usize; 3], cell_units: f64) -> f64 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let normal = self.normal.map(f64::from);
        let side = normal[u] * (at[u] as f64) + normal[v] * (at[v] as f64);
        let along = (self.offset - side * cell_units) / normal[axis];
        let units = along - at[axis] as f64 * cell_units;
        clamp_to_edge(units, cell_units)
    }
}

/// A place on an edge, in units from its lower end, as a share kept clear of both ends.
#[must_use]
#[inline]
pub fn clamp_to_edge(units: f64, cell_units: f64) -> f64 {
    if units.is_nan() {
        return 0.5;
    }
    units.clamp(END_GAP_UNITS, cell_units - END_GAP_UNITS) / cell_units
}

trait CopysignBy {
    fn copysign_by(self, sign: f64) -> f64;
}

impl CopysignBy for f64 {
    /// The value, negated when `sign` is negative.
    fn copysign_by(self, sign: f64) -> f64 {
        if sign < 0.0 { -self } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_parallel_planes_are_exact_and_slanted_ones_close() {
        let cell = 192.0;
        let x = 1000.0 + 1.0 / 3.0;
        let corners = [DVec3::new(x, 0., 0.), DVec3::new(x, 5e6, 0.), DVec3::new(x, 0., 5e6)];
        let plane = SourcePlane::through(corners, DVec3::splat(16.0 * cell));
        assert_eq!((plane.normal, plane.offset), ([1.0, 0.0, 0.0], x));
        let offset = plane.offset_on_edge(0, [5, 3, 3], cell);
        assert!((offset - (x / cell - 5.0)).abs() < 1e-12);

        let far = 1e5;
        let corners =
            [DVec3::new(-far, -far, 0.), DVec3::new(far, -far, 0.), DVec3::new(0., far, 2. * far)];
        let plane = SourcePlane::through(corners, DVec3::splat(16.0 * cell));
        // z = y + far on this plane, so it passes high above the brick.
        let offset = plane.offset_on_edge(1, [3, 4, 31], cell);
        assert!((0.0..=1.0).contains(&offset));
    }
}
