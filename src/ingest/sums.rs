//! What the triangles of a file add up to: all that an estimate needs, for every depth at once.
//!
//! A triangle that lies anywhere on a grid crosses as many of its edges, on average, as its
//! projections along the axes hold squares of the grid. It touches `1 + w/B + a/B^2` boxes of side
//! B on average, with w the sum of its extents along the axes and a the sum of the areas of its
//! projections. Both sums over all triangles are taken here; side and depth may come later.
//!
//! In:         a [`MeshSource`], read to its end.
//! Out:        [`SoupSums`].
//! Units:      model units.
//! Memory:     a batch, and the sketch of the rims; nothing grows with the input.
//! Fails:      [`IngestError`], as reading does before a repair.
//! Source:     Steiner's formula for boxes: the volume of a convex body grown by a box (Schneider,
//!             Convex Bodies, 4.1); the mean number of boxes met is that volume over the box's.

use serde::{Deserialize, Serialize};

use crate::ingest::error::IngestError;
use crate::ingest::rims::{RimSketch, Rims};
use crate::ingest::soup::{SoupStats, has_materials};
use crate::mesh::{Attributes, LengthUnit, MeshSource, TriangleBatch};
use crate::monitor::{Counter, Monitor};
use crate::octree::SnapBox;
use crate::store::StoreError;

/// Sums over the finite triangles of a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoupSums {
    /// Counts of the input.
    pub stats: SoupStats,
    /// Box of the finite triangles; empty when there is none.
    pub bounds: SnapBox,
    /// Sum of their areas, square model units.
    pub area: f64,
    /// Sum of the areas of their projections along the three axes, square model units.
    pub projected_area: f64,
    /// Sum of their extents along the three axes, model units.
    pub extent: f64,
    /// What a model unit is, where the file says so.
    pub unit: Option<LengthUnit>,
    /// Edges that an odd number of triangles shares.
    pub rims: Rims,
    /// What triangles have besides a place and a material.
    pub attributes: Attributes,
    /// Whether the file says anything of materials.
    pub has_materials: bool,
}

impl SoupSums {
    /// Triangles without a corner at infinity.
    #[must_use]
    pub fn finite_triangles(&self) -> u64 {
        self.stats.triangles - self.stats.nonfinite_triangles
    }
}

/// Reads `source` to its end and adds it up.
///
/// # Errors
/// [`IngestError`]: the source fails, there are too many triangles, the caller cancels, or
/// `strict` met a broken face.
pub fn sum_up<S: MeshSource + ?Sized>(
    source: &mut S,
    strict: bool,
    monitor: &dyn Monitor,
) -> Result<SoupSums, IngestError<S::Error>> {
    let mut adder = Adder::new();
    let mut batch = TriangleBatch::default();
    let mut read_bytes = 0;
    while source.next_batch(&mut batch).map_err(IngestError::Source)? {
        let now = source.bytes_read();
        monitor.count(Counter::InputBytesRead, now - read_bytes);
        monitor.advance(now - read_bytes);
        read_bytes = now;
        if monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        adder.sums.attributes.uvs |= !batch.uvs.is_empty();
        adder.sums.attributes.colours |= !batch.colours.is_empty();
        batch.corners.iter().for_each(|corners| adder.add(corners));
        if adder.sums.stats.triangles > u64::from(u32::MAX) {
            return Err(IngestError::TooManyTriangles { limit: u32::MAX.into() });
        }
    }
    monitor.count(Counter::InputBytesRead, source.bytes_read() - read_bytes);
    adder.sums.has_materials = has_materials(source)?;
    adder.sums.unit = source.unit();
    adder.sums.attributes.normals = source.has_normals();
    let mut sums = adder.sums;
    sums.stats.discarded = source.discarded();
    sums.stats.input_bytes = source.bytes_read();
    sums.rims = adder.rims.finish();
    sums.stats.refuse_broken(strict)?;
    Ok(sums)
}

struct Adder {
    sums: SoupSums,
    rims: RimSketch,
}

impl Adder {
    fn new() -> Self {
        let sums = SoupSums {
            stats: SoupStats::default(),
            bounds: SnapBox::EMPTY,
            area: 0.0,
            projected_area: 0.0,
            extent: 0.0,
            unit: None,
            rims: Rims::default(),
            attributes: Attributes::NONE,
            has_materials: false,
        };
        Self { sums, rims: RimSketch::new() }
    }

    fn add(&mut self, corners: &[[f64; 3]; 3]) {
        let sums = &mut self.sums;
        sums.stats.triangles += 1;
        if !corners.iter().flatten().all(|c| c.is_finite()) {
            sums.stats.nonfinite_triangles += 1;
            return;
        }
        corners.iter().for_each(|&corner| sums.bounds.add(corner));
        self.rims.add(corners);
        let [p, q, r] = corners.map(glam::DVec3::from_array);
        let normal = (q - p).cross(r - p);
        // Coordinates near the largest numbers overflow: the repair leaves such areas out as well.
        if normal.is_finite() {
            sums.area += normal.length() * 0.5;
            sums.projected_area += normal.abs().element_sum() * 0.5;
            sums.extent += (p.max(q).max(r) - p.min(q).min(r)).element_sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{Random, cuboid};
    use crate::octree::Domain;
    use crate::octree::for_each_touched_brick;

    fn sums(triangles: &[[[f64; 3]; 3]]) -> SoupSums {
        let mut adder = Adder::new();
        triangles.iter().for_each(|corners| adder.add(corners));
        adder.sums
    }

    #[test]
    fn a_box_adds_up_to_its_sides_twice() {
        let sums = sums(&cuboid([0.0; 3], [1.0, 2.0, 3.0]));
        assert_eq!(sums.finite_triangles(), 12);
        assert_eq!((sums.area, sums.projected_area), (22.0, 22.0));
        // Each of the three pairs of sides has four triangles as wide as two edges.
        assert_eq!(sums.extent, 4.0 * (3.0 + 4.0 + 5.0));
    }

    #[test]
    fn corners_at_infinity_and_areas_beyond_all_numbers_are_left_out() {
        let far = [[0.0; 3], [1e200, 0.0, 0.0], [0.0, 1e200, 0.0]];
        let sums = sums(&[[[f64::NAN; 3]; 3], [[f64::INFINITY; 3]; 3], far]);
        assert_eq!(sums.finite_triangles(), 1);
        assert_eq!((sums.area, sums.projected_area, sums.extent), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_mean_number_of_bricks_touched_is_what_the_sums_say() {
        let unit = SnapBox { lo: [0.0; 3], hi: [1.0; 3] };
        let domain = Domain::around(&unit, 9, false).expect("room enough");
        let brick = domain.brick_units() as f64;
        let mut random = Random::new(5);
        for size in [0.1, 1.0, 4.0] {
            let triangle: [[f64; 3]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.share() * size * brick));
            let sums = sums(&[triangle]);
            let expected = 1.0 + sums.extent / brick + sums.projected_area / (brick * brick);
            let places = 4000;
            let mut touched = 0_u32;
            for _ in 0..places {
                let shift: [f64; 3] = std::array::from_fn(|_| (4.0 + random.share()) * brick);
                let corners = triangle.map(|c| std::array::from_fn(|a| (c[a] + shift[a]) as i32));
                let done: Result<(), ()> = for_each_touched_brick(&domain, corners, &mut |_| {
                    touched += 1;
                    Ok(())
                });
                assert_eq!(done, Ok(()));
            }
            let mean = f64::from(touched) / f64::from(places);
            assert!((mean / expected - 1.0).abs() < 0.03, "{size}: {mean}, not {expected}");
        }
    }
}
