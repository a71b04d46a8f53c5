//! Ways to meet against rational arithmetic on small whole numbers.

use proptest::prelude::*;

use crate::defect::Meeting;
use crate::geom::signs::{Point, Signs};
use crate::verify::intersect::exact_pair::meet;
use crate::verify::intersect::meeting::meeting;

type Whole = [i128; 3];

fn minus(a: Whole, b: Whole) -> Whole {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: Whole, b: Whole) -> Whole {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Whole, b: Whole) -> i128 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn normal(t: [Whole; 3]) -> Whole {
    cross(minus(t[1], t[0]), minus(t[2], t[0]))
}

/// Where a triangle that straddles a plane cuts the line along `line`: fractions, low and high.
fn interval(t: [Whole; 3], heights: [i128; 3], line: Whole) -> [(i128, i128); 2] {
    let mut cuts = Vec::new();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (h, k) = (heights[i], heights[j]);
        if h.signum() * k.signum() < 0 {
            let (p, q) = (dot(t[i], line), dot(t[j], line));
            let below = (h - k) * (h - k).signum();
            cuts.push(((p * (h - k) + (q - p) * h) * (h - k).signum(), below));
        }
    }
    (0..3).filter(|&i| heights[i] == 0).for_each(|i| cuts.push((dot(t[i], line), 1)));
    cuts.sort_by(|a, b| (a.0 * b.1).cmp(&(b.0 * a.1)));
    [cuts[0], cuts[cuts.len() - 1]]
}

/// Whether each has corners on both sides of the other's plane, and both cut a common segment from
/// the line of the planes.
fn crosses(a: [Whole; 3], b: [Whole; 3]) -> bool {
    let (m, n) = (normal(a), normal(b));
    let of_a = a.map(|p| dot(n, minus(p, b[0])));
    let of_b = b.map(|p| dot(m, minus(p, a[0])));
    let both = |h: [i128; 3]| h.iter().any(|&x| x > 0) && h.iter().any(|&x| x < 0);
    if !both(of_a) || !both(of_b) {
        return false;
    }
    let line = cross(m, n);
    let ([a_low, a_high], [b_low, b_high]) = (interval(a, of_a, line), interval(b, of_b, line));
    let less = |x: (i128, i128), y: (i128, i128)| x.0 * y.1 < y.0 * x.1;
    less(a_low, b_high) && less(b_low, a_high)
}

fn float(t: [Whole; 3]) -> [Point; 3] {
    t.map(|p| p.map(|x| x as f64 * 0.375))
}

fn corners() -> impl Strategy<Value = [[i128; 3]; 3]> {
    prop::array::uniform3(prop::array::uniform3(-3..4_i128))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]
    #[test]
    fn crossings_are_those_of_whole_numbers(a in corners(), b in corners()) {
        prop_assume!(normal(a) != [0; 3] && normal(b) != [0; 3]);
        let expected = crosses(a, b);
        let coplanar = b.iter().all(|&p| dot(normal(a), minus(p, a[0])) == 0);
        for tame in [true, false] {
            let signs = Signs { tame };
            let (p, q) = (float(a), float(b));
            let found = meeting(signs, p, q);
            prop_assert_eq!(found == Meeting::Crossing, expected && !coplanar);
            prop_assert_eq!(found, meeting(signs, q, p));
            prop_assert_eq!(found, meeting(signs, [p[2], p[1], p[0]], [q[1], q[2], q[0]]));
            prop_assert!(found == Meeting::Touching || meet(signs, p, q, 0));
        }
    }

    #[test]
    fn areas_in_a_plane_are_shared_if_clipping_leaves_one(
        flat_a in prop::array::uniform3(prop::array::uniform2(-3..4_i128)),
        flat_b in prop::array::uniform3(prop::array::uniform2(-3..4_i128)),
    ) {
        // In the plane z = x + 2 y.
        let lift = |t: [[i128; 2]; 3]| t.map(|[x, y]| [x, y, x + 2 * y]);
        let (a, b) = (lift(flat_a), lift(flat_b));
        prop_assume!(normal(a) != [0; 3] && normal(b) != [0; 3]);
        // Corners of the common part have small denominators: its area is not near zero, or zero.
        let found = meeting(Signs { tame: true }, float(a), float(b));
        let shares_area = clipped_area(flat_a, flat_b) > 1e-7;
        prop_assert_eq!(found == Meeting::Overlapping, shares_area);
    }
}

/// The area of the common part of two triangles, rounded.
fn clipped_area(a: [[i128; 2]; 3], b: [[i128; 2]; 3]) -> f64 {
    let real = |t: [[i128; 2]; 3]| t.map(|p| p.map(|x| x as f64));
    let turn = |u: [f64; 2], v: [f64; 2], p: [f64; 2]| {
        (v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])
    };
    let (a, mut b) = (real(a), real(b));
    if turn(b[0], b[1], b[2]) < 0.0 {
        b.swap(1, 2);
    }
    let mut polygon = a.to_vec();
    for i in 0..3 {
        let (u, v) = (b[i], b[(i + 1) % 3]);
        let mut kept = Vec::new();
        for at in 0..polygon.len() {
            let (p, q) = (polygon[at], polygon[(at + 1) % polygon.len()]);
            let (h, k) = (turn(u, v, p), turn(u, v, q));
            if h >= 0.0 {
                kept.push(p);
            }
            if h * k < 0.0 {
                let t = h / (h - k);
                kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        polygon = kept;
    }
    let mut twice = 0.0;
    for at in 1..polygon.len().max(2) - 1 {
        twice += turn(polygon[0], polygon[at], polygon[at + 1]);
    }
    twice.abs() / 2.0
}
