//! Parts that nobody sees: left out, named; kept where they are seen, or on demand.

use std::fmt::Write;
use std::path::PathBuf;

use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, sphere, transform};
use brickmend::repair::{HiddenRule, Limits, Outcome, Settings};
use glam::{DMat3, DVec3};

use crate::support::run::{Workshop, at_depth, repair_soup, same_whatever_the_limits};
use crate::support::surface::Surface;

/// Thickness of the walls of the boxes here, whose sides are 1.
const WALL: f64 = 0.1;

/// Five walls of a box, and a front of bars with openings of this width between them.
fn barred_box(opening: f64, bars: usize) -> Vec<Corners> {
    let inner = 1.0 - WALL;
    let mut soup = cuboid([0.0; 3], [1.0, 1.0, WALL]);
    soup.extend(cuboid([0.0, 0.0, inner], [1.0; 3]));
    soup.extend(cuboid([0.0; 3], [WALL, 1.0, 1.0]));
    soup.extend(cuboid([inner, 0.0, 0.0], [1.0; 3]));
    soup.extend(cuboid([0.0; 3], [1.0, WALL, 1.0]));
    let bar = (1.0 - (bars - 1) as f64 * opening) / bars as f64;
    for number in 0..bars {
        let at = number as f64 * (bar + opening);
        soup.extend(cuboid([at, inner, 0.0], [at + bar, 1.0, 1.0]));
    }
    soup
}

fn content() -> Vec<Corners> {
    cuboid([0.3; 3], [0.6; 3])
}

const CONTENT_VOLUME: f64 = 0.027;

/// Repairs a box with one opening and something in it, by itself and with its content; what is
/// left of the content, as a share of its volume.
fn content_left(case: &[Corners], content: &[Corners], settings: &Settings) -> (f64, Outcome) {
    let mut soup = case.to_vec();
    soup.extend_from_slice(content);
    let (outcome, surface) = repair_soup(&soup, settings).expect("a result");
    // The grid is the same: the content does not reach beyond the case.
    let (_, empty) = repair_soup(case, settings).expect("a result");
    (surface.proof.volume - empty.proof.volume, outcome)
}

#[test]
fn what_is_seen_through_a_slit_goes_and_what_is_seen_through_a_window_stays() {
    let settings = at_depth(7);
    for (opening, bars, stays) in [(0.01, 2, false), (0.3, 2, true), (0.03, 12, true)] {
        let (volume, outcome) = content_left(&barred_box(opening, bars), &content(), &settings);
        let left = volume / CONTENT_VOLUME;
        let expected = f64::from(u8::from(stays));
        assert!((left - expected).abs() < 0.02, "{opening}: {left}");
        let told = (outcome.hidden.hidden_bodies, outcome.hidden.hidden_triangles);
        assert_eq!(told, if stays { (0, 0) } else { (1, 12) }, "{opening}");
    }
}

#[test]
fn a_slit_hides_in_any_pose_and_whichever_way_triangles_face() {
    let mut random = Random::new(21);
    for scale in [1e-6, 1.0, 1e6] {
        let turn = rotation(&mut random) * DMat3::from_diagonal(DVec3::splat(scale));
        let shift = DVec3::from(random.point()) * scale;
        let mut place = |soup: &[Corners]| {
            let mut placed = transform(soup, turn, shift);
            for corners in placed.iter_mut().filter(|_| random.below(2) == 0) {
                corners.swap(0, 1);
            }
            placed
        };
        // Two cells, so that the outside comes in at any angle.
        let case = place(&barred_box(0.016, 2));
        let content = place(&content());
        let (volume, outcome) = content_left(&case, &content, &at_depth(7));
        assert!(volume.abs() < 1e-3 * scale.powi(3), "{scale}: {volume}");
        assert_eq!(outcome.hidden.hidden_bodies + outcome.hidden.sealed_bodies, 1, "{scale}");
    }
}

#[test]
fn bars_at_any_distance_leave_a_sound_box() {
    let cell = 1.0 / 57.0;
    for (cells, stays) in [(0.7, false), (1.5, true), (3.0, true)] {
        let bars = (0.5 / (cells * cell)) as usize;
        let case = barred_box(cells * cell, bars);
        let (volume, outcome) = content_left(&case, &content(), &at_depth(6));
        let left = volume / CONTENT_VOLUME;
        assert!(left < 1.05, "{cells}: {left}");
        if stays {
            assert!(left > 0.95, "{cells}: {left}");
            assert_eq!(outcome.hidden.hidden_bodies, 0, "{cells}");
        }
    }
}

