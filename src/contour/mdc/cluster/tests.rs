//! The tree of pieces against brute force: counts, Euler characteristics, and what is refused.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::*;
use crate::contour::mdc::cell::{edges_of_mask, lower_end};
use crate::contour::mdc::table::axis_of_edge;
use crate::mesh::shapes::Random;
use crate::octree::{CornerBits, LINES};

const CELL_UNITS: i64 = 1 << 12;

/// A brick of cells over a field of signs, every component in the middle of its crossings, and the
/// plane of every crossing from `plane_at`.
fn brick_of(
    is_inside: impl Fn([usize; 3]) -> bool,
    plane_at: impl Fn(DVec3) -> CellPlane,
) -> (CellBrick, Leaves) {
    let (mut brick, mut leaves) = (CellBrick::default(), Leaves::default());
    for number in 0..SIDE * SIDE * SIDE {
        let at = place_of(number);
        let corner = |bits: usize| is_inside([0, 1, 2].map(|a| at[a] + (bits >> a & 1)));
        let mask = (0..8).fold(0_u32, |mask, bits| mask | u32::from(corner(bits)) << bits);
        if mask == 0 || mask == 255 {
            continue;
        }
        let cell = number as u32 | mask << 15;
        brick.cells.push(cell);
        leaves.components.push(brick.positions.len() as u32);
        let components = components_of(cell);
        for &edges in &components.edge_masks[..usize::from(components.count)] {
            leaves.hit_starts.push(leaves.hits.len() as u32);
            let mut sum = DVec3::ZERO;
            for edge in (0..12).filter(|edge| edges >> edge & 1 == 1) {
                let mut point = DVec3::from(lower_end(at.map(|c| c as i32), edge).map(f64::from));
                point[usize::from(axis_of_edge(edge))] += 0.5;
                sum += point;
                leaves.planes.push(plane_at(point));
                let plane = leaves.planes.len() as u32 - 1;
                leaves.hits.push(PlaneHit { plane, point: point.as_vec3().to_array() });
            }
            let middle = sum / f64::from(edges.count_ones()) * CELL_UNITS as f64;
            brick.positions.push(middle.to_array().map(|c| c as i32));
        }
    }
    leaves.components.push(brick.positions.len() as u32);
    leaves.hit_starts.push(leaves.hits.len() as u32);
    (brick, leaves)
}

fn options(threshold_cells: f64) -> ClusterOptions {
    ClusterOptions {
        threshold_cells,
        qef: QefOptions::default(),
        cell_units: CELL_UNITS,
        inset_units: 2,
    }
}

/// A plane that every vertex is on: shape alone decides.
fn anywhere(_: DVec3) -> CellPlane {
    CellPlane { normal: DVec3::ZERO, offset: 0.0 }
}

/// Vertices, edges and faces of the leaf polygons' dual pieces in a cell: V - E + F of each.
fn euler_of_pieces(brick: &CellBrick, low: [usize; 3], side: usize) -> Vec<i32> {
    let held = |at: [usize; 3]| (0..3).all(|a| (low[a]..low[a] + side).contains(&at[a]));
    let mut pieces: Vec<(usize, u8)> = Vec::new();
    let mut number_of = HashMap::new();
    for (rank, &cell) in brick.cells.iter().enumerate() {
        if held(place_of(cell_number(cell))) {
            for component in 0..components_of(cell).count {
                number_of.insert((rank, component), pieces.len());
                pieces.push((rank, component));
            }
        }
    }
    let mut joined: Vec<u32> = (0..pieces.len() as u32).collect();
    let rank_at = |at: [usize; 3]| {
        brick.cells.binary_search_by_key(&number_at(at), |cell| cell_number(*cell)).ok()
    };
    // A leaf patch is a face, crossed edges are its corners, segments on faces its sides.
    let mut corners = vec![HashSet::new(); pieces.len()];
    let mut sides = vec![HashSet::new(); pieces.len()];
    for (number, &(rank, component)) in pieces.iter().enumerate() {
        let cell = brick.cells[rank];
        let at = place_of(cell_number(cell));
        let table = components_of(cell);
        let ends = |edge: u8| (axis_of_edge(edge), lower_end(at.map(|c| c as i32), edge));
        for edge in edges_of_mask(table.edge_masks[usize::from(component)]) {
            corners[number].insert(ends(edge));
        }
        for face in 0..6 {
            for &[a, b] in segments_on(cell, face).pairs() {
                if table.component_of_edge[usize::from(a)] != component {
                    continue;
                }
                let mut side = [ends(a), ends(b)];
                side.sort_unstable();
                sides[number].insert(side);
                let mut beyond = at;
                if face % 2 == 1 || at[face / 2] == 0 {
                    continue;
                }
                beyond[face / 2] -= 1;
                if held(beyond) {
                    let other = rank_at(beyond).expect("a crossed face has two cells");
                    let there = components_of(brick.cells[other]);
                    let component = there.component_of_edge[usize::from(edge_below(a, face / 2))];
                    unite(&mut joined, number as u32, number_of[&(other, component)] as u32);
                }
            }
        }
    }
    let mut whole: HashMap<u32, (HashSet<_>, HashSet<_>, i32)> = HashMap::new();
    for number in 0..pieces.len() {
        let root = find(&mut joined, number as u32);
        let entry = whole.entry(root).or_default();
        entry.0.extend(corners[number].iter().copied());
        entry.1.extend(sides[number].iter().copied());
        entry.2 += 1;
    }
    let mut all: Vec<i32> =
        whole.values().map(|(v, e, f)| v.len() as i32 - e.len() as i32 + f).collect();
    all.sort_unstable();
    all
}

