//! Panes neither seal nor hide: an oven behind its glass stays an oven.

use std::fmt::Write;
use std::path::PathBuf;

use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, transform};
use brickmend::repair::{Limits, Outcome, Settings};
use brickmend::sign::FillRule;
use glam::DVec3;

use crate::support::run::{Workshop, at_depth};
use crate::support::surface::Surface;

/// Thickness of the walls of an oven whose sides are 1.
const WALL: f64 = 0.1;
const WALLS_VOLUME: f64 = 1.0 - (1.0 - 2.0 * WALL) * (1.0 - 2.0 * WALL) * (1.0 - WALL);
const CONTENT_VOLUME: f64 = 0.027;

/// Five walls that overlap, open at the top.
fn oven() -> Vec<Corners> {
    let inner = 1.0 - WALL;
    let mut soup = cuboid([0.0; 3], [1.0, 1.0, WALL]);
    soup.extend(cuboid([0.0; 3], [WALL, 1.0, 1.0]));
    soup.extend(cuboid([inner, 0.0, 0.0], [1.0; 3]));
    soup.extend(cuboid([0.0; 3], [1.0, WALL, 1.0]));
    soup.extend(cuboid([0.0, inner, 0.0], [1.0; 3]));
    soup
}

fn content() -> Vec<Corners> {
    cuboid([0.3; 3], [0.6; 3])
}

/// A square at this height.
fn square([lo, hi]: [f64; 2], height: f64) -> Vec<Corners> {
    let [p, q, r, s] = [[lo, lo], [hi, lo], [hi, hi], [lo, hi]].map(|[x, y]| [x, y, height]);
    vec![[p, q, r], [p, r, s]]
}

/// Writes a soup with panes of this opacity.
fn write_with_panes(
    workshop: &Workshop,
    soup: &[Corners],
    panes: &[Corners],
    opacity: f64,
) -> PathBuf {
    let materials = format!("newmtl clear\nKd 1 1 1\nd {opacity}\nnewmtl steel\nKd 0.5 0.5 0.5\n");
    let library = workshop.write_text("mtl", &materials);
    let name = library.file_name().expect("a file").to_string_lossy().into_owned();
    let mut text = format!("mtllib {name}\n");
    let mut next = 1;
    for (material, triangles) in [("steel", soup), ("clear", panes)] {
        writeln!(text, "usemtl {material}").expect("strings grow");
        for corners in triangles {
            for [x, y, z] in corners {
                writeln!(text, "v {x} {y} {z}").expect("strings grow");
            }
            writeln!(text, "f {next} {} {}", next + 1, next + 2).expect("strings grow");
            next += 3;
        }
    }
    workshop.write_text("obj", &text)
}

/// Repairs a soup with panes of this opacity; the proof demands that cavities face inward.
fn repair_with_panes(
    soup: &[Corners],
    panes: &[Corners],
    opacity: f64,
    settings: &Settings,
) -> (Outcome, Surface) {
    let workshop = Workshop::new();
    let input = write_with_panes(&workshop, soup, panes, opacity);
    let repaired = workshop.repair(&input, "ply", settings, &Limits::default()).expect("a result");
    let rule = if opacity < 1.0 { FillRule::Nonzero } else { settings.fill_rule };
    let surface = Surface::read_proven(&repaired.path, rule);
    (repaired.outcome, surface)
}

#[test]
fn an_oven_behind_a_slab_of_glass_stays_hollow_with_what_is_in_it() {
    let soup = [oven(), content()].concat();
    let glass = cuboid([0.0, 0.0, 1.0], [1.0, 1.0, 1.06]);
    let mut random = Random::new(31);
    let settings = at_depth(7);
    for pose in 0..4 {
        let (turn, shift) = (rotation(&mut random), DVec3::from(random.point()));
        let place = |soup: &[Corners]| transform(soup, turn, shift);
        let (soup, glass) = (place(&soup), place(&glass));
        let (outcome, surface) = repair_with_panes(&soup, &glass, 0.3, &settings);
        let expected = WALLS_VOLUME + CONTENT_VOLUME + 0.06;
        let found = surface.proof.volume;
        assert!((found - expected).abs() < 2e-3, "{pose}: {found}, not {expected}");
        assert_eq!(outcome.hidden.hidden_bodies + outcome.hidden.sealed_bodies, 0, "{pose}");
        assert_eq!(outcome.input.stats.transparent_triangles, 12);
        // Opaque, it is a lid on a solid.
        let (_, surface) = repair_with_panes(&soup, &glass, 1.0, &settings);
        assert!((surface.proof.volume - 1.06).abs() < 2e-3, "{}", surface.proof.volume);
    }
}

