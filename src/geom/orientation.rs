//! On which side of a plane a lattice point lies, exactly.
//!
//! In:         points of the lattice, no two of them farther apart than [`REACH`] along an axis.
//! Out:        a sign: 1 above, 0 on, -1 below.
//! Invariant:  the sign is that of the real determinant. So an odd exchange of points negates it.
//! Units:      lattice units.
//! Fails:      never.
//! Source:     the determinant as a triple product: two differences of `REACH` give a normal in i64
//!             (2 · 2^60), a third a sum in i128 (6 · 2^90). That takes fewer operations than an
//!             f64 determinant with its error bound, so there is no such filter before it.

/// Farthest that two points may be apart along an axis.
pub const REACH: i64 = 1 << 30;

/// The plane of three points, with its upper side.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    origin: [i64; 3],
    normal: [i64; 3],
}

impl Plane {
    /// The plane through three points; seen from above they turn left.
    #[inline]
    #[must_use]
    pub fn through(p: [i64; 3], q: [i64; 3], r: [i64; 3]) -> Self {
        let (u, v) = (difference(q, p), difference(r, p));
        let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        Self { origin: p, normal: [minor(1, 2), minor(2, 0), minor(0, 1)] }
    }

    /// 1 for a point above, 0 on the plane, -1 below; 0 for every point when [`Self::is_none`].
    #[inline]
    #[must_use]
    pub fn side(&self, s: [i64; 3]) -> i32 {
        let w = difference(s, self.origin);
        let product = |axis: usize| i128::from(self.normal[axis]) * i128::from(w[axis]);
        let determinant = product(0) + product(1) + product(2);
        i32::from(determinant > 0) - i32::from(determinant < 0)
    }

    /// The normal, as long as twice the area of the three points' triangle.
    #[inline]
    #[must_use]
    pub fn normal(&self) -> [i64; 3] {
        self.normal
    }

    /// Whether the three points lie on a line, so that there is no plane.
    #[inline]
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.normal == [0; 3]
    }
}

/// The sign of det(q - p, r - p, s - p): 1 when `s` lies above the plane of `p`, `q` and `r`, which
/// turn left when seen from above; 0 when all four lie in a plane.
///
/// ```
/// # use brickmend::geom::orientation::orientation;
/// let [p, q, r] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
/// assert_eq!(orientation(p, q, r, [5, 5, 1]), 1);
/// assert_eq!(orientation(p, q, r, [5, 5, 0]), 0);
/// ```
#[inline]
#[must_use]
pub fn orientation(p: [i64; 3], q: [i64; 3], r: [i64; 3], s: [i64; 3]) -> i32 {
    Plane::through(p, q, r).side(s)
}

/// Whether three points lie on a line, or two of them in one place.
#[inline]
#[must_use]
pub fn is_degenerate(p: [i64; 3], q: [i64; 3], r: [i64; 3]) -> bool {
    Plane::through(p, q, r).is_none()
}

#[inline]
fn difference(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    debug_assert!(d.iter().all(|x| x.abs() <= REACH), "farther apart than REACH: {a:?} {b:?}");
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Half of [`REACH`]: points this far from the origin are never too far apart.
    const FAR: i64 = REACH / 2;

    /// The 4 x 4 determinant of the points with ones beside them, by its 24 permutations.
    fn leibniz(points: [[i64; 3]; 4]) -> i128 {
        let entry = |row: usize, column: usize| match column {
            3 => 1,
            axis => i128::from(points[row][axis]),
        };
        let mut sum = 0;
        for code in 0..256_usize {
            let columns = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6];
            let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            if pairs.iter().any(|&(i, j)| columns[i] == columns[j]) {
                continue;
            }
            let inversions = pairs.iter().filter(|&&(i, j)| columns[i] > columns[j]).count();
            let product: i128 = (0..4).map(|row| entry(row, columns[row])).product();
            sum += if inversions % 2 == 0 { product } else { -product };
        }
        // The ones stand last, not first: one row of differences less changes the sign.
        -sum
    }

    fn point(reach: i64) -> impl Strategy<Value = [i64; 3]> {
        prop::array::uniform3(-reach..=reach)
    }

    #[test]
    fn corners_of_the_largest_box_do_not_overflow() {
        let place = |bits: usize| [0, 1, 2].map(|axis| FAR * ((bits >> axis & 1) as i64 * 2 - 1));
        for code in 0..4096_usize {
            let [p, q, r, s] = [0, 3, 6, 9].map(|shift| place(code >> shift & 7));
            let expected = leibniz([p, q, r, s]).signum();
            assert_eq!(i128::from(orientation(p, q, r, s)), expected, "{p:?} {q:?} {r:?} {s:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn the_sign_is_that_of_the_determinant(
            small in prop::array::uniform4(point(2)), large in prop::array::uniform4(point(FAR)),
        ) {
            for [p, q, r, s] in [small, large] {
                let expected = leibniz([p, q, r, s]).signum();
                prop_assert_eq!(i128::from(orientation(p, q, r, s)), expected);
                prop_assert_eq!(orientation(q, p, r, s), -orientation(p, q, r, s));
                prop_assert_eq!(orientation(p, q, s, r), -orientation(p, q, r, s));
            }
        }

        #[test]
        fn one_unit_off_a_far_plane_is_seen(
            p in point(FAR / 4), u in point(1 << 12), v in point(1 << 12),
            a in -(1_i64 << 13)..1 << 13, b in -(1_i64 << 13)..1 << 13, step in point(1),
        ) {
            let at = |a: i64, b: i64| [0, 1, 2].map(|i| p[i] + a * u[i] + b * v[i]);
            let (q, r, on) = (at(1, 0), at(0, 1), at(a, b));
            prop_assert_eq!(orientation(p, q, r, on), 0);
            let off = [0, 1, 2].map(|i| on[i] + step[i]);
            prop_assert_eq!(i128::from(orientation(p, q, r, off)), leibniz([p, q, r, off]).signum());
        }

        #[test]
        fn three_points_on_a_line_are_degenerate_and_one_unit_aside_they_are_not(
            p in point(FAR / 4), u in point(1 << 13), a in -(1_i64 << 13)..1 << 13, axis in 0..3_usize,
        ) {
            let q = [0, 1, 2].map(|i| p[i] + u[i]);
            let mut r = [0, 1, 2].map(|i| p[i] + a * u[i]);
            prop_assert!(is_degenerate(p, q, r));
            prop_assert!(is_degenerate(r, p, q));
            prop_assert!(is_degenerate(p, p, r));
            r[axis] += 1;
            let along_axis = (0..3).all(|i| i == axis || u[i] == 0);
            prop_assert_eq!(is_degenerate(p, q, r), along_axis);
        }
    }
}
