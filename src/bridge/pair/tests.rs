//! Models that were pulled apart, joined and filled again.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use glam::DVec3;

use super::{RimEdge, Strips, join_rims};
use crate::bridge::fill::{FillOptions, RimLoop, fill_loop};
use crate::mesh::shapes::Random;

type Triangle = [DVec3; 3];
type Key = [u64; 3];

fn bits(point: DVec3) -> Key {
    (point + 0.0).to_array().map(f64::to_bits)
}

fn point(key: Key) -> DVec3 {
    DVec3::from_array(key.map(f64::from_bits))
}

/// Edges with an odd number of triangles, and the third corner of one of these.
fn odd_edges(triangles: &[Triangle]) -> BTreeMap<[Key; 2], DVec3> {
    let mut odd = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (bits(t[k]), bits(t[(k + 1) % 3]));
            let edge = [a.min(b), a.max(b)];
            if odd.remove(&edge).is_none() && a != b {
                odd.insert(edge, t[(k + 2) % 3]);
            }
        }
    }
    odd
}

/// Rims with the number of the sheet: triangles that share edges.
fn rim(triangles: &[Triangle]) -> Vec<RimEdge> {
    let mut sheets: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut of_edge = BTreeMap::<[Key; 2], Vec<usize>>::new();
    for (number, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (bits(t[k]), bits(t[(k + 1) % 3]));
            of_edge.entry([a.min(b), a.max(b)]).or_default().push(number);
        }
    }
    loop {
        let before = sheets.clone();
        for sharing in of_edge.values() {
            let least = sharing.iter().map(|&t| sheets[t]).min().expect("a triangle");
            sharing.iter().for_each(|&t| sheets[t] = least);
        }
        if before == sheets {
            break;
        }
    }
    let odd = odd_edges(triangles).into_iter();
    odd.map(|(ends, opposite)| RimEdge {
        ends: ends.map(point),
        opposite,
        sheet: sheets[of_edge[&ends][0]],
    })
    .collect()
}

/// Simple loops of edges of which every corner has an even number.
fn loops(odd: &BTreeMap<[Key; 2], DVec3>) -> Vec<Vec<DVec3>> {
    let mut at_corner = BTreeMap::<Key, BTreeSet<Key>>::new();
    for [a, b] in odd.keys() {
        at_corner.entry(*a).or_default().insert(*b);
        at_corner.entry(*b).or_default().insert(*a);
    }
    let mut found = Vec::new();
    let starts: Vec<Key> = at_corner.keys().copied().collect();
    for start in starts {
        let mut path = vec![start];
        while let Some(&corner) = path.last() {
            let Some(next) = at_corner.get_mut(&corner).and_then(BTreeSet::pop_first) else {
                assert_eq!(path.len(), 1, "a corner with an odd number of edges");
                break;
            };
            assert!(at_corner.get_mut(&next).expect("both ends").remove(&corner));
            if let Some(at) = path.iter().position(|&other| other == next) {
                found.push(path.drain(at..).map(point).collect());
            }
            path.push(next);
        }
    }
    found
}

fn length(odd: &BTreeMap<[Key; 2], DVec3>) -> f64 {
    odd.keys().map(|[a, b]| point(*a).distance(point(*b))).sum()
}

fn diameter(points: &[DVec3]) -> f64 {
    points.iter().flat_map(|a| points.iter().map(|b| a.distance(*b))).fold(0.0, f64::max)
}

struct Joined {
    strips: Strips,
    /// Length of what is open before and after.
    open: [f64; 2],
    longest_loop: f64,
    /// All triangles, with those that fill the loops.
    closed: Vec<Triangle>,
}

fn joined(triangles: &[Triangle], max_gap: f64) -> Joined {
    let before = odd_edges(triangles);
    let strips = join_rims(&rim(triangles), max_gap);
    let mut closed = triangles.to_vec();
    closed.extend(&strips.triangles);
    let after = odd_edges(&closed);
    let mut longest_loop = 0.0_f64;
    for points in loops(&after) {
        longest_loop = longest_loop.max(diameter(&points));
        let rim = RimLoop { opposite: vec![None; points.len()], points };
        let options = FillOptions { cell: max_gap / 2.0, crease_deg: 12.0 };
        closed.extend(fill_loop(&rim, &options).expect("a loop").triangles);
    }
    assert!(odd_edges(&closed).is_empty());
    Joined { strips, open: [length(&before), length(&after)], longest_loop, closed }
}

