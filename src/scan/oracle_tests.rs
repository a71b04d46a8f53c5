//! Scan conversion against an independent answer: which faces the rims of a soup pierce.
//!
//! For a generic grid a face is odd exactly where the mod-2 boundary of the soup pierces it an odd
//! number of times. The rasteriser below walks boundary edges, scan conversion walks triangles;
//! all that they share is the snapped corners and the translation of the grid.

use std::collections::{BTreeMap, BTreeSet};

use crate::ingest::{fill_bins, read_soup, settle};
use crate::mesh::Attributes;
use crate::mesh::shapes::{
    Corners, ListedTriangles, Random, crumple, cuboid, sphere, tetrahedron, torus,
};
use crate::monitor::Void;
use crate::octree::{
    BrickKey, Domain, EdgeBits, HitEdge, SIDE, SnapBox, decode_hits, edge_position,
};
use crate::scan::{HAS_ODD_FACES, scan};
use crate::store::{Backing, BrickFile, NoCheckpoints, Resources, Scratch};

/// Normal and min corner of a face, in cells of the grid.
type Face = (usize, [i64; 3]);

/// Runs ingest and scan, and hands the bricks to `look`.
fn scanned<T>(soup: &[Corners], depth: u32, look: impl FnOnce(&BrickFile, &Domain) -> T) -> T {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let resources = Resources {
        scratch: &scratch,
        pool: &pool,
        share_bytes: 8 << 20,
        cached_windows: 4,
        backing: Backing::Memory,
        checkpoints: &NoCheckpoints,
        monitor: &Void,
    };
    let mut source = ListedTriangles::without_indices(soup.to_vec());
    let read = read_soup(&mut source, true, Attributes::NONE, &resources).expect("a sound soup");
    let domain = Domain::around(&read.facts.bounds, depth, false).expect("room enough");
    let triangles = read.facts.stats.triangles;
    let (bins, _) = fill_bins(read, &domain, &resources).expect("room on the disk");
    let settled = settle(&bins, &domain, triangles, &resources).expect("room");
    assert_eq!(settled.stats.duplicate_triangles, 0, "duplicates are another test's business");
    let soup = bins.without(&settled.drops);
    let (bricks, _) = scan(&soup, &domain, &resources).expect("room");
    look(&bricks, &domain)
}

/// The odd faces that the bricks see, also on their max sides.
fn odd_faces(bricks: &BrickFile) -> BTreeSet<Face> {
    let mut faces = BTreeSet::new();
    let mut marks = EdgeBits::default();
    for (number, entry) in bricks.directory().iter().enumerate() {
        let view = bricks.view(number).expect("readable");
        marks.clear();
        for edge in decode_hits(&view).expect("a hit brick").edges.iter() {
            let edge = HitEdge::from(edge);
            if edge.class() & 1 == 1 {
                marks.toggle(edge.edge());
            }
        }
        let base = BrickKey(entry.key).position().map(|c| i64::from(c) * SIDE as i64);
        let before = faces.len();
        for axis in 0..3 {
            for at in marks.odd_faces(axis).iter() {
                faces.insert((axis, std::array::from_fn(|a| base[a] + at[a] as i64)));
            }
        }
        let flagged = entry.flags & HAS_ODD_FACES != 0;
        assert_eq!(flagged, !marks.is_closed());
        assert!(flagged || faces.len() == before);
    }
    faces
}

/// Edges that an odd number of snapped triangles meets.
fn rims(soup: &[Corners], domain: &Domain) -> Vec<[[i64; 3]; 2]> {
    let mut counts: BTreeMap<[[i64; 3]; 2], u32> = BTreeMap::new();
    for corners in soup {
        let snapped = corners.map(|corner| domain.snap(corner).map(i64::from));
        for i in 0..3 {
            let (p, q) = (snapped[i], snapped[(i + 1) % 3]);
            *counts.entry([p.min(q), p.max(q)]).or_default() += 1;
        }
    }
    counts.into_iter().filter(|(_, count)| count % 2 == 1).map(|(edge, _)| edge).collect()
}

