//! Fills of openings that were cut into surfaces whose truth is known.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use proptest::prelude::*;

use super::{
    Fill, FillKind, FillOptions, LONGEST_LOOP, MOST_TRIANGLES, RimLoop, fill_area, fill_loop,
};
use crate::mesh::shapes::Random;

/// A surface of which triangles can be taken.
#[derive(Default)]
struct Shell {
    triangles: Vec<[DVec3; 3]>,
}

fn bits(point: DVec3) -> [u64; 3] {
    // Negative zero is zero.
    (point + 0.0).to_array().map(f64::to_bits)
}

impl Shell {
    /// A grid of squares cut in two; `at` places its points.
    fn grid(columns: u32, rows: u32, at: impl Fn(u32, u32) -> DVec3) -> Self {
        let mut triangles = Vec::new();
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend(
                [[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && c != a),
            );
        }
        Self { triangles }
    }

    fn ball(segments: u32, rings: u32) -> Self {
        Self::grid(segments, rings, |i, j| {
            let (around, down) = (
                TAU * f64::from(i % segments) / f64::from(segments),
                PI * f64::from(j) / f64::from(rings),
            );
            if j == rings {
                return DVec3::NEG_Z;
            }
            if j == 0 {
                return DVec3::Z;
            }
            let r = down.sin();
            DVec3::new(-r * around.cos(), r * around.sin(), down.cos())
        })
    }

