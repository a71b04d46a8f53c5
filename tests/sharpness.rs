//! Corners, planes and fill rules: the output where it is known exactly.

mod support;

use brickmend::mesh::shapes::{Corners, Random, cuboid, sphere, volume};
use brickmend::octree::Domain;
use brickmend::repair::{Outcome, Settings};
use brickmend::sign::FillRule;
use glam::{DMat3, DVec3};

use crate::support::run::{Encoding, Workshop, at_depth, repair_soup, unclustered};
use crate::support::soups::{specks, turned_cube};
use crate::support::surface::Surface;

/// How far the nearest vertex is from each corner of a turned cube, in cells, and whether the
/// corner's cell sees its three planes: whether each of them crosses an edge of that cell.
fn corner_distances(random: &mut Random) -> Vec<(f64, bool)> {
    let (soup, turn, by) = turned_cube(random);
    let (outcome, surface) = repair_soup(&soup, &at_depth(5)).expect("a result");
    assert_eq!(outcome.patch.odd_faces, 0);
    assert!((surface.proof.volume / 8.0 - 1.0).abs() < 2e-3, "{}", surface.proof.volume);
    (0..8)
        .map(|bits| {
            let sign = |bit: i32| if bits & bit == 0 { -1.0 } else { 1.0 };
            let corner = turn * DVec3::new(sign(1), sign(2), sign(4)) + by;
            let distances = surface.vertices.iter().map(|&v| DVec3::from(v).distance(corner));
            let nearest = distances.fold(f64::INFINITY, f64::min);
            let seen = planes_seen(&outcome.grid, turn, by, corner);
            (nearest / outcome.cell_size, seen == [true; 3])
        })
        .collect()
}

/// Which planes of the turned cube cross an edge of the cell that holds `corner`.
fn planes_seen(grid: &Domain, turn: DMat3, by: DVec3, corner: DVec3) -> [bool; 3] {
    let units = i64::from(grid.cell_units);
    let cell = grid.to_units(corner.into()).map(|c| (c as i64).div_euclid(units));
    let local = |bits: usize| {
        let at = std::array::from_fn(|a| (cell[a] + (bits >> a & 1) as i64) * units);
        turn.transpose() * (DVec3::from(grid.to_model(at)) - by)
    };
    let mut seen = [false; 3];
    for low in 0..8 {
        for axis in (0..3).filter(|axis| low >> axis & 1 == 0) {
            let ends = [local(low), local(low | 1 << axis)];
            let depths = ends.map(|p| p.abs().max_element() - 1.0);
            if depths[0] * depths[1] < 0.0 {
                // The outer end lies beyond the plane that the edge leaves the cube through last.
                let (inner, outer) = if depths[0] < 0.0 { (0, 1) } else { (1, 0) };
                let leaves = |a: usize| {
                    let (from, to) = (ends[inner][a].abs() - 1.0, ends[outer][a].abs() - 1.0);
                    if to > 0.0 { from / (from - to) } else { f64::INFINITY }
                };
                let first = (0..3).min_by(|&a, &b| leaves(a).total_cmp(&leaves(b)));
                seen[first.expect("three planes")] = true;
            }
        }
    }
    seen
}

#[test]
fn corners_of_turned_cubes_stay_sharp_where_their_cell_sees_three_planes() {
    let mut random = Random::new(21);
    let (mut sharp, mut all) = (0, 0);
    for pose in 0..20 {
        for (number, (off, seen)) in corner_distances(&mut random).into_iter().enumerate() {
            assert!(off < 1.0, "pose {pose}: corner {number} is {off} cells off");
            assert!(!seen || off < 1e-3, "pose {pose}: corner {number} is {off} cells off");
            sharp += usize::from(off < 1e-3);
            all += 1;
        }
    }
    assert!(sharp * 4 > all, "{sharp} of {all} corners are sharp");
}