/// The faces that the segments pierce an odd number of times, on the grid moved by (e0, e1, e2).
fn pierced(segments: &[[[i64; 3]; 2]], cell: i64) -> BTreeSet<Face> {
    let mut faces = BTreeSet::new();
    for &[from, to] in segments {
        for axis in 0..3 {
            let run = to[axis] - from[axis];
            let (lo, hi) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            // The plane lies a hair above its number: at or above the low end, below the high one.
            let mut plane = lo.div_euclid(cell) + i64::from(lo.rem_euclid(cell) != 0);
            while plane * cell < hi {
                let mut at = [0; 3];
                at[axis] = plane;
                for across in (0..3).filter(|&a| a != axis) {
                    let rise = to[across] - from[across];
                    at[across] = cell_of(axis, across, from, run, rise, plane * cell, cell);
                }
                if !faces.insert((axis, at)) {
                    faces.remove(&(axis, at));
                }
                plane += 1;
            }
        }
    }
    faces
}

/// The cell along `across` in which a segment passes the plane: exact, ties by the moved grid.
fn cell_of(
    axis: usize,
    across: usize,
    from: [i64; 3],
    run: i64,
    rise: i64,
    plane: i64,
    cell: i64,
) -> i64 {
    let turn = i128::from(run.signum());
    let below = i128::from(run.abs());
    let above =
        i128::from(from[across]) * below + i128::from(plane - from[axis]) * i128::from(rise) * turn;
    let step = below * i128::from(cell);
    let number = above.div_euclid(step) as i64;
    if above.rem_euclid(step) != 0 {
        return number;
    }
    // On a line of the grid. The plane's own shift moves the point by e_axis * rise / run, the
    // line by e_across; the lower axis has the larger shift.
    let slope = i128::from(rise) * turn;
    let beyond = axis < across && slope > 0;
    if beyond { number } else { number - 1 }
}

fn assert_faces_agree(soup: &[Corners], depth: u32, name: &str) -> usize {
    scanned(soup, depth, |bricks, domain| {
        let expected = pierced(&rims(soup, domain), i64::from(domain.cell_units));
        let found = odd_faces(bricks);
        let wrong: Vec<_> = found.symmetric_difference(&expected).take(4).collect();
        assert!(wrong.is_empty(), "{name} at depth {depth}: {wrong:?} of {}", expected.len());
        found.len()
    })
}

fn holed(mut soup: Vec<Corners>, share: f64, random: &mut Random) -> Vec<Corners> {
    soup.retain(|_| random.share() >= share);
    soup
}

#[test]
fn odd_faces_are_those_that_the_rims_pierce() {
    let mut random = Random::new(2);
    let ball = sphere([0.0; 3], 1.0, 10);
    let soups = [
        ("holed sphere", holed(ball.clone(), 0.2, &mut random)),
        ("holed torus", holed(torus(1.0, 0.4, 24, 12), 0.1, &mut random)),
        ("torn sphere", holed(crumple(&ball, 0.4, &mut random), 0.3, &mut random)),
        ("one triangle", vec![[random.point(), random.point(), random.point()]]),
        ("triangles", (0..80).map(|_| [0; 3].map(|_| random.point())).collect()),
    ];
    for (name, soup) in &soups {
        for depth in [4, 5, 6, 7] {
            assert!(assert_faces_agree(soup, depth, name) > 0, "{name}");
        }
    }
    assert_eq!(assert_faces_agree(&crumple(&ball, 0.4, &mut random), 6, "closed"), 0);
}

