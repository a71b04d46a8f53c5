//! The table over all 256 masks, and the surface that it makes of pure noise.

use super::*;
use std::collections::HashMap;

fn ambiguous_faces(mask: u8) -> Vec<u8> {
    (0..6).filter(|&face| is_ambiguous(mask, face)).collect()
}

/// The faces that one cycle of `components` touches with all four edges.
fn faces_touched_twice(mask: u8, components: &Components) -> Vec<u8> {
    let masks = &components.edge_masks[..usize::from(components.count)];
    ambiguous_faces(mask)
        .into_iter()
        .filter(|&face| {
            let all = edges_of_face(face).iter().fold(0_u16, |bits, &edge| bits | 1 << edge);
            masks.iter().any(|cycle| cycle & all == all)
        })
        .collect()
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
    for table in [&TABLE, &FLIPPED] {
        for (mask, entry) in table.iter().enumerate() {
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
                assert_eq!(is_marked(mask as u8, edge), seen >> edge & 1 == 1);
            }
        }
    }
}

#[test]
fn thirty_six_masks_are_two_sided_at_their_only_ambiguous_face() {
    let mut two_sided = 0;
    for mask in 0..=255_u8 {
        let faces = faces_touched_twice(mask, &TABLE[usize::from(mask)]);
        if faces.is_empty() {
            assert_eq!(TWO_SIDED[usize::from(mask)], NO_FACE);
            assert_eq!(FLIPPED[usize::from(mask)], TABLE[usize::from(mask)]);
        } else {
            assert_eq!(faces, ambiguous_faces(mask));
            assert_eq!(faces, [TWO_SIDED[usize::from(mask)]]);
            two_sided += 1;
        }
    }
    assert_eq!(two_sided, 36);
}

#[test]
fn the_flip_splits_the_touching_patch_in_two() {
    for mask in (0..=255_u8).filter(|&mask| TWO_SIDED[usize::from(mask)] != NO_FACE) {
        let (plain, flipped) = (&TABLE[usize::from(mask)], &FLIPPED[usize::from(mask)]);
        assert_eq!(flipped.count, plain.count + 1, "mask {mask}");
        assert!(faces_touched_twice(mask, flipped).is_empty(), "mask {mask}");
        let edges = edges_of_face(TWO_SIDED[usize::from(mask)]).map(usize::from);
        let touching = plain.component_of_edge[edges[0]];
        for component in 0..plain.count {
            let cycle = plain.edge_masks[usize::from(component)];
            assert_eq!(flipped.edge_masks.contains(&cycle), component != touching);
        }
    }
}

#[test]
fn complement_changes_only_ambiguous_faces_and_equals_the_flip_there() {
    for mask in 0..=255_u8 {
        let complement = &TABLE[usize::from(!mask)];
        match ambiguous_faces(mask)[..] {
            [] => assert_eq!(&TABLE[usize::from(mask)], complement),
            [face] => assert_eq!(&components(mask, face), complement),
            _ => {}
        }
        if TWO_SIDED[usize::from(mask)] != NO_FACE {
            assert_eq!(&FLIPPED[usize::from(mask)], complement);
        }
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
        for table in [&TABLE, &FLIPPED] {
            let sorted = |mut masks: [u16; 4]| {
                masks.sort_unstable();
                masks
            };
            let turned = table[usize::from(mask)].edge_masks.map(|cycle| {
                (0..12).filter(|e| cycle >> e & 1 == 1).fold(0, |b, e| b | 1 << image_of_edge(e))
            });
            assert_eq!(sorted(turned), sorted(table[usize::from(image)].edge_masks));
        }
    }
}

/// Random signs on a cube of corners whose outermost layer is outside.
struct Noise {
    cells: usize,
    inside: Vec<bool>,
}

impl Noise {
    fn new(cells: usize, seed: u64) -> Self {
        let corners = cells + 1;
        let mut state = seed;
        let mut inside = vec![false; corners * corners * corners];
        for (i, sign) in inside.iter_mut().enumerate() {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let at = [i % corners, i / corners % corners, i / corners / corners];
            *sign = state >> 63 == 1 && at.iter().all(|&x| x > 0 && x < cells);
        }
        Self { cells, inside }
    }

    fn sign(&self, at: [usize; 3]) -> bool {
        let corners = self.cells + 1;
        self.inside[(at[2] * corners + at[1]) * corners + at[0]]
    }

    fn mask(&self, cell: [usize; 3]) -> u8 {
        let corner = |i: usize| [cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2)];
        (0..8).filter(|&i| self.sign(corner(i))).fold(0, |mask, i| mask | 1 << i)
    }

    /// The entry of a cell, flipped where the cell and its neighbour are two-sided at one face.
    fn entry(&self, cell: [usize; 3], flips: bool) -> &'static Components {
        let mask = usize::from(self.mask(cell));
        let face = TWO_SIDED[mask];
        if flips && face != NO_FACE {
            let mut neighbour = cell;
            let axis = usize::from(face / 2);
            // The outermost faces carry no marks, so the neighbour exists.
            neighbour[axis] = neighbour[axis] + 2 * usize::from(face & 1) - 1;
            if TWO_SIDED[usize::from(self.mask(neighbour))] == face ^ 1 {
                return &FLIPPED[mask];
            }
        }
        &TABLE[mask]
    }

    /// One quad per marked edge; a vertex is a cell number times four plus a component.
    fn quads(&self, flips: bool) -> Vec<[usize; 4]> {
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
                let component = self.entry(cell, flips).component_of_edge[edge];
                assert_ne!(component, NO_COMPONENT);
                ((cell[2] * n + cell[1]) * n + cell[0]) * 4 + usize::from(component)
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
fn noise_becomes_manifold_by_the_flips_and_only_by_them() {
    for seed in [1, 2] {
        let noise = Noise::new(40, seed);
        let quads = noise.quads(true);
        assert!(quads.len() > 50_000);
        assert_eq!(non_manifold(&quads), (0, 0));
        let (edges, _) = non_manifold(&noise.quads(false));
        assert!(edges > 0, "the test must be able to fail");
    }
}
