//! The fill rule `nonzero`: cavities stay, overlaps unite, wrong normals are outvoted.

use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, sphere, transform};
use brickmend::repair::{Outcome, Settings};
use brickmend::sign::FillRule;
use glam::{DMat3, DVec3};

use crate::support::run::{at_depth, repair_soup, same_whatever_the_limits};
use crate::support::surface::Surface;

fn inverted(mut soup: Vec<Corners>) -> Vec<Corners> {
    soup.iter_mut().for_each(|corners| corners.swap(1, 2));
    soup
}

fn posed(soup: &[Corners], pose: usize, random: &mut Random) -> (Vec<Corners>, f64) {
    let scale = [1.0, 1e-6, 1e6][pose % 3];
    let turn = rotation(random) * DMat3::from_diagonal(DVec3::splat(scale));
    (transform(soup, turn, DVec3::from(random.point()) * scale), scale.powi(3))
}

fn wound(soup: &[Corners], depth: u32) -> (Outcome, Surface) {
    let settings = Settings { fill_rule: FillRule::Nonzero, ..at_depth(depth) };
    repair_soup(soup, &settings).expect("a result")
}

#[test]
fn a_cavity_stays_and_overlaps_unite_in_any_pose() {
    let hollow: Vec<Corners> =
        [cuboid([0.0; 3], [1.0; 3]), inverted(cuboid([0.2; 3], [0.8; 3]))].concat();
    let overlapping: Vec<Corners> =
        [cuboid([0.0; 3], [1.0; 3]), cuboid([0.5, 0.0, 0.0], [1.5, 1.0, 1.0])].concat();
    let mut random = Random::new(21);
    for pose in 0..6 {
        let (soup, unit) = posed(&hollow, pose, &mut random);
        let (outcome, surface) = wound(&soup, 6);
        assert!((surface.proof.volume / unit - 0.784).abs() < 4e-3, "pose {pose}");
        assert_eq!((surface.proof.components, outcome.votes.conflicts), (2, 0));
        // The other way around: the whole model is inside out.
        let (_, surface) = wound(&inverted(soup), 6);
        assert!((surface.proof.volume / unit - 0.784).abs() < 4e-3, "pose {pose}");
        let (soup, unit) = posed(&overlapping, pose, &mut random);
        let (_, surface) = wound(&soup, 6);
        assert!((surface.proof.volume / unit - 1.5).abs() < 6e-3, "pose {pose}");
        assert_eq!(surface.proof.components, 1);
    }
}

#[test]
fn a_few_wrong_normals_are_outvoted_and_many_make_it_solid() {
    let mut random = Random::new(22);
    let shell = [sphere([0.0; 3], 1.0, 24), inverted(sphere([0.0; 3], 0.6, 24))].concat();
    for (share, is_solid) in [(0.05, false), (0.5, true)] {
        let mut soup = shell.clone();
        for corners in &mut soup {
            if random.share() < share {
                corners.swap(1, 2);
            }
        }
        let (outcome, surface) = wound(&soup, 6);
        assert_eq!(outcome.votes.fell_back, is_solid);
        assert!(outcome.votes.conflicts > 0);
        assert_eq!(surface.proof.components, if is_solid { 1 } else { 2 });
    }
}

#[test]
fn a_thin_shell_keeps_its_hollow_where_the_grid_shows_it() {
    let soup = [cuboid([0.0; 3], [1.0; 3]), inverted(cuboid([0.02; 3], [0.98; 3]))].concat();
    let (_, surface) = wound(&soup, 8);
    let expected = 1.0 - 0.96_f64.powi(3);
    assert!((surface.proof.volume - expected).abs() < 1e-3, "{}", surface.proof.volume);
}

#[test]
fn votes_are_the_same_whatever_the_memory_and_the_threads() {
    let shell = [sphere([0.0; 3], 1.0, 24), inverted(sphere([0.0; 3], 0.6, 24))].concat();
    let settings = Settings { fill_rule: FillRule::Nonzero, ..at_depth(7) };
    same_whatever_the_limits(&shell, &settings, |outcome| assert!(outcome.votes.votes > 0));
}
