//! Takes off the tips of solids that would come apart as specks.
//!
//! Where a solid ends in a tip narrower than a cell, the last corner inside may touch the others
//! across a diagonal only. It is a component of its own then, of less than a cell. A corner that
//! stands alone and has no other near it is a small solid, and stays.
//!
//! In:         the signs of a brick.
//! Out:        the same without such corners, as far as they lie within the brick: what its borders
//!             share with other bricks stays.

use crate::octree::{CornerBits, LINES, SIDE};

/// Corners that lie within the brick.
const WITHIN: u64 = ((1 << SIDE) - 1) & !1;

/// Takes off all tips; how many corners that were.
pub fn take_off_tips(signs: &mut CornerBits) -> u64 {
    let mut taken = 0;
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
            signs.rows[row] &= !tips;
            taken += u64::from(tips.count_ones());
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_that_touches_others_across_a_diagonal_goes_and_one_alone_stays() {
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
        assert_eq!(take_off_tips(&mut signs), 3);
        assert_eq!((signs.rows[row(6, 5)], signs.rows[row(4, 4)]), (0, 0));
        assert_eq!((signs.rows[row(5, 5)], signs.rows[row(20, 20)]), (0b1100, 1 << 9));
        assert_eq!((signs.rows[row(SIDE, 20)], signs.rows[row(SIDE - 1, 20)]), (1 << 9, 0));
    }
}
