//! Planes that part the materials of a cell: its vertex goes where the border runs.
//!
//! In:         the crossings of one component with their materials, and edges of the soup that may
//!             be the border.
//! Out:        planes across the surface, through the border; none where one material is alone.
//! Invariant:  every crossing lies on the side of its material, of one plane or of two that bend
//!             around a corner of the border. Where no edge does that, the plane lies halfway between
//!             the materials, unless a crease parts them.
//! Units:      cells about the cell's centre.
//! Memory:     that of the borders of a brick.
//! Source:     ours.

use glam::DVec3;

use crate::contour::SurfaceDetail;
use crate::contour::mdc::leaf_vertex::Around;
use crate::contour::mdc::workspace::Workspace;
use crate::geom::qef::Hit;
use crate::octree::{Border, SIDE};

/// A crossing so near to a border is on both sides, in cells.
const ON_BORDER_CELLS: f64 = 1e-3;
/// An edge whose direction is that near to the normal of the surface is no border of it: the sine.
const LEAST_SINE: f64 = 0.1;
/// Most edges of one cell that are tried.
const MOST_EDGES: usize = 8;

/// Planes of a border in a cell.
pub(super) struct BorderPlanes {
    pub(super) count: usize,
    pub(super) planes: [Hit; 2],
}

impl BorderPlanes {
    const NONE: Self =
        Self { count: 0, planes: [Hit { point: DVec3::ZERO, normal: DVec3::ZERO }; 2] };

    fn of(planes: &[Hit]) -> Self {
        let mut found = Self::NONE;
        found.count = planes.len();
        found.planes[..planes.len()].copy_from_slice(planes);
        found
    }

    /// Whether one material is alone.
    pub(super) fn is_none(&self) -> bool {
        self.count == 0
    }

    /// The planes.
    pub(super) fn planes(&self) -> &[Hit] {
        &self.planes[..self.count]
    }
}

/// What one of the two materials has of the crossings.
struct Sides {
    /// Whether each crossing is of the first material.
    is_first: [bool; 12],
    count: usize,
    middles: [DVec3; 2],
    normals: [DVec3; 2],
}

impl Workspace {
    /// The planes that part the materials of a component of the cell at `at`.
    pub(super) fn border_planes(&self, at: [usize; 3], around: &Around) -> BorderPlanes {
        let is_told = self.surfaces != SurfaceDetail::None;
        let sides = if is_told { Sides::of(around, &self.normals, self.surfaces) } else { None };
        let Some(sides) = sides else { return BorderPlanes::NONE };
        let outward = (sides.normals[0] + sides.normals[1]).normalize_or_zero();
        let mut tried = [Hit { point: DVec3::ZERO, normal: DVec3::ZERO }; MOST_EDGES];
        let mut count = 0;
        let borders = self.borders_of(at);
        for is_shared in [true, false] {
            let alike = borders.iter().filter(|border| border.is_shared == is_shared);
            for plane in alike.filter_map(|border| plane_of(border, at, outward)) {
                if sides.are_parted_by(around, &[plane]) {
                    return BorderPlanes::of(&[plane]);
                }
                if count < MOST_EDGES {
                    tried[count] = plane;
                    count += 1;
                }
            }
        }
        for (i, one) in tried[..count].iter().enumerate() {
            for other in &tried[i + 1..count] {
                let pair = [*one, *other];
                if sides.are_parted_by(around, &pair) {
                    return BorderPlanes::of(&pair);
                }
            }
        }
        let cosine = sides.normals[0].normalize_or_zero().dot(sides.normals[1].normalize_or_zero());
        let is_crease = cosine < self.crease_cosine;
        match halfway(&sides, outward).filter(|_| !is_crease) {
            Some(plane) => BorderPlanes::of(&[plane]),
            None => BorderPlanes::NONE,
        }
    }

    /// The edges of the soup in a cell.
    fn borders_of(&self, at: [usize; 3]) -> &[Border] {
        let cell = ((at[2] * SIDE + at[1]) * SIDE + at[0]) as u16;
        let first = self.borders.partition_point(|border| border.cell < cell);
        let more = &self.borders[first..];
        &more[..more.partition_point(|border| border.cell == cell)]
    }
}

/// The plane through an edge across the surface.
fn plane_of(border: &Border, at: [usize; 3], outward: DVec3) -> Option<Hit> {
    let direction = DVec3::from(border.direction.map(f64::from));
    let across = direction.cross(outward);
    let centre = DVec3::from(at.map(|c| c as f64 + 0.5));
    let point = DVec3::from(border.point.map(f64::from)) - centre;
    (across.length() >= LEAST_SINE).then(|| Hit { point, normal: across.normalize() })
}

/// The plane halfway between the materials, across the surface.
fn halfway(sides: &Sides, outward: DVec3) -> Option<Hit> {
    let [one, other] = sides.middles;
    let way = other - one;
    let normal = (way - outward * outward.dot(way)).try_normalize()?;
    Some(Hit { point: (one + other) * 0.5, normal })
}

impl Sides {
    /// The first crossing's material and all others; `None` where there are no others.
    fn of(around: &Around, normals: &[DVec3], detail: SurfaceDetail) -> Option<Self> {
        let material = |i: usize| detail.of(around.surfaces[i]);
        let first = material(0);
        if (1..around.count).all(|i| material(i) == first) {
            return None;
        }
        let mut sides = Self {
            is_first: [false; 12],
            count: around.count,
            middles: [DVec3::ZERO; 2],
            normals: [DVec3::ZERO; 2],
        };
        let mut counts = [0.0; 2];
        for i in 0..around.count {
            sides.is_first[i] = material(i) == first;
            let side = usize::from(!sides.is_first[i]);
            sides.middles[side] += around.points[i];
            sides.normals[side] += normals[around.normals[i] as usize];
            counts[side] += 1.0;
        }
        sides.middles = [sides.middles[0] / counts[0], sides.middles[1] / counts[1]];
        Some(sides)
    }

    /// Whether these planes, one or two, have one material on one side, and the others on the other:
    /// of two planes a side is what lies on one side of both, or of any.
    fn are_parted_by(&self, around: &Around, planes: &[Hit]) -> bool {
        let mut turns = 0..1 << planes.len();
        turns.any(|turn: u32| {
            let side = |i: usize, plane: usize| {
                let Hit { point, normal } = planes[plane];
                let height = normal.dot(around.points[i] - point);
                if turn >> plane & 1 == 1 { -height } else { height }
            };
            let all = 0..planes.len();
            let lowest = |i: usize| all.clone().map(|p| side(i, p)).fold(f64::INFINITY, f64::min);
            let highest =
                |i: usize| all.clone().map(|p| side(i, p)).fold(f64::NEG_INFINITY, f64::max);
            let fits = |is_first: bool, height: f64| {
                if is_first { height >= -ON_BORDER_CELLS } else { height <= ON_BORDER_CELLS }
            };
            (0..self.count).all(|i| fits(self.is_first[i], lowest(i)))
                || (0..self.count).all(|i| fits(self.is_first[i], highest(i)))
        })
    }
}
