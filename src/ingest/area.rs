//! Where the area of the soup lies: totals, and specks far away from everything else.

use serde::{Deserialize, Serialize};

use crate::octree::{SnapBox, SoupTriangle};

/// Slices per axis of the area histogram.
const SLICES: usize = 4096;
/// A window that holds this share of the area ...
const MOST_AREA: f64 = 0.999;
/// ... in less than this share of the longest side leaves the rest as a speck.
const SMALL_WINDOW: f64 = 1.0 / 16.0;

/// Area and volume of the soup as it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoupMeasure {
    /// Sum of the triangles' areas, square model units.
    pub area: f64,
    /// Sum of signed volumes towards the box's centre, cubic model units; the enclosed volume when
    /// the soup is closed and well oriented.
    pub signed_volume: f64,
    /// Nearly all area lies in this box, far smaller than the whole.
    pub dense_box: Option<SnapBox>,
}

/// Collects areas in file order.
pub struct AreaHistogram {
    bounds: SnapBox,
    centre: [f64; 3],
    longest: f64,
    slices_per_unit: f64,
    /// Area along each axis: of each triangle half where it begins and half where it ends.
    slices: [Vec<f64>; 3],
    area: f64,
    signed_volume: f64,
}

impl AreaHistogram {
    /// A histogram over a non-empty box.
    pub fn new(bounds: SnapBox) -> Self {
        let centre = std::array::from_fn(|a| bounds.lo[a] * 0.5 + bounds.hi[a] * 0.5);
        let slices = std::array::from_fn(|_| vec![0.0; SLICES]);
        let longest = bounds.longest();
        let slices_per_unit = SLICES as f64 / longest;
        Self { bounds, centre, longest, slices_per_unit, slices, area: 0.0, signed_volume: 0.0 }
    }

    /// Adds a triangle.
    pub fn add(&mut self, triangle: &SoupTriangle) {
        let [p, q, r] = triangle
            .corners
            .map(|c| glam::DVec3::from_array(std::array::from_fn(|a| c[a] - self.centre[a])));
        let area = (q - p).cross(r - p).length() * 0.5;
        if !area.is_finite() {
            return;
        }
        self.area += area;
        self.signed_volume += p.dot(q.cross(r)) / 6.0;
        if self.longest > 0.0 && self.longest.is_finite() {
            for axis in 0..3 {
                let to_lo = self.centre[axis] - self.bounds.lo[axis];
                let slice = |coordinate: f64| {
                    let slice = ((coordinate + to_lo) * self.slices_per_unit) as i32;
                    slice.clamp(0, SLICES as i32 - 1) as usize
                };
                let (low, high) = (p[axis].min(q[axis]), p[axis].max(q[axis]));
                self.slices[axis][slice(low.min(r[axis]))] += area * 0.5;
                self.slices[axis][slice(high.max(r[axis]))] += area * 0.5;
            }
        }
    }

    /// The totals, and the dense box if there is one.
    pub fn finish(&self) -> SoupMeasure {
        let windows: [_; 3] = std::array::from_fn(|a| smallest_window(&self.slices[a], self.area));
        let widest = windows.iter().map(|(lo, hi)| hi - lo).max().unwrap_or(SLICES);
        let small = (widest as f64) < SMALL_WINDOW * SLICES as f64;
        let at = |a: usize, slice: usize| {
            self.bounds.lo[a] + self.longest * (slice as f64 / SLICES as f64)
        };
        let dense_box = (small && self.area > 0.0).then(|| SnapBox {
            lo: std::array::from_fn(|a| at(a, windows[a].0)),
            hi: std::array::from_fn(|a| at(a, windows[a].1)),
        });
        SoupMeasure { area: self.area, signed_volume: self.signed_volume, dense_box }
    }
}

/// The shortest range of slices that holds nearly all of `total`.
fn smallest_window(slices: &[f64], total: f64) -> (usize, usize) {
    let mut best = (0, slices.len());
    let mut lo = 0;
    let mut sum = 0.0;
    for (hi, area) in slices.iter().enumerate() {
        sum += area;
        while lo < hi && sum - slices[lo] >= MOST_AREA * total {
            sum -= slices[lo];
            lo += 1;
        }
        if sum >= MOST_AREA * total && hi + 1 - lo < best.1 - best.0 {
            best = (lo, hi + 1);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measure(triangles: &[SoupTriangle]) -> SoupMeasure {
        let mut bounds = SnapBox::EMPTY;
        triangles.iter().flat_map(|t| t.corners).for_each(|c| bounds.add(c));
        let mut histogram = AreaHistogram::new(bounds);
        triangles.iter().for_each(|t| histogram.add(t));
        histogram.finish()
    }

    fn triangle(corners: [[f64; 3]; 3]) -> SoupTriangle {
        SoupTriangle { corners, source: 0, part: 0, material: 0, stands_for: 0 }
    }

    #[test]
    fn a_speck_far_away_leaves_a_dense_box() {
        let large = triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]);
        let speck = triangle([[1e9; 3], [1e9 + 1e-3, 1e9, 1e9], [1e9, 1e9 + 1e-3, 1e9]]);
        assert_eq!(measure(&[large]).dense_box, None);
        let dense = measure(&[large, speck]).dense_box.expect("the rest is dense");
        assert!(dense.hi[0] < 1e6);
    }
}
