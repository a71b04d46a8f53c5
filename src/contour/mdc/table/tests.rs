//! The table over all 256 masks, and the surface that it makes of pure noise.

use super::*;
use std::collections::HashMap;

use crate::mesh::shapes::Random;

/// The sets of ambiguous faces of a mask.
fn face_sets(mask: u8) -> impl Iterator<Item = u8> {
    (0..64).filter(move |joined| joined & !AMBIGUOUS_FACES[usize::from(mask)] == 0)
}

/// Every mask with every set of its ambiguous faces.
fn all_entries() -> impl Iterator<Item = (u8, u8)> {
    (0..=255).flat_map(|mask| face_sets(mask).map(move |joined| (mask, joined)))
}

/// The faces that one cycle touches twice.
fn touched_twice(mask: u8, joined: u8) -> Vec<usize> {
    (0..6).filter(|face| touches_twice(mask, joined, *face)).collect()
}

#[test]
fn edges_and_faces_are_numbered_as_documented() {
    for edge in 0..12 {
        let (low, high) = (corner_of_edge(edge, 0), corner_of_edge(edge, 1));
        assert_eq!(high - low, 1 << axis_of_edge(edge));
        assert_eq!(edge_at_corner(low, axis_of_edge(edge)), edge);
        assert_eq!(edge_at_corner(high, axis_of_edge(edge)), edge);
        let faces = (0..6).filter(|&face| edges_of_face(face).contains(&edge)).count();
        assert_eq!(faces, 2, "edge {edge}");
    }
    for face in 0..6_u8 {
        for corner in corners_of_face(face) {
            assert_eq!(corner >> (face / 2) & 1, face & 1);
        }
        for edge in edges_of_face(face) {
            for end in 0..2 {
                assert!(corners_of_face(face).contains(&corner_of_edge(edge, end)));
            }
        }
    }
    assert_eq!((corner_of_edge(1, 0), corner_of_edge(1, 1)), (0b010, 0b011));
    assert_eq!((corner_of_edge(6, 0), corner_of_edge(6, 1)), (0b100, 0b110));
    assert_eq!((corner_of_edge(9, 0), corner_of_edge(9, 1)), (0b001, 0b101));
}

#[test]
fn component_counts_have_the_known_histogram() {
    let mut histogram = [0; 5];
    for entry in &TABLE {
        histogram[usize::from(entry.count)] += 1;
    }
    assert_eq!(histogram, [2, 162, 82, 8, 2]);
}

#[test]
fn every_marked_edge_is_in_exactly_one_component() {
    assert_eq!(all_entries().count(), FACE_SETS);
    for (mask, joined) in all_entries() {
        let entry = components(mask, joined);
        let mut seen = 0_u16;
        for component in 0..4_u8 {
            let edges = entry.edge_masks[usize::from(component)];
            assert_eq!(edges != 0, component < entry.count);
            assert_eq!(edges & seen, 0);
            seen |= edges;
            for edge in 0..12_u8 {
                let named = entry.component_of_edge[usize::from(edge)] == component;
                assert_eq!(named, edges >> edge & 1 == 1, "mask {mask}");
            }
            assert!(edges == 0 || edges.count_ones() >= 3);
        }
        for edge in 0..12_u8 {
            assert_eq!(is_marked(mask, edge), seen >> edge & 1 == 1);
        }
    }
}

#[test]
fn entries_are_those_that_are_worked_out() {
    for (mask, joined) in all_entries() {
        assert_eq!(components(mask, joined), &work_out(mask, joined), "{mask} {joined}");
    }
}

#[test]
fn thirty_six_masks_touch_their_only_ambiguous_face_twice_where_nothing_is_joined() {
    let mut touching = 0;
    for mask in 0..=255_u8 {
        let faces = touched_twice(mask, 0);
        if !faces.is_empty() {
            assert_eq!(faces.iter().fold(0, |b, f| b | 1 << f), AMBIGUOUS_FACES[usize::from(mask)]);
            assert_eq!(faces.len(), 1);
            touching += 1;
        }
    }
    assert_eq!(touching, 36);
}

