//! Corners of the model that must not be lost in clusters.
//!
//! A cluster holds both cells of a vertex that reaches into another, or neither; if both, its own
//! vertex is there.

use crate::contour::mdc::cell::{number_at, place_of};
use crate::contour::mdc::cluster::Cell;
use crate::octree::{SIDE, VertexReach};

/// A vertex that may reach, and the two cells it concerns.
pub struct Corner {
    /// Its leaf cell.
    pub cell: usize,
    /// The cell beyond; `None` in another brick.
    beyond: Option<usize>,
    /// Where it would be.
    pub position: [i32; 3],
}

impl Corner {
    /// Of a brick's record.
    pub fn of(reach: &VertexReach) -> Self {
        let cell = usize::from(reach.cell);
        let mut at = place_of(cell).map(|c| c as i32);
        at[usize::from(reach.face / 2)] += if reach.face % 2 == 1 { 1 } else { -1 };
        let is_here = at.iter().all(|c| (0..SIDE as i32).contains(c));
        let beyond = is_here.then(|| number_at(at.map(|c| c as usize)));
        Self { cell, beyond, position: reach.position }
    }

    /// Whether a cell of the octree holds one of the two cells and not the other.
    pub fn is_cut_by(&self, cell: &Cell) -> bool {
        self.is_in(cell) != self.beyond.is_some_and(|beyond| cell.holds(beyond))
    }

    /// Whether a cell of the octree holds the leaf cell.
    pub fn is_in(&self, cell: &Cell) -> bool {
        cell.holds(self.cell)
    }
}
