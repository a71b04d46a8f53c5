//! Finds the ambiguous faces of the grid that a wall passes along.
//!
//! Where the inside corners of a face lie across from each other, its signs say that two corners
//! are filled, not whether they are one piece of a wall or two bodies with a gap between them. The
//! planes of the four crossings tell: the side of a wall parts both inside corners from an outside
//! one, the side of a body parts its own inside corner from the other as well. The two sides of a
//! wall look away from each other; those of a blunt crease do not.
//!
//! In:        the crossings of a brick with their planes, and its signs.
//! Out:       the numbers of the walled faces that the brick owns, ascending.
//! Invariant: one brick decides about a face, so all cells around it are told the same.
//! Units:     lattice units.
//! Memory:    4 bytes a walled face.
//! Fails:     never; where the planes do not tell, there is no wall.
//! Source:    ours. What is at stake: Nielson and Hamann 1991 (the asymptotic decider).

use glam::DVec3;

use crate::octree::{
    CornerBits, EdgeBits, SourcePlane, edge_index, face_index, for_each_ambiguous_face,
};

/// Cosine between the outward sides of a wall, at most: what is blunter than 60 degrees is a crease,
/// whose corners the rule of all other faces keeps.
const OPPOSITE: f64 = -0.5;

/// The walled faces of a brick, by its marks and its signs; `plane_of` tells the plane of the crossing on an
/// edge, unless a patch crosses it.
pub fn find_walls(
    marks: &EdgeBits,
    signs: &CornerBits,
    cell_units: f64,
    plane_of: impl Fn(u32) -> Option<SourcePlane>,
) -> Vec<u32> {
    let mut walls = Vec::new();
    for_each_ambiguous_face(marks, |axis, at| {
        if is_walled(&plane_of, signs, (axis, at), cell_units) {
            walls.push(face_index(axis, at));
        }
    });
    walls
}

/// Whether more crossings of the face speak for a wall than for a gap, and two of its sides look away
/// from each other.
fn is_walled(
    plane_of: &impl Fn(u32) -> Option<SourcePlane>,
    signs: &CornerBits,
    (axis, at): (usize, [usize; 3]),
    cell_units: f64,
) -> bool {
    let others = [(axis + 1) % 3, (axis + 2) % 3];
    let corner = |first: usize, second: usize| {
        let mut corner = at;
        corner[others[0]] += first;
        corner[others[1]] += second;
        corner
    };
    let (even, odd) = ([corner(0, 0), corner(1, 1)], [corner(1, 0), corner(0, 1)]);
    let (inside, outside) = if signs.get(at) { (even, odd) } else { (odd, even) };
    let (mut votes, mut sides) = (0, [[DVec3::ZERO; 2]; 2]);
    for (lower, along) in [(even[0], 0), (even[0], 1), (odd[0], 1), (odd[1], 0)] {
        let Some(plane) = plane_of(edge_index(others[along], lower)) else { continue };
        let normal = plane.unit_normal();
        let [one, other] = inside
            .map(|c| normal.dot(DVec3::from(c.map(|c| c as f64))) * cell_units - plane.offset);
        if one * other < 0.0 {
            votes -= 1;
        } else if one * other > 0.0 {
            votes += 1;
            let mut upper = lower;
            upper[others[along]] += 1;
            let side = usize::from([lower, upper].contains(&outside[1]));
            sides[side][along] = normal * -one.signum();
        }
    }
    let [one, other] = sides;
    votes > 0 && one.iter().any(|one| other.iter().any(|other| one.dot(*other) <= OPPOSITE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{LINES, edge_position};

    const CELL_UNITS: f64 = 64.0;

    /// `normal . p = offset` in cells, looking outward.
    type Side = (DVec3, f64);

    /// The walled faces, and the number of ambiguous ones, of what lies within two sides or, if it
    /// is not solid there, beyond them. Each crossing is on the side that it passes.
    fn walls_of(sides: [Side; 2], is_solid_within: bool) -> (Vec<u32>, usize) {
        let height = |(normal, offset): Side, at: [usize; 3]| {
            normal.dot(DVec3::from(at.map(|c| c as f64))) - offset
        };
        let is_within = |at| sides.iter().all(|side| height(*side, at) < 0.0);
        let mut signs = CornerBits::default();
        for (row, bits) in signs.rows.iter_mut().enumerate() {
            for x in 0..LINES {
                let is_inside = is_within([x, row % LINES, row / LINES]) == is_solid_within;
                *bits |= u64::from(is_inside) << x;
            }
        }
        let mut marks = EdgeBits::default();
        marks.set_differences(&signs);
        let planes = sides.map(|(normal, offset)| {
            let (normal, offset) = (normal.as_vec3().to_array(), offset * CELL_UNITS);
            SourcePlane { normal, offset, ..SourcePlane::default() }
        });
        let plane_of = |edge| {
            let (axis, lower) = edge_position(edge);
            let mut upper = lower;
            upper[axis] += 1;
            let beyond = if is_within(lower) { upper } else { lower };
            let side = usize::from(height(sides[1], beyond) > height(sides[0], beyond));
            marks.get(edge).then_some(planes[side])
        };
        let mut ambiguous = 0;
        for_each_ambiguous_face(&marks, |_, _| ambiguous += 1);
        (find_walls(&marks, &signs, CELL_UNITS, plane_of), ambiguous)
    }

    #[test]
    fn a_slab_of_a_cell_is_walled_at_every_ambiguous_face_and_a_gap_at_none() {
        let normal = DVec3::new(0.48, 0.6, 0.64);
        let sides = [(normal, 27.75), (-normal, -26.85)];
        let (walls, ambiguous) = walls_of(sides, true);
        assert!(ambiguous > 100);
        assert_eq!(walls.len(), ambiguous);
        let (walls, ambiguous) = walls_of(sides, false);
        assert!(ambiguous > 100);
        assert!(walls.is_empty());
    }

    #[test]
    fn a_right_crease_is_walled_nowhere_and_a_blade_is() {
        // A ridge that runs almost across the cells of a layer, of so steep sides.
        let ridge = |steepness: f64| {
            let across = DVec3::new(1.0, -1.06, 0.0).normalize();
            let sides = [across, -across].map(|side| (side * steepness + DVec3::Z).normalize());
            walls_of(sides.map(|normal| (normal, normal.dot(DVec3::splat(16.3)))), true)
        };
        let (walls, ambiguous) = ridge(1.0);
        assert!(ambiguous > 10);
        assert!(walls.is_empty());
        let (walls, ambiguous) = ridge(4.0);
        assert!(ambiguous > 10);
        assert!(walls.len() > 10);
    }
}
