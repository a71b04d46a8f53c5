//! A tree of boxes around triangles, on disk where it does not fit.
//!
//! In:         triangles, one by one.
//! Out:        [`Tree`]: triangles in Morton order of their middles, the large ones apart, and boxes
//!             around each eight of them, around each eight of these, and so on up to one.
//! Invariant:  a box holds its triangles with [`SLACK`] to spare: what rounding says of a point of a
//!             triangle is never nearer than its box.
//! Memory:     a quarter of the share while it is built, an eighth as it stays.
//! Source:     Lauterbach et al. 2009, Fast BVH construction on GPUs; Kamel and Faloutsos 1993
//!             (packing by a curve).

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::reading::{BLOCK, Triangle, hash_of};
use crate::geom::morton;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// Children of a node, and triangles of a leaf.
pub(crate) const GROUP: u64 = 8;
/// Boxes are thicker than their triangles by this share of the model's extent.
const SLACK: f64 = 1.0 / (1_u64 << 40) as f64;
/// Triangles larger than the model's extent over `2^levels` have their places before the others.
const SIZE_LEVELS: u32 = 6;

/// Lowest and highest corner.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Bounds {
    pub(crate) low: [f64; 3],
    pub(crate) high: [f64; 3],
}

impl Bounds {
    const EMPTY: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    fn of(triangle: &Triangle) -> Self {
        let [a, b, c] = triangle.points();
        Self { low: a.min(b).min(c).into(), high: a.max(b).max(c).into() }
    }

    fn add(&mut self, other: &Self) {
        self.low = DVec3::from(self.low).min(DVec3::from(other.low)).into();
        self.high = DVec3::from(self.high).max(DVec3::from(other.high)).into();
    }

    /// The square of the distance from a point to the nearest one of the box.
    #[inline]
    pub(crate) fn distance_squared(&self, point: DVec3) -> f64 {
        let outside = (DVec3::from(self.low) - point).max(point - DVec3::from(self.high));
        outside.max(DVec3::ZERO).length_squared()
    }

    /// Where a ray enters the box, at 0 if it begins within; `None` if it misses. `inverse` has one
    /// over each part of its direction.
    #[inline]
    pub(crate) fn entered(&self, origin: DVec3, inverse: DVec3) -> Option<f64> {
        let one = (DVec3::from(self.low) - origin) * inverse;
        let other = (DVec3::from(self.high) - origin) * inverse;
        let enter = one.min(other).max_element().max(0.0);
        (enter <= one.max(other).min_element()).then_some(enter)
    }
}

/// Places of points in Morton order within a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    low: DVec3,
    pub(crate) extent: f64,
}

impl Curve {
    pub(crate) fn new([low, high]: [[f64; 3]; 2]) -> Self {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        Self { low, extent: (high - low).max_element() }
    }

    /// Where a point lies on the curve.
    pub(crate) fn key(&self, point: DVec3) -> u64 {
        let most = f64::from(morton::MAX_COORDINATE);
        // The conversion itself stops at zero.
        let cell = (point - self.low) / self.extent * most;
        morton::encode([cell.x, cell.y, cell.z].map(|x| x.min(most) as u32))
    }
}

/// A triangle on its way to its place.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    key: u64,
    /// Of its corners, so that copies follow each other.
    hash: u64,
    level: u32,
    number: u32,
    triangle: Triangle,
}

impl Record for Placed {
    type Key = (u32, u64, u64, u32);
    fn key(&self) -> Self::Key {
        (self.level, self.key, self.hash, self.number)
    }
}

/// A tree while triangles come, which are put in order.
pub(crate) struct TreeBuilder<'m> {
    means: &'m Means<'m>,
    bounds: [[f64; 3]; 2],
    curve: Curve,
    sorter: Sorter<Placed>,
}

impl<'m> TreeBuilder<'m> {
    /// No triangles yet.
    pub(crate) fn new(bounds: [[f64; 3]; 2], means: &'m Means<'m>) -> Self {
        let sorter = Sorter::new(means.scratch, means.share_bytes / 8);
        Self { means, bounds, curve: Curve::new(bounds), sorter }
    }

    pub(crate) fn add(&mut self, triangle: Triangle) -> Result<(), StoreError> {
        let bounds = Bounds::of(&triangle);
        let (low, high) = (DVec3::from(bounds.low), DVec3::from(bounds.high));
        let size = (high - low).max_element();
        let level = (0..SIZE_LEVELS)
            .find(|&level| size * f64::from(2_u32 << level) > self.curve.extent)
            .unwrap_or(SIZE_LEVELS);
        let key = self.curve.key(low.midpoint(high));
        let hash = hash_of(triangle.corners.as_flattened());
        self.sorter.push(Placed { key, hash, level, number: triangle.number, triangle })
    }

