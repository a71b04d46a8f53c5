//! How near two triangles come to each other.
//!
//! Units:   any, the same for all.
//! Source:  Ericson 2005, Real-time collision detection, sections 5.1.9 (segments) and 5.1.10 (triangles:
//!          what is nearest lies on two edges, or on a corner of one of them, unless they meet).

use glam::DVec3;

use crate::geom::closest_on_triangle;

/// Whether two triangles have points no farther apart than `limit`, but for rounding.
#[must_use]
pub fn are_within(limit: f64, one: &[DVec3; 3], other: &[DVec3; 3]) -> bool {
    let limit_squared = limit * limit;
    let by_corner = |from: &[DVec3; 3], to: &[DVec3; 3]| {
        let near = |corner: &DVec3| {
            corner.distance_squared(closest_on_triangle(*corner, *to)) <= limit_squared
        };
        from.iter().any(near)
    };
    if by_corner(one, other) || by_corner(other, one) {
        return true;
    }
    let edges = |corners: &[DVec3; 3]| [0, 1, 2].map(|i| [corners[i], corners[(i + 1) % 3]]);
    let (of_one, of_other) = (edges(one), edges(other));
    let near = |edge: &[DVec3; 2]| {
        of_other.iter().any(|other| segments_squared(edge, other) <= limit_squared)
    };
    of_one.iter().any(|edge| near(edge) || pierces(edge, other))
        || of_other.iter().any(|edge| pierces(edge, one))
}

/// The square of the distance between two segments.
fn segments_squared([a, b]: &[DVec3; 2], [c, d]: &[DVec3; 2]) -> f64 {
    let (along, across, from) = (*b - *a, *d - *c, *a - *c);
    let (long, other_long) = (along.length_squared(), across.length_squared());
    let (e, f, both) = (along.dot(from), across.dot(from), along.dot(across));
    let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
    let parallel = long * other_long - both * both;
    let s = share(both * f - e * other_long, parallel).clamp(0.0, 1.0);
    let t = share(both * s + f, other_long).clamp(0.0, 1.0);
    // What is nearest to a point of one segment on the other may have been beyond its end.
    let s = share(both * t - e, long).clamp(0.0, 1.0);
    (from + along * s - across * t).length_squared()
}

/// Whether a segment goes through a triangle, away from its edges.
fn pierces([from, to]: &[DVec3; 2], [a, b, c]: &[DVec3; 3]) -> bool {
    let normal = (*b - *a).cross(*c - *a);
    let (before, after) = (normal.dot(*from - *a), normal.dot(*to - *a));
    if before * after >= 0.0 {
        return false;
    }
    let at = *from + (*to - *from) * (before / (before - after));
    [[a, b], [b, c], [c, a]].iter().all(|&[p, q]| normal.dot((*q - *p).cross(at - *p)) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        proptest::array::uniform3(-1.0..1.0).prop_map(DVec3::from)
    }

    /// The least distance, by points of one triangle.
    fn by_points(one: &[DVec3; 3], other: &[DVec3; 3]) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..=60 {
            for j in 0..=60 - i {
                let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                let point = one[0] + (one[1] - one[0]) * u + (one[2] - one[0]) * v;
                least = least.min(point.distance(closest_on_triangle(point, *other)));
            }
        }
        least
    }

    proptest! {
        #[test]
        fn triangles_come_as_near_as_their_points(
            one in proptest::array::uniform3(point()), other in proptest::array::uniform3(point()),
            shift in -1.0..1.0, flat in any::<bool>(),
        ) {
            // Some lie in parallel planes.
            let place = |[x, y, z]: [f64; 3], height| {
                DVec3::new(x, y, if flat { height } else { z + height })
            };
            let one = one.map(|corner| place(corner.to_array(), 0.0));
            let other = other.map(|corner| place(corner.to_array(), shift));
            let least = by_points(&one, &other);
            // A point of the first is no farther than this from one that was looked at.
            let coarse = 3.0 / 60.0;
            prop_assert!(are_within(least + 1e-9, &one, &other));
            prop_assert_eq!(are_within(least + 1e-9, &other, &one), true);
            if least > coarse {
                prop_assert!(!are_within(least - coarse, &one, &other));
            }
        }
    }

    #[test]
    fn triangles_that_go_through_each_other_are_near_though_no_corner_or_edge_is() {
        let wide =
            [DVec3::new(-9.0, -9.0, 0.0), DVec3::new(9.0, -9.0, 0.0), DVec3::new(0.0, 9.0, 0.0)];
        let needle =
            [DVec3::new(0.0, -1.0, 5.0), DVec3::new(0.1, -1.0, -5.0), DVec3::new(0.0, -1.1, -5.0)];
        assert!(are_within(0.0, &wide, &needle) && are_within(0.0, &needle, &wide));
        let aside = needle.map(|corner| corner + DVec3::X * 20.0);
        assert!(!are_within(1.0, &wide, &aside));
    }

    #[test]
    fn what_has_no_area_or_no_length_has_a_distance_too() {
        let point = [DVec3::Z; 3];
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        assert!(are_within(1.0, &point, &line) && !are_within(0.99, &line, &point));
        assert!(are_within(1.0, &point, &[DVec3::ZERO; 3]));
    }
}
