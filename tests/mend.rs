//! Openings: which are filled, which are wanted, and the walls that come of those.

use brickmend::mesh::shapes::{
    Corners, Random, cuboid, rotation, shuffle, sphere, torus, transform, volume,
};
use brickmend::repair::{MaxHole, Outcome, Reach, Settings};
use glam::{DMat3, DVec3};

use crate::support::run::{at_depth, repair_soup, same_whatever_the_limits};
use crate::support::surface::Surface;

/// A cube from 0 to 1 without the faces that look along these axes, up (1) or down (0).
fn cube_without(sides: &[(usize, usize)]) -> Vec<Corners> {
    let looks = |corners: &Corners| {
        let axis = (0..3).find(|&a| corners.iter().all(|c| c[a] == corners[0][a]));
        axis.map(|a| (a, corners[0][a] as usize))
    };
    let kept = |corners: &Corners| looks(corners).is_none_or(|side| !sides.contains(&side));
    cuboid([0.0; 3], [1.0; 3]).into_iter().filter(kept).collect()
}

/// The soup in some pose and scale, each triangle turned over at random; the scale.
fn posed(soup: &[Corners], pose: usize, random: &mut Random) -> (Vec<Corners>, f64) {
    let scale = [1.0, 1e-6, 1e6][pose % 3];
    let turn = rotation(random) * DMat3::from_diagonal(DVec3::splat(scale));
    let mut posed = transform(soup, turn, DVec3::from(random.point()) * scale);
    shuffle(&mut posed, random);
    for corners in &mut posed {
        if random.share() < 0.5 {
            corners.swap(1, 2);
        }
    }
    (posed, scale)
}

fn with_holes(soup: &[Corners], max_hole: MaxHole, depth: u32) -> (Outcome, Surface) {
    repair_soup(soup, &Settings { max_hole, ..at_depth(depth) }).expect("a result")
}