#[test]
fn a_pane_without_thickness_becomes_a_slab_and_closes_nothing() {
    let soup = [oven(), content()].concat();
    // Set into the opening, on its border, and over all of the front.
    for (sides, height) in [([WALL, 1.0 - WALL], 0.8), ([WALL, 1.0 - WALL], 1.0), ([0.0, 1.0], 1.0)]
    {
        let pane = square(sides, height);
        let (outcome, surface) = repair_with_panes(&soup, &pane, 0.3, &at_depth(7));
        let (side, cell) = (sides[1] - sides[0], outcome.cell_size);
        let most = WALLS_VOLUME + CONTENT_VOLUME + side * side * 2.1 * cell;
        let least = WALLS_VOLUME + CONTENT_VOLUME + 0.64 * 0.9 * cell;
        let found = surface.proof.volume;
        assert!((least..most).contains(&found), "{height}: {found}, not {least} to {most}");
        assert_eq!(outcome.hidden.hidden_bodies + outcome.hidden.sealed_bodies, 0, "{height}");
    }
}

#[test]
fn a_box_without_thickness_behind_a_pane_gets_walls() {
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    soup.retain(|corners| corners.iter().any(|corner| corner[2] < 0.5));
    soup.extend(content());
    let pane = square([0.0, 1.0], 1.0);
    let (outcome, surface) = repair_with_panes(&soup, &pane, 0.3, &at_depth(7));
    let walls = 6.0 * 2.0 * outcome.cell_size;
    let found = surface.proof.volume - CONTENT_VOLUME;
    assert!(found > 0.8 * walls && found < 1.05 * walls, "{found} of {walls}");
    assert_eq!((outcome.mend.walled_shells, outcome.mend.filled_holes), (2, 0));
    let (_, surface) = repair_with_panes(&soup, &pane, 1.0, &at_depth(7));
    assert!((surface.proof.volume - 1.0).abs() < 2e-3, "{}", surface.proof.volume);
}

#[test]
fn a_pane_thinner_than_a_cell_is_thickened_whole() {
    let soup = [oven(), content()].concat();
    let mut thickened = 0;
    for step in 0..5 {
        // Where no corner of the grid lies in it, both of its sides get slabs, which overlap.
        let lo = 0.8 + 0.002 * f64::from(step);
        let pane = cuboid([WALL, WALL, lo], [1.0 - WALL, 1.0 - WALL, lo + 0.005]);
        let (outcome, surface) = repair_with_panes(&soup, &pane, 0.3, &at_depth(7));
        let glass = surface.proof.volume - WALLS_VOLUME - CONTENT_VOLUME;
        let cells = glass / (0.64 * outcome.cell_size);
        let is_thick = outcome.thickened.triangles > 0;
        let expected = if is_thick { 1.5..3.2 } else { 0.5..0.7 };
        assert!(expected.contains(&cells), "{lo}: {cells} cells of glass");
        assert_eq!(outcome.hidden.hidden_bodies + outcome.hidden.sealed_bodies, 0);
        thickened += u32::from(is_thick);
    }
    assert!((1..5).contains(&thickened), "{thickened}");
}

#[test]
fn limits_change_no_byte_of_what_lies_behind_panes() {
    let mut random = Random::new(37);
    let (turn, shift) = (rotation(&mut random), DVec3::from(random.point()));
    let place = |soup: &[Corners]| transform(soup, turn, shift);
    let soup = place(&[oven(), content()].concat());
    let glass = place(&square([0.0, 0.9], 1.0));
    let workshop = Workshop::new();
    let input = write_with_panes(&workshop, &soup, &glass, 0.3);
    let all = [
        Limits::default(),
        Limits { share_bytes: Some(16 << 10), ..Limits::default() },
        Limits { threads: 8, ..Limits::default() },
    ];
    let files = all.map(|limits| {
        let repaired = workshop.repair(&input, "ply", &at_depth(7), &limits).expect("a result");
        std::fs::read(&repaired.path).expect("it is there")
    });
    assert!(files.iter().all(|other| *other == files[0]));
}
