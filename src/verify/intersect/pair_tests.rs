//! Pairs of triangles against an independent clipper in whole numbers.

use proptest::prelude::*;

use crate::geom::signs::{Point, is_tame};
use crate::verify::intersect::filters::Normal;
use crate::verify::intersect::pair::{Face, Sharing, intersect};

/// A point over a common denominator, which is positive and comes last.
type Ratio = [i128; 4];
type Whole = [i64; 3];

fn reduced(p: Ratio) -> Ratio {
    let gcd = p.iter().fold(0_i128, |a, &b| {
        let (mut a, mut b) = (a.abs(), b.abs());
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    });
    p.map(|x| x / gcd * p[3].signum())
}

/// The part of a convex polygon where `plane`, a normal and a constant, is not negative.
fn clipped(polygon: &[Ratio], plane: [i128; 4]) -> Vec<Ratio> {
    let height = |p: &Ratio| (0..4).map(|i| plane[i] * p[i]).sum::<i128>();
    let mut kept = Vec::new();
    for (at, p) in polygon.iter().enumerate() {
        let q = &polygon[(at + 1) % polygon.len()];
        let (from, to) = (height(p), height(q));
        if from >= 0 {
            kept.push(*p);
        }
        if from.signum() * to.signum() < 0 {
            kept.push(reduced(std::array::from_fn(|i| p[i] * to - q[i] * from)));
        }
    }
    kept
}

fn minus(p: Whole, q: Whole) -> Whole {
    std::array::from_fn(|i| p[i] - q[i])
}

fn cross(u: Whole, v: Whole) -> Whole {
    std::array::from_fn(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3])
}

fn dot(u: Whole, v: Whole) -> i64 {
    (0..3).map(|i| u[i] * v[i]).sum()
}

fn is_flat([a, b, c]: [Whole; 3]) -> bool {
    cross(minus(b, a), minus(c, a)) == [0; 3]
}

/// The corners of the intersection of two triangles.
fn common_polygon(a: [Whole; 3], b: [Whole; 3]) -> Vec<Ratio> {
    let normal = cross(minus(b[1], b[0]), minus(b[2], b[0]));
    let plane = |normal: Whole, through: Whole| {
        let [x, y, z] = normal.map(i128::from);
        [x, y, z, -i128::from(dot(normal, through))]
    };
    let own = plane(normal, b[0]);
    let mut planes = vec![own, own.map(|x| -x)];
    for [s, t] in [[0, 1], [1, 2], [2, 0]] {
        planes.push(plane(cross(normal, minus(b[t], b[s])), b[s]));
    }
    let mut polygon: Vec<Ratio> =
        a.map(|[x, y, z]| [i128::from(x), i128::from(y), i128::from(z), 1]).to_vec();
    for plane in planes {
        polygon = clipped(&polygon, plane);
    }
    polygon
}

/// Whether all of the intersection of two triangles is shared; shared corners have equal names.
fn brute_force(a: [Whole; 3], b: [Whole; 3], names: [[u32; 3]; 2]) -> bool {
    let shared: Vec<Whole> =
        (0..3).filter(|&i| names[1].contains(&names[0][i])).map(|i| a[i]).collect();
    let polygon = common_polygon(a, b);
    let at = |p: &Ratio, q: Whole| (0..3).all(|i| p[i] == i128::from(q[i]) * p[3]);
    match shared[..] {
        [] => !polygon.is_empty(),
        [v] => polygon.iter().any(|p| !at(p, v)),
        [u, v] => polygon.iter().any(|p| {
            // On the line of the edge its length tells whether it is between the ends.
            let from =
                |q: Whole| -> [i128; 3] { std::array::from_fn(|i| p[i] - i128::from(q[i]) * p[3]) };
            let (s, t) = (from(u), from(v));
            let turned =
                (0..3).any(|i| s[(i + 1) % 3] * t[(i + 2) % 3] != s[(i + 2) % 3] * t[(i + 1) % 3]);
            turned || (0..3).map(|i| s[i] * t[i]).sum::<i128>() > 0
        }),
        _ => true,
    }
}

fn by_filters_and_signs(points: &[Point], a: [u32; 3], b: [u32; 3]) -> bool {
    let face = |vertices: [u32; 3]| {
        let corners = vertices.map(|v| points[v as usize]);
        Face::of(vertices, &Normal::of(corners), corners.iter().all(is_tame))
    };
    let (a, b) = (face(a), face(b));
    intersect(Sharing::of(&a, &b), &a, &b, points)
}

/// Some corners of two triangles: `shared` of them are the same.
fn two_triangles(most: i64) -> impl Strategy<Value = (Vec<Whole>, usize)> {
    (prop::collection::vec(prop::array::uniform3(0..=most), 6), 0..4_usize)
}

fn check_pair(
    points: &[Whole],
    shared: usize,
    scale: f64,
    turn: usize,
) -> Result<(), TestCaseError> {
    let a = [0, 1, 2];
    let b: [u32; 3] = std::array::from_fn(|i| if i < shared { i as u32 } else { i as u32 + 3 });
    // Any order of corners.
    let b: [u32; 3] = std::array::from_fn(|i| b[(i + turn) % 3]);
    let corners = [a, b].map(|t| t.map(|v| points[v as usize]));
    if corners.into_iter().any(is_flat) {
        return Ok(());
    }
    let expected = brute_force(corners[0], corners[1], [a, b]);
    let places: Vec<Point> = points.iter().map(|p| p.map(|x| x as f64 * scale)).collect();
    prop_assert_eq!(by_filters_and_signs(&places, a, b), expected);
    prop_assert_eq!(by_filters_and_signs(&places, b, a), expected);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn pairs_are_judged_like_by_clipping(
        (points, shared) in two_triangles(4), turn in 0..3_usize, wide in any::<bool>(),
    ) {
        // The second scale is beyond what adaptive arithmetic can do.
        check_pair(&points, shared, if wide { f64::MIN_POSITIVE } else { 0.375 }, turn)?;
    }

    #[test]
    fn pairs_in_a_plane_are_judged_like_by_clipping(
        (points, shared) in two_triangles(3), turn in 0..3_usize, slope in 0..3_i64,
    ) {
        let points: Vec<Whole> =
            points.iter().map(|&[x, y, _]| [x, y, slope * x - y + 3]).collect();
        check_pair(&points, shared, 1.0, turn)?;
    }

    #[test]
    fn flat_pairs_along_an_axis_are_judged_like_by_clipping(
        (points, shared) in two_triangles(3), turn in 0..3_usize, axis in 0..3_usize,
    ) {
        let flat = |p: &Whole| std::array::from_fn(|i| if i == axis { 2 } else { p[i] });
        check_pair(&points.iter().map(flat).collect::<Vec<_>>(), shared, 1.0, turn)?;
    }
}
