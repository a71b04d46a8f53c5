//! Corners and creases of the model in cells that the surface enters through faces and no edge.
//!
//! Such a cell has no vertex: all its corners lie on one side. The feature then belongs to a cell
//! beside it, whose vertex may reach into the empty cell: the two are one box, and all that holds
//! for the box of a cell holds for it.
//!
//! In:         the crossings of a cell, and those of the edges around it.
//! Out:        the feature; behind a face a [`VertexReach`]: where the vertex would go. Whether it may is
//!             decided when all bricks are there, by `grants`.
//! Invariant:  every plane around passes the feature, so nothing else is near that it could cut
//!             off.
//! Units:      cells about the cell's centre.
//! Fails:      [`ContourError`]: a brick beyond cannot be read.
//! Source:     ours.

use glam::DVec3;

use crate::contour::ContourError;
use crate::contour::mdc::INSET_UNITS;
use crate::contour::mdc::cell::number_at;
use crate::contour::mdc::features::Place;
use crate::contour::mdc::leaf_vertex::Around;
use crate::contour::mdc::workspace::Workspace;
use crate::geom::qef::{Hit, meet};
use crate::octree::{LINES, SIDE, VertexReach};

/// How far from a feature its planes may pass, in cells.
pub(super) const SHARP_CELLS: f64 = 1e-3;

/// More planes than this do not meet in one corner.
const MAX_PLANES: usize = 12;

/// A corner in a cell, or a corner or a crease in an empty cell beside it.
pub(super) struct NearFeature {
    /// Where.
    pub(super) position: DVec3,
    /// Normals of those planes that make it and do not cross an edge of the cell; 0 for none.
    pub(super) planes: [u32; 3],
    /// The face that it lies behind; `None` in the cell itself.
    pub(super) face: Option<u8>,
}

impl Workspace {
    /// The feature at the cell at `at` that its own planes do not tell, if all planes around meet
    /// there.
    ///
    /// # Errors
    /// [`ContourError`].
    pub(super) fn near_feature(
        &mut self,
        place: Place,
        at: [usize; 3],
        around: &Around,
    ) -> Result<Option<NearFeature>, ContourError> {
        if self.is_smooth {
            return Ok(None);
        }
        let own = &around.normals[..around.count];
        let mut meeting = Meeting::new(self, at, around);
        if meeting.apart < 2 || !meeting.is_sound {
            return Ok(None);
        }
        if meeting.apart == 3 && self.place_of(at, &meeting).is_none() {
            return Ok(None);
        }
        let leaving = self.leaving(place, at)?;
        meeting = Meeting::new(self, at, around);
        self.take_in_block(at, &mut meeting);
        leaving.iter().filter(|number| **number != 0).for_each(|number| meeting.take_in(*number));
        if !meeting.is_sound {
            return Ok(None);
        }
        let Some((position, face)) = self.place_of(at, &meeting) else { return Ok(None) };
        if meeting.apart == 2 && face.is_none() {
            return Ok(None);
        }
        let planes = meeting.apart_ones.map(|n| if own.contains(&n) { 0 } else { n });
        Ok(meeting.is_at(position).then_some(NearFeature { position, planes, face }))
    }

    /// The wish of a cell's vertex to be at a feature behind `face`.
    pub(super) fn reach(
        &self,
        at: [usize; 3],
        around: &Around,
        feature: DVec3,
        face: u8,
    ) -> VertexReach {
        VertexReach {
            cell: number_at(at) as u16,
            face,
            is_granted: false,
            far: around.middle().distance_squared(feature) as f32,
            position: self.to_lattice_beyond(at, face, feature),
        }
    }

    /// Normals on edges that leave the brick from a corner of the cell.
    fn leaving(&mut self, place: Place, at: [usize; 3]) -> Result<[u32; 24], ContourError> {
        let mut numbers = [0; 24];
        if at.iter().all(|c| (1..SIDE - 1).contains(c)) {
            return Ok(numbers);
        }
        for (i, number) in numbers.iter_mut().enumerate() {
            *number = self.outward(place, at, i / 3, i % 3)?;
        }
        Ok(numbers)
    }

    /// Where the planes meet: in the cell, or behind a face in the next one, which the surface does
    /// not cross as far as this brick knows.
    fn place_of(&self, at: [usize; 3], meeting: &Meeting) -> Option<(DVec3, Option<u8>)> {
        let feature = meeting.meet()?;
        let mut outside = (0..3).filter(|a| feature[*a].abs() > 0.5);
        let Some(axis) = outside.next() else { return Some((feature, None)) };
        if outside.next().is_some() || feature[axis].abs() >= 1.5 {
            return None;
        }
        let is_max = feature[axis] > 0.0;
        let mut next = at.map(|c| c as i32);
        next[axis] += if is_max { 1 } else { -1 };
        let is_here = (0..SIDE as i32).contains(&next[axis]);
        let is_empty = !is_here || matches!(self.mask_at(next.map(|c| c as usize)), 0 | 0xff);
        is_empty.then_some((feature, Some(2 * axis as u8 + u8::from(is_max))))
    }

