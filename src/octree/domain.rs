//! The lattice: model coordinates to integers and back, exactly.
//!
//! One lattice of 2^28 units a side for all depths. Its unit is a power of two in model units and
//! its origin a multiple of the unit, so that lattice points are exact in f64. A cell is a whole
//! number of units, a multiple of 64. The grid is 2^depth cells; the model lies in its middle.
//!
//! Units: "units" are lattice units, "cells" are cell sides.

use serde::{Deserialize, Serialize};

use crate::octree::SIDE;

/// Bits of a lattice coordinate.
pub const LATTICE_BITS: u32 = 28;

/// Cells are multiples of this many units; of fewer where cells are near the smallest allowed.
const CELL_MULTIPLE: u64 = 64;
const SMALL_CELL_MULTIPLE: u64 = MIN_CELL_UNITS;
const SMALL_CELL_UNITS: u64 = 1024;
/// A smaller cell leaves vertices no room (design: 16 steps of the output grid).
pub const MIN_CELL_UNITS: u64 = 16;
/// Where the middle of the model lies in its cell. Odd shares, so that planes of symmetry and
/// other round places of a model do not fall on planes of the grid.
const MIDDLE_SHARES: [f64; 3] = [0.287_109_375, 0.313_476_562_5, 0.339_843_75];
/// Largest share of the grid that the model's longest side takes.
const MAX_FILL: f64 = 0.9;
/// Cells kept free on both sides together.
const MARGIN_CELLS: f64 = 4.0;
/// A unit is never smaller than 2 to this power: coordinates far below are denormal noise.
const MIN_UNIT_EXPONENT: i32 = -960;

/// An axis-parallel box in model units, finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnapBox {
    /// Smallest coordinates.
    pub lo: [f64; 3],
    /// Largest coordinates.
    pub hi: [f64; 3],
}

impl SnapBox {
    /// A box that holds nothing yet.
    pub const EMPTY: Self = Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] };

    /// Grows the box to hold `point`.
    pub fn add(&mut self, point: [f64; 3]) {
        self.lo = std::array::from_fn(|a| self.lo[a].min(point[a]));
        self.hi = std::array::from_fn(|a| self.hi[a].max(point[a]));
    }

    /// The box with so much more on every side.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        Self { lo: self.lo.map(|c| c - by), hi: self.hi.map(|c| c + by) }
    }

    /// Half of the longest side; halves cannot overflow.
    fn half_longest(&self) -> f64 {
        (0..3).map(|a| self.hi[a] * 0.5 - self.lo[a] * 0.5).fold(0.0, f64::max)
    }

    /// The diagonal, model units; infinite when it overflows.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let longest = self.half_longest();
        if longest == 0.0 {
            return 0.0;
        }
        let sum: f64 = (0..3)
            .map(|a| (self.hi[a] * 0.5 - self.lo[a] * 0.5) / longest)
            .map(|share| share * share)
            .sum();
        longest * sum.sqrt() * 2.0
    }

    /// The longest side, model units; infinite when it overflows.
    #[must_use]
    pub fn longest(&self) -> f64 {
        self.half_longest() * 2.0
    }
}

/// The map between model units, lattice units, cells and bricks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Domain {
    /// The octree's depth: the grid has 2^depth cells a side.
    pub depth: u32,
    /// The lattice unit is 2 to this power, in model units.
    pub unit_exponent: i32,
    /// The lattice point (0, 0, 0) in multiples of the unit.
    pub origin_units: [i64; 3],
    /// Side of a cell in lattice units.
    pub cell_units: u32,
}

impl Domain {
    /// The domain at `depth` (4 to 15) around the finite, non-empty box of the model. With
    /// `single_precision` every lattice point near the model is exact in f32.
    ///
    /// # Errors
    /// The deepest depth at which cells keep [`MIN_CELL_UNITS`], when `depth` is beyond it.
    pub fn around(model: &SnapBox, depth: u32, single_precision: bool) -> Result<Self, u32> {
        let domain = Self::fitted(model, depth, single_precision);
        match domain.wanted_cell_units(model) {
            // Where f64 itself is that coarse, the model has no finer detail to lose.
            units if units >= MIN_CELL_UNITS as f64 || !single_precision => Ok(domain),
            _ if depth == 4 => Err(0),
            _ => {
                Err(Self::around(model, depth - 1, single_precision)
                    .map_or_else(|d| d, |d| d.depth))
            }
        }
    }

