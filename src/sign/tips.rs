//! Takes off the tips of solids that would come apart as specks.
//!
//! Where a solid ends in a tip narrower than a cell, the last corner inside may touch the others
//! across a diagonal only. It is a component of its own then, of less than a cell, unless a face is
//! walled ([`crate::sign::walls`]). A corner that stands alone and has no other near it is a small
//! solid, and stays.
//!
//! In:         the signs of a brick.
//! Out:        such corners, as far as they lie within the brick: what its borders share with other
//!             bricks stays.

use crate::octree::{CornerBits, LINES, SIDE, face_index};
use crate::store::Parts;

/// Corners that lie within the brick.
const WITHIN: u64 = ((1 << SIDE) - 1) & !1;

/// Tips that hang together are no speck if they are more than this.
const SPECK_CORNERS: usize = 8;

/// All tips, by ascending z, y and x.
pub fn find_tips(signs: &CornerBits) -> Vec<[usize; 3]> {
    let mut found = Vec::new();
    for z in 1..SIDE {
        for y in 1..SIDE {
            let row = z * LINES + y;
            let bits = signs.rows[row];
            if bits & WITHIN == 0 {
                continue;
            }
            let beside = [row - 1, row + 1, row - LINES, row + LINES].map(|r| signs.rows[r]);
            let across = beside.into_iter().fold(0, |all, row| all | row);
            let alone = bits & WITHIN & !(bits << 1) & !(bits >> 1) & !across;
            if alone == 0 {
                continue;
            }
            let diagonal = [row - LINES - 1, row - LINES + 1, row + LINES - 1, row + LINES + 1]
                .map(|r| signs.rows[r])
                .into_iter()
                .fold(across, |all, row| all | row);
            let tips = alone & (diagonal | diagonal << 1 | diagonal >> 1);
            found.extend((1..SIDE).filter(|x| tips >> x & 1 == 1).map(|x| [x, y, z]));
        }
    }
    found
}

/// Those of `tips`, as [`find_tips`] gives them, that come apart as specks: by the faces `walls` they
/// hang together with a few other tips at most.
pub fn apart(signs: &CornerBits, tips: &[[usize; 3]], walls: &[u32]) -> Vec<[usize; 3]> {
    let number_of = |corner: [usize; 3]| {
        let [x, y, z] = corner;
        tips.binary_search_by_key(&[z, y, x], |[x, y, z]| [*z, *y, *x]).ok()
    };
    let mut pieces = Parts::new(tips.len());
    let mut is_held = vec![false; tips.len()];
    for (tip, corner) in tips.iter().enumerate() {
        for beyond in across_walls(signs, walls, *corner) {
            match number_of(beyond) {
                Some(other) => drop(pieces.unite(tip, other)),
                None => is_held[tip] = true,
            }
        }
    }
    let firsts = pieces.firsts();
    let mut corners = vec![0; tips.len()];
    let mut holds = vec![false; tips.len()];
    for (&first, is_held) in firsts.iter().zip(is_held) {
        corners[first] += 1;
        holds[first] |= is_held;
    }
    let is_apart = |first: usize| !holds[first] && corners[first] <= SPECK_CORNERS;
    let apart = tips.iter().zip(firsts).filter(|(_, first)| is_apart(**first));
    apart.map(|(tip, _)| *tip).collect()
}

