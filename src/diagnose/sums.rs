//! What sets of triangles add up to: areas, volumes, boxes, and how much of them is open.
//!
//! In:         triangles joined to sets; the sides of triangles at edges that have not two.
//! Invariant:  sums are taken in the order of the file. Sets are numbered by their first triangles.
//! Units:      model units; volumes are seen from the set's first corner.
//! Memory:     a quarter of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::diagnose::Means;
use crate::diagnose::edges::{Side, SideReader};
use crate::diagnose::loops::distance;
use crate::diagnose::model::{Corners, Model};
use crate::store::{Labels, Sequence, StoreError, Table};

/// Error of a sum of triple products per term and magnitude: differences, products and sums round a
/// dozen times, by half a unit in the last place each.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// What a set of triangles adds up to.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sums {
    pub(crate) first: u64,
    pub(crate) triangles: u64,
    pub(crate) position: [f64; 3],
    pub(crate) low: [f64; 3],
    pub(crate) high: [f64; 3],
    pub(crate) area: f64,
    pub(crate) six_volumes: f64,
    /// The sum of the magnitudes of all products in it.
    pub(crate) magnitude: f64,
    /// Sides at edges that are not used alike both ways.
    unbalanced_sides: u64,
    /// Sides at edges of one triangle.
    pub(crate) open_sides: u64,
    pub(crate) open_length: f64,
    /// Sides at edges of three and more.
    pub(crate) hinge_sides: u64,
    pub(crate) hinge_length: f64,
    /// Those of them whose edges an even number of triangles has.
    even_hinges: u64,
    /// Whether something of it is seen, 1 or 0.
    pub(crate) is_seen: u64,
    /// Whether it is inside out, 1 or 0.
    pub(crate) is_inward: u64,
}

/// The sum of the magnitudes of the products in a triple product.
fn magnitude(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let [a, b, c] = [a, b, c].map(DVec3::abs);
    a.dot(DVec3::new(b.y * c.z + b.z * c.y, b.z * c.x + b.x * c.z, b.x * c.y + b.y * c.x))
}

/// The area of a triangle.
pub(crate) fn area_of(corners: &Corners) -> f64 {
    let [a, b, c] = corners.map(DVec3::from_array);
    (b - a).cross(c - a).length() / 2.0
}

impl Sums {
    fn new(number: u64, corners: &Corners) -> Self {
        let position = corners[0];
        Self { first: number, position, low: position, high: position, ..Self::zeroed() }
    }

    fn add(&mut self, corners: &Corners, sides: [Option<Side>; 3]) {
        self.triangles += 1;
        self.area += area_of(corners);
        let [a, b, c] = corners.map(|p| DVec3::from(p) - DVec3::from(self.position));
        self.six_volumes += a.dot(b.cross(c));
        self.magnitude += magnitude(a, b, c);
        for (corner, axis) in corners.iter().flat_map(|p| (0..3).map(move |axis| (p, axis))) {
            self.low[axis] = self.low[axis].min(corner[axis]);
            self.high[axis] = self.high[axis].max(corner[axis]);
        }
        for (from, side) in sides.into_iter().enumerate() {
            let length = distance([corners[from], corners[(from + 1) % 3]]);
            self.unbalanced_sides += side.map_or(0, |side| u64::from(side.is_balanced == 0));
            match side.map(|side| side.triangles) {
                None | Some(2) => {}
                Some(1) => {
                    self.open_sides += 1;
                    self.open_length += length;
                }
                Some(triangles) => {
                    self.hinge_sides += 1;
                    self.hinge_length += length;
                    self.even_hinges += u64::from(triangles % 2 == 0);
                }
            }
        }
    }

    pub(crate) fn diagonal(&self) -> f64 {
        distance([self.low, self.high])
    }

    /// Whether every edge is used alike both ways, so that it encloses a volume.
    pub(crate) fn is_oriented(&self) -> bool {
        self.unbalanced_sides == 0
    }

    /// Whether it encloses a volume, and that is negative beyond rounding.
    pub(crate) fn is_inverted(&self) -> bool {
        self.is_oriented() && self.six_volumes < -ROUNDING * self.triangles as f64 * self.magnitude
    }

    pub(crate) fn open_share(&self) -> f64 {
        self.open_sides as f64 / (3 * self.triangles) as f64
    }

    /// Whether it hangs by less than half of its border, is open on the rest, and leaves what it
    /// hangs from closed there.
    pub(crate) fn is_fin(&self) -> bool {
        self.hinge_sides > 0 && self.even_hinges == 0 && self.open_length > self.hinge_length
    }
}

/// Sets of triangles with their sums.
pub(crate) struct Sets {
    /// The number of the set of each triangle; [`NO_SET`] for those that are not whole.
    pub(crate) set_of: Table<u32>,
    pub(crate) sums: Table<Sums>,
}

const NO_SET: u32 = u32::MAX;

impl Sets {
    /// Adds up every set.
    pub(crate) fn measure(
        model: &Model,
        labels: &mut Labels,
        sides: &Sequence<Side>,
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        let mut set_of = Table::scattered(means.scratch, means.share_bytes / 8);
        let mut sums = Table::<Sums>::scattered(means.scratch, means.share_bytes / 8);
        let mut reader = SideReader::new(sides);
        // The set at hand stays out of the table while its triangles come one after the other.
        let mut last: Option<(u32, Sums)> = None;
        model.each(means, |triangle| {
            if !triangle.is_whole() {
                return set_of.push(NO_SET);
            }
            let label = labels.label(triangle.number as u32)?;
            let own = match u64::from(label) == triangle.number {
                true => sums.len() as u32,
                false => set_of.get(label.into())?,
            };
            set_of.push(own)?;
            if u64::from(own) == sums.len() {
                sums.push(Sums::new(triangle.number, triangle.corners))?;
            }
            let mut current = match last.take() {
                Some((set, current)) if set == own => current,
                other => {
                    if let Some((set, before)) = other {
                        sums.set(set.into(), before)?;
                    }
                    sums.get(own.into())?
                }
            };
            current.add(triangle.corners, reader.of(triangle.number)?);
            last = Some((own, current));
            Ok(())
        })?;
        if let Some((set, current)) = last {
            sums.set(set.into(), current)?;
        }
        Ok(Self { set_of, sums })
    }
}
