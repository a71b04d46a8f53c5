//! Flat fans: which are, and that what is said of them holds among all pairs.

use std::f64::consts::TAU;

use crate::geom::signs::{Point, is_tame};
use crate::mesh::shapes::Random;
use crate::verify::intersect::filters::Normal;
use crate::verify::intersect::flat_fans::FlatFans;
use crate::verify::intersect::pair::Face;
use crate::verify::intersect::tests::{Mesh, check, proof};

/// Triangles from an apex at the origin, vertex 0, to a round of points; open it lacks the last.
fn fan(round: &[Point], is_closed: bool) -> Mesh {
    let mut mesh = Mesh { vertices: vec![[0.0; 3]], ..Mesh::default() };
    mesh.vertices.extend(round);
    let count = round.len() as u32;
    mesh.triangles = (0..count).map(|i| [0, 1 + i, 1 + (i + 1) % count]).collect();
    if !is_closed {
        mesh.triangles.pop();
    }
    mesh
}

/// Points around the apex with heights of their own, through so many turns.
fn round(count: u32, turns: f64, height: impl Fn(f64) -> f64) -> Vec<Point> {
    let angles = (0..count).map(|i| f64::from(i) * turns * TAU / f64::from(count));
    angles.map(|angle| [angle.cos(), angle.sin(), height(angle)]).collect()
}

/// Which vertices are flat.
fn flat(mesh: &Mesh) -> Vec<bool> {
    let corners = mesh.corners();
    let normals: Vec<Normal> = corners.iter().map(|&corners| Normal::of(corners)).collect();
    let faces: Vec<Face> = (mesh.triangles.iter().zip(&corners).zip(&normals))
        .map(|((&vertices, corners), normal)| {
            Face::of(vertices, normal, corners.iter().all(is_tame))
        })
        .collect();
    let mut fans = FlatFans::default();
    fans.find(&faces, &normals, &mesh.vertices);
    fans.is_flat
}

#[test]
fn cones_saddles_and_disks_are_flat_whichever_way_they_face() {
    for slope in [-3.0, 0.0, 0.5, 40.0] {
        assert!(flat(&fan(&round(7, 1.0, |_| slope), true))[0], "a cone of {slope}");
    }
    let saddle = round(12, 1.0, |angle| (2.0 * angle).cos());
    for triangles in [12, 5] {
        let mut mesh = fan(&saddle, true);
        mesh.triangles.truncate(triangles);
        assert!(flat(&mesh)[0]);
        assert_eq!(check(&mesh), 0);
        mesh.vertices.iter_mut().for_each(|[x, y, z]| [*x, *y, *z] = [*z, *y, -*x]);
        mesh.triangles.reverse();
        assert!(flat(&mesh)[0]);
        mesh.triangles.iter_mut().for_each(|triangle| triangle.reverse());
        assert!(flat(&mesh)[0]);
    }
}

#[test]
fn fans_that_fold_over_or_go_round_twice_are_not_flat() {
    let mut folded = round(8, 1.0, |_| 0.25);
    folded.swap(3, 4);
    let folded = fan(&folded, true);
    assert!(!flat(&folded)[0]);
    assert!(check(&folded) > 0);
    // A closed round of two turns, all of whose triangles turn the same way; and one and a half.
    for (count, turns, is_closed) in [(10, 2.0, true), (11, 2.0, true), (9, 1.5, false)] {
        let twice = fan(&round(count, turns, |_| 0.5), is_closed);
        assert!(!flat(&twice)[0], "{count} triangles");
        assert!(check(&twice) > 0, "{count} triangles");
    }
}

#[test]
fn two_rounds_at_one_vertex_are_not_flat_and_their_pairs_are_found() {
    let mut mesh = fan(&round(6, 1.0, |_| 0.5), true);
    let other = fan(&round(7, 1.0, |angle| 0.5 + 0.1 * angle.sin()), true);
    mesh.vertices.extend(&other.vertices[1..]);
    let named = |v: u32| if v == 0 { 0 } else { v + 6 };
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(named)));
    assert!(!flat(&mesh)[0]);
    assert!(check(&mesh) > 0);
}