    /// Puts boxes around what came. Of copies one is kept: a thousand are no nearer than one, and each
    /// would have to be asked.
    pub(crate) fn finish(self) -> Result<Tree, StoreError> {
        let Self { means, bounds, sorter, .. } = self;
        let mut triangles = Sequence::new(means.scratch, means.share_bytes / 8);
        let mut sorted = sorter.finish()?;
        let mut last: Option<Triangle> = None;
        while let Some(Placed { triangle, .. }) = sorted.next()? {
            let is_same = |last: &Triangle| {
                last.corners == triangle.corners && last.is_pane == triangle.is_pane
            };
            if last.as_ref().is_some_and(is_same) {
                continue;
            }
            if triangles.len().is_multiple_of(1 << 16) {
                means.stop_if_asked()?;
            }
            triangles.push(triangle)?;
            last = Some(triangle);
        }
        drop(sorted);
        Tree::around(triangles, bounds, means)
    }
}

/// Triangles, and boxes around them.
pub(crate) struct Tree {
    pub(crate) triangles: Sequence<Triangle>,
    /// Boxes of groups of triangles, of groups of these, and so on; the last is one box.
    pub(crate) levels: Vec<Sequence<Bounds>>,
}

impl Tree {
    /// Puts boxes around triangles in the order in which they are.
    pub(crate) fn around(
        triangles: Sequence<Triangle>,
        bounds: [[f64; 3]; 2],
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        let slack = DVec3::splat(Curve::new(bounds).extent * SLACK);
        let mut boxes = Boxes { means, levels: Vec::new(), open: Vec::new() };
        triangles.each_block(BLOCK, |block| {
            means.stop_if_asked()?;
            block.iter().try_for_each(|triangle| {
                let mut bounds = Bounds::of(triangle);
                bounds.low = (DVec3::from(bounds.low) - slack).into();
                bounds.high = (DVec3::from(bounds.high) + slack).into();
                boxes.enter(0, &bounds)
            })
        })?;
        Ok(Self { triangles, levels: boxes.close()? })
    }
}

/// The boxes of a tree while they are made.
struct Boxes<'m> {
    means: &'m Means<'m>,
    levels: Vec<Sequence<Bounds>>,
    /// For each level what its open group holds, and how much.
    open: Vec<(Bounds, u64)>,
}

impl Boxes<'_> {
    /// Adds something to the open group of a level.
    fn enter(&mut self, level: usize, bounds: &Bounds) -> Result<(), StoreError> {
        if self.open.len() == level {
            self.open.push((Bounds::EMPTY, 0));
            let share_bytes = (self.means.share_bytes / 64) >> (3 * level).min(63);
            self.levels.push(Sequence::new(self.means.scratch, share_bytes));
        }
        let (group, count) = &mut self.open[level];
        group.add(bounds);
        *count += 1;
        if *count < GROUP {
            return Ok(());
        }
        let full = std::mem::replace(&mut self.open[level], (Bounds::EMPTY, 0)).0;
        self.levels[level].push(full)?;
        self.enter(level + 1, &full)
    }

    /// Ends the groups that are not full; all levels up to the one box.
    fn close(mut self) -> Result<Vec<Sequence<Bounds>>, StoreError> {
        let mut level = 0;
        while level < self.open.len() {
            let (group, count) = std::mem::replace(&mut self.open[level], (Bounds::EMPTY, 0));
            if count > 0 {
                self.levels[level].push(group)?;
            }
            if self.levels[level].len() == 1 {
                break;
            }
            if count > 0 {
                self.enter(level + 1, &group)?;
            }
            level += 1;
        }
        self.levels.truncate(level + 1);
        Ok(self.levels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Void;
    use crate::store::Scratch;

    #[test]
    fn of_copies_one_is_kept_though_others_share_their_box() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let means = Means { scratch: &scratch, pool: &pool, share_bytes: 1 << 20, monitor: &Void };
        let mut builder = TreeBuilder::new([[0.0; 3], [1.0, 1.0, 0.0]], &means);
        let halves = [
            [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
            [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        ];
        for number in 0..2000 {
            let corners = halves[number as usize % 2];
            builder.add(Triangle { corners, number, is_pane: 0 }).expect("added");
        }
        // Light passes this one, and not the others in its place.
        builder.add(Triangle { corners: halves[0], number: 2000, is_pane: 1 }).expect("added");
        assert_eq!(builder.finish().expect("a tree").triangles.len(), 3);
    }
}