#[test]
fn every_vertex_of_an_axis_parallel_cube_lies_on_its_planes_to_the_bit() {
    let workshop = Workshop::new();
    let odd = ([0.3, -1.7, 2.1], [1.5, -0.4, 3.2]);
    let even = ([-0.25, -1.75, 2.125], [1.5, -0.375, 3.25]);
    let unit: ([f32; 3], [f32; 3]) = ([-1.0; 3], [1.0; 3]);
    // Single precision near 3.2 does not hold 0.3 as single precision near 0.3 does.
    for (extension, (lo, hi)) in
        [("ply", odd), ("ply", even), ("ply", unit), ("stl", even), ("stl", unit)]
    {
        let soup = cuboid(lo.map(f64::from), hi.map(f64::from));
        let input = workshop.write(&soup, Encoding::BinaryStl);
        let repaired = workshop
            .repair(&input, extension, &at_depth(6), &Default::default())
            .expect("a result");
        let surface = Surface::read_proven(&repaired.path, FillRule::Solid);
        let planes = |vertex: &[f64; 3]| {
            (0..3).filter(|&a| [lo[a], hi[a]].map(f64::from).contains(&vertex[a])).count()
        };
        for vertex in &surface.vertices {
            assert!(planes(vertex) > 0, "{vertex:?} is on no plane of {lo:?} to {hi:?}");
        }
        assert_eq!(surface.vertices.iter().filter(|vertex| planes(vertex) == 3).count(), 8);
    }
}

fn with_rule(soup: &[Corners], rule: FillRule, depth: u32) -> (Outcome, Surface) {
    let settings = Settings { fill_rule: rule, ..at_depth(depth) };
    repair_soup(soup, &settings).expect("a result")
}

/// Two boxes of 1 x 1 x 1 that share a quarter of each.
fn overlapping_boxes() -> Vec<Corners> {
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    soup.extend(cuboid([0.5, 0.5, 0.0], [1.5, 1.5, 1.0]));
    soup
}

#[test]
fn solid_unites_overlapping_boxes_and_evenodd_hollows_them() {
    let soup = overlapping_boxes();
    let (outcome, surface) = with_rule(&soup, FillRule::Solid, 6);
    assert_eq!(outcome.patch.odd_faces, 0);
    assert!((surface.proof.volume - 1.75).abs() < 1.75e-2, "{}", surface.proof.volume);
    assert_eq!((surface.proof.components, surface.proof.euler_characteristic), (1, 2));
    let (_, hollow) = with_rule(&soup, FillRule::Evenodd, 6);
    assert!((hollow.proof.volume - 1.5).abs() < 2e-2, "{}", hollow.proof.volume);
}

#[test]
fn solid_fills_a_cavity_and_evenodd_keeps_it() {
    let mut soup = cuboid([-1.0; 3], [1.0; 3]);
    soup.extend(cuboid([-0.5; 3], [0.5; 3]));
    let (filled, surface) = with_rule(&soup, FillRule::Solid, 6);
    assert!((surface.proof.volume - 8.0).abs() < 1e-2, "{}", surface.proof.volume);
    assert_eq!((surface.proof.components, surface.proof.euler_characteristic), (1, 2));
    assert!(filled.reasons.iter().any(|r| r.contains("filled")), "{:?}", filled.reasons);
    let (_, hollow) = with_rule(&soup, FillRule::Evenodd, 6);
    assert!((hollow.proof.volume - 7.0).abs() < 1e-2, "{}", hollow.proof.volume);
    assert_eq!((hollow.proof.components, hollow.proof.euler_characteristic), (2, 4));
}

/// A sphere, without its cap above `top` (1 leaves it whole).
fn open_sphere(centre: [f64; 3], radius: f64, top: f64) -> Vec<Corners> {
    let mut soup = sphere(centre, radius, 24);
    soup.retain(|corners| corners.iter().any(|c| c[2] - centre[2] < top * radius));
    soup
}

#[test]
fn the_place_in_the_grid_does_not_change_the_volume() {
    let radius = 0.3;
    let mut random = Random::new(31);
    for top in [1.1, 0.75] {
        let exact = {
            let open = open_sphere([0.5; 3], radius, top);
            let rim = open.iter().flatten().map(|c| c[2]).fold(f64::MIN, f64::max) - 0.5;
            let h = radius - rim;
            let cap = std::f64::consts::PI * h * h * (3.0 * radius - h) / 3.0;
            4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) - cap
        };
        for place in 0..10 {
            // Specks hold the grid where it is; the sphere moves by up to five cells and a half.
            let centre = random.point().map(|x| 0.5 + 0.095 * x);
            let mut soup = open_sphere(centre, radius, top);
            soup.extend(specks());
            let (outcome, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
            assert_eq!(outcome.patch.odd_faces == 0, top > 1.0);
            let found = surface.proof.volume;
            let disc = std::f64::consts::PI * radius * radius * (1.0 - top * top).max(0.0);
            // A hundredth, and half a cell over the patch.
            let error = 0.01 * exact + 0.5 * disc * outcome.cell_size;
            assert!((found - exact).abs() < error, "{place} {top}: {found} {exact} {error}");
        }
    }
}

