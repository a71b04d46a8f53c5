//! The straight way from one pierced face to another in the plane of a cut.
//!
//! The segment between the two places crosses grid lines; each crossed line is an edge to flip,
//! and where it is crossed is the patch's place on that edge. All in integers.
//!
//! Source: Amanatides and Woo 1987, A fast voxel traversal algorithm; in place of Ju's Bresenham.

use crate::patch::pair::Place;

/// Places per cell.
pub const SUB: i64 = 256;
/// A patch keeps this far from the ends of an edge, in 1/65536.
const END_GAP: i64 = 512;

/// An edge that the way crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// 0 when the way goes along the first axis of the plane here, 1 when along the second.
    pub along: usize,
    /// The grid line that is crossed: its coordinate on axis `along`.
    pub line: i64,
    /// The cell on the other axis.
    pub row: i64,
    /// Where the line is crossed within that cell, in 1/65536.
    pub offset: u16,
}

/// Calls `visit` for every edge between the cells of `from` and `to`, in order.
pub fn walk<E>(
    from: Place,
    to: Place,
    mut visit: impl FnMut(Step) -> Result<(), E>,
) -> Result<(), E> {
    // The same way in both directions: it starts at the smaller place.
    let (from, to) = if from <= to { (from, to) } else { (to, from) };
    let mut cell = from.map(|c| c.div_euclid(SUB));
    let end = to.map(|c| c.div_euclid(SUB));
    let span = [to[0] - from[0], to[1] - from[1]];
    while cell != end {
        let next: [i64; 2] =
            std::array::from_fn(|a| if span[a] > 0 { cell[a] + 1 } else { cell[a] });
        let along = if cell[0] == end[0] {
            1
        } else if cell[1] == end[1] {
            0
        } else {
            // Whichever line is met first; at a corner the first axis.
            let reach: [i64; 2] = std::array::from_fn(|a| (next[a] * SUB - from[a]).abs());
            usize::from(reach[0] * span[1].abs() > reach[1] * span[0].abs())
        };
        let across = 1 - along;
        let line = next[along];
        let numerator = (line * SUB - from[along]) * span[across];
        let place = (from[across] - cell[across] * SUB) * SUB + numerator * SUB / span[along];
        let offset = place.clamp(END_GAP, (1 << 16) - END_GAP) as u16;
        visit(Step { along, line, row: cell[across], offset })?;
        cell[along] += if span[along] > 0 { 1 } else { -1 };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn steps(from: Place, to: Place) -> Vec<Step> {
        let mut steps = Vec::new();
        let done: Result<(), ()> = walk(from, to, |step| {
            steps.push(step);
            Ok(())
        });
        assert_eq!(done, Ok(()));
        steps
    }

    #[test]
    fn a_straight_way_keeps_its_height() {
        let found = steps([100, 77], [100 + 4 * SUB, 77]);
        assert_eq!(found.len(), 4);
        assert!(found.iter().all(|s| s.along == 0 && s.row == 0 && s.offset == 77 * 256));
        assert_eq!(found[0].line, 1);
    }

    proptest! {
        #[test]
        fn the_way_is_as_long_as_the_cells_are_apart_and_the_same_back(
            a in proptest::array::uniform2(1..40_000_i64),
            b in proptest::array::uniform2(1..40_000_i64),
        ) {
            let there = steps(a, b);
            let apart: u64 = (0..2).map(|i| (a[i] / SUB).abs_diff(b[i] / SUB)).sum();
            prop_assert_eq!(there.len() as u64, apart);
            prop_assert_eq!(there, steps(b, a));
        }
    }
}
