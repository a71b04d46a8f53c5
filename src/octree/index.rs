//! The octree above the bricks: which bricks exist, and the empty nodes between them.
//!
//! A linear octree over the sorted Morton keys of the bricks: a node is a level and a prefix of
//! keys, its bricks are a range of the list. Empty nodes are the largest nodes without a brick;
//! they fill the grid together with the bricks.
//!
//! Memory:  8 bytes a brick and 16 bytes an empty node; about one to two empty nodes a brick.
//! Source:  Gargantini 1982, An effective way to represent quadtrees.

use crate::geom::morton;
use crate::octree::key::BrickKey;

/// Bricks and empty nodes of the grid.
#[derive(Clone, Debug)]
pub struct BrickIndex {
    bricks: Vec<u64>,
    empties: Vec<EmptyNode>,
    side: u32,
}

#[derive(Clone, Copy, Debug)]
struct EmptyNode {
    /// Key of its lowest brick.
    first: u64,
    /// Its side is 2^level bricks.
    level: u32,
}

/// What lies at a place of the brick grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbour {
    /// The brick with this number.
    Brick(usize),
    /// The empty node with this number.
    Empty(usize),
    /// Nothing: the place is outside of the grid.
    Outside,
}

impl BrickIndex {
    /// The index of bricks with ascending keys in a grid of `side` bricks, a power of two.
    #[must_use]
    pub fn new(bricks: Vec<u64>, side: u32) -> Self {
        assert!(bricks.is_sorted_by(|a, b| a < b), "brick keys ascend");
        let mut index = Self { bricks, empties: Vec::new(), side };
        index.collect_empties(0, side.trailing_zeros(), 0, index.bricks.len());
        index
    }

    /// Visits the node at `first` of `level`, whose bricks are `from..to`.
    fn collect_empties(&mut self, first: u64, level: u32, from: usize, to: usize) {
        if from == to {
            self.empties.push(EmptyNode { first, level });
            return;
        }
        if level == 0 {
            return;
        }
        let step = 1 << (3 * (level - 1));
        let mut start = from;
        for child in 0..8 {
            let child_first = first + child * step;
            let end =
                start + self.bricks[start..to].partition_point(|&brick| brick < child_first + step);
            self.collect_empties(child_first, level - 1, start, end);
            start = end;
        }
    }

    /// The number of empty nodes.
    #[must_use]
    pub fn empty_count(&self) -> usize {
        self.empties.len()
    }

    /// What covers the brick at `position`.
    #[must_use]
    pub fn locate(&self, position: [u32; 3]) -> Neighbour {
        if position.iter().any(|&c| c >= self.side) {
            return Neighbour::Outside;
        }
        let key = BrickKey::new(position).0;
        match self.bricks.binary_search(&key) {
            Ok(number) => Neighbour::Brick(number),
            Err(_) => {
                let after = self.empties.partition_point(|node| node.first <= key);
                Neighbour::Empty(after - 1)
            }
        }
    }

    /// Calls `visit` with every empty node and each neighbour across its six sides that is an
    /// empty node of its size or larger, or the outside (`None`).
    pub fn for_each_empty_contact<E>(
        &self,
        mut visit: impl FnMut(usize, Option<usize>) -> Result<(), E>,
    ) -> Result<(), E> {
        for (number, node) in self.empties.iter().enumerate() {
            let position = morton::decode(node.first);
            let size = 1_u32 << node.level;
            for axis in 0..3 {
                for up in [false, true] {
                    let mut beyond = position;
                    beyond[axis] =
                        if up { position[axis] + size } else { position[axis].wrapping_sub(1) };
                    match self.locate(beyond) {
                        Neighbour::Outside => visit(number, None)?,
                        Neighbour::Empty(other) if self.empties[other].level >= node.level => {
                            visit(number, Some(other))?;
                        }
                        _ => {}
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_and_empty_nodes_tile_the_grid() {
        let side = 8;
        let mut keys: Vec<u64> = [[0, 0, 0], [3, 3, 3], [4, 3, 3], [7, 0, 5], [6, 0, 5]]
            .map(|p| BrickKey::new(p).0)
            .to_vec();
        keys.sort_unstable();
        let index = BrickIndex::new(keys.clone(), side);
        let volume: u32 = index.empties.iter().map(|n| 1 << (3 * n.level)).sum();
        assert_eq!(volume as usize + keys.len(), 512);
        for key in 0..512 {
            match index.locate(morton::decode(key)) {
                Neighbour::Brick(number) => assert_eq!(keys[number], key),
                Neighbour::Empty(number) => {
                    let node = index.empties[number];
                    assert!((node.first..node.first + (1 << (3 * node.level))).contains(&key));
                }
                Neighbour::Outside => panic!("{key} is in the grid"),
            }
        }
        assert_eq!(index.locate([8, 0, 0]), Neighbour::Outside);
    }

    #[test]
    fn empty_nodes_touch_through_their_sides() {
        let index = BrickIndex::new(vec![BrickKey::new([1, 1, 1]).0], 4);
        let mut outside = 0;
        let mut contacts = 0;
        let done: Result<(), ()> = index.for_each_empty_contact(|_, other| {
            match other {
                None => outside += 1,
                Some(_) => contacts += 1,
            }
            Ok(())
        });
        assert_eq!(done, Ok(()));
        assert!(outside >= 7 * 3);
        assert!(contacts >= 14);
    }
}
