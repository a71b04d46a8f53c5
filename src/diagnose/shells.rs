//! The connected surfaces of a model, and the sheets that hang from them.
//!
//! In:         triangles joined over edges; the sides of triangles at edges that have not two.
//! Out:        sums of every shell; those that are open, those that are tiny; fins.
//! Invariant:  sums are taken in the order of the file. Shells are numbered by their first triangles.
//! Units:      model units; volumes are seen from the shell's first corner.
//! Memory:     half of the share.

use std::cmp::Reverse;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::defect::{Defect, DefectKind, Fin, OpenShell, Smallest, TinyShell};
use crate::diagnose::Means;
use crate::diagnose::edges::{Side, SideReader};
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::loops::distance;
use crate::diagnose::model::{Corners, Model};
use crate::store::{Labels, Sequence, StoreError, Table};

/// Error of a sum of triple products per term and magnitude: differences, products and sums round a
/// dozen times, by half a unit in the last place each.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// All shells.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShellReport {
    /// Sets of triangles that hang together over edges.
    pub count: u64,
    /// Those without boundary edges.
    pub closed: u64,
    /// Those whose edges all have two triangles.
    pub manifold: u64,
    /// The eight with the largest areas, largest first.
    pub largest: Vec<ShellSummary>,
}

/// One shell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShellSummary {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Whether it has no boundary edge.
    pub is_closed: bool,
    /// Whether nobody sees it.
    pub is_hidden: bool,
    /// Area, model units squared.
    pub area: f64,
    /// Signed volume, cubed model units; of closed ones.
    pub volume: Option<f64>,
    /// Lowest and highest corner.
    pub bounds: [[f64; 3]; 2],
}

/// What a set of triangles adds up to.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sums {
    pub(crate) first: u64,
    pub(crate) triangles: u64,
    pub(crate) position: [f64; 3],
    low: [f64; 3],
    high: [f64; 3],
    pub(crate) area: f64,
    pub(crate) six_volumes: f64,
    /// The sum of the magnitudes of all products in it.
    pub(crate) magnitude: f64,
    /// Sides at edges that are not used alike both ways.
    unbalanced_sides: u64,
    /// Sides at edges of one triangle.
    open_sides: u64,
    open_length: f64,
    /// Sides at edges of three and more.
    hinge_sides: u64,
    hinge_length: f64,
    /// Those of them whose edges an even number of triangles has.
    even_hinges: u64,
    /// Whether something of it is seen, 1 or 0.
    pub(crate) is_seen: u64,
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

    fn diagonal(&self) -> f64 {
        distance([self.low, self.high])
    }

    /// Whether it encloses a volume, and that is negative beyond rounding.
    pub(crate) fn is_inverted(&self) -> bool {
        self.unbalanced_sides == 0
            && self.six_volumes < -ROUNDING * self.triangles as f64 * self.magnitude
    }

    fn open_share(&self) -> f64 {
        self.open_sides as f64 / (3 * self.triangles) as f64
    }

    /// Whether it hangs by less than half of its border, is open on the rest, and leaves what it
    /// hangs from closed there.
    fn is_fin(&self) -> bool {
        self.hinge_sides > 0 && self.even_hinges == 0 && self.open_length > self.hinge_length
    }
}

/// Sets of triangles with their sums.
struct Sets {
    /// The number of the set of each triangle; [`NO_SET`] for those that are not whole.
    set_of: Table<u32>,
    sums: Table<Sums>,
}

const NO_SET: u32 = u32::MAX;