#[test]
fn on_demand_hidden_parts_stay() {
    let settings = Settings { hidden: HiddenRule::Keep, ..at_depth(7) };
    let (volume, outcome) = content_left(&barred_box(0.02, 2), &content(), &settings);
    assert!((volume / CONTENT_VOLUME - 1.0).abs() < 0.02, "{volume}");
    assert_eq!(outcome.hidden, Default::default());
}

#[test]
fn what_is_sealed_in_is_told_and_goes_by_the_fill_rule() {
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    soup.extend(sphere([0.5; 3], 0.2, 12));
    soup.extend(cuboid([0.1; 3], [0.2; 3]));
    let (outcome, surface) = repair_soup(&soup, &at_depth(6)).expect("a result");
    assert!((surface.proof.volume - 1.0).abs() < 1e-3);
    let hidden = &outcome.hidden;
    assert_eq!((hidden.bodies, hidden.sealed_bodies, hidden.hidden_bodies), (3, 2, 0));
    let [ball, cube] = &hidden.largest[..] else { panic!("two bodies are told of") };
    assert!(ball.is_sealed && ball.area > cube.area && cube.triangles == 12);
    assert!(cube.lo.iter().chain(&cube.hi).all(|c| (0.1..=0.2).contains(c)));
}

#[test]
fn what_lies_within_a_hidden_part_goes_with_it() {
    let mut within = content();
    within.extend(sphere([0.45; 3], 0.1, 12));
    let (volume, outcome) = content_left(&barred_box(0.01, 2), &within, &at_depth(7));
    assert!(volume.abs() < 1e-3, "{volume}");
    assert_eq!((outcome.hidden.hidden_bodies, outcome.hidden.sealed_bodies), (1, 1));
}

/// The triangles of a cuboid, each a little smaller.
fn apart(soup: &[Corners]) -> Vec<Corners> {
    let smaller = |corners: &Corners| {
        let [p, q, r] = corners.map(DVec3::from);
        let middle = (p + q + r) / 3.0;
        [p, q, r].map(|corner| corner.lerp(middle, 0.02).to_array())
    };
    soup.iter().map(smaller).collect()
}

/// An OBJ file of parts with names.
fn write_parts(workshop: &Workshop, parts: &[(&str, Vec<Corners>)]) -> PathBuf {
    let mut text = String::new();
    let mut next = 1;
    for (name, soup) in parts {
        writeln!(text, "o {name}").expect("strings grow");
        for [p, q, r] in soup {
            for [x, y, z] in [p, q, r] {
                writeln!(text, "v {x} {y} {z}").expect("strings grow");
            }
            writeln!(text, "f {next} {} {}", next + 1, next + 2).expect("strings grow");
            next += 3;
        }
    }
    workshop.write_text("obj", &text)
}

#[test]
fn hidden_parts_are_named_and_open_pieces_of_one_part_go_together_or_not_at_all() {
    let workshop = Workshop::new();
    // Cracks too narrow for the grid stay as they are, so the pieces stay open.
    let parts = |y: f64| {
        let loose = cuboid([0.6, y, 0.2], [0.7, y + 0.1, 0.3]);
        [
            ("case", barred_box(0.01, 2)),
            ("open", [apart(&content()), apart(&loose)].concat()),
            ("ball", sphere([0.75; 3], 0.1, 8)),
        ]
    };
    for (y, expected) in [(0.65, 2), (1.1, 1)] {
        let input = write_parts(&workshop, &parts(y));
        let repaired =
            workshop.repair(&input, "ply", &at_depth(7), &Limits::default()).expect("a result");
        drop(Surface::read_proven(&repaired.path, Default::default()));
        let hidden = repaired.outcome.hidden;
        let names: Vec<&str> = hidden.largest.iter().map(|body| body.part.as_str()).collect();
        assert_eq!(hidden.hidden_bodies, expected, "{y}: {names:?}");
        assert!(names.contains(&"ball") && !names.contains(&"case"), "{y}: {names:?}");
        assert_eq!(names.contains(&"open"), expected == 2, "{y}: {names:?}");
    }
}

#[test]
fn what_is_left_out_is_the_same_whatever_the_memory_and_the_threads() {
    let mut soup = barred_box(0.01, 2);
    soup.extend(content());
    soup.extend(sphere([0.75; 3], 0.1, 16));
    let look = |outcome: &Outcome| assert_eq!(outcome.hidden.hidden_bodies, 2);
    same_whatever_the_limits(&soup, &at_depth(7), look);
}
