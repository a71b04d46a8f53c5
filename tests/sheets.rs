//! Fins, free sheets and panels that something holds: what goes, and what becomes a plate.

use brickmend::ingest::SheetRule;
use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, shuffle, transform};
use brickmend::repair::{Outcome, Settings};
use glam::{DMat3, DVec3};

use crate::support::run::{at_depth, repair_soup, same_whatever_the_limits};
use crate::support::soups::prism;
use crate::support::surface::Surface;

/// A rectangle from `at` along two ways.
fn panel(at: [f64; 3], along: [f64; 3], up: [f64; 3]) -> Vec<Corners> {
    let (p, u, v) = (DVec3::from(at), DVec3::from(along), DVec3::from(up));
    let [q, r, s] = [p + u, p + u + v, p + v];
    vec![[p, q, r].map(Into::into), [p, r, s].map(Into::into)]
}

/// A box of 2 x 2 x 2 with a fin along each of two of its edges.
fn finned_box() -> Vec<Corners> {
    let mut soup = cuboid([-1.0; 3], [1.0; 3]);
    for (at, along, up) in [
        ([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.05]),
        ([1.0, 1.0, -1.0], [0.0, 0.0, 2.0], [0.04, 0.04, 0.0]),
    ] {
        soup.extend(panel(at, along, up));
    }
    soup
}

fn with_rule(soup: &[Corners], sheets: SheetRule, depth: u32) -> (Outcome, Surface) {
    repair_soup(soup, &Settings { sheets, ..at_depth(depth) }).expect("a result")
}

#[test]
fn a_fin_goes_and_leaves_the_box_as_if_it_had_never_been() {
    let mut random = Random::new(5);
    for pose in 0..6 {
        let scale = [1.0, 1e-6, 1e6][pose % 3];
        let turn = rotation(&mut random) * DMat3::from_diagonal(DVec3::splat(scale));
        let by = DVec3::from(random.point()) * scale;
        let mut soup = transform(&finned_box(), turn, by);
        // The order and the orientation of triangles tell nothing.
        shuffle(&mut soup, &mut random);
        soup.iter_mut().for_each(|corners| {
            if random.share() < 0.5 {
                corners.swap(1, 2);
            }
        });
        let (outcome, surface) = with_rule(&soup, SheetRule::Thicken, 6);
        assert_eq!(outcome.found.settle.fins.fins, 2, "pose {pose}");
        assert_eq!(outcome.found.settle.fins.triangles, 4);
        assert_eq!((outcome.thickened.triangles, outcome.patch.odd_faces), (0, 0));
        let volume = 8.0 * scale.powi(3);
        assert!((surface.proof.volume / volume - 1.0).abs() < 1e-3, "{}", surface.proof.volume);
        let far = surface.vertices.iter().map(|v| {
            let local = turn.inverse() * (DVec3::from(*v) - by);
            local.abs().max_element()
        });
        let far = far.fold(0.0, f64::max);
        assert!(far < 1.01, "pose {pose}: fins of 1.05 were there, and {far} is");
    }
}

#[test]
fn a_fin_that_is_wanted_becomes_a_plate() {
    let (outcome, surface) = with_rule(&finned_box(), SheetRule::KeepFins, 7);
    assert_eq!(outcome.found.settle.fins.fins, 0);
    assert_eq!((outcome.mend.walled_shells, outcome.thickened.triangles), (2, 0));
    assert!(surface.proof.volume > 8.0);
}

