//! Walls thinner than a cell: thickened, never torn; dropped on demand.

use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, sphere, transform};
use brickmend::repair::{Depth, Limits, Settings, ThinRule};
use glam::{DMat3, DVec3};

use crate::support::run::{Encoding, Workshop, at_depth, repair_soup, same_whatever_the_limits};

/// A soup in some pose, by what it is where a cell is so wide; the width depends on the pose, and
/// hardly on a wall's thickness.
fn in_cells(make: impl Fn(f64) -> Vec<Corners>, random: &mut Random) -> Vec<Corners> {
    let (turn, by) = (rotation(random), DVec3::from(random.point()));
    let posed = |cell: f64| transform(&make(cell), turn, by);
    let cell = (0..3).fold(1.0 / 57.0, |cell, _| {
        let (outcome, _) = repair_soup(&posed(cell), &at_depth(6)).expect("a result");
        outcome.cell_size
    });
    posed(cell)
}

/// A plate of 1 x 1 and so many cells of depth 6, whose cells are about 1/57 wide, in some pose.
fn plate(cells: f64, random: &mut Random) -> Vec<Corners> {
    let soup = cuboid([0.0; 3], [1.0, 1.0, cells / 57.0]);
    transform(&soup, rotation(random), DVec3::from(random.point()))
}

#[test]
fn a_plate_far_thinner_than_a_cell_stays_whole() {
    let mut random = Random::new(8);
    for cells in [0.1, 0.3, 0.7, 3.0] {
        for pose in 0..4 {
            let (outcome, surface) =
                repair_soup(&plate(cells, &mut random), &at_depth(6)).expect("a result");
            // Tips may come off as specks; there is no hole.
            let (parts, euler) = (surface.proof.components, surface.proof.euler_characteristic);
            assert!(parts <= 12 && euler == 2 * parts as i64, "{cells}, {pose}: {parts} {euler}");
            let told = surface.proof.volume / outcome.cell_size;
            assert!(told > cells * 0.6 && told < cells + 2.6, "{cells} cells: {told}");
            assert_eq!(outcome.thickened.triangles > 0, cells < 1.0, "{cells} cells");
        }
    }
}

