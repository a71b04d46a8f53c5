//! Eigenvalues and eigenvectors of a symmetric 3x3 matrix, and its truncated inverse.
//!
//! In:         [`Symmetric`], finite.
//! Out:        [`Spectrum`]: orthonormal vectors with their values, largest first.
//! Invariant:  only + - * / and square roots, in a fixed order: the same bits everywhere.
//! Fails:      never; a matrix of zeros has rank 0.
//! Source:     Jacobi 1846, cyclic order; rotation formulas after Rutishauser 1966.

use glam::DVec3;

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric = [f64; 6];

/// Convergence is quadratic: from 1e-7 of the trace one more sweep would reach the last bit.
const OFF_DIAGONAL: f64 = 1e-10;

/// Enough for 3x3; 4 are usual.
const SWEEPS_MAX: u32 = 5;

/// The product of a symmetric matrix and a vector.
pub(crate) fn apply(a: &Symmetric, v: DVec3) -> DVec3 {
    DVec3::new(
        a[0] * v.x + a[1] * v.y + a[2] * v.z,
        a[1] * v.x + a[3] * v.y + a[4] * v.z,
        a[2] * v.x + a[4] * v.y + a[5] * v.z,
    )
}

/// The sum of the eigenvalues.
pub(crate) fn trace(a: &Symmetric) -> f64 {
    a[0] + a[3] + a[5]
}

/// Eigenvalues, largest first, with their unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spectrum {
    pub(crate) values: [f64; 3],
    pub(crate) vectors: [DVec3; 3],
}

impl Spectrum {
    /// Decomposes `a` by cyclic rotations.
    pub(crate) fn of(a: &Symmetric) -> Self {
        let mut m = [[a[0], a[1], a[2]], [a[1], a[3], a[4]], [a[2], a[4], a[5]]];
        let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let limit = OFF_DIAGONAL * trace(a);
        for _ in 0..SWEEPS_MAX {
            if m[0][1].abs() + m[0][2].abs() + m[1][2].abs() <= limit {
                break;
            }
            rotate::<0, 1, 2>(&mut m, &mut v);
            rotate::<0, 2, 1>(&mut m, &mut v);
            rotate::<1, 2, 0>(&mut m, &mut v);
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| m[j][j].total_cmp(&m[i][i]));
        Self {
            values: order.map(|i| m[i][i]),
            vectors: order.map(|i| DVec3::new(v[0][i], v[1][i], v[2][i])),
        }
    }

    /// How many eigenvalues are above `cutoff` times the largest.
    pub(crate) fn rank(&self, cutoff: f64) -> u8 {
        let limit = cutoff * self.values[0];
        self.values.iter().filter(|&&value| value > limit && value > 0.0).count() as u8
    }

    /// The inverse on the first `rank` eigenvectors, zero on the others, applied to `v`.
    pub(crate) fn solve(&self, rank: u8, v: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for i in 0..usize::from(rank) {
            sum += self.vectors[i] * (self.vectors[i].dot(v) / self.values[i]);
        }
        sum
    }

    /// The matrix with only its first `rank` eigenvalues.
    pub(crate) fn truncated(&self, rank: u8) -> Symmetric {
        let mut sum = [0.0; 6];
        for i in 0..usize::from(rank) {
            let (n, w) = (self.vectors[i], self.values[i]);
            let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
            for (sum, product) in sum.iter_mut().zip(products) {
                *sum += w * product;
            }
        }
        sum
    }
}

/// Zeroes the element `P`, `Q`; `R` is the third index.
fn rotate<const P: usize, const Q: usize, const R: usize>(
    m: &mut [[f64; 3]; 3],
    v: &mut [[f64; 3]; 3],
) {
    let off = m[P][Q];
    if off == 0.0 {
        return;
    }
    // The smaller root of t² + 2θt - 1, without the quotient θ, which can overflow.
    let half = 0.5 * (m[Q][Q] - m[P][P]);
    let root = (half * half + off * off).sqrt();
    let t = if half >= 0.0 { off / (half + root) } else { off / (half - root) };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    m[P][P] -= t * off;
    m[Q][Q] += t * off;
    m[P][Q] = 0.0;
    m[Q][P] = 0.0;
    let (p, q) = (m[P][R], m[Q][R]);
    m[P][R] = c * p - s * q;
    m[R][P] = m[P][R];
    m[Q][R] = s * p + c * q;
    m[R][Q] = m[Q][R];
    for row in v {
        let (p, q) = (row[P], row[Q]);
        row[P] = c * p - s * q;
        row[Q] = s * p + c * q;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, SymmetricEigen};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eigenvalues_and_products_agree_with_nalgebra(
            n in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..6),
        ) {
            let mut a = [0.0; 6];
            for [x, y, z] in n {
                for (sum, p) in a.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                    *sum += p;
                }
            }
            let spectrum = Spectrum::of(&a);
            let m = Matrix3::new(a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5]);
            let mut oracle = SymmetricEigen::new(m).eigenvalues.as_slice().to_vec();
            oracle.sort_by(|x, y| y.total_cmp(x));
            let scale = trace(&a);
            for (value, expected) in spectrum.values.iter().zip(&oracle) {
                prop_assert!((value - expected).abs() < 1e-12 * scale);
            }
            for (x, y) in spectrum.truncated(3).iter().zip(&a) {
                prop_assert!((x - y).abs() < 1e-9 * scale);
            }
            for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)] {
                let dot = spectrum.vectors[i].dot(spectrum.vectors[j]);
                prop_assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn zero_and_diagonal_matrices_need_no_rotation() {
        assert_eq!(Spectrum::of(&[0.0; 6]).rank(0.01), 0);
        let spectrum = Spectrum::of(&[1.0, 0.0, 0.0, 3.0, 0.0, 2.0]);
        assert_eq!(spectrum.values, [3.0, 2.0, 1.0]);
        assert_eq!(spectrum.vectors, [DVec3::Y, DVec3::Z, DVec3::X]);
        assert_eq!((spectrum.rank(0.5), spectrum.rank(0.7)), (2, 1));
    }
}