    /// Takes in the planes of all edges of the brick that the cells around have.
    fn take_in_block(&self, at: [usize; 3], meeting: &mut Meeting) {
        let range = |a: usize| at[a].saturating_sub(1)..(at[a] + 3).min(LINES);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    for axis in 0..3 {
                        if self.is_marked(axis, [x, y, z]) && [x, y, z][axis] < at[axis] + 2 {
                            meeting.take_in(self.crossing(axis, [x, y, z]).normal);
                        }
                    }
                }
            }
        }
    }

    /// Rounds to the lattice, strictly inside the cell beyond `face`.
    fn to_lattice_beyond(&self, at: [usize; 3], face: u8, feature: DVec3) -> [i32; 3] {
        let (axis, is_max) = (usize::from(face / 2), face % 2 == 1);
        std::array::from_fn(|a| {
            let step = i64::from(a == axis) * if is_max { 1 } else { -1 };
            let low = (at[a] as i64 + step) * self.cell_units;
            let place = feature[a] + 0.5 + at[a] as f64;
            let units = (place * self.cell_units as f64).round() as i64;
            units.clamp(low + INSET_UNITS, low + self.cell_units - INSET_UNITS) as i32
        })
    }
}

/// Planes that may meet in a feature.
struct Meeting<'w> {
    space: &'w Workspace,
    centre: DVec3,
    middle: DVec3,
    numbers: [u32; MAX_PLANES],
    count: usize,
    /// Planes apart from each other by more than the crease angle.
    apart_ones: [u32; 3],
    apart: usize,
    /// Whether all have normals, and there are not too many.
    is_sound: bool,
}

impl<'w> Meeting<'w> {
    /// Of the planes that cross edges of the cell.
    fn new(space: &'w Workspace, at: [usize; 3], around: &Around) -> Self {
        let mut meeting = Self {
            space,
            centre: DVec3::from(at.map(|c| c as f64 + 0.5)),
            middle: around.middle(),
            numbers: [0; MAX_PLANES],
            count: 0,
            apart_ones: [0; 3],
            apart: 0,
            is_sound: true,
        };
        around.normals[..around.count].iter().for_each(|number| meeting.take_in(*number));
        meeting
    }

    fn normal(&self, number: u32) -> DVec3 {
        self.space.normals[number as usize]
    }

    /// The offset of a plane from the brick's min corner.
    fn offset(&self, number: u32) -> f64 {
        self.space.planes[number as usize - 1].offset / self.space.cell_units as f64
    }

    /// Takes in the plane of the normal with this number.
    fn take_in(&mut self, number: u32) {
        if !self.is_sound || self.numbers[..self.count].contains(&number) {
            return;
        }
        if number == 0 || self.count == MAX_PLANES {
            self.is_sound = false;
            return;
        }
        self.numbers[self.count] = number;
        self.count += 1;
        let (normal, cosine) = (self.normal(number), self.space.crease_cosine);
        let known = &self.apart_ones[..self.apart];
        if known.len() < 3 && known.iter().all(|n| self.normal(*n).dot(normal).abs() < cosine) {
            self.apart_ones[self.apart] = number;
            self.apart += 1;
        }
    }

    /// Whether all planes pass the feature.
    fn is_at(&self, feature: DVec3) -> bool {
        self.numbers[..self.count].iter().all(|&number| {
            let distance = self.normal(number).dot(feature + self.centre) - self.offset(number);
            distance.abs() <= SHARP_CELLS
        })
    }

    /// Where the planes apart meet, within two cells: three in a corner, two in a crease, of which
    /// the place nearest to the middle of the crossings.
    fn meet(&self) -> Option<DVec3> {
        let mut hits = [Hit { point: self.middle, normal: DVec3::ZERO }; 3];
        for (hit, &number) in hits.iter_mut().zip(&self.apart_ones[..self.apart]) {
            let (normal, offset) = (self.normal(number), self.offset(number));
            hit.normal = normal;
            hit.point -= normal * (normal.dot(self.middle + self.centre) - offset);
            for axis in 0..3 {
                if normal[axis].abs() == 1.0 {
                    hit.point[axis] = offset * normal[axis] - self.centre[axis];
                }
            }
        }
        let mut options = self.space.qef;
        (options.lo, options.hi) = (DVec3::splat(-2.0), DVec3::splat(2.0));
        meet(&hits[..self.apart], &options)
    }
}
