//! All paths against the truth, against each other and against a search by brute force.

use super::*;
use crate::geom::qef::solve::force;
use glam::DQuat;
use nalgebra::{Matrix3, SymmetricEigen};
use proptest::prelude::*;

/// Uniform numbers in 0..1, the same every run.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.roll(), self.roll(), self.roll()) - 0.5
    }

    fn rotation(&mut self) -> DQuat {
        let (v, w) = (self.vector(), self.roll() - 0.5);
        DQuat::from_xyzw(v.x, v.y, v.z, w).normalize()
    }
}

/// Where the cell's edges leave the convex solid of half-spaces through `apex`.
fn hits_of_solid(normals: &[DVec3], apex: DVec3) -> Vec<Hit> {
    let depth = |at: DVec3, n: &DVec3| n.dot(at - apex);
    let inside = |at: DVec3| normals.iter().all(|n| depth(at, n) <= 0.0);
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) - 0.5;
    let mut hits = Vec::new();
    for (low, axis) in (0..8).flat_map(|i| (0..3).map(move |a| (i, a))) {
        if low >> axis & 1 == 1 || inside(corner(low)) == inside(corner(low | 1 << axis)) {
            continue;
        }
        let (mut from, mut to) = (corner(low), corner(low | 1 << axis));
        if inside(to) {
            (from, to) = (to, from);
        }
        let exit = normals
            .iter()
            .filter(|n| depth(to, n) > 0.0)
            .map(|n| (depth(from, n) / (depth(from, n) - depth(to, n)), *n))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("the far end is outside of one plane");
        hits.push(Hit { point: from + (to - from) * exit.0, normal: exit.1 });
    }
    hits
}

