//! Finds the ambiguous faces of the grid that a wall passes along.
//!
//! Where the inside corners of a face lie across from each other, its signs say that two corners
//! are filled, not whether they are one piece of a wall or two bodies with a gap between them. The
//! planes of the four crossings tell: the side of a wall parts both inside corners from an outside
//! one, the side of a body parts its own inside corner from the other as well.
//!
//! In:        the crossings of a brick with their planes, and its signs.
//! Out:       the numbers of the walled faces that the brick owns, ascending.
//! Invariant: one brick decides about a face, so all cells around it are told the same.
//! Units:     lattice units.
//! Memory:    4 bytes a walled face.
//! Fails:     never; where the planes do not tell, there is no wall.
//! Source:    ours. What is at stake: Nielson and Hamann 1991 (the asymptotic decider).

use crate::octree::{
    CornerBits, EdgeBits, PATCH, SignBrick, edge_index, face_index, for_each_ambiguous_face,
};

/// The walled faces of a brick, by its crossings, its marks and its signs.
pub fn find_walls(
    brick: &SignBrick,
    marks: &EdgeBits,
    signs: &CornerBits,
    cell_units: f64,
) -> Vec<u32> {
    let mut walls = Vec::new();
    for_each_ambiguous_face(marks, |axis, at| {
        if votes(brick, signs, (axis, at), cell_units) > 0 {
            walls.push(face_index(axis, at));
        }
    });
    walls
}

/// How many more crossings of the face speak for a wall than for a gap.
fn votes(
    brick: &SignBrick,
    signs: &CornerBits,
    (axis, at): (usize, [usize; 3]),
    cell_units: f64,
) -> i32 {
    let others = [(axis + 1) % 3, (axis + 2) % 3];
    let corner = |first: usize, second: usize| {
        let mut corner = at;
        corner[others[0]] += first;
        corner[others[1]] += second;
        corner
    };
    let inside =
        if signs.get(at) { [corner(0, 0), corner(1, 1)] } else { [corner(1, 0), corner(0, 1)] };
    let edges = [(0, corner(0, 0)), (0, corner(0, 1)), (1, corner(0, 0)), (1, corner(1, 0))];
    let vote = |(along, lower): (usize, [usize; 3])| {
        let edge = edge_index(others[along], lower);
        let found = brick.crossings.binary_search_by_key(&edge, |crossing| crossing.edge);
        let plane = brick.crossings[found.ok()?].plane;
        let plane =
            if plane & PATCH == 0 { brick.planes.get(plane as usize)? } else { return None };
        let normal = plane.normal.map(f64::from);
        let heights = inside.map(|corner| {
            let along: f64 = (0..3).map(|a| normal[a] * corner[a] as f64).sum();
            along * cell_units - plane.offset
        });
        let product = heights[0] * heights[1];
        (product != 0.0).then_some(if product > 0.0 { 1 } else { -1 })
    };
    edges.into_iter().filter_map(vote).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{Crossing, LINES, SourcePlane, edge_position};

    const CELL_UNITS: f64 = 64.0;

    const TILTED: [f64; 3] = [0.48, 0.6, 0.64];
    const MIDDLE: f64 = 27.3;
    const HALF: f64 = 0.45;

    /// How far a point in cells is above the middle plane.
    fn height(at: [f64; 3]) -> f64 {
        (0..3).map(|a| TILTED[a] * at[a]).sum::<f64>() - MIDDLE
    }

    /// The walled faces, and the number of ambiguous ones, of what lies within `HALF` of the middle
    /// plane or of what lies beyond: each crossing is on the plane of its side.
    fn walls_of(is_slab: bool) -> (Vec<u32>, usize) {
        let mut signs = CornerBits::default();
        for (row, bits) in signs.rows.iter_mut().enumerate() {
            for x in 0..LINES {
                let is_within =
                    height([x, row % LINES, row / LINES].map(|c| c as f64)).abs() < HALF;
                *bits |= u64::from(is_within == is_slab) << x;
            }
        }
        let mut marks = EdgeBits::default();
        marks.set_differences(&signs);
        let mut brick = SignBrick { base_inside: signs.get([0; 3]), ..SignBrick::default() };
        marks.for_each(|edge| {
            let (axis, at) = edge_position(edge);
            let mut middle = at.map(|c| c as f64);
            middle[axis] += 0.5;
            let offset = CELL_UNITS * (MIDDLE + HALF.copysign(height(middle)));
            let plane = brick.planes.len() as u32;
            let normal = TILTED.map(|c| c as f32);
            brick.planes.push(SourcePlane { normal, offset, ..SourcePlane::default() });
            brick.crossings.push(Crossing { edge, plane });
        });
        let mut ambiguous = 0;
        for_each_ambiguous_face(&marks, |_, _| ambiguous += 1);
        (find_walls(&brick, &marks, &signs, CELL_UNITS), ambiguous)
    }

    #[test]
    fn a_slab_of_a_cell_is_walled_at_every_ambiguous_face_and_a_gap_at_none() {
        let (walls, ambiguous) = walls_of(true);
        assert!(ambiguous > 100);
        assert_eq!(walls.len(), ambiguous);
        let (walls, ambiguous) = walls_of(false);
        assert!(ambiguous > 100);
        assert!(walls.is_empty());
    }
}
