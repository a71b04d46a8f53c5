//! The promises, held against soups of all kinds.

use brickmend::mesh::shapes::{Corners, Random, area, shuffle, sphere, volume};
use brickmend::repair::RepairError;
use brickmend::sign::FillRule;
use glam::DVec3;
use proptest::prelude::*;

use crate::support::breakage::{Breakage, flip, move_all};
use crate::support::run::{
    Encoding, Workshop, at_depth, repair_anything, repair_soup, unclustered,
};
use crate::support::soups::{Closed, beside_a_fold, closed_soups, random_triangles};
use crate::support::surface::Surface;

/// Volume that a surface may gain or lose: less than this share of a cell all over it.
const SURFACE_ERROR_CELLS: f64 = 0.25;

fn assert_volume(soup: &[Corners], expected: f64, found: f64, cell: f64, name: &str) {
    let error = area(soup) * cell * SURFACE_ERROR_CELLS;
    assert!((found - expected).abs() < error, "{name}: {found} for {expected}, error {error}");
}

fn repair_closed(closed: &Closed, depth: u32) {
    let name = closed.name;
    let found = repair_soup(&closed.triangles, &at_depth(depth));
    let (outcome, surface) = found.unwrap_or_else(|e| panic!("{name} at depth {depth}: {e}"));
    assert_eq!(outcome.found.settle.rim_edges, 0, "{name} at depth {depth}");
    assert_eq!(outcome.patch.odd_faces, 0, "{name} at depth {depth}");
    assert_eq!(outcome.patch.flipped_edges, 0, "{name} at depth {depth}");
    assert_eq!(outcome.sign.patch_crossings, 0, "{name} at depth {depth}");
    if let Some(expected) = closed.volume {
        let found = surface.proof.volume;
        assert_volume(&closed.triangles, expected, found, outcome.cell_size, name);
    }
}

#[test]
fn closed_soups_have_no_odd_faces_at_any_depth() {
    for depth in 4..=7 {
        for closed in closed_soups(depth, u64::from(depth)) {
            repair_closed(&closed, depth);
        }
    }
}

#[test]
fn closed_folds_that_snapping_presses_flat_have_no_odd_faces() {
    for depth in 4..=7 {
        // In single precision its two sides would be the same as given: a panel written twice.
        let triangles = beside_a_fold();
        repair_closed(&Closed { name: "sphere beside a fold", triangles, volume: None }, depth);
    }
}

#[test]
fn closed_soups_stay_closed_in_single_precision() {
    let workshop = Workshop::new();
    for closed in closed_soups(5, 77) {
        for encoding in [Encoding::BinaryStl, Encoding::AsciiStl] {
            let input = workshop.write(&closed.triangles, encoding);
            let settings = at_depth(5);
            let repaired = workshop
                .repair(&input, "stl", &settings, &Default::default())
                .unwrap_or_else(|e| panic!("{}: {e}", closed.name));
            assert_eq!(repaired.outcome.patch.odd_faces, 0, "{}", closed.name);
            Surface::read_proven(&repaired.path, settings.fill_rule);
        }
    }
}

#[test]
fn the_order_of_triangles_does_not_matter() {
    let mut random = Random::new(3);
    for mut closed in closed_soups(5, 4) {
        let (outcome, before) = repair_soup(&closed.triangles, &at_depth(5)).expect("a result");
        shuffle(&mut closed.triangles, &mut random);
        let (shuffled, after) = repair_soup(&closed.triangles, &at_depth(5)).expect("a result");
        assert_eq!(shuffled.patch.odd_faces, 0);
        assert_eq!(outcome.scan, shuffled.scan, "{}", closed.name);
        assert_eq!(outcome.sign, shuffled.sign, "{}", closed.name);
        assert!(before.sorted_triangles() == after.sorted_triangles(), "{}", closed.name);
    }
}

fn encodings() -> impl Strategy<Value = Encoding> {
    prop_oneof![Just(Encoding::BinaryStl), Just(Encoding::Obj)]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(40) })]

    #[test]
    fn broken_soups_keep_every_promise(
        seed in any::<u64>(), kind in 0..10_usize, depth in 4..7_u32,
        steps in proptest::collection::vec((0..9_usize, 0.0..0.5_f64), 0..4),
        encoding in encodings(),
    ) {
        let mut random = Random::new(seed);
        let mut soup = closed_soups(depth, seed).swap_remove(kind).triangles;
        for (step, share) in steps {
            Breakage::ALL[step].apply(&mut soup, share, &mut random);
        }
        repair_anything(&soup, encoding, FillRule::Solid, depth);
    }

    #[test]
    fn random_triangles_keep_every_promise(
        seed in any::<u64>(), count in 1..60_usize, size in 0.01..1.5_f64, depth in 4..7_u32,
    ) {
        let soup = random_triangles(count, size, &mut Random::new(seed));
        repair_anything(&soup, Encoding::Obj, FillRule::Solid, depth);
    }
}