/// Eigenvalues of the hits' matrix, largest first.
fn eigenvalues(hits: &[Hit]) -> Vec<f64> {
    let mut m = Matrix3::zeros();
    for n in hits.iter().map(|hit| nalgebra::Vector3::from(hit.normal.to_array())) {
        m += n * n.transpose();
    }
    let mut values = SymmetricEigen::new(m).eigenvalues.as_slice().to_vec();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

fn mean(hits: &[Hit]) -> DVec3 {
    hits.iter().map(|hit| hit.point).sum::<DVec3>() / hits.len() as f64
}

/// The point on all planes through `apex` that is nearest to `from`.
fn nearest_on_planes(normals: &[DVec3], apex: DVec3, from: DVec3) -> DVec3 {
    match normals {
        [n] => from - *n * n.dot(from - apex),
        [a, b] => {
            let line = a.cross(*b).normalize();
            apex + line * line.dot(from - apex)
        }
        _ => apex,
    }
}

/// Forces every path over 1000 poses of a solid and compares with the truth.
fn check_every_path(normals: &[DVec3], closed: Path, seed: u64) {
    let options = QefOptions::default();
    let (mut dice, mut checked, mut tries) = (Dice(seed), 0, 0);
    while checked < 1000 {
        tries += 1;
        assert!(tries < 100_000, "only {checked} poses of {closed:?} could be checked");
        let (rotation, apex) = (dice.rotation(), dice.vector() * 0.9);
        let turned = normals.iter().map(|&n| rotation * n).collect::<Vec<_>>();
        let hits = hits_of_solid(&turned, apex);
        if !turned.iter().all(|n| hits.iter().any(|hit| hit.normal == *n)) {
            continue;
        }
        let values = eigenvalues(&hits);
        if values[normals.len() - 1] < 1.5 * options.cutoff() * values[0] {
            continue;
        }
        let truth = nearest_on_planes(&turned, apex, mean(&hits));
        for path in [closed, Path::Ldl, Path::Jacobi] {
            // Near the cut the closed corner may leave the decision to the eigenvalues.
            let Some(at) = force(&hits, path, &options) else {
                assert_eq!(path, Path::ThreePlanes);
                assert!(values[2] < 3.0 * options.cutoff() * values[0]);
                continue;
            };
            assert!((at - truth).length() < 1e-3, "{path:?}: {at} is not {truth}");
        }
        let solution = solve(&hits, &options);
        if truth.abs().max_element() < 0.499 {
            assert!((solution.position - truth).length() < 1e-3);
            assert_eq!(usize::from(solution.rank), normals.len());
            assert!(!solution.clamped);
        }
        checked += 1;
    }
}

fn around_z(deg: f64) -> DVec3 {
    DVec3::new(deg.to_radians().cos(), deg.to_radians().sin(), 0.0)
}

#[test]
fn flats_creases_and_corners_are_within_a_thousandth_on_every_path() {
    check_every_path(&[DVec3::X], Path::Plane, 1);
    for (i, deviation) in [20.0, 45.0, 90.0, 120.0, 150.0].into_iter().enumerate() {
        let wedge = [around_z(0.0), around_z(deviation)];
        check_every_path(&wedge, Path::TwoPlanes, 10 + i as u64);
        let prism = [DVec3::Z, wedge[0], wedge[1]];
        check_every_path(&prism, Path::ThreePlanes, 20 + i as u64);
    }
    check_every_path(&[DVec3::X, DVec3::Y, DVec3::Z], Path::ThreePlanes, 30);
}

#[test]
fn creases_below_the_angle_are_averaged_and_above_it_kept() {
    let options = QefOptions::default();
    for (deviation, rank) in [(11.5, 1), (12.5, 2)] {
        let normals = [around_z(90.0 - deviation / 2.0), around_z(90.0 + deviation / 2.0)];
        let point = |i: usize, x: f64| Hit {
            point: DVec3::new(x, -normals[i].x * x / normals[i].y, 0.1),
            normal: normals[i],
        };
        let hits = [point(0, 0.4), point(1, -0.4)];
        let solution = solve(&hits, &options);
        assert_eq!(solution.rank, rank);
        let reference = force(&hits, Path::Jacobi, &options).expect("the reference always answers");
        assert!((solution.position - reference).length() < 1e-12);
        assert_eq!(solution.path, if rank == 1 { Path::Jacobi } else { Path::TwoPlanes });
    }
}

#[test]
fn the_cut_off_is_the_squared_tangent_of_half_the_angle() {
    for deg in [0.1, 1.0, 12.0, 35.0, 60.0, 90.0] {
        let cutoff = QefOptions::new(deg, DVec3::NEG_ONE, DVec3::ONE).cutoff();
        let expected = (deg.to_radians() / 2.0).tan().powi(2);
        assert!((cutoff / expected - 1.0).abs() < 1e-14, "{deg}");
    }
    assert!(QefOptions::new(0.0, DVec3::NEG_ONE, DVec3::ONE).cutoff() > 0.0);
}

#[test]
fn axis_parallel_planes_keep_their_coordinates_bit_by_bit() {
    let (x, y, z) = (0.1 + 0.2 - 0.15, 1.0 / 3.0, -0.1 / 0.7);
    let mut hits = Vec::new();
    for (u, v) in [(0.1, 0.3), (-0.37, 0.21), (0.49, -0.5)] {
        hits.push(Hit { point: DVec3::new(u, v, z), normal: DVec3::NEG_Z });
    }
    assert_eq!(solve(&hits, &QefOptions::default()).position.z.to_bits(), z.to_bits());
    hits.push(Hit { point: DVec3::new(x, 0.3, 0.4), normal: DVec3::X });
    let crease = solve(&hits, &QefOptions::default());
    assert_eq!((crease.path, crease.position.x, crease.position.z), (Path::TwoPlanes, x, z));
    hits.push(Hit { point: DVec3::new(0.3, y, 0.1), normal: DVec3::Y });
    let corner = solve(&hits, &QefOptions::default());
    assert_eq!(corner.path, Path::ThreePlanes);
    assert_eq!(corner.position, DVec3::new(x, y, z));
    hits.push(Hit { point: corner.position, normal: DVec3::ONE.normalize() });
    let cut = solve(&hits, &QefOptions::default());
    assert_eq!((cut.path, cut.position), (Path::Ldl, DVec3::new(x, y, z)));
}

#[test]
fn planes_on_two_sides_leave_the_vertex_between_them() {
    let hits = [0.25, -0.35].map(|z| Hit { point: DVec3::new(0.5, 0.1, z), normal: DVec3::Z });
    let solution = solve(&hits, &QefOptions::default());
    assert_eq!((solution.path, solution.rank), (Path::Plane, 1));
    assert!((solution.position.z + 0.05).abs() < 1e-15);
}

#[test]
fn hits_without_normals_give_their_mean_or_nothing() {
    let point = DVec3::new(0.5, 0.25, -0.125);
    let options = QefOptions::new(12.0, DVec3::splat(-0.4), DVec3::splat(0.4));
    let solution = solve(&[Hit { point, normal: DVec3::ZERO }], &options);
    assert_eq!((solution.path, solution.rank, solution.clamped), (Path::Mass, 0, true));
    assert_eq!(solution.position, DVec3::new(0.4, 0.25, -0.125));
    let empty = solve(&[], &options);
    assert_eq!((empty.path, empty.position), (Path::Mass, DVec3::ZERO));
}

#[test]
fn a_quadric_solves_like_the_hits_it_was_made_of() {
    let mut dice = Dice(5);
    let hits = [0; 7].map(|_| Hit { point: dice.vector(), normal: dice.vector().normalize() });
    let mut qef = Qef::default();
    for hit in &hits {
        qef.add_plane(hit.point, hit.normal);
    }
    let options = QefOptions::default();
    let (whole, leaf) = (qef.solve(&options), solve(&hits, &options));
    assert_eq!(leaf.rank, whole.rank);
    assert!((whole.position - leaf.position).length() < 1e-4);
}

/// The least error of the quadric on a fine grid of the box.
fn least_error_on_grid(qef: &Qef, options: &QefOptions) -> f64 {
    let steps = 24_usize;
    let at = |i: usize, lo: f64, hi: f64| lo + (hi - lo) * i as f64 / steps as f64;
    let mut least = f64::INFINITY;
    for i in 0..(steps + 1).pow(3) {
        let [x, y, z] = [i, i / (steps + 1), i / (steps + 1).pow(2)].map(|k| k % (steps + 1));
        let (lo, hi) = (options.lo, options.hi);
        let point = DVec3::new(at(x, lo.x, hi.x), at(y, lo.y, hi.y), at(z, lo.z, hi.z));
        least = least.min(qef.error(point));
    }
    least
}

#[test]
fn no_grid_point_of_the_box_beats_a_clamped_vertex() {
    let mut dice = Dice(77);
    let mut clamped = [0; 4];
    for round in 0..600 {
        // A tiny cut-off keeps all that the grid sees; three or fewer planes leave ranks open.
        let lo = DVec3::new(-0.45, -0.4, -0.3);
        let options = QefOptions::new(0.02, lo, DVec3::new(0.2, 0.45, 0.4));
        let hits = (0..2 + round % 4)
            .map(|_| Hit { point: dice.vector(), normal: dice.vector().normalize() })
            .collect::<Vec<_>>();
        let mut qef = Qef::default();
        for hit in &hits {
            qef.add_plane(hit.point, hit.normal);
        }
        let solution = qef.solve(&options);
        assert!(qef.error(solution.position) <= least_error_on_grid(&qef, &options) + 1e-7);
        if solution.clamped {
            let border = |axis: usize| {
                let x = solution.position[axis];
                (x - options.lo[axis]).min(options.hi[axis] - x) < 1e-12
            };
            clamped[(0..3).filter(|&axis| border(axis)).count()] += 1;
        }
    }
    assert!(clamped[1..].iter().all(|&n| n > 5), "faces, edges, corners: {clamped:?}");
    assert_eq!(clamped[0], 0);
}

/// Normals that occur, and such that must not: zero, short, not a number.
fn any_normal() -> impl Strategy<Value = DVec3> {
    let unit = prop::array::uniform3(-1.0..1.0_f64)
        .prop_map(|n| DVec3::from_array(n).try_normalize().unwrap_or(DVec3::X));
    prop_oneof![
        4 => unit,
        2 => prop::sample::select(vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::Z, DVec3::NEG_Z]),
        1 => prop::sample::select(vec![DVec3::ZERO, DVec3::splat(1e-200), DVec3::NAN, DVec3::MAX]),
        1 => (-1e-5..1e-5_f64).prop_map(|e| DVec3::new(e, 1.0, -e).normalize()),
    ]
}

