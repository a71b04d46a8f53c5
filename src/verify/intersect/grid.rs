//! Grids of cubes over the triangles, and cells inside of cells.
//!
//! Invariant:  the cell of a coordinate never falls while the coordinate rises. That is all that
//!             the join of cells rests on: rounding moves walls, alike for all triangles.
//! Units:      model units; a cell's side is a power of two.

use crate::geom::signs::Point;

/// Cells of the outermost grid along an axis, as a power of two. What lies farther out belongs to
/// the last ones.
const ROOT_BITS: u32 = 21;

/// A grid along all three axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// Cells per model unit.
    scale: f64,
    /// Subtracted after scaling.
    offset: [f64; 3],
    /// The last cell.
    last: u32,
}

/// A box of cells, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CellRange {
    pub(crate) low: [u32; 3],
    pub(crate) high: [u32; 3],
}

impl Grid {
    /// The outermost grid, with cells of about a side, around a point of the mesh: far from the
    /// origin all of it would lie in the last cells of a grid around that.
    pub(crate) fn around(middle: Point, side: f64) -> Self {
        // The nearest power of two, by the exponent's bits.
        let exponent = ((side * std::f64::consts::SQRT_2).to_bits() >> 52) as i32 - 1023;
        let exponent = exponent.clamp(-1000, 1000);
        let half = f64::from(1_u32 << (ROOT_BITS - 1));
        let scale = power(-exponent);
        // A whole number of cells, or none where that is no number.
        let cells = middle.map(|x| (x * scale).floor());
        let offset = cells.map(|cells| if cells.is_finite() { cells - half } else { -half });
        Self { scale, offset, last: (1 << ROOT_BITS) - 1 }
    }

    /// The cell of a coordinate.
    #[inline]
    pub(crate) fn cell(&self, axis: usize, x: f64) -> u32 {
        // The conversion itself stops at zero and at the largest number.
        ((x * self.scale - self.offset[axis]) as u32).min(self.last)
    }

    /// The cells that a box meets.
    #[inline]
    pub(crate) fn range(&self, low: Point, high: Point) -> CellRange {
        CellRange {
            low: std::array::from_fn(|axis| self.cell(axis, low[axis])),
            high: std::array::from_fn(|axis| self.cell(axis, high[axis])),
        }
    }

    /// The side of a cell.
    pub(crate) fn side(&self) -> f64 {
        1.0 / self.scale
    }

    /// Whether a triangle of this extent is put only into those cells of its box that it meets
    /// itself; others are put into all of them, eight at most.
    #[inline]
    pub(crate) fn is_wide(&self, extent: f64) -> bool {
        extent * self.scale > 0.25
    }

    /// The middle of a box of cells and half of its sides.
    pub(crate) fn middle(&self, range: &CellRange) -> (Point, Point) {
        let at = |axis: usize, cell: f64| (cell + self.offset[axis]) / self.scale;
        let low: Point = std::array::from_fn(|i| at(i, f64::from(range.low[i])));
        let high: Point = std::array::from_fn(|i| at(i, f64::from(range.high[i]) + 1.0));
        (
            std::array::from_fn(|i| low[i].midpoint(high[i])),
            std::array::from_fn(|i| (high[i] - low[i]) / 2.0),
        )
    }

    /// Whether a range of cells touches those that hold all that lies beyond the grid.
    pub(crate) fn is_at_border(&self, range: &CellRange) -> bool {
        (0..3).any(|axis| range.low[axis] == 0 || range.high[axis] == self.last)
    }

    /// A grid of 2^bits cells a side inside of a cell that is `1 << shift` cells of this one wide.
    pub(crate) fn within(&self, cell: [u32; 3], shift: u32, bits: u32) -> Self {
        let finer = power(bits as i32 - shift as i32);
        let low = cell.map(|c| f64::from(c) * power(shift as i32));
        Self {
            scale: self.scale * finer,
            offset: std::array::from_fn(|i| (low[i] + self.offset[i]) * finer),
            last: (1 << bits) - 1,
        }
    }
}

impl CellRange {
    /// The one cell that it is.
    #[inline]
    pub(crate) fn single(&self) -> Option<[u32; 3]> {
        (self.low == self.high).then_some(self.low)
    }

    /// The same in cells that are `1 << shift` times as wide.
    pub(crate) fn coarser(&self, shift: u32) -> Self {
        Self { low: self.low.map(|c| c >> shift), high: self.high.map(|c| c >> shift) }
    }

