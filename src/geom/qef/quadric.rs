//! The accumulated quadric: squared distances to planes, and the mass point of the hits.
//!
//! In:         planes (point and unit normal) and bare points.
//! Out:        [`Qef`], additive, so that clusters are sums of leaves.
//! Invariant:  everything is relative to one origin near the data (the centre of the cell);
//!             [`Qef::shifted`] moves the origin before two quadrics are added. Sums over world
//!             coordinates would be differences of large numbers.
//! Units:      cells.
//! Memory:     112 bytes, whatever was added.
//! Fails:      never.
//! Source:     Garland, Heckbert 1997 (quadrics); Ju et al. 2002 (mass point).

use crate::geom::qef::jacobi::{Symmetric, apply};
use glam::DVec3;

/// Sum of the squared distances to planes: xᵀ A x - 2 bᵀ x + c, and the sum of the hits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Qef {
    pub(crate) ata: Symmetric,
    pub(crate) atb: [f64; 3],
    btb: f64,
    mass: [f64; 3],
    count: u32,
}

impl Qef {
    /// Adds the plane through `point`, and `point` to the mass.
    #[inline]
    pub fn add_plane(&mut self, point: DVec3, unit_normal: DVec3) {
        let n = unit_normal;
        let offset = n.dot(point);
        let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
        for (sum, product) in self.ata.iter_mut().zip(products) {
            *sum += product;
        }
        for (sum, part) in self.atb.iter_mut().zip(n.to_array()) {
            *sum += part * offset;
        }
        self.btb += offset * offset;
        self.add_point(point);
    }

    /// Adds a hit without a usable normal: it counts for the mass point only.
    #[inline]
    pub fn add_point(&mut self, point: DVec3) {
        for (sum, part) in self.mass.iter_mut().zip(point.to_array()) {
            *sum += part;
        }
        self.count += 1;
    }

    /// The same quadric about the origin that lies at `by` in the present coordinates.
    #[must_use]
    pub fn shifted(&self, by: DVec3) -> Self {
        let moved = apply(&self.ata, by);
        let atb = DVec3::from_array(self.atb);
        Self {
            ata: self.ata,
            atb: (atb - moved).to_array(),
            btb: self.btb - 2.0 * atb.dot(by) + by.dot(moved),
            mass: (DVec3::from_array(self.mass) - by * f64::from(self.count)).to_array(),
            count: self.count,
        }
    }

    /// Adds another quadric about the same origin.
    pub fn merge(&mut self, other: &Self) {
        for (sum, part) in self.ata.iter_mut().zip(other.ata) {
            *sum += part;
        }
        for (sum, part) in self.atb.iter_mut().zip(other.atb) {
            *sum += part;
        }
        for (sum, part) in self.mass.iter_mut().zip(other.mass) {
            *sum += part;
        }
        self.btb += other.btb;
        self.count += other.count;
    }

    /// The number of hits, with and without planes.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The mean of the hits; the origin when there are none.
    #[must_use]
    pub fn mass_point(&self) -> DVec3 {
        DVec3::from_array(self.mass) / f64::from(self.count.max(1))
    }

    /// The sum of the squared distances of `at` to the planes.
    #[must_use]
    pub fn error(&self, at: DVec3) -> f64 {
        let linear = at.dot(DVec3::from_array(self.atb));
        (at.dot(apply(&self.ata, at)) - 2.0 * linear + self.btb).max(0.0)
    }

    /// b - A m: the right-hand side about the mass point `m`.
    pub(crate) fn residual(&self, mass_point: DVec3) -> DVec3 {
        DVec3::from_array(self.atb) - apply(&self.ata, mass_point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seed: f64) -> (DVec3, DVec3) {
        let point = DVec3::new(seed * 0.31 % 1.0, seed * 0.47 % 1.0, seed * 0.73 % 1.0) - 0.5;
        (point, DVec3::new(seed % 1.3 - 0.6, seed % 0.7 - 0.4, 0.3).normalize())
    }

    #[test]
    fn shifted_sums_equal_sums_about_the_new_origin() {
        let by = DVec3::new(0.5, -1.25, 2.0);
        let (mut here, mut there) = (Qef::default(), Qef::default());
        for (point, normal) in (1..12).map(|i| sample(f64::from(i) * 1.7)) {
            here.add_plane(point, normal);
            there.add_plane(point - by, normal);
        }
        here.add_point(DVec3::splat(0.1));
        there.add_point(DVec3::splat(0.1) - by);
        let moved = here.shifted(by);
        assert!((moved.mass_point() - there.mass_point()).length() < 1e-12);
        for at in [DVec3::ZERO, DVec3::new(1.0, -2.0, 0.5)] {
            assert!((moved.error(at) - there.error(at)).abs() < 1e-12);
            assert!((moved.error(at) - here.error(at + by)).abs() < 1e-12);
        }
    }

    #[test]
    fn merging_two_halves_equals_adding_everything_to_one() {
        let (mut left, mut right, mut whole) = (Qef::default(), Qef::default(), Qef::default());
        for i in 1..9 {
            let (point, normal) = sample(f64::from(i));
            let half = if i < 4 { &mut left } else { &mut right };
            half.add_plane(point, normal);
            whole.add_plane(point, normal);
        }
        left.merge(&right);
        assert_eq!(left.count(), 8);
        assert!((left.mass_point() - whole.mass_point()).length() < 1e-15);
        assert!((left.error(DVec3::ONE) - whole.error(DVec3::ONE)).abs() < 1e-12);
    }
}
