//! Triangles that are cut in halves across their longest edge, and what surrounds them.
//!
//! Units:   any, the same for all.
//! Source:  Rivara 1984, Algorithms for refining triangular grids (bisection of the longest edge:
//!          no angle gets smaller than half of the smallest one).

use glam::DVec3;

/// Which edge of a triangle is its longest, by the corner that it begins at, and the square of its
/// length; of equals the first.
#[must_use]
#[inline]
pub fn longest_edge(corners: &[DVec3; 3]) -> (usize, f64) {
    let square = |i: usize| corners[i].distance_squared(corners[(i + 1) % 3]);
    let mut longest = (0, square(0));
    for i in [1, 2] {
        let found = square(i);
        if found > longest.1 {
            longest = (i, found);
        }
    }
    longest
}

/// Both halves of a triangle, cut from the middle of its longest edge to the corner across. Corners
/// that stay keep their places, so [`rejoin`] has the triangle back.
#[must_use]
pub fn halve(corners: &[DVec3; 3]) -> [[DVec3; 3]; 2] {
    let (from, _) = longest_edge(corners);
    let to = (from + 1) % 3;
    let middle = corners[from].midpoint(corners[to]);
    let mut halves = [*corners; 2];
    halves[0][to] = middle;
    halves[1][from] = middle;
    halves
}

/// The triangle that [`halve`] cut into these two; `None` if it did not.
#[must_use]
pub fn rejoin([first, second]: &[[DVec3; 3]; 2]) -> Option<[DVec3; 3]> {
    (0..3).find_map(|from| {
        let (to, across) = ((from + 1) % 3, (from + 2) % 3);
        let meet = first[to] == second[from] && first[across] == second[across];
        meet.then(|| {
            let mut whole = *first;
            whole[to] = second[to];
            whole
        })
    })
}

/// Centre and radius of the smallest ball around a triangle, but for rounding; no corner is outside.
#[must_use]
#[inline]
pub fn ball_around(corners: &[DVec3; 3]) -> (DVec3, f64) {
    let (from, _) = longest_edge(corners);
    let [a, b, c] = [0, 1, 2].map(|i| corners[(from + i) % 3]);
    let (ca, cb) = (a - c, b - c);
    // The corner across from the longest edge has the largest angle.
    let centre = if ca.dot(cb) <= 0.0 { a.midpoint(b) } else { circumcentre(c, ca, cb) };
    let square = corners.iter().map(|corner| centre.distance_squared(*corner)).fold(0.0, f64::max);
    (centre, square.sqrt())
}

/// The point as far from `c` as from `c + a` and `c + b`, in their plane.
fn circumcentre(c: DVec3, a: DVec3, b: DVec3) -> DVec3 {
    let normal = a.cross(b);
    let away = (b * a.length_squared() - a * b.length_squared()).cross(normal);
    let centre = c + away / (2.0 * normal.length_squared());
    if centre.is_finite() { centre } else { c }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn corners() -> impl Strategy<Value = [DVec3; 3]> {
        let point = || proptest::array::uniform3(-1.0..1.0).prop_map(DVec3::from);
        proptest::array::uniform3(point())
    }

    proptest! {
        #[test]
        fn halves_make_the_whole_again_corner_by_corner(corners in corners()) {
            let halves = halve(&corners);
            prop_assert_eq!(rejoin(&halves), Some(corners));
            let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
            prop_assert!((area(halves[0]) - area(corners) / 2.0).abs() < 1e-9);
            prop_assert!((area(halves[1]) - area(corners) / 2.0).abs() < 1e-9);
            let [first, second] = halves;
            prop_assert_eq!(rejoin(&[second, first]), None);
        }

        #[test]
        fn the_ball_holds_all_corners_and_none_is_much_smaller(corners in corners()) {
            let (centre, radius) = ball_around(&corners);
            for corner in corners {
                prop_assert!(centre.distance(corner) <= radius * (1.0 + 1e-12));
            }
            let (_, longest_squared) = longest_edge(&corners);
            let longest = longest_squared.sqrt();
            prop_assert!(radius >= longest / 2.0 - 1e-9);
            prop_assert!(radius <= longest / 3.0_f64.sqrt() + 1e-9);
        }
    }

    #[test]
    fn a_needle_has_a_ball_too() {
        let needle = [DVec3::ZERO, DVec3::X, DVec3::X * 0.5];
        assert_eq!(ball_around(&needle), (DVec3::X * 0.5, 0.5));
        assert_eq!(ball_around(&[DVec3::ONE; 3]), (DVec3::ONE, 0.0));
    }
}