#[test]
fn files_without_a_finite_triangle_with_an_area_are_refused_as_such() {
    let point = vec![[[1.0, 2.0, 3.0]; 3]; 4];
    let line = vec![[[0.0; 3], [1.0; 3], [2.0; 3]]];
    let nothing = vec![[[f64::NAN; 3]; 3]];
    for soup in [point, line, nothing] {
        let found = repair_soup(&soup, &at_depth(4)).map(|_| ());
        assert!(matches!(found, Err(RepairError::NoTriangle { .. })), "{found:?}");
    }
}

#[test]
fn models_far_from_the_origin_and_of_any_size_keep_their_shape() {
    let soup = sphere([0.25, 0.5, -0.125], 1.0, 10);
    let relative = |scale: f64, by: f64| {
        let mut moved = soup.clone();
        move_all(&mut moved, scale, by);
        let (outcome, surface) = repair_soup(&moved, &at_depth(5)).expect("a result");
        let cells = surface.proof.volume / outcome.cell_size.powi(3);
        (surface.proof.volume / volume(&moved), cells)
    };
    let (share, cells) = relative(1.0, 0.0);
    assert!((share - 1.0).abs() < 0.01, "{share}");
    for (scale, by) in [(1.0, 1e6), (1e-6, 0.0), (1e6, -1e6), (1e-3, 1e3), (1e30, 0.0)] {
        let (other_share, other_cells) = relative(scale, by);
        assert!((other_share / share - 1.0).abs() < 1e-4, "{scale} {by}: {other_share} {share}");
        assert!((other_cells / cells - 1.0).abs() < 1e-3, "{scale} {by}: {other_cells} {cells}");
    }
}

#[test]
fn a_far_speck_is_told() {
    let mut soup = sphere([0.0; 3], 1.0, 12);
    let mut near = soup.clone();
    let mut speck = brickmend::mesh::shapes::tetrahedron([60.0, 0.0, 0.0], 1e-3);
    soup.append(&mut speck);
    let (outcome, _) = repair_soup(&soup, &at_depth(7)).expect("the sphere is three cells wide");
    assert!(outcome.reasons.iter().any(|r| r.contains("far parts")), "{:?}", outcome.reasons);
    let mut far = brickmend::mesh::shapes::tetrahedron([1e9, 0.0, 0.0], 1e-3);
    near.append(&mut far);
    match repair_soup(&near, &at_depth(7)) {
        Ok((outcome, _)) => {
            assert!(outcome.reasons.iter().any(|r| r.contains("far parts")));
        }
        Err(error) => assert!(matches!(error, RepairError::EmptyResult { .. }), "{error}"),
    }
}

#[test]
fn the_orientation_of_triangles_does_not_matter() {
    let mut random = Random::new(11);
    for mut closed in closed_soups(5, 12) {
        // The last bit of a distance may decide whether a cell is a cluster.
        let settings = unclustered(5);
        let (_, before) = repair_soup(&closed.triangles, &settings).expect("a result");
        flip(&mut closed.triangles, 0.5, &mut random);
        let (outcome, after) = repair_soup(&closed.triangles, &settings).expect("a result");
        assert_eq!(outcome.patch.odd_faces, 0, "{}", closed.name);
        let (v, w) = (before.proof.volume, after.proof.volume);
        assert!((v - w).abs() <= 1e-9 * v, "{}: {v} {w}", closed.name);
    }
}

#[test]
fn a_sphere_keeps_its_volume_and_its_place() {
    let centre = DVec3::new(0.3, -0.7, 0.2);
    let soup = sphere(centre.into(), 1.0, 48);
    let (outcome, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
    let expected = 4.0 / 3.0 * std::f64::consts::PI;
    assert!((surface.proof.volume / expected - 1.0).abs() < 0.01, "{}", surface.proof.volume);
    for vertex in &surface.vertices {
        let off = ((DVec3::from(*vertex) - centre).length() - 1.0).abs() / outcome.cell_size;
        assert!(off < 0.5, "{off} cells at {vertex:?}");
    }
    assert_eq!((surface.proof.components, surface.proof.euler_characteristic), (1, 2));
}

#[test]
fn a_torus_keeps_its_hole() {
    let soup = brickmend::mesh::shapes::torus(1.0, 0.45, 64, 32);
    let (_, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
    assert_eq!((surface.proof.components, surface.proof.euler_characteristic), (1, 0));
}