    /// Faces of the octahedron divided into squares of `steps`.
    fn geodesic(steps: u32) -> Self {
        let mut shell = Self::default();
        for signs in 0..8_u32 {
            let sign = |k: u32| if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
            let at = |i: u32, j: u32| {
                let (x, y) = (f64::from(i), f64::from(j));
                let p = DVec3::new(sign(0) * x, sign(1) * y, sign(2) * (f64::from(steps) - x - y));
                p.normalize()
            };
            let mut add = |t: [DVec3; 3]| {
                shell.triangles.push(if sign(0) * sign(1) * sign(2) > 0.0 {
                    t
                } else {
                    [t[0], t[2], t[1]]
                });
            };
            for (i, j) in (0..steps).flat_map(|i| (0..steps - i).map(move |j| (i, j))) {
                add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < steps {
                    add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        shell
    }

    fn tube(radius: f64, height: f64, around: u32, rows: u32) -> Self {
        Self::grid(around, rows, |i, j| {
            let angle = TAU * f64::from(i % around) / f64::from(around);
            let z = height * (f64::from(j) / f64::from(rows) - 0.5);
            DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        })
    }

    fn cube(steps: u32) -> Self {
        let mut shell = Self::default();
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let face = Self::grid(steps, steps, |i, j| {
                    let (mut u, mut v) =
                        (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    if side == 0.0 {
                        std::mem::swap(&mut u, &mut v);
                    }
                    let mut p = [0.0; 3];
                    p[axis] = side;
                    p[(axis + 1) % 3] = u;
                    p[(axis + 2) % 3] = v;
                    DVec3::from_array(p)
                });
                shell.triangles.extend(face.triangles);
            }
        }
        shell
    }

    /// The one loop around the triangles whose middles are chosen.
    fn opened(&self, chosen: impl Fn(DVec3) -> bool) -> RimLoop {
        let mut removed = BTreeMap::new();
        let mut kept = BTreeMap::new();
        for t in &self.triangles {
            let to = if chosen((t[0] + t[1] + t[2]) / 3.0) { &mut removed } else { &mut kept };
            for k in 0..3 {
                to.insert((bits(t[k]), bits(t[(k + 1) % 3])), t[(k + 2) % 3]);
            }
        }
        let mut next = BTreeMap::new();
        for &(a, b) in removed.keys() {
            if let Some(&opposite) = kept.get(&(b, a)) {
                assert!(next.insert(a, (b, opposite)).is_none(), "a pinched opening");
            }
        }
        let mut rim = RimLoop::default();
        let first = *next.keys().next().expect("an opening");
        let mut at = first;
        loop {
            let (to, opposite) = next[&at];
            rim.points.push(DVec3::from_array(at.map(f64::from_bits)));
            rim.opposite.push(Some(opposite));
            at = to;
            if at == first {
                break;
            }
        }
        assert_eq!(rim.points.len(), next.len(), "more than one opening");
        rim
    }
}

fn filled(rim: &RimLoop, cell: f64) -> Fill {
    let fill = fill_loop(rim, &FillOptions { cell, crease_deg: 12.0 }).expect("a loop");
    check_border(rim, &fill).expect("bounded by the rim");
    fill
}

/// Each edge of the rim once, in its direction; each inner edge once in either direction.
fn check_border(rim: &RimLoop, fill: &Fill) -> Result<(), String> {
    let mut edges = BTreeMap::<_, i32>::new();
    for t in &fill.triangles {
        for k in 0..3 {
            let (a, b) = (bits(t[k]), bits(t[(k + 1) % 3]));
            if a == b {
                return Err(format!("no length at {}", t[k]));
            }
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    let count = rim.points.len();
    for i in 0..count {
        let (a, b) = (bits(rim.points[i]), bits(rim.points[(i + 1) % count]));
        if edges.remove(&(a, b)) != Some(1) || edges.contains_key(&(b, a)) {
            return Err(format!("edge {i} of the rim"));
        }
    }
    for (&(a, b), &times) in &edges {
        if times != 1 || edges.get(&(b, a)) != Some(&1) {
            return Err(format!("an inner edge {times} times"));
        }
    }
    Ok(())
}

fn area(fill: &Fill) -> f64 {
    fill.triangles.iter().map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

/// The largest of a value over corners and middles of triangles.
fn worst(fill: &Fill, value: impl Fn(DVec3) -> f64) -> f64 {
    let places = fill.triangles.iter().flat_map(|&[a, b, c]| [a, b, c, (a + b + c) / 3.0]);
    places.map(value).fold(0.0, f64::max)
}

/// What a fill of a ball's opening deviates from the ball, where its edges are no longer than the
/// rim's: those lie below it.
fn ball_error(shell: &Shell, half_angle_deg: f64, axis: DVec3) -> f64 {
    let least = half_angle_deg.to_radians().cos();
    let rim = shell.opened(|p| p.normalize().dot(axis.normalize()) > least);
    let fill = filled(&rim, 0.03);
    assert_eq!(fill.kind, FillKind::Smooth);
    let on_rim: Vec<_> = rim.points.iter().map(|&p| bits(p)).collect();
    let corners = fill.triangles.iter().flatten().filter(|&&p| !on_rim.contains(&bits(p)));
    corners.map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max)
}

const TILTED: DVec3 = DVec3::new(0.3, 0.5, 0.8);

#[test]
fn a_hole_in_a_fine_ball_bulges_to_the_ball() {
    for shell in [Shell::ball(64, 48), Shell::geodesic(20)] {
        for axis in [DVec3::Z, TILTED] {
            for (degrees, most) in [(20.0, 0.002), (30.0, 0.002), (45.0, 0.003), (60.0, 0.003)] {
                let error = ball_error(&shell, degrees, axis);
                assert!(error < most, "{degrees} degrees: {error}");
            }
        }
    }
}

#[test]
fn a_hole_in_a_coarse_ball_bulges_about_to_the_ball() {
    // The triangles themselves lie up to 0.025 below the ball, and new corners do near the rim.
    for shell in [Shell::ball(16, 12), Shell::geodesic(6)] {
        for axis in [DVec3::Z, TILTED] {
            for (degrees, most) in [(30.0, 0.022), (60.0, 0.03)] {
                let error = ball_error(&shell, degrees, axis);
                assert!(error < most, "{degrees} degrees: {error}");
            }
        }
    }
    // Around the pole the rim is a circle of the ball, and little of it is lost.
    assert!(ball_error(&Shell::ball(16, 12), 30.0, DVec3::Z) < 0.01);
    assert!(ball_error(&Shell::ball(16, 12), 60.0, DVec3::Z) < 0.015);
}

#[test]
fn a_hole_in_the_wall_of_a_round_tube_goes_on_round() {
    let tube = Shell::tube(1.0, 4.0, 64, 40);
    for (half_angle, most) in [(0.5, 0.004), (1.0, 0.035)] {
        let rim = tube.opened(|p| p.y.atan2(p.x).abs() < half_angle && p.z.abs() < 0.7);
        let fill = filled(&rim, 0.03);
        assert_eq!(fill.kind, FillKind::Smooth);
        let error = worst(&fill, |p| (p.truncate().length() - 1.0).abs());
        assert!(error < most, "{half_angle}: {error}");
    }
}

#[test]
fn a_hole_in_the_wall_of_a_tube_of_few_facets_goes_on_in_facets() {
    for around in [8, 12, 16, 24] {
        let tube = Shell::tube(1.0, 4.0, around, 40);
        let rim = tube.opened(|p| p.y.atan2(p.x).abs() < 0.9 && p.z.abs() < 0.7);
        let fill = filled(&rim, 0.03);
        assert_eq!(fill.kind, FillKind::Flat);
        assert!(fill.creases > 0);
        // The middles of facets.
        let apothem = (PI / f64::from(around)).cos();
        for [a, b, c] in fill.triangles {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let is_line = normal == DVec3::ZERO;
            assert!(is_line || (normal.dot(a).abs() - apothem).abs() < 1e-9, "{normal}");
        }
    }
}

#[test]
fn holes_in_a_torus_are_continued_whatever_its_curvature() {
    let torus = Shell::grid(96, 48, |i, j| {
        let (a, b) = (TAU * f64::from(i % 96) / 96.0, TAU * f64::from(j % 48) / 48.0);
        let r = 2.0 + 0.8 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.8 * b.sin())
    });
    for (centre, radius) in
        [([2.8, 0.0, 0.0], 0.6), ([1.2, 0.0, 0.0], 0.45), ([2.0, 0.0, 0.8], 0.6)]
    {
        let rim = torus.opened(|p| p.distance(DVec3::from_array(centre)) < radius);
        let fill = filled(&rim, 0.05);
        assert_eq!(fill.kind, FillKind::Smooth);
        let error = worst(&fill, |p| ((p.truncate().length() - 2.0).hypot(p.z) - 0.8).abs());
        assert!(error < 0.015 * radius, "{centre:?}: {error}");
    }
}

#[test]
fn a_hole_in_a_saddle_is_continued() {
    let height = |p: DVec3| 0.5 * (p.x * p.x - p.y * p.y);
    let saddle = Shell::grid(40, 40, |i, j| {
        let p = DVec3::new(f64::from(i) / 20.0 - 1.0, f64::from(j) / 20.0 - 1.0, 0.0);
        p.with_z(height(p))
    });
    let rim = saddle.opened(|p| p.truncate().length() < 0.6);
    let fill = filled(&rim, 0.03);
    assert_eq!(fill.kind, FillKind::Smooth);
    assert!(worst(&fill, |p| (p.z - height(p)).abs()) < 0.002);
}

#[test]
fn holes_of_a_cube_are_filled_so_that_nothing_of_it_is_missing() {
    let cube = Shell::cube(8);
    let off_faces =
        |p: DVec3| (0..3).map(|k| p[k].abs().min((1.0 - p[k]).abs())).fold(1.0, f64::min);
    let near = |place: DVec3, radius: f64| move |p: DVec3| p.distance(place) < radius;
    let top = DVec3::new(0.5, 0.5, 1.0);
    let edge = DVec3::new(1.0, 0.5, 1.0);
    let corner = DVec3::ONE;
    let cases = [
        ("in a face", cube.opened(|p| p.z > 0.99 && near(top, 0.3)(p)), 0),
        ("up to an edge", cube.opened(|p| p.z > 0.99 && p.x > 0.75 && (p.y - 0.5).abs() < 0.25), 0),
        ("of a whole face", cube.opened(|p| p.z > 0.99), 0),
        ("over an edge", cube.opened(near(edge, 0.3)), 1),
        ("over a corner", cube.opened(near(corner, 0.4)), 3),
    ];
    for (name, rim, creases) in cases {
        let fill = filled(&rim, 0.03);
        assert_eq!((fill.kind, fill.creases), (FillKind::Flat, creases), "{name}");
        assert!(worst(&fill, off_faces) < 1e-12, "{name}");
        // What was taken away: the faces' squares of 1/64.
        let squares = area(&fill) * 64.0;
        assert!((squares * 2.0 - (squares * 2.0).round()).abs() < 1e-9, "{name}: {squares}");
    }
}

#[test]
fn a_hole_over_the_round_edge_of_a_can_goes_on_along_an_arc() {
    // The crease is known by the last facets around, which lie half a facet's angle off.
    for (around, most) in [(48, 0.02), (96, 0.01)] {
        let mut can = Shell::tube(1.0, 2.0, around, 24);
        let cap = Shell::grid(around, 12, |i, j| {
            let angle = TAU * f64::from(i % around) / f64::from(around);
            let radius = 1.0 - f64::from(j) / 12.0;
            if j == 12 {
                DVec3::Z
            } else {
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 1.0)
            }
        });
        can.triangles.extend(cap.triangles);
        let rim = can.opened(|p| p.distance(DVec3::new(1.0, 0.0, 1.0)) < 0.55);
        let fill = filled(&rim, 0.03);
        assert_eq!((fill.kind, fill.creases), (FillKind::Smooth, 1));
        let error = worst(&fill, |p| {
            let radius = p.truncate().length();
            (radius - 1.0).abs().min((p.z - 1.0).abs()).max(radius - 1.0).max(p.z - 1.0)
        });
        assert!(error < most, "{around}: {error}");
    }
}

#[test]
fn a_corner_that_was_cut_off_by_a_plane_is_there_again() {
    // Three edges, and three faces behind them.
    let points =
        vec![DVec3::new(0.7, 1.0, 1.0), DVec3::new(1.0, 0.7, 1.0), DVec3::new(1.0, 1.0, 0.7)];
    let opposite = vec![DVec3::Z, DVec3::X, DVec3::Y];
    let rim = RimLoop { points, opposite: opposite.into_iter().map(Some).collect() };
    let fill = filled(&rim, 0.01);
    assert_eq!((fill.triangles.len(), fill.creases), (3, 3));
    assert!(fill.triangles.iter().all(|t| t.iter().any(|p| p.distance(DVec3::ONE) < 1e-12)));
}

#[test]
fn lids_and_frustums_are_closed_flat() {
    for (around, slope) in [(4, 0.0), (64, 0.0), (6, 0.3), (64, 0.2)] {
        let count = around as usize;
        let ring = |z: f64| {
            let angle = |i: usize| TAU * (i % count) as f64 / f64::from(around);
            (0..count).map(move |i| {
                DVec3::new(
                    (1.0 - slope * z) * angle(i).cos(),
                    (1.0 - slope * z) * angle(i).sin(),
                    z,
                )
            })
        };
        let rim = RimLoop { points: ring(1.0).collect(), opposite: ring(0.75).map(Some).collect() };
        let fill = filled(&rim, 0.02);
        assert_eq!((fill.kind, fill.creases), (FillKind::Flat, 0), "{around} sides, slope {slope}");
        assert!(worst(&fill, |p| (p.z - 1.0).abs()) == 0.0);
    }
}

#[test]
fn a_gap_at_a_t_junction_is_closed_by_the_fewest_triangles() {
    for count in 1..40_u32 {
        let mut random = Random::new(count.into());
        let mut points = vec![DVec3::new(3.0, 1.0, 2.0), DVec3::new(4.0, 2.0, -1.0)];
        let along = points[0] - points[1];
        for i in 1..=count {
            let share = f64::from(i) / f64::from(count + 1);
            let jitter = DVec3::from_array(random.point()) * 1e-4;
            points.push(points[1] + along * share + jitter);
        }
        let rim = RimLoop { opposite: vec![Some(DVec3::ZERO); points.len()], points };
        let fill = filled(&rim, 0.05);
        assert_eq!(fill.triangles.len(), count as usize);
        assert_eq!(fill.kind, FillKind::Flat);
    }
}

#[test]
fn a_noisy_hole_in_a_flat_face_stays_about_flat() {
    let mut random = Random::new(3);
    let mut ring = |radius: f64| -> Vec<DVec3> {
        let angle = |i: u32| TAU * f64::from(i) / 90.0;
        (0..90)
            .map(|i| {
                let noise = DVec3::from_array(random.point()) * 0.01;
                DVec3::new(angle(i).cos(), angle(i).sin(), 0.0) * radius + noise
            })
            .collect()
    };
    let rim = RimLoop { points: ring(1.0), opposite: ring(1.1).into_iter().map(Some).collect() };
    // The noise is less than a cell, or more.
    for (cell, most) in [(0.1, 0.01), (0.01, 0.03)] {
        let fill = filled(&rim, cell);
        let error = worst(&fill, |p| p.z.abs());
        assert!(error < most, "{cell}: {error}");
    }
}

fn wave(count: u32, noise: f64) -> RimLoop {
    let mut random = Random::new(7);
    let angle = |i: u32| TAU * f64::from(i) / f64::from(count);
    let at = |i: u32, r: f64| {
        DVec3::new(r * angle(i).cos(), r * angle(i).sin(), 0.2 * (3.0 * angle(i)).sin())
    };
    RimLoop {
        points: (0..count).map(|i| at(i, 1.0) + DVec3::Z * random.within(-noise, noise)).collect(),
        opposite: (0..count).map(|i| Some(at(i, 1.1))).collect(),
    }
}

#[test]
fn long_rims_are_thinned_out_and_keep_every_edge() {
    for count in [129, 500, 1500, 8000] {
        let rim = wave(count, 0.002);
        let fill = filled(&rim, 0.01);
        assert_eq!(fill.kind, FillKind::Smooth);
        assert!(fill.triangles.len() <= MOST_TRIANGLES);
        assert!(fill_area(&rim) > PI && fill_area(&rim) < 1.3 * PI);
    }
    let beyond = wave(LONGEST_LOOP as u32 + 1, 0.0);
    assert!(fill_loop(&beyond, &FillOptions { cell: 0.01, crease_deg: 12.0 }).is_none());
}

#[test]
fn cells_that_are_far_too_small_do_not_make_more_triangles_than_allowed() {
    let fill = filled(&wave(64, 0.0), 1e-9);
    assert!(fill.triangles.len() <= MOST_TRIANGLES);
    let fill = filled(&wave(4000, 0.0), 1e-9);
    assert!(fill.triangles.len() <= MOST_TRIANGLES && fill.triangles.len() > MOST_TRIANGLES / 4);
}

#[test]
fn a_fill_smaller_than_a_few_cells_has_no_new_corners() {
    let fill = filled(&wave(30, 0.0), 1.5);
    assert_eq!((fill.kind, fill.triangles.len()), (FillKind::Coarse, 28));
}

#[test]
fn a_sphere_that_is_all_but_gone_is_not_invented() {
    // The tangents of its rim lead far away.
    let rim = Shell::geodesic(12).opened(|p| p.normalize().dot(TILTED.normalize()) > -0.8);
    let fill = filled(&rim, 0.03);
    let farthest = worst(&fill, |p| p.length());
    assert!(farthest < 1.05, "{farthest}");
    assert!(area(&fill) < 1.3 * fill_area(&rim));
}

#[test]
fn what_is_no_loop_is_refused() {
    let options = FillOptions { cell: 1.0, crease_deg: 12.0 };
    let rim =
        |points: &[DVec3]| RimLoop { points: points.to_vec(), opposite: vec![None; points.len()] };
    assert!(fill_loop(&rim(&[]), &options).is_none());
    assert!(fill_loop(&rim(&[DVec3::X, DVec3::Y]), &options).is_none());
    assert!(fill_loop(&rim(&[DVec3::X, DVec3::Y, DVec3::NAN]), &options).is_none());
    assert_eq!(fill_area(&rim(&[DVec3::X, DVec3::Y])), 0.0);
    assert_eq!(fill_area(&rim(&[DVec3::ZERO, DVec3::X, DVec3::Y])), 0.5);
}

/// The triangles of a fill as numbers of corners, in the order in which they come first.
fn numbered(fill: &Fill) -> (Vec<usize>, Vec<DVec3>) {
    let (mut numbers, mut places) = (BTreeMap::new(), Vec::new());
    let order = fill.triangles.iter().flatten().map(|&p| {
        *numbers.entry(bits(p)).or_insert_with(|| {
            places.push(p);
            places.len() - 1
        })
    });
    (order.collect(), places)
}

#[test]
fn a_loop_that_is_turned_moved_and_scaled_is_filled_alike() {
    let mut random = Random::new(11);
    let mut uneven = |p: DVec3, by: f64| p + DVec3::from_array(random.point()) * by;
    let ball = Shell::ball(40, 30).opened(|p| p.normalize().dot(TILTED.normalize()) > 0.8);
    let loops = [
        RimLoop { points: ball.points.iter().map(|&p| uneven(p, 0.01)).collect(), ..ball },
        RimLoop {
            points: wave(300, 0.0).points.iter().map(|&p| uneven(p, 0.004)).collect(),
            ..wave(300, 0.0)
        },
    ];
    for (rim, cell) in loops.iter().zip([0.04, 0.06]) {
        let (order, places) = numbered(&filled(rim, cell));
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.7).normalize(), 1.1);
        for (scale, by) in [
            (1.0, DVec3::ZERO),
            (1e-6, DVec3::ZERO),
            (1e6, DVec3::ZERO),
            (1.0, DVec3::splat(100.0)),
        ] {
            let change = |p: &DVec3| turn * *p * scale + by;
            let changed = RimLoop {
                points: rim.points.iter().map(change).collect(),
                opposite: rim.opposite.iter().map(|o| o.as_ref().map(change)).collect(),
            };
            let (same_order, moved) = numbered(&filled(&changed, cell * scale));
            assert!(
                order == same_order,
                "other triangles at scale {scale}, moved by {by}, {} edges",
                rim.points.len()
            );
            for (place, moved) in places.iter().zip(&moved) {
                assert!(change(place).distance(*moved) < 1e-6 * scale);
            }
        }
    }
}