/// The volume that is inside by parity, by rays along an axis.
fn volume(triangles: &[Triangle], low: f64, high: f64) -> f64 {
    let (steps, size) = (60, high - low);
    let mut inside = 0.0;
    // Off the lattice of the models.
    let at = |i: i32| low + size * (f64::from(i) + 0.513_7) / f64::from(steps);
    for i in 0..steps {
        let x = at(i);
        let reaches = |t: &&Triangle| t.iter().any(|p| p.x < x) && t.iter().any(|p| p.x > x);
        let row: Vec<&Triangle> = triangles.iter().filter(reaches).collect();
        for j in 0..steps {
            let y = at(j) + 1e-5 * f64::from(i);
            let mut hits: Vec<f64> = row.iter().filter_map(|t| height_at(t, x, y)).collect();
            hits.sort_by(f64::total_cmp);
            inside += hits.chunks(2).map(|pair| pair[pair.len() - 1] - pair[0]).sum::<f64>();
        }
    }
    inside * (size / f64::from(steps)).powi(2)
}

fn height_at(&[a, b, c]: &Triangle, x: f64, y: f64) -> Option<f64> {
    let p = DVec3::new(x, y, 0.0);
    // The same for both triangles at an edge.
    let side = |a: DVec3, b: DVec3| {
        let swap = bits(a) > bits(b);
        let (a, b) = if swap { (b, a) } else { (a, b) };
        let side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        if swap { -side } else { side }
    };
    let [u, v, w] = [side(b, c), side(c, a), side(a, b)];
    let inside = u > 0.0 && v > 0.0 && w > 0.0 || u < 0.0 && v < 0.0 && w < 0.0;
    inside.then(|| (u * a.z + v * b.z + w * c.z) / (u + v + w))
}

fn grid(columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> Vec<Triangle> {
    let at = |i: u32, j: u32| at(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
    let cells = (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j)));
    let quads = cells.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// Faces of the unit cube, each cut into other rows and columns, moved outwards.
fn panels(apart: f64, cuts: impl Fn(usize) -> [u32; 2]) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for face in 0..6 {
        let (axis, side) = (face / 2, f64::from(face as u32 % 2));
        let [columns, rows] = cuts(face);
        triangles.extend(grid(columns, rows, |u, v| {
            let mut p = DVec3::splat(side * (1.0 + 2.0 * apart) - apart);
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            p
        }));
    }
    triangles
}

#[test]
fn a_cube_of_six_panels_that_were_pulled_apart_is_joined() {
    let gap = 0.02;
    for (name, model) in [
        ("one square each", panels(gap, |_| [1, 1])),
        ("many squares", panels(gap, |_| [9, 9])),
        ("no two alike", panels(gap, |face| [1 + 3 * face as u32, 17 - 2 * face as u32])),
    ] {
        let joined = joined(&model, 2.0 * gap);
        // Three-cornered loops are left at the corners.
        assert!(joined.longest_loop < 3.0 * gap, "{name}: {}", joined.longest_loop);
        assert!(joined.open[1] < 0.1 * joined.open[0], "{name}: {:?}", joined.open);
        assert!((joined.strips.length - joined.open[0]).abs() < 0.01, "{name}");
        let volume = volume(&joined.closed, -0.1, 1.1);
        let (least, most) = (1.0 + 6.0 * gap, (1.0 + 2.0 * gap).powi(3));
        assert!(volume > least - 0.01 && volume < most + 0.01, "{name}: {volume}");
    }
}