/// Triangles whose corners all lie on corners, edge middles or face middles of the grid.
fn on_grid(depth: u32, step_cells: f64, random: &mut Random) -> Vec<Corners> {
    let unit = SnapBox { lo: [0.0; 3], hi: [1.0; 3] };
    let domain = Domain::around(&unit, depth, false).expect("room enough");
    let step = (f64::from(domain.cell_units) * step_cells) as i64;
    let cells = (domain.brick_units() >> 5) << depth;
    let count = cells / step;
    let mut corner = || loop {
        let units: [i64; 3] = std::array::from_fn(|_| random.below(count as usize) as i64 * step);
        let point = domain.to_model(units);
        if point.iter().all(|&c| (0.0..=1.0).contains(&c)) {
            return point;
        }
    };
    let mut soup: Vec<Corners> = (0..60).map(|_| [corner(), corner(), corner()]).collect();
    // Walls that lie in planes of the grid.
    let (lo, hi) = loop {
        let (p, q) = (corner(), corner());
        if (0..3).all(|a| p[a] < q[a]) {
            break (p, q);
        }
    };
    soup.extend(cuboid(lo, hi).into_iter().skip(3));
    soup.extend(tetrahedron([0.0; 3], 1.0 / 512.0));
    let far = tetrahedron([0.0; 3], 1.0 / 512.0);
    soup.extend(far.iter().map(|corners| corners.map(|c| c.map(|x| 1.0 - x))));
    soup
}

#[test]
fn odd_faces_agree_where_everything_lies_on_the_grid() {
    for seed in 0..12 {
        for (depth, step) in [(4, 1.0), (5, 1.0), (5, 0.5), (6, 0.25)] {
            let soup = on_grid(depth, step, &mut Random::new(seed));
            assert!(assert_faces_agree(&soup, depth, "on the grid") > 0);
        }
    }
}

/// Plates within one layer of cells; plate i of nine covers i + 1 ninths of the width.
fn plates() -> Vec<Corners> {
    let mut soup = Vec::new();
    for i in 0..9 {
        let x = f64::from(i) * 1e-4;
        let (y, up) = (f64::from(i + 1) / 9.0, i % 3 != 0);
        for corners in [[[0.0, 0.0], [y, 0.0], [y, 1.0]], [[0.0, 0.0], [y, 1.0], [0.0, 1.0]]] {
            let mut corners = corners.map(|[y, z]| [x, y, z]);
            if !up {
                corners.swap(1, 2);
            }
            soup.push(corners);
        }
    }
    soup
}

#[test]
fn edges_with_none_to_nine_hits_keep_their_parity() {
    let soup = plates();
    let mut seen = [0_u64; 10];
    scanned(&soup, 6, |bricks, domain| {
        let cell = i64::from(domain.cell_units);
        for (number, entry) in bricks.directory().iter().enumerate() {
            let view = bricks.view(number).expect("readable");
            let base = BrickKey(entry.key).position().map(|c| i64::from(c) * SIDE as i64);
            for edge in decode_hits(&view).expect("a hit brick").edges.iter() {
                let edge = HitEdge::from(edge);
                let sum = edge.signed_sum();
                let (axis, at) = edge_position(edge.edge());
                assert_eq!(axis, 0, "the plates are parallel to the other edges");
                let corner = std::array::from_fn(|a| (base[a] + at[a] as i64) * cell);
                let y = domain.to_model(corner)[1];
                let hit = |i: &i32| f64::from(i + 1) / 9.0 > y;
                let hits: Vec<i32> = (0..9).filter(hit).collect();
                assert_eq!(edge.class() & 1, hits.len() as u32 & 1, "{} hits", hits.len());
                assert_eq!(edge.class() > 1, hits.len() > 1);
                assert_eq!(edge.kept(), hits.len().min(3));
                let balance: i16 = hits.iter().map(|i| if i % 3 == 0 { -1 } else { 1 }).sum();
                assert_eq!(sum, balance);
                seen[hits.len()] += 1;
            }
        }
        let total: u64 = bricks.directory().len() as u64;
        assert!(total > 1, "several bricks");
    });
    assert!(seen[0] == 0 && seen[1..].iter().all(|&count| count > 0), "{seen:?}");
    assert!(assert_faces_agree(&soup, 6, "plates") > 0);
}