/// Noise without two-sided faces that meet: signs of a few random balls and slabs.
fn blobs(random: &mut Random) -> impl Fn([usize; 3]) -> bool + use<> {
    let balls: Vec<(DVec3, f64)> =
        (0..12).map(|_| (DVec3::from(random.point()) * 32.0, random.within(1.0, 6.0))).collect();
    move |at| {
        let at = DVec3::from(at.map(|c| c as f64));
        balls.iter().filter(|(centre, radius)| at.distance(*centre) < *radius).count() % 2 == 1
    }
}

#[test]
fn euler_characteristics_by_increments_are_those_by_brute_force() {
    let mut random = Random::new(5);
    let mut compared = 0;
    for _ in 0..8 {
        let (brick, leaves) = brick_of(blobs(&mut random), anywhere);
        let mut clustering = Clustering::new(options(1.0));
        for (rank, &cell) in brick.cells.iter().enumerate() {
            clustering.ranks[cell_number(cell)] = rank as u16;
        }
        for level in 1..=3_u32 {
            for number in 0..(SIDE * SIDE * SIDE) >> (3 * level) {
                let start =
                    brick.cells.partition_point(|c| cell_number(*c) >> (3 * level) < number);
                let end = brick.cells.partition_point(|c| cell_number(*c) >> (3 * level) <= number);
                if start == end {
                    continue;
                }
                let mut copy = brick.clone();
                let positions = std::mem::take(&mut copy.positions);
                let mut cut =
                    Cut { brick: &mut copy, leaves: &leaves, positions, placed: Vec::new() };
                clustering.nodes.clear();
                clustering.groups.clear();
                clustering.node_of = vec![0; brick.positions.len()];
                let cell = Cell { level, number, leaves: start..end };
                if !clustering.visit(&mut cut, &cell) {
                    continue;
                }
                let mut found: Vec<i32> = clustering.nodes.iter().map(|node| node.euler).collect();
                found.sort_unstable();
                let low = place_of(number << (3 * level));
                assert_eq!(found, euler_of_pieces(&brick, low, 1 << level), "{low:?} {level}");
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "only {compared} cells");
}

#[test]
fn a_flat_brick_is_one_vertex_and_none_of_its_cells_if_that_is_banned() {
    let plane = |_: DVec3| CellPlane { normal: DVec3::Z, offset: 10.5 };
    let (mut brick, leaves) = brick_of(|at| at[2] <= 10, plane);
    let mut clustering = Clustering::new(options(0.01));
    let unclustered = brick.clone();
    clustering.cut(&mut brick, &leaves);
    assert_eq!((brick.clusters.len(), brick.positions.len()), (1, 1));
    assert_eq!(i64::from(brick.positions[0][2]), CELL_UNITS * 21 / 2);
    let mut banned = CellBrick { banned: vec![5 << 15], ..unclustered };
    clustering.cut(&mut banned, &leaves);
    assert_eq!((banned.clusters.len(), banned.positions.len()), (4, 4));
}

#[test]
fn a_lip_of_one_cell_on_a_plate_is_no_part_of_a_cluster() {
    // Flat at 10.5, and a step of one cell up in a corner of the brick.
    let is_lip = |at: DVec3| at.x > 27.0 && at.y > 27.0;
    let plane = |at: DVec3| {
        if is_lip(at) && at.z > 10.6 {
            let side = at.z < 11.4;
            let normal =
                if side { if at.x < 28.0 { DVec3::X } else { DVec3::Y } } else { DVec3::Z };
            return CellPlane { normal, offset: normal.dot(at) };
        }
        CellPlane { normal: DVec3::Z, offset: 10.5 }
    };
    let is_inside = |at: [usize; 3]| at[2] <= 10 || (at[2] <= 11 && at[0] >= 28 && at[1] >= 28);
    let (mut brick, leaves) = brick_of(is_inside, plane);
    Clustering::new(options(0.1)).cut(&mut brick, &leaves);
    assert!(!brick.clusters.is_empty());
    let tops = brick.positions.iter().filter(|p| i64::from(p[2]) == CELL_UNITS * 23 / 2).count();
    assert!(tops > 0, "the lip's own plane has vertices");
    for cluster in &brick.clusters {
        let (first, level) = ((cluster & 0x7fff) as usize, cluster >> 15 & 7);
        let (low, side) = (place_of(first), 1 << level);
        let has_step = (0..2).all(|a| low[a] <= 27 && 27 < low[a] + side) && side > 8;
        assert!(!has_step, "a cluster at {low:?} of {side} cells holds the lip");
    }
}

#[test]
fn a_block_is_a_disk_by_bits_where_it_is_one_by_joining_its_cells() {
    let mut random = Random::new(11);
    let (mut disks, mut others) = (0, 0);
    for round in 0..12 {
        let field = blobs(&mut random);
        let share = if round % 3 == 2 { 0.02 } else { 0.0 };
        let mut flipped = HashSet::new();
        for _ in 0..(share * 33.0_f64.powi(3)) as usize {
            flipped.insert(random.point().map(|c| (c * 33.0) as usize));
        }
        let is_inside = |at: [usize; 3]| field(at) ^ flipped.contains(&at);
        let (brick, leaves) = brick_of(is_inside, anywhere);
        let mut signs = CornerBits::default();
        for (row, bits) in signs.rows.iter_mut().enumerate() {
            let inside = (0..LINES).filter(|x| is_inside([*x, row % LINES, row / LINES]));
            *bits = inside.fold(0, |bits, x| bits | 1 << x);
        }
        let mut clustering = Clustering::new(options(1.0));
        for (rank, &cell) in brick.cells.iter().enumerate() {
            clustering.ranks[cell_number(cell)] = rank as u16;
        }
        for level in [1, 2] {
            let block_of = |cell: u32| cell_number(cell) >> (3 * level);
            let mut start = 0;
            for block in brick.cells.chunk_by(|a, b| block_of(*a) == block_of(*b)) {
                let cell =
                    Cell { level, number: block_of(block[0]), leaves: start..start + block.len() };
                start += block.len();
                let is_single = |cell: &u32| {
                    components_of(*cell).count == 1
                        && AMBIGUOUS_FACES[usize::from(cell_mask(*cell))] == 0
                };
                let low = place_of(cell.number << (3 * level));
                let found = disk_in_block(&signs, low, 1 << level);
                if !block.iter().all(is_single) {
                    assert_eq!(found, None, "{low:?}");
                    continue;
                }
                let mut copy = brick.clone();
                let positions = std::mem::take(&mut copy.positions);
                let mut cut =
                    Cut { brick: &mut copy, leaves: &leaves, positions, placed: Vec::new() };
                clustering.nodes.clear();
                clustering.groups.clear();
                clustering.node_of = vec![0; brick.positions.len()];
                clustering.visit(&mut cut, &cell);
                let one = match &clustering.nodes[..] {
                    [node] if node.is_simple() => Some(node.edges),
                    _ => None,
                };
                assert_eq!(found, one, "{low:?}");
                *if one.is_some() { &mut disks } else { &mut others } += 1;
            }
        }
    }
    assert!(disks > 300 && others > 300, "{disks} disks, {others} others");
}
