//! A cell of the cut: how it is packed, and the box that its vertex may be in.
//!
//! Units: places in cells from the min corner of the brick that looks.

use crate::contour::mdc::cell::place_of;
use crate::octree::{MAX_LEVEL, SIDE};

/// A cell of the cut, packed: number of its first leaf cell (15 bits), level (4 bits at 15), whether
/// it is flagged (bit 19), whether it has several vertices (bit 20), and one more
/// than the face that its vertex reaches through (3 bits at 21). Of a cell above the brick, which of
/// its bricks along each axis this one is (10 bits each at 32).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CutCell(u64);

impl CutCell {
    const FLAGGED: u64 = 1 << 19;
    const MULTI: u64 = 1 << 20;
    const REACHES: u64 = 7 << 21;

    /// Packs.
    #[inline]
    pub fn new(first: usize, level: u32, is_flagged: bool, is_multi: bool) -> Self {
        let flagged = if is_flagged { Self::FLAGGED } else { 0 };
        let multi = if is_multi { Self::MULTI } else { 0 };
        Self(first as u64 | u64::from(level) << 15 | flagged | multi)
    }

    /// The cell above the brick at `brick`, which has one vertex.
    pub fn above(level: u32, brick: [u32; 3]) -> Self {
        let last = (1_u64 << (level - MAX_LEVEL)) - 1;
        let [x, y, z] = brick.map(|c| u64::from(c) & last);
        Self(u64::from(level) << 15 | x << 32 | y << 42 | z << 52)
    }

    /// Of a cell above the brick, which of its bricks along each axis this is.
    #[inline]
    pub fn brick_in_it(self) -> [i32; 3] {
        [32, 42, 52].map(|shift| (self.0 >> shift & 0x3ff) as i32)
    }

    /// Whether it is larger than a brick.
    #[inline]
    pub fn is_above(self) -> bool {
        self.level() > MAX_LEVEL
    }

    /// The number of its first leaf cell.
    #[inline]
    pub fn first(self) -> usize {
        (self.0 & 0x7fff) as usize
    }

    /// 0 for a leaf cell.
    #[inline]
    pub fn level(self) -> u32 {
        (self.0 >> 15 & 15) as u32
    }

    /// Whether all its face points are vertices.
    #[inline]
    pub fn is_flagged(self) -> bool {
        self.0 & Self::FLAGGED != 0
    }

    /// Whether it has several vertices.
    #[inline]
    pub fn is_multi(self) -> bool {
        self.0 & Self::MULTI != 0
    }

    /// The same cell, whose vertex reaches through `face`.
    #[inline]
    pub fn reaching(self, face: u8) -> Self {
        Self(self.0 | (u64::from(face) + 1) << 21)
    }

    /// The face that its vertex reaches through into the cell beyond.
    #[inline]
    pub fn reaches(self) -> Option<usize> {
        (self.0 >> 21 & 7).checked_sub(1).map(|face| face as usize)
    }

    /// Whether its box is that of a leaf cell.
    #[inline]
    pub fn is_unit(self) -> bool {
        self.0 & (15 << 15 | Self::REACHES) == 0
    }

    /// Whether it is a leaf cell that is not flagged, and its vertex is in it.
    #[inline]
    pub fn is_plain(self) -> bool {
        self.0 & (15 << 15 | Self::REACHES | Self::FLAGGED) == 0
    }

    /// Whether both boxes are cubes of one size.
    #[inline]
    pub fn is_as_large_as(self, other: Self) -> bool {
        self.level() == other.level() && (self.0 | other.0) & Self::REACHES == 0
    }
}

/// A cell of the cut as a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CutBox {
    /// Its low corner, in cells.
    pub low: [i32; 3],
    /// Its high corner.
    pub high: [i32; 3],
}

impl CutBox {
    /// The box of a cell of the cut in the brick in slot `slot`.
    pub fn new(slot: usize, cut: CutCell) -> Self {
        let place = place_of(cut.first());
        let steps = steps_of(slot);
        let brick = cut.brick_in_it();
        let mut low: [i32; 3] =
            std::array::from_fn(|a| place[a] as i32 + (steps[a] - brick[a]) * SIDE as i32);
        let mut high = low.map(|c| c + (1 << cut.level()));
        if let Some(face) = cut.reaches() {
            if face % 2 == 1 {
                high[face / 2] += 1;
            } else {
                low[face / 2] -= 1;
            }
        }
        Self { low, high }
    }

    /// The same box, moved.
    pub fn moved(self, by: [i32; 3]) -> Self {
        let add = |end: [i32; 3]| std::array::from_fn(|a| end[a] + by[a]);
        Self { low: add(self.low), high: add(self.high) }
    }

    /// Whether a leaf cell lies in it.
    #[inline]
    pub fn holds(&self, cell: [i32; 3]) -> bool {
        (0..3).all(|a| (self.low[a]..self.high[a]).contains(&cell[a]))
    }
}

/// How many bricks away slot `slot` lies along each axis.
#[inline]
pub const fn steps_of(slot: usize) -> [i32; 3] {
    [slot as i32 % 3 - 1, slot as i32 / 3 % 3 - 1, slot as i32 / 9 - 1]
}
