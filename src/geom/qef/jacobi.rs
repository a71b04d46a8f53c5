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
        let [spectrum] = Self::of_all(&[*a]);
        spectrum
    }

    /// Decomposes all, each as if it were alone: a rotation is a chain of two roots and two
    /// quotients, and several chains side by side take hardly longer than one.
    pub(crate) fn of_all<const N: usize>(all: &[Symmetric; N]) -> [Self; N] {
        let lanes = |i: usize| std::array::from_fn(|lane| all[lane][i]);
        let [xx, xy, xz, yy, yz, zz] = [0, 1, 2, 3, 4, 5].map(lanes);
        let mut m = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let (zero, one) = ([0.0; N], [1.0; N]);
        let mut v = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        let limit: [f64; N] = std::array::from_fn(|lane| OFF_DIAGONAL * trace(&all[lane]));
        for _ in 0..SWEEPS_MAX {
            let done = std::array::from_fn(|lane| {
                let [xy, xz, yz] = [m[0][1][lane], m[0][2][lane], m[1][2][lane]];
                xy.abs() + xz.abs() + yz.abs() <= limit[lane]
            });
            if done == [true; N] {
                break;
            }
            rotate::<0, 1, 2, N>(&mut m, &mut v, &done);
            rotate::<0, 2, 1, N>(&mut m, &mut v, &done);
            rotate::<1, 2, 0, N>(&mut m, &mut v, &done);
        }
        std::array::from_fn(|lane| {
            let mut order = [0, 1, 2];
            order.sort_by(|&i, &j| m[j][j][lane].total_cmp(&m[i][i][lane]));
            Self {
                values: order.map(|i| m[i][i][lane]),
                vectors: order.map(|i| DVec3::new(v[0][i][lane], v[1][i][lane], v[2][i][lane])),
            }
        })
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

/// One number of each matrix.
type Lanes<const N: usize> = [f64; N];

/// Zeroes the element `P`, `Q` of the matrices that are not done; `R` is the third index.
#[inline]
fn rotate<const P: usize, const Q: usize, const R: usize, const N: usize>(
    m: &mut [[Lanes<N>; 3]; 3],
    v: &mut [[Lanes<N>; 3]; 3],
    done: &[bool; N],
) {
    let (mut c, mut s) = ([1.0; N], [0.0; N]);
    for lane in 0..N {
        let off = m[P][Q][lane];
        // The smaller root of t² + 2θt - 1, without the quotient θ, which can overflow.
        let half = 0.5 * (m[Q][Q][lane] - m[P][P][lane]);
        let root = (half * half + off * off).sqrt();
        let t = off / if half >= 0.0 { half + root } else { half - root };
        // A matrix that is done, or has its zero already, turns by nothing.
        let t = if done[lane] || off == 0.0 { 0.0 } else { t };
        c[lane] = 1.0 / (t * t + 1.0).sqrt();
        s[lane] = t * c[lane];
        m[P][P][lane] -= t * off;
        m[Q][Q][lane] += t * off;
        m[P][Q][lane] = if done[lane] { off } else { 0.0 };
    }
    m[Q][P] = m[P][Q];
    turn(&c, &s, m[P][R], m[Q][R], |p, q| (m[P][R], m[Q][R]) = (p, q));
    (m[R][P], m[R][Q]) = (m[P][R], m[Q][R]);
    for row in v {
        turn(&c, &s, row[P], row[Q], |p, q| (row[P], row[Q]) = (p, q));
    }
}

#[inline]
fn turn<const N: usize>(
    c: &Lanes<N>,
    s: &Lanes<N>,
    mut p: Lanes<N>,
    mut q: Lanes<N>,
    put: impl FnOnce(Lanes<N>, Lanes<N>),
) {
    for lane in 0..N {
        (p[lane], q[lane]) =
            (c[lane] * p[lane] - s[lane] * q[lane], s[lane] * p[lane] + c[lane] * q[lane]);
    }
    put(p, q);
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
    fn matrices_side_by_side_are_as_if_alone() {
        let all = [
            [1.0, 0.25, -0.5, 3.0, 0.125, 2.0],
            [0.0; 6],
            [1.0, 0.0, 0.0, 3.0, 0.0, 2.0],
            [1.0, 1e-3, 1e-5, 1e-6, 1e-8, 1e-9],
        ];
        for (alone, together) in all.iter().map(Spectrum::of).zip(Spectrum::of_all(&all)) {
            assert_eq!((alone.values, alone.vectors), (together.values, together.vectors));
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
