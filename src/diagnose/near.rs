//! What lies near what, out of core: things in grids as coarse as they are large, small probes in
//! all of these grids.
//!
//! In:         things with boxes, then probes with boxes.
//! Out:        every probe with every thing whose box meets its own; some pairs several times.
//! Invariant:  no pair is missed: a thing lies in all cells that its box meets, of a grid whose
//!             cells are no smaller than it, so in eight at most; a probe in all cells of each grid
//!             that has things.
//! Memory:     three eighths of the share for the sort, an eighth for things of a crowded cell, and those of
//!             a cell that fit, 4 MiB at most.
//! Source:     Ericson 2005, Real-time collision detection, 7.2.1 (hierarchical grids).

use bytemuck::{Pod, Zeroable};

use crate::diagnose::Means;
use crate::store::{Record, Sorter, StoreError, Table};

/// Cells of the finest grid along an axis, as a power of two.
const BITS: u32 = 20;
/// Things of a cell that are held; the others are read again for every probe.
const MOST_HELD: usize = 16 << 10;

/// Up to three points of a thing or a probe.
pub(crate) type Points = [[f64; 3]; 3];

/// A thing or a probe in a cell.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Placed {
    level: u32,
    cell: [u32; 3],
    /// 0 for things, 1 for probes.
    role: u32,
    /// The caller's number.
    pub(crate) number: u32,
    /// The caller's vertices, if need be.
    pub(crate) vertices: [u32; 3],
    unused: u32,
    pub(crate) points: Points,
}

impl Record for Placed {
    type Key = (u32, [u32; 3], u32, u32);
    fn key(&self) -> Self::Key {
        (self.level, self.cell, self.role, self.number)
    }
}

/// Lowest and highest corner.
pub(crate) fn box_of(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let mut bounds = [points[0]; 2];
    for (point, axis) in points.iter().flat_map(|p| (0..3).map(move |axis| (p, axis))) {
        bounds[0][axis] = bounds[0][axis].min(point[axis]);
        bounds[1][axis] = bounds[1][axis].max(point[axis]);
    }
    bounds
}

fn placed(role: u32, level: u32, number: u32, vertices: [u32; 3], points: Points) -> Placed {
    Placed { level, cell: [0; 3], role, number, vertices, unused: 0, points }
}

/// Things and probes on their way into cells.
pub(crate) struct Near<'m> {
    means: &'m Means<'m>,
    low: [f64; 3],
    /// Side of the finest cells.
    finest: f64,
    margin: f64,
    sorter: Sorter<Placed>,
    /// Grids that have things, by bits.
    used: u32,
}

impl<'m> Near<'m> {
    /// Nothing yet, in a model of these bounds; `reach` is the longest side of a probe's box, and
    /// `margin` what it has more than its points.
    pub(crate) fn new(
        bounds: [[f64; 3]; 2],
        (reach, margin): (f64, f64),
        means: &'m Means<'m>,
    ) -> Self {
        let [low, high] = bounds;
        let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let finest = (longest / f64::from(1 << BITS)).max(reach).max(f64::MIN_POSITIVE);
        let sorter = Sorter::new(means.scratch, means.share_bytes / 8 * 3);
        Self { means, low, finest, margin, sorter, used: 0 }
    }

    fn side(&self, level: u32) -> f64 {
        self.finest * f64::from(1_u32 << level)
    }

    /// Adds a thing.
    pub(crate) fn add(
        &mut self,
        number: u32,
        vertices: [u32; 3],
        points: Points,
    ) -> Result<(), StoreError> {
        let bounds = box_of(&points);
        let extent = (0..3).map(|axis| bounds[1][axis] - bounds[0][axis]).fold(0.0, f64::max);
        // The coarsest grid takes whatever is larger than the model, by rounding.
        let level = (0..BITS).find(|&level| self.side(level) >= extent).unwrap_or(BITS);
        self.used |= 1 << level;
        self.place(placed(0, level, number, vertices, points), bounds)
    }

    /// Adds a probe, once all things are there: it meets what comes into the box around its points
    /// with the margin on every side.
    pub(crate) fn probe(
        &mut self,
        number: u32,
        vertices: [u32; 3],
        points: Points,
    ) -> Result<(), StoreError> {
        let [low, high] = box_of(&points);
        let bounds = [low.map(|x| x - self.margin), high.map(|x| x + self.margin)];
        let used = self.used;
        for level in (0..=BITS).filter(|level| used >> level & 1 == 1) {
            self.place(placed(1, level, number, vertices, points), bounds)?;
        }
        Ok(())
    }