/// Loops of many shapes: round, jagged, flat, tangled, with runs on a line.
fn any_loop() -> impl Strategy<Value = RimLoop> {
    let shape = (3..60_usize, 0..4_u32, any::<u64>(), 0.0..1.0_f64, 0.0..1.0_f64);
    shape.prop_map(|(count, family, seed, height, noise)| {
        let mut random = Random::new(seed);
        let mut points: Vec<DVec3> = (0..count)
            .map(|i| {
                let angle = TAU * i as f64 / count as f64;
                let random_point = DVec3::from_array(random.point());
                let round = DVec3::new(angle.cos(), angle.sin(), height * (2.0 * angle).cos());
                match family {
                    0 => round + random_point * noise * 0.2,
                    // Flat and jagged.
                    1 => (round * random.within(0.3, 1.0)).with_z(0.0),
                    // Tangled.
                    2 => random_point,
                    // On a lattice: long runs on a line.
                    _ => (round * 4.0).round() + DVec3::new(0.0, 0.0, random_point.z * 1e-3),
                }
            })
            .collect();
        let mut seen = std::collections::BTreeSet::new();
        points.retain(|&p| seen.insert(bits(p)));
        let opposite = points.iter().map(|p| {
            let known = random.share() < 0.8;
            let away = DVec3::from_array(random.point()) * noise;
            known.then_some(*p * 1.2 + away * 0.3)
        });
        RimLoop { opposite: opposite.collect(), points }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn every_fill_is_bounded_by_its_loop_exactly(rim in any_loop(), cell in 0.02..2.0_f64) {
        prop_assume!(rim.points.len() >= 3);
        let options = FillOptions { cell, crease_deg: 12.0 };
        let fill = fill_loop(&rim, &options).expect("a loop");
        prop_assert_eq!(check_border(&rim, &fill), Ok(()));
        prop_assert!(fill.triangles.len() <= MOST_TRIANGLES);
        prop_assert_eq!(&fill, &fill_loop(&rim, &options).expect("a loop"));
    }

    #[test]
    fn no_fill_strays_far_from_its_loop(rim in any_loop()) {
        prop_assume!(rim.points.len() >= 3);
        let fill = filled(&rim, 0.05);
        let centre = rim.points.iter().sum::<DVec3>() / rim.points.len() as f64;
        let farthest = rim.points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        // From the coarse fill by half of the diameter, which is at most twice the radius.
        prop_assert!(worst(&fill, |p| p.distance(centre)) <= 2.0 * farthest + 1e-9);
    }

    #[test]
    fn flat_loops_are_filled_in_their_plane(rim in any_loop(), normal in prop::array::uniform3(-1.0..1.0_f64)) {
        prop_assume!(rim.points.len() >= 3);
        let normal = DVec3::from_array(normal).normalize_or(DVec3::Z);
        let flat: Vec<_> = rim.points.iter().map(|p| p.reject_from_normalized(normal)).collect();
        let opposite = flat.iter().map(|p| Some(*p * 1.3)).collect();
        let rim = RimLoop { points: flat, opposite };
        let fill = filled(&rim, 0.05);
        prop_assert!(worst(&fill, |p| p.dot(normal).abs()) < 1e-12);
    }
}