#[test]
fn a_turned_face_splits_the_component_that_touches_it_twice_and_no_other() {
    for (mask, joined) in all_entries() {
        let before = components(mask, joined);
        for face in touched_twice(mask, joined) {
            let after = components(mask, joined ^ 1 << face);
            assert_eq!(after.count, before.count + 1, "mask {mask}");
            let edges = edges_of_face(face as u8).map(usize::from);
            let touching = before.component_of_edge[edges[0]];
            for component in 0..before.count {
                let cycle = before.edge_masks[usize::from(component)];
                assert_eq!(after.edge_masks.contains(&cycle), component != touching);
            }
            // So no face is touched twice that was not before, and this one is no more.
            let still = touched_twice(mask, joined ^ 1 << face);
            assert!(!still.contains(&face));
            assert!(still.iter().all(|face| touched_twice(mask, joined).contains(face)));
        }
    }
}

#[test]
fn complement_joins_all_ambiguous_faces() {
    for mask in 0..=255_u8 {
        let complement = components(!mask, 0);
        assert_eq!(components(mask, AMBIGUOUS_FACES[usize::from(mask)]), complement);
    }
}

#[test]
fn the_table_turns_with_the_cell() {
    // One permutation of the axes and one mirror make all 48 symmetries between them.
    let turn = |corner: u8| (corner << 1 | corner >> 2) & 7;
    let swap = |corner: u8| (corner & 1) << 1 | corner >> 1 & 1 | corner & 4;
    let mirror = |corner: u8| corner ^ 1;
    let moves: [&dyn Fn(u8) -> u8; 3] = [&turn, &swap, &mirror];
    for (moved, mask) in moves.iter().flat_map(|m| (0..=255_u8).map(move |mask| (m, mask))) {
        let image =
            (0..8).filter(|c| mask >> c & 1 == 1).fold(0_u8, |bits, c| bits | 1 << moved(c));
        let image_of_edge = |edge: u8| {
            let ends = [moved(corner_of_edge(edge, 0)), moved(corner_of_edge(edge, 1))];
            (0..12_u8)
                .find(|&e| {
                    ends.contains(&corner_of_edge(e, 0)) && ends.contains(&corner_of_edge(e, 1))
                })
                .expect("symmetries map edges to edges")
        };
        let image_of_face = |face: u8| {
            let corners = corners_of_face(face).map(moved);
            let is_there = |f: &u8| corners.iter().all(|c| corners_of_face(*f).contains(c));
            (0..6_u8).find(is_there).expect("symmetries map faces to faces")
        };
        for joined in face_sets(mask) {
            let faces = (0..6).filter(|f| joined >> f & 1 == 1);
            let image_joined = faces.fold(0_u8, |bits, f| bits | 1 << image_of_face(f));
            let sorted = |mut masks: [u16; 4]| {
                masks.sort_unstable();
                masks
            };
            let turned = components(mask, joined).edge_masks.map(|cycle| {
                (0..12).filter(|e| cycle >> e & 1 == 1).fold(0, |b, e| b | 1 << image_of_edge(e))
            });
            assert_eq!(sorted(turned), sorted(components(image, image_joined).edge_masks));
        }
    }
}

/// Random signs on a cube of corners whose outermost layer is outside, and random walled faces.
struct Noise {
    cells: usize,
    inside: Vec<bool>,
    /// Of every cell, which faces join their inside corners.
    joined: Vec<u8>,
}

impl Noise {
    /// One face in `walls_below` hundred is walled; faces are turned where `turns`.
    fn new(cells: usize, seed: u64, walls_below: usize, turns: bool) -> Self {
        let corners = cells + 1;
        let mut random = Random::new(seed);
        let mut inside = vec![false; corners * corners * corners];
        for (i, sign) in inside.iter_mut().enumerate() {
            let at = [i % corners, i / corners % corners, i / corners / corners];
            *sign = random.below(2) == 1 && at.iter().all(|&x| x > 0 && x < cells);
        }
        let joined = vec![0; cells * cells * cells];
        let mut noise = Self { cells, inside, joined };
        // The outermost faces carry no marks.
        noise.each_pair(|noise, (cell, mask), (beyond, other), face| {
            let is_walled = random.below(100) < walls_below;
            let checkered = [mask, other].iter().any(|m| AMBIGUOUS_FACES[usize::from(*m)] == 63);
            if is_walled && !checkered {
                noise.joined[cell] |= 1 << face;
                noise.joined[beyond] |= 1 << (face ^ 1);
            }
        });
        // One face after the other: the rounds of the grid must do as well as any order.
        if turns {
            noise.each_pair(|noise, (cell, mask), (beyond, other), face| {
                if touches_twice(mask, noise.joined[cell], face)
                    && touches_twice(other, noise.joined[beyond], face ^ 1)
                {
                    noise.joined[cell] ^= 1 << face;
                    noise.joined[beyond] ^= 1 << (face ^ 1);
                }
            });
        }
        noise
    }