#[test]
fn shapes_are_what_these_tests_take_them_for() {
    assert!((volume(&overlapping_boxes()) - 2.0).abs() < 1e-12);
    assert!(volume(&specks()) > 0.0);
}

#[test]
fn a_lip_of_a_cell_on_a_large_plate_survives_clustering() {
    // 220 cells long at depth 8; the lip is a cell high and ten wide.
    let cell = 1.0 / 220.0;
    let (plate, lip) = (0.1, 0.1 + cell);
    let mut soup = cuboid([0.0; 3], [1.0, 1.0, plate]);
    soup.extend(cuboid([1.0 - 10.0 * cell, 1.0 - 10.0 * cell, 0.5 * plate], [1.0, 1.0, lip]));
    let (outcome, surface) = repair_soup(&soup, &at_depth(8)).expect("a result");
    let step = 2.0_f64.powi(outcome.grid.unit_exponent);
    let on_lip = surface.vertices.iter().filter(|v| (v[2] - lip).abs() <= step);
    let far = on_lip.clone().filter(|v| (v[0] - 1.0).abs() <= step && (v[1] - 1.0).abs() <= step);
    assert!(on_lip.count() >= 4, "the lip is there");
    assert_eq!(far.count(), 1, "with its corner");
    let volume = plate + 100.0 * cell * cell * cell;
    assert!((surface.proof.volume - volume).abs() < 1e-5 * volume, "{}", surface.proof.volume);
    let leaves = outcome.output.contour.crossed_edges * 2;
    assert!(surface.proof.triangles * 50 < leaves, "{} of {leaves}", surface.proof.triangles);
}

#[test]
fn no_clustering_gives_every_leaf_its_vertices() {
    let soup = sphere([0.0; 3], 1.0, 24);
    let (outcome, surface) = repair_soup(&soup, &unclustered(6)).expect("a result");
    let contour = outcome.output.contour;
    assert_eq!((contour.clusters, contour.face_points), (0, 0));
    assert_eq!(contour.cut_vertices, contour.cell_vertices);
    assert_eq!(contour.polygons, contour.crossed_edges);
    assert_eq!(surface.proof.triangles, 2 * (contour.polygons + contour.fans));
    let (clustered, lighter) = repair_soup(&soup, &at_depth(6)).expect("a result");
    assert!(clustered.output.contour.cluster_error_cells <= 0.1);
    assert!(lighter.proof.triangles < surface.proof.triangles);
    assert_eq!(lighter.proof.euler_characteristic, surface.proof.euler_characteristic);
}

#[test]
fn clusters_lose_no_corner_of_a_turned_cube() {
    let mut random = Random::new(22);
    for pose in 0..10 {
        let (soup, turn, by) = turned_cube(&mut random);
        let sharp = |settings| {
            let (outcome, surface) = repair_soup(&soup, settings).expect("a result");
            let is_sharp = |bits: &i32| {
                let sign = |bit: i32| if bits & bit == 0 { -1.0 } else { 1.0 };
                let corner = turn * DVec3::new(sign(1), sign(2), sign(4)) + by;
                let near = |v: &[f64; 3]| DVec3::from(*v).distance(corner) / outcome.cell_size;
                surface.vertices.iter().map(near).fold(f64::INFINITY, f64::min) < 1e-3
            };
            (0..8).filter(is_sharp).collect::<Vec<i32>>()
        };
        let (before, after) = (sharp(&unclustered(6)), sharp(&at_depth(6)));
        assert!(before.iter().all(|corner| after.contains(corner)), "{pose}: {before:?} {after:?}");
    }
}
