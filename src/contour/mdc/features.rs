//! Creases and corners that pass through a cell whose own edges miss one of their planes.
//!
//! A corner of the model may lie in a cell of which only two of its three planes cross an edge. The
//! third crosses an edge that leaves one of the cell's corners. The vertex stays on the planes of
//! its own crossings, and moves along them to those of the edges around if that is in the cell.
//!
//! In:         the crossings of a cell and of the 24 edges that leave its corners outward.
//! Out:        the vertex on the feature, and the planes that were taken in.
//! Invariant:  a vertex leaves none of its own planes, so a plane taken in wrongly does no harm.
//! Units:      cells about the cell's centre.
//! Memory:     the crossings on edges that leave the brick: 26 KiB.
//! Fails:      [`ContourError`]: a brick beyond cannot be read.
//! Source:     ours.

use glam::DVec3;

use crate::contour::ContourError;
use crate::contour::mdc::leaf_vertex::Around;
use crate::contour::mdc::workspace::Workspace;
use crate::geom::qef::{Hit, Solution, meet};
use crate::octree::{
    AXIS_EDGES, BrickKey, Crossing, LINES, PATCH, ROWS, SIDE, SignBricks, SourcePlane,
    edge_position,
};

/// Most planes of edges around that are looked at.
const MAX_PLANES: usize = 4;

/// Crossings on the edges that leave a brick through its six sides: numbers of normals.
pub struct Halo {
    sides: [Vec<u32>; 6],
    is_loaded: [bool; 6],
}

impl Halo {
    /// Of no brick yet.
    pub fn new() -> Self {
        Self { sides: [const { Vec::new() }; 6], is_loaded: [false; 6] }
    }

    /// Forgets the brick.
    pub fn clear(&mut self) {
        self.is_loaded = [false; 6];
    }
}

/// Where a brick's signs are, and those of the bricks around it.
#[derive(Clone, Copy)]
pub struct Place<'s> {
    /// All bricks of signs.
    pub signs: SignBricks<'s>,
    /// The own brick.
    pub key: BrickKey,
}

impl Workspace {
    /// Moves the vertex of the cell at `at` to a feature in it; the vertex, and the numbers of the
    /// normals taken in.
    pub(super) fn toward_feature(
        &mut self,
        place: Place,
        at: [usize; 3],
        around: &Around,
        solution: &Solution,
    ) -> Result<Option<(DVec3, [u32; 2])>, ContourError> {
        if self.is_smooth && at.iter().all(|c| (1..SIDE - 1).contains(c)) {
            return Ok(None);
        }
        let Some(own) = OwnPlanes::of(around, solution, &self.normals) else { return Ok(None) };
        let mut planes = Planes { numbers: [0; MAX_PLANES], count: 0 };
        for corner in 0..8_usize {
            for axis in 0..3 {
                let number = self.outward(place, at, corner, axis)?;
                planes.note(number, &own, &self.normals, self.crease_cosine);
            }
        }
        let planes = &planes.numbers[..planes.count];
        if own.count == 1 {
            for (i, &one) in planes.iter().enumerate() {
                for &other in &planes[i + 1..] {
                    if let Some(vertex) = self.meet(at, &own, &[one, other], solution) {
                        return Ok(Some((vertex, [one, other])));
                    }
                }
            }
        }
        let single =
            planes.iter().find_map(|&one| Some((self.meet(at, &own, &[one], solution)?, [one, 0])));
        Ok(single)
    }

    /// Where the own planes and those of `numbers` meet, if that is in the cell.
    fn meet(
        &self,
        at: [usize; 3],
        own: &OwnPlanes,
        numbers: &[u32],
        solution: &Solution,
    ) -> Option<DVec3> {
        let mut hits = [Hit { point: solution.position, normal: DVec3::ZERO }; 3];
        let mut count = 0;
        for &number in &own.numbers[..own.count] {
            hits[count].normal = self.normals[number as usize];
            count += 1;
        }
        let centre = DVec3::from(at.map(|c| c as f64 + 0.5));
        for &number in numbers {
            let normal = self.normals[number as usize];
            let offset = self.planes[number as usize - 1].offset / self.cell_units as f64;
            let point = solution.position;
            let mut point = point - normal * (normal.dot(point + centre) - offset);
            for axis in 0..3 {
                if normal[axis].abs() == 1.0 {
                    point[axis] = offset * normal[axis] - centre[axis];
                }
            }
            hits[count] = Hit { point, normal };
            count += 1;
        }
        meet(&hits[..count], &self.qef)
    }