fn any_hits() -> impl Strategy<Value = Vec<Hit>> {
    let point = prop::array::uniform3(-0.5..=0.5_f64).prop_map(DVec3::from_array);
    prop::collection::vec(
        (point, any_normal()).prop_map(|(point, normal)| Hit { point, normal }),
        0..13,
    )
}

proptest! {
    #[test]
    fn every_vertex_is_finite_and_in_its_box(
        hits in any_hits(),
        crease_deg in 0.0..90.0_f64,
        margin in 1e-9..0.4_f64,
    ) {
        let hi = DVec3::splat(0.5 - margin);
        let options = QefOptions::new(crease_deg, -hi, hi);
        let at = solve(&hits, &options).position;
        prop_assert!(at.is_finite());
        prop_assert!(at.cmpge(options.lo).all() && at.cmple(options.hi).all());
    }

    #[test]
    fn broken_points_still_give_a_finite_vertex(
        mut hits in any_hits(),
        broken in prop::sample::select(vec![f64::NAN, f64::INFINITY, -1e300, 1e17]),
    ) {
        hits.push(Hit { point: DVec3::new(broken, 0.0, 0.1), normal: DVec3::X });
        let at = solve(&hits, &QefOptions::default()).position;
        prop_assert!(at.is_finite() && at.abs().max_element() <= 0.5);
    }

    #[test]
    fn the_chosen_path_agrees_with_the_reference(
        points in prop::collection::vec(prop::array::uniform3(-0.5..0.5_f64), 1..10),
        noise in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 10),
        which in prop::collection::vec(0_usize..3, 10),
        spread in prop::sample::select(vec![0.0, 0.01, 0.1, 0.5]),
    ) {
        let planes = [(1.0, 2.0, 3.0), (-2.0, 1.0, 0.5), (0.3, -1.0, 2.0)].map(DVec3::from);
        let hits = points.iter().enumerate().map(|(i, &point)| {
            let tilt = DVec3::from_array(noise[i]) * spread;
            let normal = (planes[which[i]].normalize() + tilt).normalize();
            Hit { point: DVec3::from_array(point), normal }
        }).collect::<Vec<_>>();
        let options = QefOptions::new(12.0, DVec3::splat(-50.0), DVec3::splat(50.0));
        let solution = solve(&hits, &options);
        let reference = force(&hits, Path::Jacobi, &options).expect("the reference always answers");
        let distance = (reference - mean(&hits)).length();
        prop_assert!((solution.position - reference).length() < 1e-3 * distance.max(1.0));
        let values = eigenvalues(&hits);
        let rank = values.iter().filter(|&&v| v > options.cutoff() * values[0]).count();
        let from_cut = |v: &f64| (v / values[0] / options.cutoff() - 1.0).abs();
        let on_the_cut = values.iter().any(|v| from_cut(v) < 1e-6);
        prop_assert!(on_the_cut || rank == usize::from(solution.rank));
    }
}