/// An L-shaped post of two storeys, with a panel in its notch where they meet: held by two of its
/// four edges.
fn post_with_a_shelf() -> Vec<Corners> {
    // All corners are seen from the first one.
    let profile = [[1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
    let mut soup = prism(&profile, 0.0, 1.0);
    soup.extend(prism(&profile, 1.0, 2.0));
    soup.extend(panel([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    soup
}

#[test]
fn a_shelf_that_half_of_its_border_holds_is_no_fin() {
    let soup = post_with_a_shelf();
    // The floor between the storeys is there twice; where the shelf meets it, an odd number of
    // other triangles does, so one copy counts. Four of its edges are odd, and two of the shelf.
    let (outcome, surface) = with_rule(&soup, SheetRule::Thicken, 6);
    let found = outcome.found.settle;
    assert_eq!((found.rim_edges, found.interface_triangles), (6, 0));
    assert_eq!(found.fins.triangles, 0);
    let thick = outcome.mend.walled_triangles + outcome.thickened.triangles;
    assert_eq!(thick, 2, "it becomes a plate");
    assert!(surface.proof.volume > 6.0);
}

#[test]
fn walls_around_an_opening_are_no_fins() {
    let mut soup = cuboid([-1.0; 3], [1.0; 3]);
    let rim = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    for i in 0..4 {
        let (p, q) = (rim[i], rim[(i + 1) % 4]);
        let along = [q[0] - p[0], q[1] - p[1], 0.0];
        soup.extend(panel([p[0], p[1], 1.0], along, [0.0, 0.0, 0.1]));
    }
    let (outcome, _) = with_rule(&soup, SheetRule::Thicken, 6);
    assert!(outcome.found.settle.rim_edges > 0);
    assert_eq!(outcome.found.settle.fins.fins, 0, "walls are not flat");
}

#[test]
fn a_free_panel_becomes_a_plate_and_goes_only_on_demand() {
    let mut soup = cuboid([-1.0; 3], [0.0; 3]);
    soup.extend(panel([0.3, -1.0, -1.0], [0.0, 1.0, 0.1], [0.0, 0.1, 1.0]));
    let (kept, plates) = with_rule(&soup, SheetRule::Thicken, 6);
    assert_eq!(kept.found.settle.fins.triangles, 0);
    assert!(plates.proof.components > 1);
    let (gone, alone) = with_rule(&soup, SheetRule::Remove, 6);
    let fins = gone.found.settle.fins;
    assert_eq!((fins.free_sheets, fins.fins, fins.triangles), (1, 0, 2));
    assert!((fins.area - 1.0).abs() < 0.02, "{}", fins.area);
    assert_eq!(alone.proof.components, 1);
    assert!((alone.proof.volume - 1.0).abs() < 1e-6, "{}", alone.proof.volume);
}

#[test]
fn fins_are_found_alike_whatever_the_memory_and_the_threads() {
    same_whatever_the_limits(&finned_box(), &at_depth(7), |outcome| {
        assert_eq!(outcome.found.settle.fins.fins, 2);
    });
}

#[test]
fn a_sheet_of_many_triangles_was_made_on_purpose_and_stays() {
    let mut soup = cuboid([-1.0; 3], [1.0; 3]);
    // Strips that hang from an edge of the box, the first of which it shares.
    for strip in 0..40 {
        let z = 1.0 + 0.01 * f64::from(strip);
        soup.extend(panel([-1.0, -1.0, z], [2.0, 0.0, 0.0], [0.0, 0.0, 0.01]));
    }
    let (outcome, _) = with_rule(&soup, SheetRule::Thicken, 6);
    assert_eq!(outcome.found.settle.fins.triangles, 0);
}

#[test]
fn boxes_that_share_edges_stay_closed_beside_a_sheet() {
    // All four edges of the floor's underside lie on edges of the walls, so it is a sheet of its own.
    let walls = [
        ([0.0, 0.0, 0.0], [0.1, 1.0, 1.0]),
        ([0.9, 0.0, 0.0], [1.0, 1.0, 1.0]),
        ([0.0, 0.0, 0.0], [1.0, 0.1, 1.0]),
        ([0.0, 0.9, 0.0], [1.0, 1.0, 1.0]),
    ];
    let mut soup = cuboid([0.0; 3], [1.0, 1.0, 0.1]);
    walls.iter().for_each(|&(lo, hi)| soup.extend(cuboid(lo, hi)));
    let (_, alone) = repair_soup(&soup, &at_depth(6)).expect("a result");
    let corner = |x: f64, y: f64| [x, y, 1.5];
    let sheet = [corner(0.3, 0.3), corner(0.6, 0.3), corner(0.6, 0.6)];
    soup.push(sheet);
    let (outcome, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
    assert_eq!((outcome.mend.walled_shells, outcome.mend.walled_triangles), (1, 1));
    let slab = surface.proof.volume - alone.proof.volume;
    let expected = 0.045 * 2.0 * outcome.cell_size;
    assert!(slab > 0.7 * expected && slab < 1.3 * expected, "{slab} for {expected}");
}