#[test]
fn a_plate_of_about_a_cell_has_no_tunnel() {
    let mut random = Random::new(13);
    for cells in [0.8, 0.95, 1.02, 1.1, 1.3, 1.7] {
        for pose in 0..4 {
            let soup = in_cells(|cell| cuboid([0.0; 3], [1.0, 1.0, cells * cell]), &mut random);
            let (outcome, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
            let (parts, euler) = (surface.proof.components, surface.proof.euler_characteristic);
            assert!(parts <= 4 && euler == 2 * parts as i64, "{cells}, {pose}: {parts} {euler}");
            let told = surface.proof.volume / outcome.cell_size;
            assert!(told > cells * 0.7 && told < cells + 2.6, "{cells} cells: {told}");
        }
    }
}

#[test]
fn a_gap_of_about_a_cell_stays_one() {
    let mut random = Random::new(14);
    for cells in [1.02, 1.1, 1.3, 1.7] {
        let two = |cell: f64| {
            let gap = cells * cell;
            let mut soup = cuboid([0.0; 3], [1.0, 1.0, 0.2]);
            soup.extend(cuboid([0.0, 0.0, 0.2 + gap], [1.0, 1.0, 0.4 + gap]));
            soup
        };
        let (_, surface) =
            repair_soup(&in_cells(two, &mut random), &at_depth(6)).expect("a result");
        let proof = &surface.proof;
        assert_eq!((proof.components, proof.euler_characteristic), (2, 4), "{cells} cells");
    }
}

#[test]
fn walls_of_about_a_cell_are_the_same_whatever_the_memory_and_the_threads() {
    let wall = |cell: f64| cuboid([0.0; 3], [1.0, 1.0, 1.02 * cell]);
    let soup = in_cells(wall, &mut Random::new(15));
    same_whatever_the_limits(&soup, &at_depth(6), |outcome| {
        assert!(outcome.sign.walled_faces > 100);
    });
}

#[test]
fn on_demand_what_the_grid_misses_goes_and_is_told() {
    let mut random = Random::new(9);
    let settings = Settings { thin: ThinRule::Drop, ..at_depth(6) };
    let mut soup = plate(0.02, &mut random);
    soup.extend(sphere([4.0; 3], 0.5, 16));
    let (outcome, surface) = repair_soup(&soup, &settings).expect("the sphere is left");
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
    assert!(surface.proof.volume < 1.05 * ball, "{}", surface.proof.volume);
    assert_eq!(outcome.thickened.triangles, 0);
    assert!(outcome.dropped.thin_edges > 0);
}

#[test]
fn a_thick_solid_is_as_it_would_be_without_the_rule() {
    let mut random = Random::new(10);
    let turn = rotation(&mut random) * DMat3::from_diagonal(DVec3::new(1.0, 0.6, 0.3));
    let soup = transform(&cuboid([-1.0; 3], [1.0; 3]), turn, DVec3::ZERO);
    let workshop = Workshop::new();
    let input = workshop.write(&soup, Encoding::Obj);
    let bytes = [ThinRule::Thicken, ThinRule::Drop].map(|thin| {
        let settings = Settings { thin, ..at_depth(7) };
        let repaired =
            workshop.repair(&input, "ply", &settings, &Limits::default()).expect("a result");
        std::fs::read(repaired.path).expect("it is there")
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn thickening_is_the_same_whatever_the_memory_and_the_threads() {
    let mut soup = plate(0.4, &mut Random::new(11));
    soup.extend(sphere([2.0; 3], 0.3, 24));
    same_whatever_the_limits(&soup, &at_depth(7), |outcome| {
        assert!(outcome.thickened.triangles > 0);
    });
}

#[test]
fn the_grid_gets_deeper_by_itself_where_walls_are_thin_and_says_so() {
    let auto = |soup: &[Corners], max_depth| {
        let settings = Settings { depth: Depth::Auto { max_depth }, ..Settings::default() };
        repair_soup(soup, &settings).expect("a result")
    };
    let mut random = Random::new(12);
    for scale in [1.0, 1e-6, 1e6] {
        // A wall of half a cell at the depth that the diagonal asks for.
        let box_of = |lo: f64, hi: f64| cuboid([lo; 3], [hi; 3]);
        let mut soup = box_of(0.0, 1.0);
        soup.extend(cuboid([1.2, 0.0, 0.0], [1.205, 1.0, 1.0]));
        let turn = rotation(&mut random) * DMat3::from_diagonal(DVec3::splat(scale));
        let soup = transform(&soup, turn, DVec3::ZERO);
        let (outcome, surface) = auto(&soup, 12);
        let volume = surface.proof.volume / scale.powi(3);
        assert!((volume - 1.005).abs() < 3e-3, "{scale}: {volume}, {}", outcome.depth_reason);
        assert_eq!(surface.proof.components, 2);
        assert!(outcome.depth_reason.contains("thinner"), "{}", outcome.depth_reason);
        let depth = outcome.grid.depth;
        let (outcome, _) = auto(&soup, depth - 1);
        assert_eq!(outcome.grid.depth, depth - 1);
        assert!(outcome.thickened.triangles > 0);
    }
    let (outcome, _) = auto(&cuboid([0.0; 3], [1.0; 3]), 12);
    assert_eq!((outcome.grid.depth, outcome.thickened.triangles), (8, 0));
}

#[test]
fn walls_within_a_solid_are_not_thickened() {
    let mut random = Random::new(13);
    for pose in 0..4 {
        let mut soup = cuboid([0.0; 3], [1.0; 3]);
        soup.extend(cuboid([0.002; 3], [0.998; 3]));
        let soup = transform(&soup, rotation(&mut random), DVec3::ZERO);
        let (outcome, surface) = repair_soup(&soup, &at_depth(7)).expect("a result");
        assert_eq!(outcome.thickened.triangles, 0, "pose {pose}");
        assert!((surface.proof.volume - 1.0).abs() < 1e-3, "pose {pose}");
    }
}
