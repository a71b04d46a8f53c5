//! Edges of the grid with the cells around them, and arcs between the vertices of neighbouring cells.
//!
//! Two neighbouring cells of the cut share a face, that of the smaller one: the minimal face. The
//! pieces of surface in the two meet there in an arc. The segment between their vertices passes the
//! minimal face, or a face point on it must be a vertex: always where one of the cells is flagged.
//!
//! Units: places in cells, positions in lattice units, from the own brick's min corner.
//! Source: Ju and Udeshi 2006 (face vertices and minimal edges); the rest is ours.

use crate::contour::ContourError;
use crate::contour::mdc::cell::{edge_in_cell, lower_end, segments_on};
use crate::contour::mdc::cut_cell::{CutBox, CutCell};
use crate::contour::mdc::loaded::{face_point_key, far_point_key};
use crate::contour::mdc::neighbourhood::{Neighbourhood, OWN, Patch};
use crate::contour::mdc::table::{axis_of_edge, edge_at_corner};
use crate::octree::SIDE;

/// An edge of the grid: its direction and its lower end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// The axis that it runs along.
    pub axis: usize,
    /// Its lower end.
    pub lower: [i32; 3],
}

impl Edge {
    /// The vertices of the four cells around it, counted around its direction: (-,-), (+,-), (+,+),
    /// (-,+) on the two axes after its own.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    #[inline]
    pub fn ring(&self, nb: &mut Neighbourhood) -> Result<[Patch; 4], ContourError> {
        if let Some(ring) = self.ring_within(nb) {
            return Ok(ring);
        }
        let mut ring = [None; 4];
        for (patch, (down, number)) in ring.iter_mut().zip(AROUND[self.axis]) {
            let found = nb.cell(std::array::from_fn(|a| self.lower[a] - down[a]))?;
            *patch = Some(nb.vertex(found, number));
        }
        Ok(ring.map(|patch| patch.expect("all four are found")))
    }

    /// The same where all four cells are in the own brick: a shorter way.
    #[inline]
    fn ring_within(&self, nb: &Neighbourhood) -> Option<[Patch; 4]> {
        let places = self.places_within(nb)?;
        Some(places.map(|place| Patch { vertex: nb.own().vertex(place), slot: OWN }))
    }

    /// Where these four vertices are in the list of the own brick, if the cells are all in it.
    #[inline]
    fn places_within(&self, nb: &Neighbourhood) -> Option<[usize; 4]> {
        let is_within =
            (0..3).all(|a| (i32::from(a != self.axis)..SIDE as i32).contains(&self.lower[a]));
        if !is_within {
            return None;
        }
        let mut places = [0; 4];
        for (place, (down, number)) in places.iter_mut().zip(AROUND[self.axis]) {
            let at = std::array::from_fn(|a| (self.lower[a] - down[a]) as usize);
            *place = nb.own().place_of_vertex(nb.find_within(at)?.rank(), number);
        }
        Some(places)
    }

    /// Whether surely no more than two vertices are around it, without a look at them.
    #[inline]
    pub fn is_between_two(&self, nb: &Neighbourhood) -> bool {
        self.places_within(nb).is_some_and(|places| {
            (0..4).filter(|slot| places[*slot] != places[(slot + 1) % 4]).count() < 3
        })
    }
}

/// The four cells around the lower edge of a cell along each axis: the axes along which each lies
/// one step down, and the number of the edge there.
const AROUND: [[([i32; 3], u8); 4]; 3] = {
    let mut around = [[([0; 3], 0); 4]; 3];
    let mut axis = 0;
    while axis < 3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let downs = [u | v, v, 0, u];
        let mut slot = 0;
        while slot < 4 {
            let down: u8 = downs[slot];
            let steps = [(down & 1) as i32, (down >> 1 & 1) as i32, (down >> 2) as i32];
            around[axis][slot] = (steps, edge_at_corner(down, axis as u8));
            slot += 1;
        }
        axis += 1;
    }
    around
};

/// The face that two cells of the cut share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MinimalFace {
    /// The axis across it.
    pub axis: usize,
    /// A box without height.
    pub face: CutBox,
}

impl MinimalFace {
    /// The face point of an arc that leaves the face at these two crossings.
    pub fn point(&self, ends: [[i32; 3]; 2], cell_units: i32) -> [i32; 3] {
        let [p, q] = ends.map(|end| end.map(i64::from));
        let cell = i64::from(cell_units);
        let middle: [i64; 3] = std::array::from_fn(|a| (p[a] + q[a]) / 2);
        let [low, high] =
            [self.face.low, self.face.high].map(|end| end.map(|c| i64::from(c) * cell));
        let is_inside =
            (0..3).filter(|a| *a != self.axis).all(|a| low[a] < middle[a] && middle[a] < high[a]);
        let at: [i64; 3] = if is_inside {
            middle
        } else {
            std::array::from_fn(|a| (p[a] + q[a] + low[a] + high[a]) / 4)
        };
        let mut at = at.map(|c| c as i32);
        at[self.axis] = self.face.low[self.axis] * cell_units;
        at
    }
}

/// The arc between two cells of the cut.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// The axis across the face.
    pub axis: usize,
    /// The vertex below the face.
    pub lower: Patch,
    /// The vertex above it.
    pub upper: Patch,
}

