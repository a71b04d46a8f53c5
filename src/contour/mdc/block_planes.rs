//! The planes that pass a block of cells, each once, with its crossings there.
//!
//! In:         crossings of the block and of edges that leave it, in any order.
//! Out:        of each plane of the block the sum of its crossings; the other planes.
//! Units:      cells, from the brick's min corner.
//! Memory:     8 bytes a plane of the brick, and 80 a plane of the block.
//! Fails:      never.
//! Source:     ours.

use glam::DVec3;

use crate::contour::mdc::cluster::Group;

/// The crossings of a block, plane by plane.
#[derive(Default)]
pub struct BlockPlanes {
    /// Which block this is: one more for every one.
    block: u32,
    /// Of every plane, by the number of its normal, the last block that has it and its rank there.
    seen: Vec<[u32; 2]>,
    /// The planes of the block.
    pub own: Vec<Group>,
    /// Numbers of the normals on edges that leave it, but for those that were own planes before.
    pub leaving: Vec<u32>,
}

/// In place of a rank: of a plane on edges that leave the block only.
const LEAVES: u32 = u32::MAX;

impl BlockPlanes {
    /// Goes on with another block.
    pub fn begin(&mut self) {
        self.own.clear();
        self.leaving.clear();
        self.block = self.block.checked_add(1).unwrap_or_else(|| {
            self.seen.fill([0; 2]);
            1
        });
    }

    /// Whether a plane is of the block or of an edge that leaves it.
    #[inline]
    pub fn has(&self, number: u32) -> bool {
        self.seen.get(number as usize).is_some_and(|seen| seen[0] == self.block)
    }

    /// Where it is noted that a plane was seen.
    #[inline]
    fn seen(&mut self, number: u32) -> &mut [u32; 2] {
        let number = number as usize;
        if number >= self.seen.len() {
            self.seen.resize(number + 1, [0; 2]);
        }
        &mut self.seen[number]
    }

    /// Adds a crossing of the block.
    #[inline]
    pub fn add(&mut self, number: u32, point: DVec3) {
        let (block, next) = (self.block, self.own.len() as u32);
        let seen = self.seen(number);
        let [last, mut rank] = *seen;
        if last != block || rank == LEAVES {
            rank = next;
            *seen = [block, rank];
            self.own.push(Group::of_plane(number - 1));
        }
        self.own[rank as usize].add_point(point);
    }

    /// Notes the plane of an edge that leaves the block.
    #[inline]
    pub fn note(&mut self, number: u32) {
        let block = self.block;
        let seen = self.seen(number);
        if seen[0] != block {
            *seen = [block, LEAVES];
            self.leaving.push(number);
        }
    }
}