    /// The cell that the model asks for, in units; the domain's own is rounded up.
    fn wanted_cell_units(&self, model: &SnapBox) -> f64 {
        let half_longest = model.half_longest();
        if half_longest == 0.0 {
            return f64::from(self.cell_units);
        }
        scale(half_longest, -self.unit_exponent) * 2.0 / fill_cells(self.depth)
    }

    fn fitted(model: &SnapBox, depth: u32, single_precision: bool) -> Self {
        assert!((4..=15).contains(&depth), "depth {depth} is outside of 4..=15");
        let half_longest = model.half_longest();
        let farthest = (0..3).map(|a| model.lo[a].abs().max(model.hi[a].abs())).fold(0.0, f64::max);
        // No finer than the spacing of f64 at the farthest coordinate: then origins are exact.
        let mut exponent = (exponent_of(farthest) - 52).max(MIN_UNIT_EXPONENT);
        if single_precision {
            // Vertices may lie a cell beyond the model's box.
            let reach = farthest + half_longest * 0.5;
            exponent = exponent.max(exponent_of(reach) - 23);
        }
        let fine = exponent_of(half_longest) + 1 - LATTICE_BITS as i32;
        exponent = exponent.max(fine);
        loop {
            let units = scale(half_longest, -exponent) * 2.0;
            let wanted = ((units / fill_cells(depth)).ceil() as u64).max(1);
            let multiple =
                if wanted < SMALL_CELL_UNITS { SMALL_CELL_MULTIPLE } else { CELL_MULTIPLE };
            let cell = wanted.next_multiple_of(multiple);
            if cell << depth <= 1 << LATTICE_BITS {
                let centre = |a: usize| {
                    let middle = model.lo[a] * 0.5 + model.hi[a] * 0.5;
                    let shift = (cell as f64 * MIDDLE_SHARES[a]) as i64;
                    scale(middle, -exponent).floor() as i64 - ((cell << depth) / 2) as i64 - shift
                };
                return Self {
                    depth,
                    unit_exponent: exponent,
                    origin_units: [centre(0), centre(1), centre(2)],
                    cell_units: cell as u32,
                };
            }
            exponent += 1;
        }
    }

    /// The cell's side in model units.
    #[must_use]
    pub fn cell_size(&self) -> f64 {
        scale(f64::from(self.cell_units), self.unit_exponent)
    }

    /// The side of a brick in lattice units.
    #[must_use]
    pub fn brick_units(&self) -> i64 {
        i64::from(self.cell_units) * SIDE as i64
    }

    /// Bricks along one side of the grid.
    #[must_use]
    pub fn bricks_per_side(&self) -> u32 {
        (1_u32 << self.depth).div_ceil(SIDE as u32)
    }

    /// The box of the grid without so many cells at its border, model units.
    #[must_use]
    pub fn room(&self, free_cells: i64) -> SnapBox {
        let cell = i64::from(self.cell_units);
        let [lo, hi] = [free_cells * cell, (cell << self.depth) - free_cells * cell];
        SnapBox { lo: self.to_model([lo; 3]), hi: self.to_model([hi; 3]) }
    }

    /// The nearest lattice point to a point of the model's box.
    #[must_use]
    #[inline]
    pub fn snap(&self, point: [f64; 3]) -> [i32; 3] {
        let to_units = power_of_two(-self.unit_exponent);
        let is_near = self.origin_units.iter().all(|units| units.unsigned_abs() < NEAR_UNITS);
        let origin = self.origin_units;
        if is_near {
            std::array::from_fn(|a| (nearest_of_near(point[a] * to_units) - origin[a]) as i32)
        } else {
            std::array::from_fn(|a| (nearest(point[a] * to_units) - origin[a]) as i32)
        }
    }

    /// A point in lattice units without rounding to the lattice (up to the last bit of f64).
    #[must_use]
    #[inline]
    pub fn to_units(&self, point: [f64; 3]) -> [f64; 3] {
        let to_units = power_of_two(-self.unit_exponent);
        std::array::from_fn(|a| point[a] * to_units - self.origin_units[a] as f64)
    }

    /// The model coordinates of a lattice point. Exact.
    #[must_use]
    #[inline]
    pub fn to_model(&self, point: [i64; 3]) -> [f64; 3] {
        let unit = power_of_two(self.unit_exponent);
        std::array::from_fn(|a| (self.origin_units[a] + point[a]) as f64 * unit)
    }
}

/// Origins nearer than this leave all coordinates of their lattices below 2^51.
const NEAR_UNITS: u64 = 1 << 50;

/// The nearest integer, of two the even one.
fn nearest(x: f64) -> i64 {
    x.round_ties_even() as i64
}

