//! Which cells a wide triangle meets.
//!
//! In:         a triangle and a box of cells.
//! Invariant:  no cell that it meets is left out; some that it does not meet may be there.

use crate::geom::signs::{PLANES, Point};
use crate::verify::intersect::grid::{CellRange, Grid, box_of, extent_of};

/// Far above what rounding adds up to in these sums.
const SLACK: f64 = 1.0e-9;

/// A triangle, its plane and its edges.
pub(crate) struct Reach<'t> {
    corners: &'t [Point; 3],
    edges: [Point; 3],
    normal: Point,
    /// Sums of the magnitudes of the products in `normal`.
    doubt: Point,
    /// Whether products of coordinates can neither overflow nor vanish.
    is_plain: bool,
}

/// Products of two numbers in this range, and errors of them, are numbers with all their bits.
const PLAIN: std::ops::Range<f64> = 1.0e-60..1.0e60;

impl<'t> Reach<'t> {
    pub(crate) fn new(corners: &'t [Point; 3]) -> Self {
        let minus = |p: Point, q: Point| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let [a, b, c] = *corners;
        let edges = [minus(b, a), minus(c, b), minus(a, c)];
        let product = |i: usize, j: usize| edges[0][i] * edges[1][j];
        let normal = PLANES.map(|[i, j]| product(i, j) - product(j, i));
        let doubt = PLANES.map(|[i, j]| product(i, j).abs() + product(j, i).abs());
        let most = corners.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let is_plain = PLAIN.contains(&most) && PLAIN.contains(&extent_of(&box_of(corners)));
        Self { corners, edges, normal, doubt, is_plain }
    }

    /// Shows the cells that it meets, in a box of them; `coarser` cells are `1 << shift` wide.
    pub(crate) fn try_each<E>(
        &self,
        grid: &Grid,
        range: &CellRange,
        shift: u32,
        visit: &mut impl FnMut([u32; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        let fine = CellRange {
            low: range.low.map(|c| c << shift),
            high: range.high.map(|c| (c << shift) + ((1 << shift) - 1)),
        };
        if self.is_plain && !grid.is_at_border(&fine) && !self.may_meet(grid, &fine) {
            return Ok(());
        }
        if let Some(cell) = range.single() {
            return visit(cell);
        }
        // The longest side in two halves.
        let side = |i: &usize| range.high[*i] - range.low[*i];
        let axis = (0..3).max_by_key(side).unwrap_or(0);
        let middle = range.low[axis].midpoint(range.high[axis]);
        let (mut lower, mut upper) = (*range, *range);
        lower.high[axis] = middle;
        upper.low[axis] = middle + 1;
        self.try_each(grid, &lower, shift, visit)?;
        self.try_each(grid, &upper, shift, visit)
    }

    /// Whether no plane of the usual ones separates triangle and box surely: the triangle's own,
    /// and those through an edge along an axis.
    fn may_meet(&self, grid: &Grid, range: &CellRange) -> bool {
        let (middle, half) = grid.middle(range);
        let from_middle =
            self.corners.map(|p| -> Point { std::array::from_fn(|i| p[i] - middle[i]) });
        let most: Point = std::array::from_fn(|i| {
            half[i] + middle[i].abs() + self.corners.iter().map(|p| p[i].abs()).fold(0.0, f64::max)
        });
        let a = from_middle[0];
        let distance = (0..3).map(|i| self.normal[i] * a[i]).sum::<f64>().abs();
        let radius = (0..3).map(|i| self.normal[i].abs() * half[i]).sum::<f64>();
        let slack = SLACK * (0..3).map(|i| self.doubt[i] * most[i]).sum::<f64>();
        if distance > radius + slack {
            return false;
        }
        PLANES.into_iter().all(|[i, j]| {
            self.edges.iter().all(|edge| {
                let across = |p: &Point| edge[i] * p[j] - edge[j] * p[i];
                let sides = from_middle.each_ref().map(across);
                let (low, high) =
                    (sides[0].min(sides[1]).min(sides[2]), sides[0].max(sides[1]).max(sides[2]));
                let radius = edge[i].abs() * half[j] + edge[j].abs() * half[i];
                let slack = SLACK * (edge[i].abs() * most[j] + edge[j].abs() * most[i]);
                let are_apart = low > radius + slack || high < -radius - slack;
                !are_apart
            })
        })
    }
}
