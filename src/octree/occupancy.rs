//! Which corners of the grid are inside, for looking along rays.
//!
//! In:      the inside corners of bricks, by ascending key.
//! Out:     [`Occupancy`].
//! Memory:  the share, and 8 bytes a brick; 4 KiB a brick on disk beyond the share.

use bytemuck::{Pod, Zeroable};

use crate::octree::edge_bits::SIDE;
use crate::octree::{BrickIndex, Domain, Neighbour};
use crate::store::{Resources, StoreError, Table};

/// Words of a brick's own corners: one bit each, a row along x in half a word.
const WORDS: usize = SIDE * SIDE * SIDE / 64;

/// The inside corners of a brick. 4 104 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct InsideCorners {
    words: [u64; WORDS],
    /// Bit a: the corner one brick up along axis a is inside. A brick without a record there is so
    /// as a whole.
    beyond: u64,
}

impl Default for InsideCorners {
    fn default() -> Self {
        Self::zeroed()
    }
}

impl InsideCorners {
    /// Sets row (y, z) of the brick's own corners.
    pub fn set_row(&mut self, [y, z]: [usize; 2], bits: u64) {
        let row = z * SIDE + y;
        let own = bits & ((1 << SIDE) - 1);
        self.words[row / 2] |= own << (row % 2 * SIDE);
    }

    /// Says that the corner one brick up along `axis` from the brick's first is inside.
    pub fn set_beyond(&mut self, axis: usize) {
        self.beyond |= 1 << axis;
    }

    fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        let row = z * SIDE + y;
        self.words[row / 2] >> (row % 2 * SIDE + x) & 1 == 1
    }
}

/// The inside corners of all bricks.
pub struct Occupancy {
    index: BrickIndex,
    corners: Table<InsideCorners>,
    domain: Domain,
}

/// The place on a ray, and what is known of the brick there.
struct Walker<'o> {
    occupancy: &'o mut Occupancy,
    brick: [u32; 3],
    /// Its corners; `None` where it has no record.
    corners: Option<InsideCorners>,
    /// Whether a brick without a record is inside.
    is_filled: bool,
}

impl Walker<'_> {
    /// Goes to a corner beside the last one, along `axis`; whether it is inside.
    fn step(&mut self, at: [u32; 3], axis: usize) -> Result<bool, StoreError> {
        let side = SIDE as u32;
        let brick = at.map(|c| c / side);
        if brick != self.brick {
            // Only the lower brick has the edges between two.
            let is_up = brick[axis] > self.brick[axis];
            if let (true, Some(corners)) = (is_up, &self.corners) {
                self.is_filled = corners.beyond >> axis & 1 == 1;
            } else if self.corners.is_some() {
                self.is_filled = false;
            }
            self.brick = brick;
            self.corners = self.occupancy.corners_of(brick)?;
        }
        Ok(match &self.corners {
            Some(corners) => corners.is_inside(at.map(|c| (c % side) as usize)),
            None => self.is_filled,
        })
    }
}

impl Occupancy {
    /// Of bricks with these ascending keys.
    #[must_use]
    pub fn new(keys: Vec<u64>, corners: Table<InsideCorners>, domain: &Domain) -> Self {
        let index = BrickIndex::new(keys, domain.bricks_per_side());
        Self { index, corners, domain: *domain }
    }

    /// An empty table to be filled with the corners of the bricks, by ascending key.
    #[must_use]
    pub fn table(resources: &Resources) -> Table<InsideCorners> {
        Table::new(resources.scratch, resources.share_bytes / 4)
    }

    fn corners_of(&mut self, brick: [u32; 3]) -> Result<Option<InsideCorners>, StoreError> {
        match self.index.locate(brick) {
            Neighbour::Brick(number) => self.corners.get(number as u64).map(Some),
            Neighbour::Empty(_) | Neighbour::Outside => Ok(None),
        }
    }

    /// Whether a ray from an outside corner leaves the grid before it comes to an inside one. Every
    /// corner stands for the cube of one cell around it.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn escapes(&mut self, from: [u32; 3], towards: [f64; 3]) -> Result<bool, StoreError> {
        let end = 1_u32 << self.domain.depth;
        let step_length = towards.map(|d| 1.0 / d.abs());
        // From the middle of a cube its sides are half a cell off.
        let mut next = step_length.map(|length| 0.5 * length);
        let mut at = from;
        let brick = from.map(|c| c / SIDE as u32);
        let corners = self.corners_of(brick)?;
        let mut walker = Walker { occupancy: self, brick, corners, is_filled: false };
        loop {
            let axis = match next {
                [x, y, z] if x <= y && x <= z => 0,
                [_, y, z] if y <= z => 1,
                _ => 2,
            };
            if towards[axis] > 0.0 {
                at[axis] += 1;
            } else if at[axis] == 0 {
                return Ok(true);
            } else {
                at[axis] -= 1;
            }
            if at[axis] >= end {
                return Ok(true);
            }
            next[axis] += step_length[axis];
            if walker.step(at, axis)? {
                return Ok(false);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{BrickKey, SnapBox};
    use crate::store::Scratch;

    /// A grid of 4^3 bricks of which one has a wall of corners, whose upper neighbour is filled.
    fn occupancy(scratch: &Scratch) -> Occupancy {
        let domain = Domain::around(&SnapBox { lo: [0.0; 3], hi: [1.0; 3] }, 7, false)
            .expect("a unit box fits");
        let mut corners = Table::new(scratch, 1 << 20);
        let mut walled = InsideCorners::default();
        for z in 0..SIDE {
            for y in 0..SIDE {
                walled.set_row([y, z], if y == 3 { 0 } else { 1 << 5 });
            }
        }
        walled.set_beyond(1);
        corners.push(walled).expect("push works");
        Occupancy::new(vec![BrickKey::new([1, 1, 1]).0], corners, &domain)
    }

    #[test]
    fn rays_end_at_inside_corners_and_in_bricks_that_are_filled() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut occupancy = occupancy(&Scratch::new(folder.path()));
        let mut escapes =
            |from, towards| occupancy.escapes(from, towards).expect("the table can be read");
        let from = [32 + 2, 32 + 10, 32 + 10];
        assert!(!escapes(from, [1.0, 1e-9, 1e-9]), "a wall");
        assert!(escapes(from, [-1.0, 1e-9, 1e-9]), "nothing");
        assert!(!escapes(from, [1e-9, 1.0, 1e-9]), "the brick above is filled");
        assert!(escapes(from, [1e-9, -1.0, 1e-9]), "the brick below is not");
        assert!(escapes([32 + 2, 32 + 3, 32 + 10], [1.0, 1e-9, 1e-9]), "a slit");
        assert!(escapes([2, 32 + 10, 32 + 10], [-1.0, -1e-9, 1e-9]));
        assert!(!escapes([2, 32 + 10, 32 + 10], [1.0, 1e-9, -1e-9]), "from afar");
    }
}
