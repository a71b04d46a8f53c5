//! A tree of boxes around triangles, on disk where it does not fit.
//!
//! In:         a tape, with its triangles in runs.
//! Out:        [`Tree`]: boxes around runs in Morton order of their middles, the large ones apart, around
//!             each eight of these, and so on up to one. Triangles stay where they are.
//! Invariant:  a box holds its triangles with [`SLACK`] to spare: what rounding says of a point of a
//!             triangle is never nearer than its box.
//! Memory:     a quarter of the share while it is built, an eighth as it stays.
//! Source:     Lauterbach et al. 2009, Fast BVH construction on GPUs; Kamel and Faloutsos 1993
//!             (packing by a curve).

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::pages::Pages;
use crate::deviate::reading::Tape;
use crate::deviate::runs::Run;
use crate::deviate::triangles::{BLOCK, Triangle, Triangles};
use crate::geom::morton;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// Children of a node, and triangles of a run, at most.
pub(crate) const GROUP: u64 = 8;
/// Boxes are thicker than their triangles by this share of the model's extent.
const SLACK: f64 = 1.0 / (1_u64 << 40) as f64;
/// Runs larger than the model's extent over `2^levels` have their places before the others.
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

/// A box, and what it is around: triangles of the tape, or boxes of the level below.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) bounds: Bounds,
    /// Number of the first, and how many; they lie on one page.
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// A run of triangles on its way to its place.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    key: u64,
    level: u64,
    run: Run,
}

impl Record for Placed {
    type Key = (u64, u64, u64, u32);
    fn key(&self) -> Self::Key {
        // Copies follow each other.
        (self.level, self.key, self.run.hash, self.run.node.first)
    }
}

/// Triangles, and boxes around them.
pub(crate) struct Tree<'s> {
    pub(crate) triangles: Triangles<'s>,
    /// Boxes of runs of triangles, of groups of these, and so on; the last is one box.
    pub(crate) levels: Vec<Sequence<Node>>,
}

impl<'s> Tree<'s> {
    /// Puts boxes around the triangles of a tape. Of runs that are copies of each other one gets a box:
    /// a thousand are no nearer than one, and each would have to be asked.
    pub(crate) fn around(tape: Tape<'s>, means: &Means<'_>) -> Result<Self, StoreError> {
        let Tape { triangles, runs, bounds, .. } = tape;
        let curve = Curve::new(bounds);
        let slack = DVec3::splat(curve.extent * SLACK);
        let mut sorter = Sorter::new(means.scratch, means.share_bytes / 8);
        runs.each_block(BLOCK, |block| {
            means.stop_if_asked()?;
            block.iter().try_for_each(|run| sorter.push(Placed::new(*run, &curve)))
        })?;
        drop(runs);
        let mut boxes = Boxes { means, levels: Vec::new(), open: Vec::new() };
        let mut sorted = sorter.finish()?;
        let mut last = Last { triangles: &triangles, hash: None, known: Vec::new() };
        let mut count = 0_u64;
        while let Some(Placed { run: Run { mut node, hash, .. }, .. }) = sorted.next()? {
            if count.is_multiple_of(1 << 16) {
                means.stop_if_asked()?;
            }
            count += 1;
            if last.is_copied_by(&node, hash)? {
                continue;
            }
            let Bounds { low, high } = &mut node.bounds;
            *low = (DVec3::from(*low) - slack).into();
            *high = (DVec3::from(*high) + slack).into();
            boxes.enter(0, &node)?;
        }
        let levels = boxes.close()?;
        Ok(Self { triangles, levels })
    }
}

impl Placed {
    fn new(run: Run, curve: &Curve) -> Self {
        let Bounds { low, high } = run.node.bounds;
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let size = (high - low).max_element();
        let level = (0..SIZE_LEVELS)
            .find(|&level| size * f64::from(2_u32 << level) > curve.extent)
            .unwrap_or(SIZE_LEVELS);
        Self { key: curve.key(low.midpoint(high)), level: level.into(), run }
    }
}

