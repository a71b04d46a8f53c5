//! Triangles that meet, judged by two oracles that share nothing with the test under test.
//!
//! Small triangles are clipped: the first by the plane of the second and by its three sides, in
//! exact barycentric coordinates. What is left must lie in the shared vertex or edge. Large ones
//! are small ones under a linear map of large integers, and one unit off from that; there, an axis
//! is looked for on which the two are apart.

use std::cell::RefCell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::orientation::{REACH, is_degenerate, orientation};
use super::triangle_triangle::{Triangle, meets_improperly};

type Vector = [i128; 3];

fn wide(p: [i64; 3]) -> Vector {
    p.map(i128::from)
}

fn minus(p: Vector, q: Vector) -> Vector {
    [0, 1, 2].map(|i| p[i] - q[i])
}

fn dot(p: Vector, q: Vector) -> i128 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn cross(p: Vector, q: Vector) -> Vector {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn common_divisor(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.abs()
}

/// What is left of a convex polygon where a linear function is not negative. The polygon's corners
/// are barycentric and homogeneous, the function is given by its values at the three of the
/// triangle.
fn clip(polygon: &[Vector], values: Vector) -> Vec<Vector> {
    let mut left = Vec::new();
    for (at, &here) in polygon.iter().enumerate() {
        let next = polygon[(at + 1) % polygon.len()];
        let (value, next_value) = (dot(values, here), dot(values, next));
        if value >= 0 {
            left.push(here);
        }
        if value.signum() * next_value.signum() < 0 {
            let (weight, next_weight) = (next_value.abs(), value.abs());
            let crossing = [0, 1, 2].map(|i| here[i] * weight + next[i] * next_weight);
            let divisor = crossing.iter().fold(0, |divisor, &x| common_divisor(divisor, x));
            left.push(crossing.map(|x| x / divisor));
        }
    }
    left
}

/// The oracle for small triangles.
fn meets_by_clipping(a: &Triangle, b: &Triangle) -> bool {
    let (p, q) = (a.corners.map(wide), b.corners.map(wide));
    let normal = cross(minus(q[1], q[0]), minus(q[2], q[0]));
    let above = p.map(|corner| dot(normal, minus(corner, q[0])));
    let mut common = clip(&[[1, 0, 0], [0, 1, 0], [0, 0, 1]], above);
    common = clip(&common, above.map(|value| -value));
    for side in 0..3 {
        let inwards = cross(normal, minus(q[(side + 1) % 3], q[side]));
        common = clip(&common, p.map(|corner| dot(inwards, minus(corner, q[side]))));
    }
    let shared = a.ids.map(|id| b.ids.contains(&id));
    shared == [true; 3] || common.iter().any(|c| (0..3).any(|i| !shared[i] && c[i] != 0))
}

/// Whether two convex hulls are apart, by trying every axis that can tell.
fn hulls_are_apart(p: &[Vector], q: &[Vector]) -> bool {
    let points = [p, q].concat();
    let mut ways = Vec::new();
    for (at, &point) in points.iter().enumerate() {
        ways.extend(points[..at].iter().map(|&other| minus(point, other)));
    }
    let tells = |axis: Vector| {
        let span = |hull: &[Vector]| {
            let places = hull.iter().map(|&point| dot(axis, minus(point, points[0])));
            places.fold((i128::MAX, i128::MIN), |(lo, hi), at| (lo.min(at), hi.max(at)))
        };
        let ((p_lo, p_hi), (q_lo, q_hi)) = (span(p), span(q));
        p_hi < q_lo || q_hi < p_lo
    };
    let mut normals = (0..ways.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    normals.any(|(i, j)| {
        let normal = cross(ways[i], ways[j]);
        tells(normal) || ways.iter().any(|&way| tells(cross(normal, way)))
    })
}

/// The oracle for large triangles with one vertex in common at most. Two angles at a vertex meet
/// iff sides of one and sides of the other, reversed, balance each other.
fn meets_by_axes(a: &Triangle, b: &Triangle) -> bool {
    let (p, q) = (a.corners.map(wide), b.corners.map(wide));
    let Some(i) = (0..3).find(|&i| b.ids.contains(&a.ids[i])) else {
        return !hulls_are_apart(&p, &q);
    };
    let j = (0..3).find(|&j| b.ids[j] == a.ids[i]).expect("the id was found");
    let a_sides = [1, 2].map(|k| minus(p[(i + k) % 3], p[i]));
    let b_sides = [1, 2].map(|k| minus(q[j], q[(j + k) % 3]));
    !hulls_are_apart(&[[0; 3]], &[a_sides, b_sides].concat())
}

/// Two triangles in a box of `reach` units; often flat, often with vertices in common.
fn pairs(reach: i64) -> impl Strategy<Value = (Triangle, Triangle)> {
    let corners = || prop::array::uniform3(prop::array::uniform3(0..=reach));
    let flat = prop::option::weighted(0.4, 0..3_usize);
    let order = Just([0_usize, 1, 2]).prop_shuffle();
    let not_flat = |(a, b): &(Triangle, Triangle)| {
        [a, b].iter().all(|t| !is_degenerate(t.corners[0], t.corners[1], t.corners[2]))
    };
    let pair = (corners(), corners(), flat, 0..=3_usize, order);
    let pair = pair.prop_map(move |(mut a, mut b, flat, count, order)| {
        if let Some(axis) = flat {
            // One plane for both: across an axis, or oblique.
            for corner in a.iter_mut().chain(&mut b) {
                corner[axis] = if reach % 2 == 0 { corner[(axis + 1) % 3] } else { 1 };
            }
        }
        let mut ids = [10, 11, 12];
        for at in 0..count {
            b[order[at]] = a[at];
            ids[order[at]] = at as u64;
        }
        (Triangle { corners: a, ids: [0, 1, 2] }, Triangle { corners: b, ids })
    });
    pair.prop_filter("degenerate", not_flat)
}

fn shared_count(a: &Triangle, b: &Triangle) -> usize {
    a.ids.iter().filter(|id| b.ids.contains(id)).count()
}

fn is_coplanar(a: &Triangle, b: &Triangle) -> bool {
    let [p, q, r] = a.corners;
    b.corners.iter().all(|&corner| orientation(p, q, r, corner) == 0)
}

fn runner(cases: u32) -> TestRunner {
    TestRunner::new(ProptestConfig {
        failure_persistence: None,
        max_local_rejects: u32::MAX,
        ..ProptestConfig::with_cases(cases)
    })
}

#[test]
fn small_triangles_meet_as_clipping_says() {
    // By vertices in common, coplanar or not, and answer.
    let seen = RefCell::new([[[0_u32; 2]; 2]; 4]);
    for reach in 1..=4 {
        let run = runner(15_000).run(&pairs(reach), |(a, b)| {
            let expected = meets_by_clipping(&a, &b);
            prop_assert_eq!(meets_improperly(&a, &b), expected);
            prop_assert_eq!(meets_improperly(&b, &a), expected);
            let [p, q, r] = a.corners;
            let [i, j, k] = a.ids;
            let turned_over = Triangle { corners: [r, q, p], ids: [k, j, i] };
            prop_assert_eq!(meets_improperly(&turned_over, &b), expected);
            let class = (shared_count(&a, &b), usize::from(is_coplanar(&a, &b)));
            seen.borrow_mut()[class.0][class.1][usize::from(expected)] += 1;
            Ok(())
        });
        run.unwrap();
    }
    for (count, by_plane) in seen.borrow().iter().enumerate() {
        for (coplanar, answers) in by_plane.iter().enumerate() {
            let [apart, meet] = *answers;
            let (may_be_apart, may_meet) = match (count, coplanar) {
                (2, 0) => (true, false),
                (3, 0) => (false, false),
                (3, _) => (false, true),
                _ => (true, true),
            };
            assert!(apart >= if may_be_apart { 100 } else { 0 }, "{seen:?}");
            assert!(meet >= if may_meet { 100 } else { 0 }, "{seen:?}");
            assert!(may_be_apart || apart == 0, "{seen:?}");
            assert!(may_meet || meet == 0, "{seen:?}");
        }
    }
}

/// Rows of a linear map that keeps a box of three units within [`REACH`], with room for a step.
fn maps() -> impl Strategy<Value = [[i64; 3]; 3]> {
    const MOST: i64 = REACH / 16;
    let row = || prop::array::uniform3(-MOST..=MOST);
    let is_regular = |rows: &[[i64; 3]; 3]| orientation([0; 3], rows[0], rows[1], rows[2]) != 0;
    prop::array::uniform3(row()).prop_filter("singular", is_regular)
}

fn mapped(triangle: &Triangle, rows: &[[i64; 3]; 3], origin: [i64; 3]) -> Triangle {
    let image = |p: [i64; 3]| {
        [0, 1, 2].map(|i| origin[i] + rows[i][0] * p[0] + rows[i][1] * p[1] + rows[i][2] * p[2])
    };
    Triangle { corners: triangle.corners.map(image), ids: triangle.ids }
}

#[test]
fn large_triangles_meet_as_the_small_ones_they_are_images_of() {
    let origins = prop::array::uniform3(-(1_i64 << 50)..1 << 50);
    for reach in 1..=3 {
        let cases = (pairs(reach), maps(), origins.clone());
        let run = runner(10_000).run(&cases, |((a, b), rows, origin)| {
            let expected = meets_by_clipping(&a, &b);
            let (a, b) = (mapped(&a, &rows, origin), mapped(&b, &rows, origin));
            prop_assert_eq!(meets_improperly(&a, &b), expected);
            prop_assert_eq!(meets_improperly(&b, &a), expected);
            Ok(())
        });
        run.unwrap();
    }
}

#[test]
fn one_unit_decides_between_large_triangles() {
    let steps = prop::array::uniform3(prop::array::uniform3(-1_i64..=1));
    // How often the step changed the answer, and how often it brought the triangles together.
    let changes = RefCell::new([0_u32; 2]);
    for reach in 1..=2 {
        let cases = (pairs(reach), maps(), steps.clone());
        let run = runner(2_500).run(&cases, |((a, b), rows, steps)| {
            let before = meets_by_clipping(&a, &b);
            let (a, mut b) = (mapped(&a, &rows, [0; 3]), mapped(&b, &rows, [0; 3]));
            for j in (0..3).filter(|&j| !a.ids.contains(&b.ids[j])) {
                b.corners[j] = [0, 1, 2].map(|axis| b.corners[j][axis] + steps[j][axis]);
            }
            match shared_count(&a, &b) {
                3 => return Ok(()),
                2 if is_coplanar(&a, &b) => return Ok(()),
                2 => prop_assert!(!meets_improperly(&a, &b)),
                _ => prop_assert_eq!(meets_improperly(&a, &b), meets_by_axes(&a, &b)),
            }
            let after = meets_improperly(&a, &b);
            prop_assert_eq!(meets_improperly(&b, &a), after);
            changes.borrow_mut()[usize::from(after)] += u32::from(before != after);
            Ok(())
        });
        run.unwrap();
    }
    // A touch is lost by a step; nothing that was apart by a fraction of 2^26 units is reached.
    let [parted, joined] = *changes.borrow();
    assert!(parted >= 100, "parted {parted}");
    assert_eq!(joined, 0);
}

#[test]
fn triangles_at_the_ends_of_the_reach_do_not_overflow() {
    let place = |bits: usize| [0, 1, 2].map(|axis| REACH * (bits >> axis & 1) as i64);
    let triples = (0..512_usize).map(|code| [code & 7, code >> 3 & 7, code >> 6]);
    let triangles: Vec<_> = triples
        .filter(|[i, j, k]| i < j && j < k)
        .map(|corners| Triangle { corners: corners.map(place), ids: corners.map(|i| i as u64) })
        .collect();
    assert_eq!(triangles.len(), 56);
    for a in &triangles {
        for b in &triangles {
            let unit =
                |t: &Triangle| Triangle { corners: t.corners.map(|p| p.map(|x| x / REACH)), ..*t };
            assert_eq!(
                meets_improperly(a, b),
                meets_by_clipping(&unit(a), &unit(b)),
                "{a:?} {b:?}"
            );
            // As strangers they touch where they share a place.
            let stranger = Triangle { ids: [20, 21, 22], ..*b };
            let expected = meets_by_clipping(&unit(a), &unit(&stranger));
            assert_eq!(meets_improperly(a, &stranger), expected, "{a:?} {stranger:?}");
        }
    }
}

fn triangle(corners: [[i64; 3]; 3], ids: [u64; 3]) -> Triangle {
    Triangle { corners, ids }
}

#[test]
fn a_place_in_common_is_a_touch_unless_it_is_one_vertex() {
    let a = triangle([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [0, 1, 2]);
    let corners = [[0, 0, 0], [-4, 0, 1], [0, -4, 1]];
    assert!(!meets_improperly(&a, &triangle(corners, [0, 3, 4])));
    assert!(meets_improperly(&a, &triangle(corners, [5, 3, 4])));
}

#[test]
fn an_edge_in_common_is_fine_unless_the_triangles_lie_on_each_other() {
    let a = triangle([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [0, 1, 2]);
    let beside = |apex| triangle([[4, 0, 0], apex, [0, 0, 0]], [1, 3, 0]);
    assert!(meets_improperly(&a, &beside([9, 1, 0])));
    assert!(!meets_improperly(&a, &beside([9, 1, 1])));
    assert!(!meets_improperly(&a, &beside([9, -1, 0])));
    // A second triangle under other ids touches along the whole edge.
    assert!(meets_improperly(&a, &triangle([[4, 0, 0], [9, -1, 0], [0, 0, 0]], [7, 8, 9])));
}