#[test]
fn a_box_without_a_lid_gets_walls_behind_its_faces_and_on_demand_a_lid() {
    let mut random = Random::new(3);
    for pose in 0..6 {
        let (soup, scale) = posed(&cube_without(&[(2, 1)]), pose, &mut random);
        let (outcome, surface) = with_holes(&soup, MaxHole::Auto, 7);
        let wall = 2.0 * outcome.cell_size / scale;
        let inner = (1.0 - 2.0 * wall).powi(2) * (1.0 - wall);
        let volume = surface.proof.volume / scale.powi(3);
        assert!((volume / (1.0 - inner) - 1.0).abs() < 1e-2, "pose {pose}: {volume}");
        // The tips of the rim may come off as specks; there is no tunnel in any wall.
        let (parts, euler) = (surface.proof.components, surface.proof.euler_characteristic);
        assert!(parts <= 3 && euler == 2 * parts as i64, "pose {pose}: {parts}, {euler}");
        assert_eq!((outcome.mend.walled_shells, outcome.mend.wanted_openings), (1, 1));
        let (outcome, surface) = with_holes(&soup, MaxHole::All, 7);
        let volume = surface.proof.volume / scale.powi(3);
        assert!((volume - 1.0).abs() < 1e-3, "pose {pose}: {volume}");
        assert_eq!((outcome.mend.filled_holes, outcome.mend.walled_shells), (1, 0));
        assert!((outcome.mend.filled_area / scale.powi(2) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn the_size_of_a_hole_decides_where_it_is_given() {
    let soup = cube_without(&[(2, 1)]);
    // The diagonal of the opening is 1.41.
    for (size, walls) in [(1.3, 1), (1.5, 0)] {
        let size = MaxHole::Size(Reach::Length(brickmend::repair::Length::Model(size)));
        let (outcome, _) = with_holes(&soup, size, 6);
        assert_eq!(outcome.mend.walled_shells, walls);
    }
}

#[test]
fn a_free_panel_becomes_a_plate_of_even_thickness_in_any_pose() {
    let mut random = Random::new(4);
    let square = vec![
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
    ];
    for pose in 0..6 {
        let (soup, scale) = posed(&square, pose, &mut random);
        for max_hole in [MaxHole::Auto, MaxHole::All] {
            let (outcome, surface) = with_holes(&soup, max_hole, 7);
            let thickness = 2.0 * outcome.cell_size / scale;
            let volume = surface.proof.volume / scale.powi(3);
            assert!((volume / thickness - 1.0).abs() < 1e-2, "pose {pose}: {volume}");
            assert_eq!((surface.proof.components, surface.proof.euler_characteristic), (1, 2));
        }
        let sheet_thickness = Reach::Length(brickmend::repair::Length::Model(0.1 * scale));
        let settings = Settings { sheet_thickness, ..at_depth(7) };
        let (_, surface) = repair_soup(&soup, &settings).expect("a result");
        let volume = surface.proof.volume / scale.powi(3);
        assert!((volume / 0.1 - 1.0).abs() < 1e-2, "pose {pose}: {volume}");
    }
}

#[test]
fn panels_that_meet_without_a_common_edge_are_one_box() {
    // Six panels, each on its own, a little short of where they meet; then five.
    let mut random = Random::new(6);
    let short = |soup: Vec<Corners>| -> Vec<Corners> {
        let centre =
            |pair: &[Corners]| pair.iter().flatten().map(|c| DVec3::from(*c)).sum::<DVec3>() / 6.0;
        let pairs = soup.chunks(2);
        pairs
            .flat_map(|pair| {
                let about = centre(pair);
                let shrink = move |c: [f64; 3]| (about + (DVec3::from(c) - about) * 0.999).into();
                pair.iter().map(|corners| corners.map(shrink)).collect::<Vec<Corners>>()
            })
            .collect()
    };
    for pose in 0..3 {
        let (soup, scale) = posed(&short(cuboid([0.0; 3], [1.0; 3])), pose, &mut random);
        let (outcome, surface) = with_holes(&soup, MaxHole::Auto, 6);
        let volume = surface.proof.volume / scale.powi(3);
        assert!((volume - 1.0).abs() < 0.01, "pose {pose}: {volume}");
        assert_eq!(outcome.mend.walled_shells, 0);
        let (soup, scale) = posed(&short(cube_without(&[(2, 1)])), pose, &mut random);
        let (outcome, surface) = with_holes(&soup, MaxHole::Auto, 6);
        let volume = surface.proof.volume / scale.powi(3);
        assert!(volume < 0.3, "pose {pose}: {volume}");
        assert_eq!((outcome.mend.walled_shells, surface.proof.components), (1, 1));
    }
}

#[test]
fn a_small_hole_is_filled_and_a_bowl_stays_a_bowl() {
    let ball = sphere([0.0; 3], 1.0, 24);
    let below = |height: f64| -> Vec<Corners> {
        ball.iter().copied().filter(|t| t.iter().all(|c| c[2] < height)).collect()
    };
    let (outcome, surface) = with_holes(&below(0.85), MaxHole::Auto, 7);
    let mend = &outcome.mend;
    assert_eq!((mend.filled_holes, mend.smooth_holes, mend.walled_shells), (1, 1, 0));
    assert_eq!(mend.widest_holes.len(), 1);
    let whole = surface.proof.volume / volume(&ball);
    assert!((whole - 1.0).abs() < 3e-3, "the fill bulges: {whole}");
    let (outcome, surface) = with_holes(&below(0.1), MaxHole::Auto, 6);
    assert_eq!((outcome.mend.filled_holes, outcome.mend.walled_shells), (0, 1));
    let wall = outcome.mend.walled_area * 2.0 * outcome.cell_size;
    assert!((surface.proof.volume / wall - 1.0).abs() < 0.1, "{}", surface.proof.volume);
}

#[test]
fn an_edge_that_runs_into_a_hole_is_continued() {
    // Where two faces of a cube meet, a piece of each is missing.
    let grid = |at: [f64; 3], u: [f64; 3], v: [f64; 3]| -> Vec<Corners> {
        let (at, u, v) = (DVec3::from(at), DVec3::from(u) / 8.0, DVec3::from(v) / 8.0);
        let corner = |i: u32, j: u32| at + u * f64::from(i) + v * f64::from(j);
        let squares =
            (0..64).map(|n| (n % 8, n / 8)).filter(|(i, j)| !(3..5).contains(i) || *j > 1);
        let cut = |(i, j)| {
            let [p, q, r, s] =
                [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[p, q, r].map(Into::into), [p, r, s].map(Into::into)]
        };
        squares.flat_map(cut).collect()
    };
    let sides: Vec<Corners> = cube_without(&[(2, 1), (1, 0)]);
    let mut soup = sides;
    soup.extend(grid([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    soup.extend(grid([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]));
    let (outcome, surface) = with_holes(&soup, MaxHole::Auto, 7);
    assert!(outcome.mend.filled_holes >= 1 && outcome.mend.walled_shells == 0);
    assert!((surface.proof.volume - 1.0).abs() < 1e-3, "{}", surface.proof.volume);
}

#[test]
fn holes_that_a_shape_is_meant_to_have_stay() {
    for max_hole in [MaxHole::Auto, MaxHole::All] {
        let (outcome, surface) = with_holes(&torus(1.0, 0.3, 32, 16), max_hole, 6);
        assert_eq!(surface.proof.euler_characteristic, 0);
        assert_eq!(outcome.mend.sheets, 0);
    }
}

#[test]
fn walls_are_the_same_whatever_the_memory_and_the_threads() {
    let soup = cube_without(&[(0, 0), (2, 1)]);
    same_whatever_the_limits(&soup, &at_depth(7), |outcome| {
        assert_eq!(outcome.mend.walled_shells, 1);
    });
}

#[test]
fn cracks_wider_than_a_cell_are_joined_wherever_the_grid_lies() {
    // The octants of a ball, pulled apart by a cell and a half.
    let ball = sphere([0.0; 3], 1.0, 32);
    let mut random = Random::new(14);
    for pose in 0..4 {
        let cell = 2.0 / 57.0;
        let pulled: Vec<Corners> = ball
            .iter()
            .map(|corners| {
                let middle = corners.iter().map(|c| DVec3::from(*c)).sum::<DVec3>();
                let away = middle.signum() * 0.75 * cell;
                corners.map(|corner| (DVec3::from(corner) + away).into())
            })
            .collect();
        let (soup, scale) = posed(&pulled, pose, &mut random);
        let (outcome, surface) = with_holes(&soup, MaxHole::Auto, 6);
        let whole = surface.proof.volume / scale.powi(3) / volume(&ball);
        assert!(whole > 0.97 && whole < 1.12, "pose {pose}: {whole}, {:?}", outcome.mend);
        assert_eq!((outcome.mend.walled_shells, surface.proof.components), (0, 1));
        assert!(outcome.mend.joined_length > 0.0);
        let settings = Settings { max_gap: Reach::Cells(0.0), ..at_depth(6) };
        let (apart, _) = repair_soup(&soup, &settings).expect("a result");
        assert_eq!(apart.mend.joined_length, 0.0);
    }
}