#[test]
fn flat_fans_that_touch_at_a_vertex_of_each_are_found_unless_places_are_names() {
    let mut mesh = fan(&round(6, 1.0, |_| -1.0), true);
    let count = mesh.vertices.len() as u32;
    let other = fan(&round(6, 1.0, |_| 1.0), true);
    mesh.vertices.extend(&other.vertices);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + count)));
    assert!(flat(&mesh)[0] && flat(&mesh)[count as usize]);
    assert_eq!(mesh.intersecting().len(), 36);
    assert_eq!(check(&mesh), 36);
    assert_eq!(proof(&mesh, false, 1 << 20, 1).intersecting_pairs, 0);
}

#[test]
fn a_hub_of_ten_thousand_triangles_is_flat_and_what_goes_through_it_is_found() {
    let mut hub = fan(&round(10_000, 1.0, |angle| (5.0 * angle).sin()), true);
    assert!(flat(&hub)[0]);
    for (share_bytes, threads) in [(64 << 20, 2), (1 << 20, 1)] {
        assert_eq!(proof(&hub, true, share_bytes, threads).intersecting_pairs, 0);
    }
    let next = hub.vertices.len() as u32;
    hub.vertices.extend([[0.5, 0.0, -2.0], [0.5, 0.0, 2.0], [0.5001, 0.0001, 0.0]]);
    hub.triangles.push([next, next + 1, next + 2]);
    assert!(proof(&hub, true, 64 << 20, 2).intersecting_pairs > 0);
    // Corners that are so many are sorted: here they are in an open fan, then one comes twice.
    let mut open = fan(&round(10_000, 1.0, |_| 1.0), true);
    open.triangles.truncate(4000);
    open.triangles.swap(5, 3000);
    assert!(flat(&open)[0]);
    open.triangles.push(open.triangles[5]);
    assert!(!flat(&open)[0]);
}

#[test]
fn no_two_triangles_of_a_flat_fan_intersect_and_random_fans_are_judged_like_by_all_pairs() {
    let mut random = Random::new(55);
    let (mut flat_fans, mut others) = (0, 0);
    for case in 0..300_u32 {
        let count = 3 + case % 8;
        let mut link: Vec<Point> = round(count, 1.0, |angle| angle.sin());
        for point in &mut link {
            // On a coarse grid many of them touch, fold and fall on one line.
            let reach = if case % 2 == 0 { 8.0 } else { 0.5 };
            *point = point.map(|x| (4.0 * x + (random.share() - 0.5) * 4.0 * reach).round());
        }
        let mut mesh = fan(&link, random.share() < 0.7);
        if random.share() < 0.1 {
            mesh.triangles[0].reverse();
        }
        let is_flat = flat(&mesh)[0];
        let pairs = mesh.intersecting();
        let has_area = |t: &[u32; 3]| {
            let normal = Normal::of(t.map(|v| mesh.vertices[v as usize])).towards;
            normal != [0.0; 3]
        };
        assert!(!is_flat || pairs.is_empty() && mesh.triangles.iter().all(has_area), "{case}");
        flat_fans += u32::from(is_flat);
        others += u32::from(!pairs.is_empty());
        if case % 6 == 0 {
            assert_eq!(check(&mesh), check_twin(&mesh));
        }
    }
    assert!(flat_fans > 50 && others > 50, "{flat_fans} flat, {others} not");
}

/// How many pairs intersect at most, with the vertices' numbers or with places as names.
fn check_twin(mesh: &Mesh) -> u64 {
    let welded = Mesh::of(&mesh.corners());
    mesh.intersecting().len().max(welded.intersecting().len()) as u64
}
