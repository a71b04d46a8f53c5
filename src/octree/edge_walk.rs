//! Where edges of a brick are that come by ascending number: only a new row takes divisions.
//!
//! In:         edge numbers, ascending.
//! Out:        their rows, axes and lower corners, as [`edge_position`] tells them.
//! Units:      cells from the brick's min corner.
//! Memory:     none.
//! Fails:      never.

use crate::octree::{LINES, edge_position};

/// The edge under way.
#[derive(Clone, Copy, Debug, Default)]
pub struct EdgeWalk {
    /// The number of the first edge of its row.
    first: u32,
    row: usize,
    axis: usize,
    at: [usize; 3],
}

impl EdgeWalk {
    /// Goes on to an edge.
    #[inline]
    pub fn go_to(&mut self, edge: u32) {
        let x = edge.wrapping_sub(self.first) as usize;
        if x < LINES {
            self.at[0] = x;
        } else {
            self.row = edge as usize / LINES;
            self.first = (self.row * LINES) as u32;
            (self.axis, self.at) = edge_position(edge);
        }
    }

    /// Its row, among those of all axes one after the other.
    #[must_use]
    #[inline]
    pub fn row(&self) -> usize {
        self.row
    }

    /// The axis that it runs along, and its lower corner.
    #[must_use]
    #[inline]
    pub fn position(&self) -> (usize, [usize; 3]) {
        (self.axis, self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::AXIS_EDGES;

    #[test]
    fn a_walk_is_where_the_edges_are_however_long_its_steps() {
        for step in [1, 2, 32, 33, 34, 1000, 40_000] {
            let mut walk = EdgeWalk::default();
            for edge in (0..3 * AXIS_EDGES).step_by(step) {
                walk.go_to(edge);
                assert_eq!(walk.position(), edge_position(edge));
                assert_eq!(walk.row(), edge as usize / LINES);
            }
        }
    }
}