impl Arc {
    /// The key of its face point in the brick that owns the face, that of the upper cell.
    pub fn key(&self) -> u64 {
        let is_beyond = self.lower.slot != self.upper.slot;
        let (upper, lower) = (self.upper.number_in_brick(), self.lower.number_in_brick());
        face_point_key(self.axis, is_beyond, upper, lower)
    }

    /// Whether both cells are above the brick: then its ends may be far from each other.
    #[inline]
    pub fn is_far(&self) -> bool {
        self.lower.vertex.cut.is_above() && self.upper.vertex.cut.is_above()
    }

    /// Whether one vertex is on both sides: then it is none.
    #[inline]
    pub fn is_inner(&self) -> bool {
        self.lower.id() == self.upper.id()
    }

    /// The brick that owns the face point of an arc between two cells above the brick, the one
    /// that has the vertex of the smaller; and its key there.
    pub fn far_key(&self) -> (usize, u64) {
        let is_upper = self.upper.vertex.cut.level() < self.lower.vertex.cut.level();
        let smaller = if is_upper { self.upper } else { self.lower };
        (smaller.vertex.number as usize, far_point_key(self.axis, is_upper))
    }

    /// The minimal face, which both boxes have.
    pub fn minimal_face(&self) -> MinimalFace {
        let (lower, upper) = (self.lower.cut_box(), self.upper.cut_box());
        let mut low: [i32; 3] = std::array::from_fn(|a| lower.low[a].max(upper.low[a]));
        let mut high: [i32; 3] = std::array::from_fn(|a| lower.high[a].min(upper.high[a]));
        (low[self.axis], high[self.axis]) = (upper.low[self.axis], upper.low[self.axis]);
        MinimalFace { axis: self.axis, face: CutBox { low, high } }
    }

    /// Whether no face point between these two cells is a vertex, wherever theirs are.
    #[inline]
    pub fn never_misses(lower: CutCell, upper: CutCell) -> bool {
        // The union of two equal cells is convex.
        !lower.is_flagged() && !upper.is_flagged() && lower.is_as_large_as(upper)
    }

    /// Whether the face point is a vertex.
    pub fn is_explicit(&self, cell_units: i32) -> bool {
        let (lower, upper) = (self.lower.vertex.cut, self.upper.vertex.cut);
        lower.is_flagged() || upper.is_flagged() || !self.passes(cell_units)
    }

    /// Whether the segment between the two vertices passes strictly through the minimal face.
    pub fn passes(&self, cell_units: i32) -> bool {
        if self.lower.vertex.cut.is_as_large_as(self.upper.vertex.cut) {
            // The union of two equal cells is convex.
            return true;
        }
        let MinimalFace { face, .. } = self.minimal_face();
        let from = self.lower.vertex.position.map(i64::from);
        let to = self.upper.vertex.position.map(i64::from);
        let cell = i64::from(cell_units);
        let whole = to[self.axis] - from[self.axis];
        let part = i64::from(face.low[self.axis]) * cell - from[self.axis];
        (0..3).filter(|a| *a != self.axis).all(|a| {
            let at = from[a] * whole + part * (to[a] - from[a]);
            let (low, high) = (i64::from(face.low[a]) * cell, i64::from(face.high[a]) * cell);
            low * whole < at && at < high * whole
        })
    }

    /// The face point of an arc that leaves its face at these two crossings.
    pub fn point(&self, ends: [[i32; 3]; 2], cell_units: i32) -> [i32; 3] {
        self.minimal_face().point(ends, cell_units)
    }

    /// Whether the arc ends at an edge of the fine face below cell `above`: not if it goes on
    /// between the same two cells beyond the edge.
    pub fn ends_at(&self, edge: &Edge, above: [i32; 3]) -> bool {
        let across = 3 - self.axis - edge.axis;
        let step = if edge.lower[across] > above[across] { 1 } else { -1 };
        let mut upper = above;
        upper[across] += step;
        let mut lower = upper;
        lower[self.axis] -= 1;
        !(self.upper.cut_box().holds(upper) && self.lower.cut_box().holds(lower))
    }
}

impl Arc {
    /// The crossings where the arc leaves its face, of which `edge` is one; the fine face there
    /// lies below cell `above`.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn ends(
        &self,
        nb: &mut Neighbourhood,
        edge: Edge,
        above: [i32; 3],
    ) -> Result<[[i32; 3]; 2], ContourError> {
        let (mut here, mut cell) = (edge, above);
        loop {
            let found = nb.cell(cell)?;
            let number = edge_in_cell(here.axis, here.lower, cell);
            let pairs = segments_on(nb.packed(found), 2 * self.axis).pairs();
            let pair = pairs.iter().find(|pair| pair.contains(&number));
            let pair = *pair.ok_or_else(|| nb.contradiction("a segment on a crossed face"))?;
            let [one, other] = edges_of(pair, cell);
            here = if one == here { other } else { one };
            if self.ends_at(&here, cell) {
                break;
            }
            let across = 3 - self.axis - here.axis;
            cell[across] += if here.lower[across] > cell[across] { 1 } else { -1 };
        }
        Ok([nb.crossing(edge.axis, edge.lower)?.0, nb.crossing(here.axis, here.lower)?.0])
    }
}

/// The edges of a cell that a segment on one of its faces joins.
pub fn edges_of(pair: [u8; 2], at: [i32; 3]) -> [Edge; 2] {
    pair.map(|edge| Edge { axis: usize::from(axis_of_edge(edge)), lower: lower_end(at, edge) })
}
