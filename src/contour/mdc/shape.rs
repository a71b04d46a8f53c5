//! How a polygon between cells of any size becomes triangles.
//!
//! In:         the loop of its vertices and of those face points that are vertices, its crossing,
//!             and its minimal edge.
//! Out:        two triangles or one that stay in the envelope of the polygon, the tetrahedra
//!             between the minimal edge and the sides of the loop; else a fan around the crossing.
//! Invariant:  decided exactly on the lattice; no triangle is degenerate; no two polygons have the
//!             same diagonal.
//! Units:      lattice units from the own brick's min corner.
//! Source:     Ju and Udeshi 2006 (the envelope). Which diagonals two clusters may have is ours.

use glam::DVec3;

use crate::contour::mdc::neighbourhood::Patch;
use crate::contour::mdc::triangulate::Cut;
use crate::geom::orientation::{is_degenerate, orientation};

/// Residuals that differ by less than this share of the minimal edge are equal.
const EQUAL_RESIDUAL_SHARE: f64 = 1e-6;

/// A corner of a loop.
#[derive(Clone, Copy, Debug)]
pub struct LoopPoint {
    /// Where.
    pub position: [i32; 3],
    /// A name, distinct in the neighbourhood.
    pub id: u64,
    /// Whether it is a vertex of a leaf cell.
    pub is_leaf: bool,
    /// Whether it is a face point.
    pub is_face_point: bool,
}

impl Shape {
    /// The triangles by the numbers of their corners; none for a fan.
    pub const fn triangles(self) -> &'static [[usize; 3]] {
        match self {
            Self::Triangle => &[[0, 1, 2]],
            Self::FirstThird => &[[0, 1, 2], [0, 2, 3]],
            Self::SecondFourth => &[[1, 2, 3], [1, 3, 0]],
            Self::Fan => &[],
        }
    }
}

impl From<Cut> for Shape {
    fn from(cut: Cut) -> Self {
        match cut {
            Cut::FirstThird => Self::FirstThird,
            Cut::SecondFourth => Self::SecondFourth,
            Cut::Fan => Self::Fan,
        }
    }
}

impl LoopPoint {
    /// A vertex of a cell.
    pub fn of_vertex(patch: &Patch) -> Self {
        let (position, cut) = (patch.vertex.position, patch.vertex.cut);
        Self { position, id: patch.id(), is_leaf: cut.level() == 0, is_face_point: false }
    }
}

/// A loop around a crossed edge, seen from the edge's upper end.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    points: [LoopPoint; 8],
    count: usize,
    /// The edge's direction.
    axis: usize,
    /// The crossing.
    pub crossing: [i32; 3],
    /// Whether the edge's lower end is inside.
    pub inside_below: bool,
}

/// Triangles of a loop by the numbers of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Its three points.
    Triangle,
    /// Cut from point 0 to 2.
    FirstThird,
    /// Cut from point 1 to 3.
    SecondFourth,
    /// A fan around the crossing.
    Fan,
}

impl Loop {
    /// A loop without points.
    pub fn new(axis: usize, crossing: [i32; 3], inside_below: bool) -> Self {
        let none = LoopPoint { position: [0; 3], id: 0, is_leaf: false, is_face_point: false };
        Self { points: [none; 8], count: 0, axis, crossing, inside_below }
    }

    /// Adds the next point.
    pub fn push(&mut self, point: LoopPoint) {
        self.points[self.count] = point;
        self.count += 1;
    }

    /// The points in order.
    pub fn points(&self) -> &[LoopPoint] {
        &self.points[..self.count]
    }

