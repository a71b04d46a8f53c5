//! Corners and creases of sharp solids in any position, before and after clustering.

use brickmend::mesh::shapes::{Corners, Random, cuboid, gear, rotation, transform};
use brickmend::repair::{Reach, Settings};
use glam::DVec3;

use crate::support::run::{at_depth, repair_soup, unclustered};
use crate::support::soups::{prism, turned_cube};
use crate::support::surface::Surface;

/// How far a vertex may be from a corner of the model, in cells.
const SHARP_CELLS: f64 = 1e-3;

/// Normals apart by more than 15 degrees make a crease.
const CREASE_COSINE: f64 = 0.966;

/// The vertices of a closed soup at which three planes meet.
fn corners_of(soup: &[Corners]) -> Vec<DVec3> {
    let mut corners: Vec<(DVec3, Vec<DVec3>)> = Vec::new();
    for triangle in soup {
        let [p, q, r] = triangle.map(DVec3::from);
        let normal = (q - p).cross(r - p).normalize();
        for point in [p, q, r] {
            let at = corners.iter().position(|(known, _)| known.distance(point) < 1e-9);
            let at = at.unwrap_or_else(|| {
                corners.push((point, Vec::new()));
                corners.len() - 1
            });
            let normals = &mut corners[at].1;
            if normals.iter().all(|known| known.dot(normal).abs() < CREASE_COSINE) {
                normals.push(normal);
            }
        }
    }
    corners.into_iter().filter(|(_, normals)| normals.len() >= 3).map(|(at, _)| at).collect()
}

/// A polygon of `sides` sides.
fn regular(sides: u32, radius: f64) -> Vec<[f64; 2]> {
    let at = |i: u32| (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
    (0..sides).map(at).map(|(s, c)| [radius * c, radius * s]).collect()
}

/// Solids with sharp corners, by name, with the share of their corners that must be sharp.
///
/// A corner can be out of reach: two pieces of surface that end in one cell beside it are not
/// joined by it, and a narrow one ends more than a cell beyond the last cell with a vertex.
fn solids() -> Vec<(&'static str, Vec<Corners>, f64)> {
    let mut bolt = prism(&regular(6, 1.0), 0.0, 0.5);
    // The shaft ends inside the head, and its corners there are gone.
    bolt.extend(prism(&regular(8, 0.5), 0.25, 2.0));
    vec![
        ("cube", cuboid([-1.0; 3], [1.0; 3]), 0.98),
        ("wedge", prism(&[[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]], 0.0, 1.5), 0.7),
        ("gear", gear(6, 0.7, 1.0, 0.5), 0.94),
        ("bolt", bolt, 0.98),
    ]
}

/// Of each corner of a solid in a position of its own, how far the nearest vertex is, in cells.
fn distances(solid: &[Corners], random: &mut Random, settings: &Settings) -> Vec<f64> {
    let (turn, by) = (rotation(random), DVec3::from(random.point()));
    let hidden = |at: DVec3| (at.z - 0.25).abs() < 1e-9;
    let corners = corners_of(solid).into_iter().filter(|at| !hidden(*at));
    let corners: Vec<DVec3> = corners.map(|corner| turn * corner + by).collect();
    let (outcome, surface) = repair_soup(&transform(solid, turn, by), settings).expect("a result");
    assert_eq!(outcome.patch.odd_faces, 0);
    let nearest = |corner: &DVec3| off(&surface, *corner) / outcome.cell_size;
    corners.iter().map(nearest).collect()
}

fn off(surface: &Surface, corner: DVec3) -> f64 {
    let distances = surface.vertices.iter().map(|&v| DVec3::from(v).distance(corner));
    distances.fold(f64::INFINITY, f64::min)
}

#[test]
fn corners_of_sharp_solids_in_any_position_stay_sharp_before_and_after_clustering() {
    let mut random = Random::new(21);
    for (name, solid, share) in solids() {
        for settings in [unclustered(6), at_depth(6)] {
            let poses = (0..6).flat_map(|_| distances(&solid, &mut random, &settings));
            let all: Vec<f64> = poses.collect();
            let sharp = all.iter().filter(|off| **off < SHARP_CELLS).count();
            let (expected, decimate) = (share * all.len() as f64, settings.decimate);
            assert!(sharp as f64 >= expected, "{name} {decimate:?}: {sharp} of {}", all.len());
        }
    }
}

#[test]
fn clusters_lose_no_sharp_corner_of_a_turned_cube() {
    let mut random = Random::new(22);
    let (mut sharp, mut all) = (0, 0);
    for pose in 0..20 {
        let (soup, turn, by) = turned_cube(&mut random);
        let corners: Vec<DVec3> = corners_of(&soup);
        assert_eq!(corners.len(), 8, "turned by {turn}, moved by {by}");
        let of = |settings| {
            let (outcome, surface) = repair_soup(&soup, settings).expect("a result");
            let is_sharp =
                |corner: &DVec3| off(&surface, *corner) < SHARP_CELLS * outcome.cell_size;
            corners.iter().map(is_sharp).collect::<Vec<bool>>()
        };
        let (before, after) = (of(&unclustered(6)), of(&at_depth(6)));
        for (corner, (before, after)) in before.into_iter().zip(after).enumerate() {
            assert!(after || !before, "pose {pose}: corner {corner} is lost in a cluster");
            sharp += usize::from(before);
            all += 1;
        }
    }
    assert!(sharp * 100 >= all * 98, "{sharp} of {all} corners are sharp");
}

#[test]
fn boxes_in_each_others_way_stay_sound_while_vertices_reach() {
    let mut random = Random::new(23);
    for (count, decimate) in [(40, 0.0), (80, 0.1), (120, 1.0)] {
        let mut soup = Vec::new();
        for _ in 0..count {
            let size = [0; 3].map(|_| random.within(0.06, 0.2));
            let (turn, by) = (rotation(&mut random), DVec3::from(random.point()));
            soup.extend(transform(&cuboid([0.0; 3], size), turn, by));
        }
        let settings = Settings { decimate: Reach::Cells(decimate), ..at_depth(6) };
        let (_, surface) = repair_soup(&soup, &settings).expect("a result");
        assert!(surface.proof.components > 1);
    }
}