#[test]
fn smooth_cells_are_solved_as_by_eigenvalues() {
    let mut dice = Dice(9);
    let options = QefOptions::default();
    let mut solved = 0;
    for _ in 0..2000 {
        let axis = dice.vector().normalize_or(DVec3::X);
        let count = 4 + (dice.roll() * 6.0) as usize;
        let hits: Vec<Hit> = (0..count)
            .map(|_| {
                let tilt = dice.vector() * 0.1;
                let normal = (axis + tilt).normalize() * if dice.roll() < 0.5 { 1.0 } else { -1.0 };
                Hit { point: dice.vector() * 0.6, normal }
            })
            .collect();
        let Some(fast) = solve_smooth(&hits, &options) else { continue };
        let expected = solve(&hits, &options);
        if !expected.clamped && expected.rank == 1 {
            assert!((fast.position - expected.position).length() < 1e-6, "{fast:?} {expected:?}");
            solved += 1;
        }
    }
    assert!(solved > 1000, "{solved}");
}

#[test]
fn what_the_box_leaves_alone_is_found_without_it_and_nothing_else() {
    let mut dice = Dice(13);
    let options = QefOptions::default();
    let (mut inside, mut outside) = (0, 0);
    for _ in 0..20_000 {
        let count = (dice.roll() * 8.0) as usize;
        // Flat, bent and wild cells, some with normals that are not known.
        let (axis, tilt) = (dice.vector(), dice.roll() * 2.0);
        let hits: Vec<Hit> = (0..count)
            .map(|_| {
                let normal = (axis + dice.vector() * tilt).normalize_or(DVec3::X);
                let is_known = dice.roll() < 0.95;
                let normal = if is_known { normal } else { DVec3::ZERO };
                Hit { point: dice.vector() * 0.6, normal }
            })
            .collect();
        let expected = solve(&hits, &options);
        let found = solve_inside(&hits, &options);
        assert_eq!(found.is_some(), !expected.clamped, "{hits:?}");
        match found {
            Some(found) => {
                assert!((found - expected.position).length() < 1e-9, "{found:?} {expected:?}");
                inside += 1;
            }
            None => outside += 1,
        }
    }
    assert!(inside > 5000 && outside > 1000, "{inside} {outside}");
}

#[test]
fn planes_meet_where_their_quadric_is_least_or_not_in_the_box() {
    let mut dice = Dice(11);
    let options = QefOptions::default();
    let mut met = [0; 3];
    for _ in 0..20_000 {
        let count = 1 + (dice.roll() * 3.0) as usize;
        let planes: Vec<Hit> = (0..count)
            .map(|_| Hit { point: dice.vector(), normal: dice.vector().normalize_or(DVec3::X) })
            .collect();
        let expected = solve(&planes, &options);
        let found = meet(&planes, &options);
        assert_eq!(found.is_some(), !expected.clamped && usize::from(expected.rank) == count);
        if let Some(found) = found {
            assert!((found - expected.position).length() < 1e-6, "{found:?} {expected:?}");
            met[count - 1] += 1;
        }
    }
    assert!(met.iter().all(|count| *count > 500), "{met:?}");
}