/// The last run that got a box, or a copy of it.
struct Last<'t> {
    triangles: &'t Triangles<'t>,
    hash: Option<(u64, Node)>,
    /// Its triangles, once they were asked for.
    known: Vec<Triangle>,
}

impl Last<'_> {
    /// Whether a run has the triangles of the last one; if not, it is the last one now.
    fn is_copied_by(&mut self, node: &Node, hash: u64) -> Result<bool, StoreError> {
        if let Some((last_hash, last)) = self.hash
            && last_hash == hash
            && last.count == node.count
        {
            if self.known.is_empty() {
                self.known = self.triangles_of(&last)?;
            }
            let these = self.triangles_of(node)?;
            let is_same = |(one, other): (&Triangle, &Triangle)| {
                one.corners == other.corners && one.is_pane == other.is_pane
            };
            if self.known.iter().zip(&these).all(is_same) {
                return Ok(true);
            }
        }
        self.hash = Some((hash, *node));
        self.known.clear();
        Ok(false)
    }

    fn triangles_of(&self, node: &Node) -> Result<Vec<Triangle>, StoreError> {
        Pages::new(self.triangles, 0).group(node.first, node.count).map(<[Triangle]>::to_vec)
    }
}

/// The boxes of a tree while they are made.
struct Boxes<'m> {
    means: &'m Means<'m>,
    levels: Vec<Sequence<Node>>,
    /// Above each level the box whose group is not full.
    open: Vec<Node>,
}

impl Boxes<'_> {
    /// Adds a box to a level.
    fn enter(&mut self, level: usize, node: &Node) -> Result<(), StoreError> {
        if self.open.len() == level {
            self.open.push(Node { bounds: Bounds::EMPTY, first: 0, count: 0 });
            let share_bytes = (self.means.share_bytes / 16) >> (3 * level).min(63);
            self.levels.push(Sequence::new(self.means.scratch, share_bytes));
        }
        self.levels[level].push(*node)?;
        let group = &mut self.open[level];
        group.bounds.add(&node.bounds);
        group.count += 1;
        if u64::from(group.count) < GROUP { Ok(()) } else { self.close_group(level) }
    }

    /// Ends a group, whose box goes to the level above.
    fn close_group(&mut self, level: usize) -> Result<(), StoreError> {
        let first = self.levels[level].len() as u32;
        let next = Node { bounds: Bounds::EMPTY, first, count: 0 };
        let full = std::mem::replace(&mut self.open[level], next);
        self.enter(level + 1, &full)
    }

    /// Ends the groups that are not full; all levels up to the one box.
    fn close(mut self) -> Result<Vec<Sequence<Node>>, StoreError> {
        let mut level = 0;
        while level < self.levels.len() && self.levels[level].len() > 1 {
            if self.open[level].count > 0 {
                self.close_group(level)?;
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
    use crate::deviate::reading::TapeWriter;
    use crate::monitor::Void;
    use crate::store::Scratch;

    #[test]
    fn of_copies_one_is_kept_though_others_share_their_box() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let means = Means { scratch: &scratch, pool: &pool, share_bytes: 1 << 20, monitor: &Void };
        let mut tape = TapeWriter::new(&means);
        let halves = [
            [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
            [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        ];
        for number in 0..2000 {
            tape.push(&halves[number % 2], false).expect("added");
        }
        // Light passes this one, and not the others in its place.
        tape.push(&halves[0], true).expect("added");
        let tree = Tree::around(tape.finish().expect("a tape"), &means).expect("a tree");
        let mut room = Vec::new();
        let runs = tree.levels[0].block(0, 10, &mut room).expect("some runs");
        // One of the many runs of eight, and that of the last triangle.
        assert_eq!(runs.iter().map(|run| run.count).sum::<u32>(), 8 + 1);
        assert!(runs.iter().any(|run| run.first == 2000));
    }
}