#[test]
fn a_ball_of_octants_that_were_pulled_apart_is_joined() {
    let gap = 0.03;
    for steps in [6, 24] {
        let mut model = Vec::new();
        for octant in 0..8_u32 {
            let sign =
                DVec3::from_array([0, 1, 2].map(|k| if octant >> k & 1 == 0 { 1.0 } else { -1.0 }));
            // Other numbers of rows, so that no corner faces another.
            let rows = steps + octant;
            let corner = |i: u32, j: u32| {
                let p = DVec3::new(f64::from(i), f64::from(j), f64::from(rows - i - j));
                (p.normalize() + gap / 2.0) * sign
            };
            for (i, j) in (0..rows).flat_map(|i| (0..rows - i).map(move |j| (i, j))) {
                model.push([corner(i, j), corner(i + 1, j), corner(i, j + 1)]);
                if i + j + 1 < rows {
                    model.push([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                }
            }
        }
        let joined = joined(&model, 2.0 * gap);
        assert!(joined.longest_loop < 3.0 * gap, "{steps} rows: {}", joined.longest_loop);
        assert!(joined.open[1] < 0.1 * joined.open[0], "{steps} rows: {:?}", joined.open);
        let volume = volume(&joined.closed, -1.1, 1.1);
        let ball = 2.0 / 3.0 * TAU;
        assert!(volume > 0.97 * ball && volume < 1.08 * ball, "{steps} rows: {volume}");
    }
}

#[test]
fn triangles_that_were_all_moved_a_little_are_joined() {
    for seed in 0..2 {
        let mut random = Random::new(seed);
        let mut model = panels(0.0, |_| [8, 8]);
        for corner in model.iter_mut().flatten() {
            *corner += DVec3::from_array(random.point()) * 0.003;
        }
        let joined = joined(&model, 0.02);
        assert!(joined.longest_loop < 0.06, "{}", joined.longest_loop);
        assert!((volume(&joined.closed, -0.1, 1.1) - 1.0).abs() < 0.02);
    }
}

#[test]
fn a_crack_that_opens_like_a_v_is_closed_from_its_tip_to_where_it_is_wide() {
    // Two halves of a sheet that meet at one end.
    let half = |side: f64| {
        move |u: f64, v: f64| DVec3::new(u, side * (0.05 * u + v * (1.0 - 0.05 * u)), 0.0)
    };
    let mut model = grid(20, 10, half(1.0));
    model.extend(grid(13, 7, half(-1.0)));
    let joined = joined(&model, 0.04);
    // It is 0.04 wide at 0.4.
    assert!((joined.strips.length - 0.8).abs() < 0.1, "{}", joined.strips.length);
}

#[test]
fn a_slot_is_closed_and_wider_openings_are_left_alone() {
    let sheet = |hole: fn(DVec3) -> bool| -> Vec<Triangle> {
        let all = grid(40, 40, |u, v| DVec3::new(u, v, 0.0));
        all.into_iter().filter(|t| !hole((t[0] + t[1] + t[2]) / 3.0)).collect()
    };
    let slot = sheet(|p| (p.x - 0.5).abs() < 0.012_6 + 0.012_5 && (p.y - 0.5).abs() < 0.3);
    let square = sheet(|p| (p.x - 0.5).abs() < 0.3 && (p.y - 0.5).abs() < 0.3);
    let round = sheet(|p| p.distance(DVec3::new(0.5, 0.5, 0.0)) < 0.04);
    assert!(!join_rims(&rim(&slot), 0.06).triangles.is_empty());
    for wanted in [slot, square, round] {
        assert_eq!(join_rims(&rim(&wanted), 0.04), Strips::default());
    }
}

#[test]
fn shelves_above_each_other_are_not_joined() {
    let mut model = grid(5, 5, |u, v| DVec3::new(u, v, 0.0));
    model.extend(grid(5, 5, |u, v| DVec3::new(u, v, 0.03)));
    assert_eq!(join_rims(&rim(&model), 0.05), Strips::default());
}

#[test]
fn the_order_of_the_edges_does_not_matter() {
    let model = panels(0.02, |face| [1 + face as u32, 4]);
    let mut edges = rim(&model);
    let once = join_rims(&edges, 0.04);
    edges.reverse();
    edges.iter_mut().step_by(2).for_each(|edge| edge.ends.reverse());
    assert_eq!(once, join_rims(&edges, 0.04));
    assert!(!once.triangles.is_empty());
}

#[test]
fn what_cannot_be_joined_is_left_alone() {
    let edges = rim(&panels(0.02, |_| [1, 1]));
    for gap in [0.0, -1.0, f64::NAN, 0.001] {
        assert_eq!(join_rims(&edges, gap), Strips::default());
    }
    assert_eq!(join_rims(&[], 1.0), Strips::default());
}