    fn place(&mut self, placed: Placed, [low, high]: [[f64; 3]; 2]) -> Result<(), StoreError> {
        let side = self.side(placed.level);
        // The conversion itself stops at zero and at the largest number.
        let cell = |axis: usize, x: f64| ((x - self.low[axis]) / side) as u32;
        let from: [u32; 3] = std::array::from_fn(|axis| cell(axis, low[axis]));
        let to: [u32; 3] = std::array::from_fn(|axis| cell(axis, high[axis]));
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    self.sorter.push(Placed { cell: [x, y, z], ..placed })?;
                }
            }
        }
        Ok(())
    }

    /// Shows every probe with the things whose boxes come near.
    pub(crate) fn join(
        self,
        mut meet: impl FnMut(&Placed, &Placed) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let Self { means, margin, sorter, .. } = self;
        let mut held = Held { margin, ..Held::default() };
        let new_rest = || Table::<Placed>::new(means.scratch, means.share_bytes / 8);
        let mut rest = new_rest();
        let mut cell = (u32::MAX, [0; 3]);
        let mut sorted = sorter.finish()?;
        let mut count = 0_u64;
        while let Some(placed) = sorted.next()? {
            count += 1;
            if count.is_multiple_of(1 << 16) {
                means.stop_if_asked()?;
            }
            if cell != (placed.level, placed.cell) {
                cell = (placed.level, placed.cell);
                held.clear();
                if !rest.is_empty() {
                    rest = new_rest();
                }
            }
            if placed.role == 0 {
                if held.things.len() < MOST_HELD {
                    held.push(placed);
                } else {
                    rest.push(placed)?;
                }
                continue;
            }
            held.meet(&placed, &mut meet)?;
            for at in 0..rest.len() {
                meet(&placed, &rest.get(at)?)?;
            }
        }
        Ok(())
    }
}

/// The things of a cell, along the axis on which they lie widest apart.
#[derive(Default)]
struct Held {
    margin: f64,
    things: Vec<Placed>,
    boxes: Vec<[[f64; 3]; 2]>,
    /// Where the boxes begin, ascending, and which they are; empty until a probe comes.
    order: Vec<(f64, u32)>,
    axis: usize,
    /// The longest side along the axis.
    widest: f64,
}

impl Held {
    fn clear(&mut self) {
        self.things.clear();
        self.boxes.clear();
        self.order.clear();
    }

    fn push(&mut self, thing: Placed) {
        self.boxes.push(box_of(&thing.points));
        self.things.push(thing);
    }

    fn arrange(&mut self) {
        let boxes = &self.boxes;
        let spread = |axis: usize| {
            let lows = || boxes.iter().map(|bounds| bounds[0][axis]);
            lows().fold(f64::MIN, f64::max) - lows().fold(f64::MAX, f64::min)
        };
        let spreads = [spread(0), spread(1), spread(2)];
        let axis = (0..3).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
        self.axis = axis;
        self.widest = boxes.iter().map(|b| b[1][axis] - b[0][axis]).fold(0.0, f64::max);
        self.order.extend(boxes.iter().map(|b| b[0][axis]).zip(0..));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    fn meet(
        &mut self,
        probe: &Placed,
        meet: &mut impl FnMut(&Placed, &Placed) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        if self.order.len() != self.things.len() {
            self.arrange();
        }
        let [low, high] = box_of(&probe.points);
        let (low, high) = (low.map(|x| x - self.margin), high.map(|x| x + self.margin));
        let (from, to) = (low[self.axis] - self.widest, high[self.axis]);
        let from = self.order.partition_point(|&(begin, _)| begin < from);
        for &(begin, at) in &self.order[from..] {
            if begin > to {
                break;
            }
            let [near, far] = &self.boxes[at as usize];
            if (0..3).all(|axis| near[axis] <= high[axis] && low[axis] <= far[axis]) {
                meet(probe, &self.things[at as usize])?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::mesh::shapes::Random;
    use crate::monitor::Void;
    use crate::store::Scratch;

    #[test]
    fn no_pair_of_boxes_that_meet_is_missed() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut random = Random::new(7);
        let margin = 0.004;
        let mut thing = |sizes: [f64; 2]| -> Points {
            let (at, size) = (random.point(), random.within(sizes[0], sizes[1]));
            std::array::from_fn(|_| {
                let by = random.point();
                std::array::from_fn(|i| (at[i] + size * by[i]).clamp(-1.0, 1.0))
            })
        };
        let things: Vec<Points> =
            (0..600).map(|i| thing(if i % 20 == 0 { [0.3, 1.0] } else { [0.0, 0.03] })).collect();
        let probes: Vec<Points> = (0..3000).map(|_| thing([0.0, 0.003])).collect();
        let meets = |a: &Points, b: &Points| {
            let ([a_low, a_high], [b_low, b_high]) = (box_of(a), box_of(b));
            (0..3).all(|i| a_low[i] <= b_high[i] + margin && b_low[i] - margin <= a_high[i])
        };
        let mut expected = BTreeSet::new();
        for (i, thing) in (0..).zip(&things) {
            let near = (0..).zip(&probes).filter(|(_, probe)| meets(thing, probe));
            expected.extend(near.map(|(j, _)| (j, i)));
        }
        assert!(expected.len() > 100, "{} pairs only", expected.len());
        for share_bytes in [16 << 10, 8 << 20] {
            let means = Means { scratch: &scratch, share_bytes, monitor: &Void };
            let mut near = Near::new([[-1.0; 3], [1.0; 3]], (0.02, margin), &means);
            for (i, &points) in (0..).zip(&things) {
                near.add(i, [0; 3], points).expect("the scratch folder works");
            }
            for (j, &points) in (0..).zip(&probes) {
                near.probe(j, [0; 3], points).expect("the scratch folder works");
            }
            let mut found = BTreeSet::new();
            near.join(|probe, thing| {
                if meets(&thing.points, &probe.points) {
                    found.insert((probe.number, thing.number));
                }
                Ok(())
            })
            .expect("the scratch folder works");
            assert_eq!(found, expected);
        }
    }
}
