//! The point of a triangle that is closest to a given one.
//!
//! Units:   any, the same for all.
//! Source:  Ericson 2005, Real-time collision detection, section 5.1.5.

use glam::DVec3;

/// The point of the triangle `a`, `b`, `c` closest to `p`.
#[must_use]
#[inline]
pub fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * share(d1, d1 - d3);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * share(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * share(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let sum = va + vb + vc;
    a + ab * share(vb, sum) + ac * share(vc, sum)
}

/// A quotient, or nothing where a triangle without area has none.
#[inline]
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        proptest::array::uniform3(-1.0..1.0).prop_map(DVec3::from)
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_closer(
            p in point(), corners in proptest::array::uniform3(point()),
            u in 0.0..1.0, v in 0.0..1.0,
        ) {
            let (u, v): (f64, f64) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = corners;
            let other = a + (b - a) * u + (c - a) * v;
            let closest = closest_on_triangle(p, corners);
            prop_assert!(p.distance(closest) <= p.distance(other) + 1e-9);
        }

        #[test]
        fn a_point_of_the_triangle_is_its_own(corners in proptest::array::uniform3(point()), u in 0.0..0.5, v in 0.0..0.5) {
            let [a, b, c] = corners;
            let p: DVec3 = a + (b - a) * u + (c - a) * v;
            prop_assert!(p.distance(closest_on_triangle(p, corners)) < 1e-9);
        }
    }
}