/// The same below 2^51: where numbers are whole, adding rounds.
#[inline]
fn nearest_of_near(x: f64) -> i64 {
    const WHOLE: f64 = (3_u64 << 51) as f64;
    (x + WHOLE).to_bits() as i64 - WHOLE.to_bits() as i64
}

/// Cells that the model's longest side takes.
fn fill_cells(depth: u32) -> f64 {
    let cells = f64::from(1_u32 << depth);
    (MAX_FILL * cells).min(cells - MARGIN_CELLS)
}

/// The exponent e with 2^e <= x < 2^(e+1); very small for zero and denormals.
fn exponent_of(x: f64) -> i32 {
    (x.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

/// 2^exponent for exponents of normal numbers.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// x times 2^exponent.
fn scale(x: f64, exponent: i32) -> f64 {
    x * power_of_two(exponent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn both_ways_to_the_nearest_integer_agree(
            whole in -1_i64 << 50..1 << 50, quarters in 0..4_u8, off in -1e-3..1e-3_f64,
        ) {
            for x in [whole as f64 + f64::from(quarters) * 0.25, (whole % 4096) as f64 + off] {
                prop_assert_eq!(nearest_of_near(x), nearest(x));
            }
        }
    }

    fn check(model: SnapBox, depth: u32) {
        let domain = Domain::around(&model, depth, false).expect("room enough");
        let side = i64::from(domain.cell_units) << depth;
        assert!(side <= 1 << LATTICE_BITS);
        assert_eq!(u64::from(domain.cell_units) % SMALL_CELL_MULTIPLE, 0);
        for corner in [model.lo, model.hi] {
            let snapped = domain.snap(corner).map(i64::from);
            for (a, &q) in snapped.iter().enumerate() {
                let margin = i64::from(domain.cell_units);
                assert!(q >= margin && q <= side - margin, "{q} of {side}, {model:?}");
                let back = domain.to_model(snapped)[a];
                assert!((back - corner[a]).abs() <= power_of_two(domain.unit_exponent) * 0.5);
            }
        }
    }

    #[test]
    fn models_far_from_the_origin_and_of_any_size_keep_their_shape() {
        for (at, size) in
            [(0.0, 1.0), (1e6, 1.0), (-1e6, 1e-3), (0.0, 1e-6), (1e9, 1e5), (3.0, 1e300)]
        {
            for depth in [4, 8, 13, 15] {
                check(SnapBox { lo: [at; 3], hi: [at + size, at + size / 2.0, at] }, depth);
            }
        }
        check(SnapBox { lo: [-1e308; 3], hi: [1e308; 3] }, 8);
        check(SnapBox { lo: [5.0; 3], hi: [5.0; 3] }, 8);
        check(SnapBox { lo: [0.0; 3], hi: [1e-310; 3] }, 8);
    }

    #[test]
    fn single_precision_models_lie_on_the_lattice_unmoved() {
        let model = SnapBox { lo: [0.0; 3], hi: [f64::from(1.7_f32); 3] };
        let domain = Domain::around(&model, 9, false).expect("room enough");
        for i in 0..100 {
            let x = f64::from(0.017_f32 * i as f32);
            if x >= 0.25 {
                assert_eq!(domain.to_model(domain.snap([x; 3]).map(i64::from)), [x; 3]);
            }
        }
    }

    #[test]
    fn too_deep_for_single_precision_names_the_depth_that_would_do() {
        let model = SnapBox { lo: [1e6; 3], hi: [1e6 + 100.0; 3] };
        let deepest = Domain::around(&model, 12, true).expect_err("f32 is too coarse there");
        assert!((4..12).contains(&deepest));
        let domain = Domain::around(&model, deepest, true).expect("this depth would do");
        let side = i64::from(domain.cell_units) << deepest;
        for q in [0, 12_345, side / 2, side] {
            let [x, _, _] = domain.to_model([q; 3]);
            assert_eq!(f64::from(x as f32), x);
        }
        assert!(Domain::around(&model, 12, false).is_ok());
    }

    proptest! {
        #[test]
        fn the_model_fills_about_half_of_the_grid_or_more(
            at in -1e4..1e4_f64, size in 1e-3..1e3_f64, depth in 4..14_u32,
        ) {
            let model = SnapBox { lo: [at; 3], hi: [at + size; 3] };
            check(model, depth);
            let domain = Domain::around(&model, depth, false).expect("room enough");
            let share = size / (domain.cell_size() * f64::from(1_u32 << depth));
            prop_assert!(share > 0.7, "{share}");
        }
    }
}
