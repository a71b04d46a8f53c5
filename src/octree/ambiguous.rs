//! Ambiguous faces: all four edges crossed, so that the inside corners lie across from each other.
//!
//! A face belongs to the cell above it, and is named by that cell and the axis across it.

use crate::octree::{EdgeBits, LINES, SIDE};

/// Faces that a brick owns.
pub const OWN_FACES: u32 = 3 << 15;

/// The number of the face below cell `at` of the brick, across `axis`.
#[must_use]
#[inline]
pub const fn face_index(axis: usize, at: [usize; 3]) -> u32 {
    (axis as u32) << 15 | (at[2] << 10 | at[1] << 5 | at[0]) as u32
}

/// Calls `visit` with the axis and the cell of every ambiguous face that the brick owns, ascending
/// by number.
pub fn for_each_ambiguous_face(marks: &EdgeBits, mut visit: impl FnMut(usize, [usize; 3])) {
    const OWN: u64 = (1 << SIDE) - 1;
    let [xs, ys, zs] = [0, 1, 2].map(|axis| marks.rows(axis));
    for axis in 0..3 {
        for (z, y) in (0..SIDE).flat_map(|z| (0..SIDE).map(move |y| (z, y))) {
            let row = z * LINES + y;
            let mut faces = OWN
                & match axis {
                    0 => ys[row] & ys[row + LINES] & zs[row] & zs[row + 1],
                    1 => xs[row] & xs[row + LINES] & zs[row] & zs[row] >> 1,
                    _ => xs[row] & xs[row + 1] & ys[row] & ys[row] >> 1,
                };
            while faces != 0 {
                let x = faces.trailing_zeros() as usize;
                faces &= faces - 1;
                visit(axis, [x, y, z]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::Random;
    use crate::octree::CornerBits;

    #[test]
    fn faces_are_ambiguous_where_their_corners_alternate() {
        let mut random = Random::new(3);
        let mut corners = CornerBits::default();
        for row in corners.rows.iter_mut() {
            *row = (0..LINES).fold(0, |bits, x| bits | (random.below(2) as u64) << x);
        }
        let mut marks = EdgeBits::default();
        marks.set_differences(&corners);
        let mut found = Vec::new();
        for_each_ambiguous_face(&marks, |axis, at| found.push(face_index(axis, at)));
        let mut expected = Vec::new();
        for axis in 0..3 {
            let steps = |corner: usize, at: [usize; 3]| {
                let mut at = at;
                at[(axis + 1) % 3] += corner & 1;
                at[(axis + 2) % 3] += corner >> 1;
                corners.get(at)
            };
            for i in 0..SIDE * SIDE * SIDE {
                let at = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE];
                let [a, b, c, d] = [0, 1, 2, 3].map(|corner| steps(corner, at));
                if a == d && b == c && a != b {
                    expected.push(face_index(axis, at));
                }
            }
        }
        assert!(found.len() > 1000 && found.last().is_some_and(|face| *face < OWN_FACES));
        assert_eq!(found, expected);
    }
}
