//! What surrounds a crossed edge: a polygon of the vertices of the cells around it.
//!
//! Units: places in cells, positions in lattice units, from the own brick's min corner.
//! Source: Ju and Udeshi 2006 (minimal edges).

use crate::contour::ContourError;
use crate::contour::mdc::arcs::{Arc, Edge};
use crate::contour::mdc::neighbourhood::{Neighbourhood, Patch};

/// A polygon around a crossed edge: three or four vertices, seen from the edge's upper end.
pub struct Polygon {
    /// The edge.
    pub edge: Edge,
    /// How many vertices.
    pub count: usize,
    patches: [Patch; 4],
    /// The vertices of the four cells.
    ring: [Patch; 4],
    /// In which of the four cells around the edge each vertex' turn ends.
    last: [u8; 4],
}

impl Polygon {
    /// The polygon around an edge; `None` if its cells have fewer than three vertices.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn around(nb: &mut Neighbourhood, edge: Edge) -> Result<Option<Self>, ContourError> {
        Ok(Self::of_ring(edge, edge.ring(nb)?))
    }

    /// The polygon of these four vertices; `None` if fewer than three differ.
    pub fn of_ring(edge: Edge, ring: [Patch; 4]) -> Option<Self> {
        let mut polygon = Self { edge, count: 0, patches: ring, ring, last: [0; 4] };
        for slot in 0..4 {
            // A vertex stands where its turn ends.
            if ring[slot].id() != ring[(slot + 1) % 4].id() {
                polygon.patches[polygon.count] = ring[slot];
                polygon.last[polygon.count] = slot as u8;
                polygon.count += 1;
            }
        }
        (polygon.count >= 3).then_some(polygon)
    }

    /// How often two cells that follow each other around an edge have different vertices.
    #[inline]
    pub fn turns(ring: &[Patch; 4]) -> usize {
        (0..4).filter(|slot| ring[*slot].id() != ring[(slot + 1) % 4].id()).count()
    }

    /// The vertices in order.
    pub fn patches(&self) -> &[Patch] {
        &self.patches[..self.count]
    }

    /// The arc from vertex `i` to the next.
    pub fn arc(&self, i: usize) -> Arc {
        // The very cells at the face: those of a cell above the brick may lie in two bricks.
        let last = usize::from(self.last[i]);
        let (this, next) = (self.ring[last], self.ring[(last + 1) % 4]);
        let (u, v) = ((self.edge.axis + 1) % 3, (self.edge.axis + 2) % 3);
        // From (-,-) up along u, up along v, down along u, down along v.
        let (axis, is_up) = [(u, true), (v, true), (u, false), (v, false)][last];
        if is_up {
            Arc { axis, lower: this, upper: next }
        } else {
            Arc { axis, lower: next, upper: this }
        }
    }

    /// Whether the segment of an arc misses its face and vertex `own` is not at that arc. Such a
    /// polygon is a fan if `own` shares its cell with others: the cell cannot see the face point.
    pub fn has_missed_arc_off(&self, own: usize, cell_units: i32) -> bool {
        let before = (own + self.count - 1) % self.count;
        (0..self.count).any(|i| i != own && i != before && !self.arc(i).passes(cell_units))
    }

    /// The minimal edge, which all cells around share, from end to end; `None` if the surface
    /// crosses it more than once.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn minimal_edge(
        &self,
        nb: &mut Neighbourhood,
    ) -> Result<Option<[[i32; 3]; 2]>, ContourError> {
        let Edge { axis, lower } = self.edge;
        let boxes = self.patches().iter().map(Patch::cut_box);
        let (low, high) = boxes.fold((i32::MIN, i32::MAX), |(low, high), cut| {
            (low.max(cut.low[axis]), high.min(cut.high[axis]))
        });
        // An edge of a cell above the brick is crossed once at most. Others lie in one brick.
        let is_above = self.patches().iter().all(|patch| patch.vertex.cut.is_above());
        let others = if is_above { 0..0 } else { low..high };
        for along in others.filter(|along| *along != lower[axis]) {
            let mut other = lower;
            other[axis] = along;
            if nb.is_crossed(axis, other)? {
                return Ok(None);
            }
        }
        let cell = nb.cell_units();
        Ok(Some([low, high].map(|along| {
            let mut end = lower;
            end[axis] = along;
            end.map(|c| c * cell)
        })))
    }
}