    /// Shows every cell.
    pub(crate) fn try_each<E>(
        &self,
        mut visit: impl FnMut([u32; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        for z in self.low[2]..=self.high[2] {
            for y in self.low[1]..=self.high[1] {
                for x in self.low[0]..=self.high[0] {
                    visit([x, y, z])?;
                }
            }
        }
        Ok(())
    }
}

/// Two to the power of a normal exponent.
pub(crate) fn power(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent.clamp(-1022, 1023)) as u64) << 52)
}

/// The bits of three numbers of 21 bits in turns, so that cells inside of a coarser one are next to
/// each other.
#[inline]
pub(crate) fn key_of_cell(cell: [u32; 3]) -> u64 {
    let spread = |x: u32| {
        let mut x = u64::from(x);
        x = (x | x << 32) & 0x001f_0000_0000_ffff;
        x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}

/// The cell of a key.
pub(crate) fn cell_of_key(key: u64) -> [u32; 3] {
    let gather = |x: u64| {
        let mut x = x & 0x1249_2492_4924_9249;
        x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
        x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
        x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
        x = (x | x >> 16) & 0x001f_0000_0000_ffff;
        ((x | x >> 32) & 0x001f_ffff) as u32
    };
    [gather(key), gather(key >> 1), gather(key >> 2)]
}

/// Lowest and highest corner.
#[inline]
pub(crate) fn box_of([a, b, c]: &[Point; 3]) -> [Point; 2] {
    // All are numbers, which `f64::min` would look after.
    let less = |x: f64, y: f64| if x < y { x } else { y };
    let more = |x: f64, y: f64| if x > y { x } else { y };
    let low = |i: usize| less(less(a[i], b[i]), c[i]);
    let high = |i: usize| more(more(a[i], b[i]), c[i]);
    [[low(0), low(1), low(2)], [high(0), high(1), high(2)]]
}

/// The longest side of a box.
#[inline]
pub(crate) fn extent_of([low, high]: &[Point; 2]) -> f64 {
    (high[0] - low[0]).max(high[1] - low[1]).max(high[2] - low[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_cells_are_one_to_one_and_nested() {
        for cell in [[0, 0, 0], [1, 2, 3], [0x1f_ffff, 0, 0x15_5555], [77_777, 1 << 20, 0x1f_ffff]]
        {
            let key = key_of_cell(cell);
            assert_eq!(cell_of_key(key), cell);
            assert_eq!(key >> 15, key_of_cell(cell.map(|c| c >> 5)));
        }
    }

    #[test]
    fn a_grid_inside_of_a_cell_divides_it_and_takes_what_is_beyond() {
        let root = Grid::around([0.0; 3], 4.0);
        assert_eq!(root.side(), 4.0);
        let cell = [root.cell(0, 9.0), root.cell(1, -1.0), root.cell(2, 0.0)];
        assert_eq!(cell, [(1 << 20) + 2, (1 << 20) - 1, 1 << 20]);
        let inner = root.within(cell, 0, 2);
        assert_eq!([8.0, 9.0, 11.9, 12.0].map(|x| inner.cell(0, x)), [0, 1, 3, 3]);
        assert_eq!([-9.0, -4.0, -1.0, 5.0].map(|x| inner.cell(1, x)), [0, 0, 3, 3]);
        let wide = root.within(cell.map(|c| c >> 3), 3, 3);
        assert_eq!(wide.side(), 4.0);
        assert_eq!(wide.cell(0, 9.0), 2);
        assert_eq!(root.cell(0, f64::MAX), (1 << 21) - 1);
    }

    #[test]
    fn a_mesh_far_from_the_origin_has_as_many_cells_as_one_there() {
        for far in [1e6, -1e9, 1e14] {
            let grid = Grid::around([far, 0.0, -far], 0.25);
            let cells = [0.0, 0.25, 1.0, -1.0].map(|by| grid.cell(0, far + by));
            let home = cells[0];
            assert_eq!(cells, [home, home + 1, home + 4, home - 4], "{far}");
            assert!(!grid.is_at_border(&grid.range([far, 0.0, -far], [far, 0.0, -far])));
        }
        assert_eq!(Grid::around([f64::MAX; 3], 1e-9).cell(0, 0.0), 1 << 20);
    }
}