    /// Visits every ambiguous face between two cells: their numbers and masks, and the face of the
    /// first.
    fn each_pair(&mut self, mut visit: impl FnMut(&mut Self, (usize, u8), (usize, u8), usize)) {
        let n = self.cells;
        for (i, axis) in (0..n * n * n).flat_map(|i| (0..3).map(move |axis| (i, axis))) {
            let cell = [i % n, i / n % n, i / n / n];
            let mut beyond = cell;
            beyond[axis] += 1;
            let face = 2 * axis + 1;
            let mask = self.mask(cell);
            if beyond[axis] < n && AMBIGUOUS_FACES[usize::from(mask)] >> face & 1 == 1 {
                let other = self.mask(beyond);
                visit(self, (i, mask), (self.number(beyond), other), face);
            }
        }
    }

    fn number(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.cells + cell[1]) * self.cells + cell[0]
    }

    fn sign(&self, at: [usize; 3]) -> bool {
        let corners = self.cells + 1;
        self.inside[(at[2] * corners + at[1]) * corners + at[0]]
    }

    fn mask(&self, cell: [usize; 3]) -> u8 {
        let corner = |i: usize| [cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2)];
        (0..8).filter(|&i| self.sign(corner(i))).fold(0, |mask, i| mask | 1 << i)
    }

    /// One quad per marked edge; a vertex is a cell number times four plus a component.
    fn quads(&self) -> Vec<[usize; 4]> {
        let n = self.cells;
        let mut quads = Vec::new();
        for (axis, i) in (0..3).flat_map(|axis| (0..n * n * n).map(move |i| (axis, i))) {
            let low = [i % n, i / n % n, i / n / n];
            let mut high = low;
            high[axis] += 1;
            if self.sign(low) == self.sign(high) {
                continue;
            }
            let (u, v) = other_axes(axis as u8);
            quads.push([(1, 1), (0, 1), (0, 0), (1, 0)].map(|(first, second)| {
                let mut cell = low;
                cell[usize::from(u)] -= first;
                cell[usize::from(v)] -= second;
                let edge = axis * 4 + (second << 1 | first);
                let number = self.number(cell);
                let entry = components(self.mask(cell), self.joined[number]);
                let component = entry.component_of_edge[edge];
                assert_ne!(component, NO_COMPONENT);
                number * 4 + usize::from(component)
            }));
        }
        quads
    }
}

/// How many edges have not two quads, and how many vertices have not one cycle of quads.
fn non_manifold(quads: &[[usize; 4]]) -> (usize, usize) {
    let mut uses = HashMap::new();
    let mut links: HashMap<usize, Vec<[usize; 2]>> = HashMap::new();
    for quad in quads {
        for i in 0..4 {
            let (before, at, after) = (quad[(i + 3) % 4], quad[i], quad[(i + 1) % 4]);
            *uses.entry((at.min(after), at.max(after))).or_insert(0) += 1;
            links.entry(at).or_default().push([before, after]);
        }
    }
    let edges = uses.values().filter(|&&count| count != 2).count();
    let vertices = links.values().filter(|link| !is_one_cycle(link)).count();
    (edges, vertices)
}

fn is_one_cycle(link: &[[usize; 2]]) -> bool {
    let start = link[0][0];
    let (mut at, mut used) = (start, vec![false; link.len()]);
    loop {
        let next =
            (0..link.len()).filter(|&i| !used[i] && link[i].contains(&at)).collect::<Vec<_>>();
        if next.len() > 2 || next.is_empty() || (next.len() == 2 && at != start) {
            return false;
        }
        used[next[0]] = true;
        at = link[next[0]][usize::from(link[next[0]][0] == at)];
        if at == start {
            return used.iter().all(|&u| u);
        }
    }
}

#[test]
fn noise_becomes_manifold_by_turned_faces_and_only_by_them() {
    for (seed, walls_below) in [(1, 0), (2, 10), (3, 50), (4, 100)] {
        let quads = Noise::new(40, seed, walls_below, true).quads();
        assert!(quads.len() > 50_000);
        assert_eq!(non_manifold(&quads), (0, 0), "{walls_below} of 100 walled");
        let (edges, _) = non_manifold(&Noise::new(40, seed, walls_below, false).quads());
        assert!(edges > 0, "the test must be able to fail");
    }
}
