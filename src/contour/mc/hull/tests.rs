//! All sign patterns with crossings at all kinds of places: no triangle touches another.

use std::collections::HashMap;

use super::cut;
use crate::contour::mc::cycles::CYCLES;
use crate::contour::mdc::table::{axis_of_edge, corner_of_edge, edges_of_face, is_marked};
use crate::mesh::shapes::Random;

type Point = [i64; 3];
/// A triangle by the edges of the cell that its corners lie on.
type ByEdges = [u8; 3];

/// The crossing on each edge of a cell.
fn crossings(cell: i64, random: &mut Random) -> [Point; 12] {
    std::array::from_fn(|edge| {
        let corner = corner_of_edge(edge as u8, 0);
        let mut point = [0, 1, 2].map(|a| i64::from(corner >> a & 1) * cell);
        // At the ends, in the middle, and anywhere: many lie in one plane.
        point[usize::from(axis_of_edge(edge as u8))] = match random.below(4) {
            0 => 1,
            1 => cell - 1,
            2 => cell / 2,
            _ => 1 + random.below(cell as usize - 1) as i64,
        };
        point
    })
}

fn triangles_of(mask: usize, crossings: &[Point; 12]) -> Vec<Vec<ByEdges>> {
    let cycles = CYCLES[mask].iter();
    cycles
        .map(|cycle| {
            let points: Vec<Point> =
                cycle.iter().map(|&edge| crossings[usize::from(edge)]).collect();
            let mut triangles = Vec::new();
            cut(&points, &mut |triangle| triangles.push(triangle.map(|i| cycle[i])));
            triangles
        })
        .collect()
}

fn for_all_cells(rounds: usize, check: impl Fn(usize, &[Point; 12])) {
    let mut random = Random::new(3);
    for mask in 1..255 {
        for round in 0..rounds {
            let cell = [16, 64, 1 << 24][round % 3];
            check(mask, &crossings(cell, &mut random));
        }
    }
}

fn orientation(p: Point, q: Point, r: Point, s: Point) -> i32 {
    let [a, b, c] = [q, r, s].map(|t| [0, 1, 2].map(|i| i128::from(t[i] - p[i])));
    let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
    (a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)).signum() as i32
}