impl Sets {
    fn measure(
        model: &Model,
        labels: &mut Labels,
        sides: &Sequence<Side>,
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        let mut set_of = Table::new(means.scratch, means.share_bytes / 8);
        let mut sums = Table::<Sums>::new(means.scratch, means.share_bytes / 4);
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

/// Finds sheets that hang from others by an edge.
pub(crate) fn fins(
    model: &Model,
    patches: &mut Labels,
    sides: &Sequence<Side>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let kind = DefectKind::Fin;
    if sides.is_empty() {
        return Ok(Finding::none(kind));
    }
    let mut sets = Sets::measure(model, patches, sides, means)?;
    let mut largest = SizedPlaces::default();
    let (mut count, mut area) = (0, 0.0);
    for number in 0..sets.sums.len() {
        let sums = sets.sums.get(number)?;
        if sums.is_fin() {
            count += 1;
            area += sums.area;
            let fin = Fin {
                triangle: sums.first,
                triangles: sums.triangles,
                area: sums.area,
                hinge: sums.hinge_length,
                open: sums.open_length,
                position: sums.position,
            };
            largest.offer(sums.area, sums.first, Defect::Fin(fin));
        }
    }
    Ok(Finding::sized(kind, count, (Measure::TotalArea, area), largest.into_places()))
}

/// The shells of a model.
pub(crate) struct Shells {
    sets: Sets,
}

impl Shells {
    /// Adds up every shell.
    pub(crate) fn measure(
        model: &Model,
        labels: &mut Labels,
        sides: &Sequence<Side>,
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        Ok(Self { sets: Sets::measure(model, labels, sides, means)? })
    }

    /// How many there are.
    pub(crate) fn len(&self) -> u64 {
        self.sets.sums.len()
    }

    /// The shell of a whole triangle.
    pub(crate) fn of(&mut self, triangle: u64) -> Result<u64, StoreError> {
        Ok(self.sets.set_of.get(triangle)?.into())
    }

    /// What a shell adds up to.
    pub(crate) fn sums(&mut self, shell: u64) -> Result<Sums, StoreError> {
        self.sets.sums.get(shell)
    }

    /// Notes that something of a shell is seen.
    pub(crate) fn see(&mut self, shell: u64) -> Result<(), StoreError> {
        let sums = self.sets.sums.get(shell)?;
        self.sets.sums.set(shell, Sums { is_seen: 1, ..sums })
    }

    /// Tells of all shells, once it is known which are seen.
    pub(crate) fn report(
        &mut self,
        tiny: f64,
        means: &Means<'_>,
    ) -> Result<(ShellReport, Vec<Finding>), StoreError> {
        let mut report = ShellReport { count: self.len(), ..ShellReport::default() };
        let (mut open, mut small) = (Tally::default(), Tally::default());
        let mut largest = Smallest::new();
        for shell in 0..self.len() {
            if shell % 4096 == 0 {
                means.stop_if_asked()?;
            }
            let sums = self.sums(shell)?;
            let (triangle, triangles, position) = (sums.first, sums.triangles, sums.position);
            let is_closed = sums.open_sides == 0;
            report.closed += u64::from(is_closed);
            report.manifold += u64::from(is_closed && sums.hinge_sides == 0);
            let by_area = Reverse(sums.area.max(0.0).to_bits());
            largest.offer((by_area, triangle), shell);
            if !is_closed {
                let (area, open_share) = (sums.area, sums.open_share());
                let defect = OpenShell { triangle, triangles, area, open_share, position };
                open.add(area, triangle, Defect::OpenShell(defect));
            }
            if sums.diagonal() < tiny {
                let diagonal = sums.diagonal();
                let defect = TinyShell { triangle, triangles, diagonal, position };
                small.add(diagonal, triangle, Defect::TinyShell(defect));
            }
        }
        for &(_, shell) in largest.iter() {
            report.largest.push(self.summary(shell)?);
        }
        let size = (Measure::TotalArea, open.total);
        let places = open.largest.into_places();
        let open = Finding::sized(DefectKind::OpenShell, open.count, size, places);
        let places = small.largest.into_places();
        let small = Finding::counted(DefectKind::TinyShell, small.count, places);
        Ok((report, vec![open, small]))
    }

    fn summary(&mut self, shell: u64) -> Result<ShellSummary, StoreError> {
        let sums = self.sums(shell)?;
        let is_closed = sums.open_sides == 0;
        Ok(ShellSummary {
            triangle: sums.first,
            triangles: sums.triangles,
            is_closed,
            is_hidden: sums.is_seen == 0,
            area: sums.area,
            volume: is_closed.then_some(sums.six_volumes / 6.0),
            bounds: [sums.low, sums.high],
        })
    }
}

/// Shells of one kind.
#[derive(Default)]
struct Tally {
    count: u64,
    total: f64,
    largest: SizedPlaces,
}

impl Tally {
    fn add(&mut self, size: f64, number: u64, defect: Defect) {
        self.count += 1;
        self.total += size;
        self.largest.offer(size, number, defect);
    }
}