    /// The shape of the loop around the minimal edge `ends`, `None` of which makes a fan.
    pub fn shape(&self, ends: Option<[[i32; 3]; 2]>) -> Shape {
        let Some(ends) = ends else { return Shape::Fan };
        let ends = ends.map(|end| end.map(i64::from));
        let at = |i: usize| self.points[i].position.map(i64::from);
        match self.count {
            3 => {
                let corners = [at(0), at(1), at(2)];
                let is_sound =
                    !is_degenerate(corners[0], corners[1], corners[2]) && separates(corners, ends);
                if is_sound { Shape::Triangle } else { Shape::Fan }
            }
            4 => {
                let corners = [at(0), at(1), at(2), at(3)];
                let order = if self.prefers_first(&corners, ends) { [0, 1] } else { [1, 0] };
                for first in order {
                    if self.allows(first) && in_envelope(&corners, first, ends) {
                        return [Shape::FirstThird, Shape::SecondFourth][first];
                    }
                }
                Shape::Fan
            }
            _ => Shape::Fan,
        }
    }

    /// Whether no other polygon can have the diagonal from point `first` to the one opposite.
    fn allows(&self, first: usize) -> bool {
        let (from, to) = (&self.points[first], &self.points[first + 2]);
        if self.points().iter().any(|point| point.is_face_point) {
            // Two vertices that share an arc with a face point have no edge.
            return (from.is_face_point && to.is_leaf) || (to.is_face_point && from.is_leaf);
        }
        // Two clusters share at most two crossings of one line, in opposite directions.
        from.is_leaf || to.is_leaf || self.inside_below == (first == 0)
    }

    /// Whether the surface over the first diagonal passes nearer to the crossing; the shorter one
    /// where both pass it alike.
    fn prefers_first(&self, corners: &[[i64; 3]; 4], ends: [[i64; 3]; 2]) -> bool {
        let [first, second] = [0, 1].map(|first| self.residual(corners, first, ends));
        let length = (ends[1][self.axis] - ends[0][self.axis]) as f64;
        if (first - second).abs() > EQUAL_RESIDUAL_SHARE * length {
            return first < second;
        }
        let square = |i: usize, j: usize| -> i128 {
            (0..3).map(|a| i128::from(corners[i][a] - corners[j][a]).pow(2)).sum()
        };
        square(0, 2) <= square(1, 3)
    }

    /// How far from the crossing the surface over a diagonal meets the edge's line.
    fn residual(&self, corners: &[[i64; 3]; 4], first: usize, [a, b]: [[i64; 3]; 2]) -> f64 {
        let [p, q, r, s] = [0, 1, 2, 3].map(|i| corners[(first + i) % 4]);
        let pierced = if orientation(p, r, a, b) < 0 { s } else { q };
        let difference =
            |x: [i64; 3], y: [i64; 3]| DVec3::from([0, 1, 2].map(|i| (x[i] - y[i]) as f64));
        let normal = difference(r, p).cross(difference(pierced, p));
        let way = difference(p, self.crossing.map(i64::from));
        let height = normal.dot(way) / normal[self.axis];
        if height.is_nan() { f64::INFINITY } else { height.abs() }
    }
}

/// Whether the ends lie strictly on opposite sides of the triangle's plane.
fn separates([p, q, r]: [[i64; 3]; 3], ends: [[i64; 3]; 2]) -> bool {
    ends.map(|end| orientation(p, q, r, end)).into_iter().product::<i32>() < 0
}

/// Whether the two triangles on the diagonal from corner `first` stay in the envelope.
fn in_envelope(corners: &[[i64; 3]; 4], first: usize, [a, b]: [[i64; 3]; 2]) -> bool {
    let [p, q, r, s] = [0, 1, 2, 3].map(|i| corners[(first + i) % 4]);
    if is_degenerate(p, q, r) || is_degenerate(p, r, s) {
        return false;
    }
    let side = orientation(p, r, a, b);
    if side == 0 {
        return separates([p, r, q], [a, b]) && separates([p, r, s], [a, b]);
    }
    [(q, s), (s, q)].into_iter().any(|(beyond, pierced)| {
        orientation(p, r, b, beyond) == side
            && orientation(p, r, beyond, a) == side
            && separates([p, r, pierced], [a, b])
    })
}