    /// The number of the normal on the edge that leaves a corner of a cell outward along `axis`;
    /// 0 where none is.
    #[inline]
    pub(super) fn outward(
        &mut self,
        place: Place,
        at: [usize; 3],
        corner: usize,
        axis: usize,
    ) -> Result<u32, ContourError> {
        let mut lower = [0, 1, 2].map(|a| at[a] + (corner >> a & 1));
        if corner >> axis & 1 == 1 {
            if lower[axis] == SIDE {
                return self.beyond_side(place, 2 * axis + 1, lower);
            }
        } else {
            if lower[axis] == 0 {
                return self.beyond_side(place, 2 * axis, lower);
            }
            lower[axis] -= 1;
        }
        Ok(if self.is_marked(axis, lower) { self.crossing(axis, lower).normal } else { 0 })
    }

    /// The same on an edge that leaves the brick through `side`.
    fn beyond_side(
        &mut self,
        place: Place,
        side: usize,
        corner: [usize; 3],
    ) -> Result<u32, ContourError> {
        let (u, v) = ((side / 2 + 1) % 3, (side / 2 + 2) % 3);
        Ok(self.beyond(place, side)?[corner[v] * LINES + corner[u]])
    }

    /// The same on all edges that leave the brick through `side`, row by row: rows run along the axis after
    /// that of the side.
    pub(super) fn beyond(&mut self, place: Place, side: usize) -> Result<&[u32], ContourError> {
        if !self.halo.is_loaded[side] {
            self.load_side(place, side)?;
        }
        Ok(&self.halo.sides[side])
    }

    /// Loads the crossings on edges that leave the brick through `side`.
    fn load_side(&mut self, place: Place, side: usize) -> Result<(), ContourError> {
        let (axis, is_max) = (side / 2, side % 2 == 1);
        self.halo.is_loaded[side] = true;
        let numbers = &mut self.halo.sides[side];
        numbers.clear();
        numbers.resize(LINES * LINES, 0);
        let key = if is_max { Some(place.key.upper(axis)) } else { place.key.lower(1 << axis) };
        let Some(number) = key.and_then(|key| place.signs.find(key)) else { return Ok(()) };
        let view = place.signs.view(number)?;
        let record = view.record()?;
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let wanted = if is_max { 0 } else { SIDE - 1 };
        let brick_units = self.cell_units as f64 * SIDE as f64;
        let shift = if is_max { brick_units } else { -brick_units };
        let first = axis as u32 * AXIS_EDGES;
        let planes = record.planes();
        record.each_crossing_within([first, first + AXIS_EDGES], |Crossing { edge, plane }| {
            // Where it is along the axis alone: all of it takes longer.
            let step = [1, LINES, ROWS][axis];
            if (edge - first) as usize / step % LINES != wanted || plane & PATCH != 0 {
                return;
            }
            let (_, at) = edge_position(edge);
            let mut plane = SourcePlane::from(&planes[plane as usize]);
            let normal = plane.unit_normal();
            plane.offset += normal[axis] * shift;
            self.planes.push(plane);
            self.normals.push(normal);
            self.halo.sides[side][at[v] * LINES + at[u]] = (self.normals.len() - 1) as u32;
        });
        Ok(())
    }
}

/// Planes of edges around a cell, by the numbers of their normals.
struct Planes {
    numbers: [u32; MAX_PLANES],
    count: usize,
}

impl Planes {
    fn note(&mut self, number: u32, own: &OwnPlanes, normals: &[DVec3], cosine: f64) {
        let is_new = number != 0
            && self.count < MAX_PLANES
            && !self.numbers[..self.count].contains(&number)
            && own.is_apart_from(number, normals, cosine);
        if is_new {
            self.numbers[self.count] = number;
            self.count += 1;
        }
    }
}

/// The one or two planes that all crossings of a cell lie on.
struct OwnPlanes {
    numbers: [u32; 2],
    count: usize,
}

impl OwnPlanes {
    /// `None` if a vertex on them cannot move.
    fn of(around: &Around, solution: &Solution, normals: &[DVec3]) -> Option<Self> {
        if solution.clamped || solution.rank == 0 || solution.rank > 2 {
            return None;
        }
        let mut own = Self { numbers: [0; 2], count: 0 };
        for &number in &around.normals[..around.count] {
            let normal = normals[number as usize];
            let is_known = own.numbers[..own.count].iter().any(|known| {
                let known = normals[*known as usize];
                known == normal || known == -normal
            });
            if is_known || number == 0 {
                continue;
            }
            if own.count == 2 {
                return None;
            }
            own.numbers[own.count] = number;
            own.count += 1;
        }
        (own.count == usize::from(solution.rank)).then_some(own)
    }

    /// Whether a normal differs from all own ones by more than the crease angle.
    fn is_apart_from(&self, number: u32, normals: &[DVec3], cosine: f64) -> bool {
        let normal = normals[number as usize];
        self.numbers[..self.count]
            .iter()
            .all(|own| normals[*own as usize].dot(normal).abs() < cosine)
    }
}