/// The corners across the walled faces of a tip, but for those by which it hangs on a neck: there
/// both cells at the face see one surface around the tip and beyond, which would pinch itself. In a
/// wall one of them has another walled face of the tip, and what lies across the two hangs together.
fn across_walls<'a>(
    signs: &'a CornerBits,
    walls: &'a [u32],
    tip: [usize; 3],
) -> impl Iterator<Item = [usize; 3]> + 'a {
    let octants = (0..8).map(|octant| [0, 1, 2].map(|axis| octant >> axis & 1));
    // Of each octant its min corner and the two sides of each axis: that of the tip, and the other.
    let cells = octants.map(move |steps: [usize; 3]| {
        let low: [usize; 3] = std::array::from_fn(|a| tip[a] - steps[a]);
        (low, [0, 1, 2].map(|a| low[a] + 1 - steps[a]))
    });
    cells.flat_map(move |(low, far)| {
        let is_walled = |axis: usize, side: usize| {
            let mut at = low;
            at[axis] = side;
            at.iter().all(|c| *c < SIDE) && walls.binary_search(&face_index(axis, at)).is_ok()
        };
        let beyond = |axis: usize| {
            let mut corner = far;
            corner[axis] = tip[axis];
            corner
        };
        let walled = [0, 1, 2].map(|axis| is_walled(axis, tip[axis]));
        let hangs = |one: usize, other: usize| {
            let shared = 3 - one - other;
            walled[one] && walled[other] && (signs.get(far) || is_walled(shared, far[shared]))
        };
        let is_firm = |axis: usize| (0..3).any(|other| other != axis && hangs(axis, other));
        let firm = [0, 1, 2].map(|axis| is_firm(axis).then(|| beyond(axis)));
        firm.into_iter().flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_that_touches_others_across_a_diagonal_is_a_tip_and_one_alone_is_none() {
        let mut signs = CornerBits::default();
        let row = |y: usize, z: usize| z * LINES + y;
        signs.rows[row(5, 5)] = 0b1100;
        // Across an edge of the cell, and across the cell.
        signs.rows[row(6, 5)] = 1 << 4;
        signs.rows[row(4, 4)] = 1 << 1;
        // Alone, and at the border beside another.
        signs.rows[row(20, 20)] = 1 << 9;
        signs.rows[row(SIDE, 20)] = 1 << 9;
        signs.rows[row(SIDE - 1, 20)] = 1 << 10;
        assert_eq!(find_tips(&signs), [[1, 4, 4], [4, 6, 5], [10, SIDE - 1, 20]]);
    }

    #[test]
    fn a_tip_is_apart_unless_walls_hold_it() {
        let mut signs = CornerBits::default();
        let tips = [[5, 5, 5], [20, 20, 20]];
        assert_eq!(apart(&signs, &tips, &[]), tips);
        // On a neck, and then where what lies across three faces hangs together.
        assert_eq!(apart(&signs, &tips, &[face_index(2, [5, 5, 5])]), tips);
        let walls = [0, 1, 2].map(|axis| face_index(axis, [5, 5, 5]));
        assert_eq!(apart(&signs, &tips, &walls), tips);
        signs.rows[6 * LINES + 6] |= 1 << 6;
        assert_eq!(apart(&signs, &tips, &walls), [[20, 20, 20]]);
    }

    #[test]
    fn tips_that_hold_nothing_but_each_other_go_while_they_are_few() {
        // Corners whose coordinates have one sum, with all walls between them.
        let of_plane = |side: usize| {
            let cells = (0..side * side).map(|i| [5 + i % side, 5 + i / side]);
            let mut tips: Vec<[usize; 3]> = cells.map(|[x, y]| [x, y, 40 - x - y]).collect();
            tips.sort_unstable_by_key(|[x, y, z]| [*z, *y, *x]);
            let mut walls = Vec::new();
            for (axis, at) in tips.iter().flat_map(|tip| (0..3).map(move |axis| (axis, *tip))) {
                for along in [(axis + 1) % 3, (axis + 2) % 3] {
                    let mut low = at;
                    low[along] -= 1;
                    walls.push(face_index(axis, low));
                }
            }
            walls.sort_unstable();
            walls.dedup();
            (tips, walls)
        };
        let signs = CornerBits::default();
        for (side, gone) in [(2, 4), (3, 0)] {
            let (mut tips, walls) = of_plane(side);
            // The walls of the outermost lead to corners that are none: those are no tips here.
            let all = apart(&signs, &tips, &walls);
            assert!(all.is_empty());
            let inner = |face: &u32| {
                let (axis, at) = ((face >> 15) as usize, face & 0x7fff);
                let low = [at & 31, at >> 5 & 31, at >> 10].map(|c| c as usize);
                let (mut one, mut other) = (low, low);
                one[(axis + 1) % 3] += 1;
                other[(axis + 2) % 3] += 1;
                tips.contains(&one) && tips.contains(&other)
            };
            let between: Vec<u32> = walls.iter().copied().filter(inner).collect();
            assert_eq!(apart(&signs, &tips, &between).len(), gone);
            tips.truncate(1);
            assert_eq!(apart(&signs, &tips, &[]), tips);
        }
    }
}