/// The normal of a triangle, up to its length.
fn normal([p, q, r]: [Point; 3]) -> [i128; 3] {
    let [a, b] = [q, r].map(|t| [0, 1, 2].map(|i| i128::from(t[i] - p[i])));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Whether a segment meets a triangle, touching included.
fn meets([p, q]: [Point; 2], triangle: [Point; 3]) -> bool {
    let [a, b, c] = triangle;
    let sides = [p, q].map(|point| orientation(a, b, c, point));
    if sides == [0, 0] {
        return meets_in_plane([p, q], triangle);
    }
    if sides[0] * sides[1] > 0 {
        return false;
    }
    let around = [(a, b), (b, c), (c, a)].map(|(from, to)| orientation(p, q, from, to));
    around.iter().all(|&side| side >= 0) || around.iter().all(|&side| side <= 0)
}

/// The same where all lie in one plane: no side of the triangle, and no line of the segment, parts
/// the two, as seen along an axis that the plane does not run along.
fn meets_in_plane([p, q]: [Point; 2], triangle: [Point; 3]) -> bool {
    let axis = (0..3).max_by_key(|&a| normal(triangle)[a].abs()).expect("three axes");
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let turn = |a: Point, b: Point, c: Point| {
        let (ab, ac) = ([b[u] - a[u], b[v] - a[v]], [c[u] - a[u], c[v] - a[v]]);
        (i128::from(ab[0]) * i128::from(ac[1]) - i128::from(ab[1]) * i128::from(ac[0])).signum()
    };
    let [a, b, c] = triangle;
    let parted_by_a_side = [(a, b, c), (b, c, a), (c, a, b)].into_iter().any(|(from, to, apex)| {
        let inner = turn(from, to, apex);
        [p, q].into_iter().all(|point| turn(from, to, point) * inner < 0)
    });
    let around = triangle.map(|corner| turn(p, q, corner));
    let parted_by_the_segment = around.iter().all(|&s| s > 0) || around.iter().all(|&s| s < 0);
    !parted_by_a_side && !parted_by_the_segment
}

/// Whether two triangles meet in more than the corners that they share.
fn intersect(first: ByEdges, second: ByEdges, crossings: &[Point; 12]) -> bool {
    let places = |edges: ByEdges| edges.map(|edge| crossings[usize::from(edge)]);
    let shared = first.iter().filter(|edge| second.contains(edge)).count();
    let apart = |edge: &u8, other: &ByEdges| !other.contains(edge);
    // Of a triangle that shares a corner only the side across from it can tell.
    let sides = |triangle: ByEdges, other: ByEdges| {
        (0..3)
            .map(move |i| [triangle[i], triangle[(i + 1) % 3]])
            .filter(move |side| side.iter().all(|edge| apart(edge, &other)))
            .map(|side| side.map(|edge| crossings[usize::from(edge)]))
    };
    if shared < 2 {
        return sides(first, second).any(|side| meets(side, places(second)))
            || sides(second, first).any(|side| meets(side, places(first)));
    }
    let lone = |triangle: ByEdges, other: ByEdges| {
        let edge = triangle.into_iter().find(|edge| apart(edge, &other)).expect("not the same");
        crossings[usize::from(edge)]
    };
    let [a, b, c] = places(first);
    let folded = orientation(a, b, c, lone(second, first)) == 0;
    let dot: i128 = (0..3).map(|i| normal(places(first))[i] * normal(places(second))[i]).sum();
    folded && dot < 0
}

#[test]
fn no_triangle_of_a_cell_meets_another() {
    for_all_cells(60, |mask, crossings| {
        let all: Vec<ByEdges> = triangles_of(mask, crossings).concat();
        for (i, &first) in all.iter().enumerate() {
            for &second in &all[..i] {
                let met = intersect(first, second, crossings);
                assert!(!met, "{mask:08b}: {first:?} {second:?} {crossings:?}");
            }
        }
    });
}

#[test]
fn triangles_that_meet_are_found() {
    let first = [[0, 0, 0], [8, 0, 0], [0, 8, 0]];
    let met = |second: [Point; 3]| {
        // Corners in one place are one crossing.
        let mut crossings = [[0; 3]; 12];
        crossings[..3].copy_from_slice(&first);
        crossings[3..6].copy_from_slice(&second);
        let number = |i: usize| first.iter().position(|&p| p == second[i]).unwrap_or(3 + i) as u8;
        let (first, second) = ([0, 1, 2], [number(0), number(1), number(2)]);
        let found = intersect(first, second, &crossings);
        assert_eq!(intersect(second, first, &crossings), found);
        found
    };
    assert!(met([[2, 2, -1], [2, 2, 5], [9, 9, 5]]), "pierced");
    assert!(met([[2, 2, 0], [2, 2, 5], [9, 9, 5]]), "touched by a corner");
    assert!(met([[4, -4, 1], [4, -4, -1], [4, 0, 0]]), "a corner on a side");
    assert!(met([[1, 1, 0], [2, 1, 0], [1, 2, 0]]), "inside, in one plane");
    assert!(met([[-1, 1, 0], [9, 1, 0], [9, 9, 0]]), "across, in one plane");
    assert!(met([[0, 0, 0], [9, 9, 0], [9, 9, 5]]), "one corner shared, one side within");
    assert!(met([[8, 0, 0], [0, 0, 0], [1, 3, 0]]), "folded onto each other");
    assert!(!met([[8, 0, 0], [0, 0, 0], [1, 3, 1]]), "a sharp fold");
    assert!(!met([[8, 0, 0], [0, 0, 0], [1, -3, 0]]), "flat");
    assert!(!met([[0, 0, 0], [-9, -9, 0], [0, -5, 0]]), "one corner shared, in one plane");
    assert!(!met([[2, 2, 1], [2, 2, 5], [9, 9, 5]]), "above");
    assert!(!met([[9, 0, 0], [9, 9, 0], [8, 9, 0]]), "beside, in one plane");
}

#[test]
fn fans_would_have_diagonals_in_faces() {
    let in_face =
        |a: u8, b: u8| (0..6).map(edges_of_face).any(|e| e.contains(&a) && e.contains(&b));
    let fans = CYCLES.iter().flat_map(|cycles| cycles.iter());
    let mut diagonals = fans.flat_map(|cycle| (2..cycle.len() - 1).map(|i| (cycle[0], cycle[i])));
    assert!(diagonals.any(|(from, to)| in_face(from, to)));
}

#[test]
fn triangles_have_an_area_and_no_diagonal_lies_in_a_face() {
    for_all_cells(60, |mask, crossings| {
        let cycles = CYCLES[mask].iter();
        for (cycle, triangles) in cycles.zip(triangles_of(mask, crossings)) {
            assert_eq!(triangles.len(), cycle.len() - 2);
            let mut uses = HashMap::new();
            for triangle in triangles {
                let places = triangle.map(|edge| crossings[usize::from(edge)]);
                assert_ne!(normal(places), [0; 3], "{mask:08b}");
                for i in 0..3 {
                    let side = [triangle[i], triangle[(i + 1) % 3]];
                    *uses.entry(side).or_insert(0) += 1;
                }
            }
            for (&[from, to], &count) in &uses {
                assert_eq!(count, 1, "{mask:08b}");
                let at = cycle.iter().position(|&edge| edge == from).expect("of the cycle");
                let is_side = cycle[(at + 1) % cycle.len()] == to;
                assert_ne!(is_side, uses.contains_key(&[to, from]), "{mask:08b}");
                let in_face = (0..6).any(|face| {
                    let edges = edges_of_face(face);
                    edges.contains(&from) && edges.contains(&to)
                });
                assert!(is_side || !in_face, "{mask:08b}: {from} {to}");
            }
        }
    });
}

#[test]
fn the_surface_has_the_inside_behind_it() {
    for_all_cells(6, |mask, crossings| {
        let cell = crossings.iter().flatten().copied().max().expect("twelve crossings");
        let all = triangles_of(mask, crossings).concat();
        for edge in (0..12).filter(|&edge| is_marked(mask as u8, edge)) {
            let ends = [0, 1].map(|end| corner_of_edge(edge, end));
            let swap = mask >> ends[0] & 1 == 0;
            let [inside, outside] = [ends[usize::from(swap)], ends[usize::from(!swap)]]
                .map(|corner| [0, 1, 2].map(|a| i64::from(corner >> a & 1) * cell));
            // The edge passes the fan around its crossing from the inside to the outside.
            let fan = all.iter().filter(|triangle| triangle.contains(&edge));
            let fan: Vec<_> = fan.map(|t| t.map(|edge| crossings[usize::from(edge)])).collect();
            let sides = |end: Point| fan.iter().map(move |&[p, q, r]| orientation(p, q, r, end));
            assert!(sides(inside).any(|side| side < 0), "{mask:08b} {edge}");
            assert!(sides(outside).all(|side| side >= 0), "{mask:08b} {edge}");
        }
    });
}
