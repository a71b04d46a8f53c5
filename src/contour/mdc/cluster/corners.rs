//! Corners of the model that must not be lost in clusters.
//!
//! A cluster holds both cells of a vertex that reaches into another, or neither; if both, its own
//! vertex is there.

use crate::contour::mdc::cell::{number_at, place_of};
use crate::contour::mdc::cluster::Cell;
use crate::octree::{SIDE, VertexReach};

/// A vertex that may reach.
pub struct Corner {
    /// Its leaf cell.
    pub cell: usize,
    /// The cell beyond; `None` in another brick.
    beyond: Option<usize>,
    /// Where it would be.
    pub position: [i32; 3],
}

/// Those of one brick.
#[derive(Default)]
pub struct Corners {
    /// By ascending cell.
    by_cell: Vec<Corner>,
    /// Cells beyond with those that their vertices come from, ascending.
    by_beyond: Vec<[usize; 2]>,
}

impl Corners {
    /// Takes in those of another brick, by ascending cell, in place of these.
    pub fn reset(&mut self, reaches: &[VertexReach]) {
        self.by_cell.clear();
        self.by_cell.extend(reaches.iter().map(Corner::of));
        self.by_beyond.clear();
        let pairs = self.by_cell.iter().filter_map(|corner| Some([corner.beyond?, corner.cell]));
        self.by_beyond.extend(pairs);
        self.by_beyond.sort_unstable();
    }

    /// Those whose vertices belong to a cell of the octree.
    pub fn within(&self, cell: &Cell) -> &[Corner] {
        let range = cell.range();
        let first = self.by_cell.partition_point(|corner| corner.cell < range.start);
        let more = &self.by_cell[first..];
        &more[..more.partition_point(|corner| corner.cell < range.end)]
    }

    /// Whether a cell of the octree holds one cell of a corner and not the other.
    pub fn are_cut_by(&self, cell: &Cell) -> bool {
        let leaves = |corner: &Corner| corner.beyond.is_none_or(|beyond| !cell.holds(beyond));
        if self.within(cell).iter().any(leaves) {
            return true;
        }
        let first = self.by_beyond.partition_point(|[beyond, _]| *beyond < cell.range().start);
        let inside = self.by_beyond[first..].iter().take_while(|[beyond, _]| cell.holds(*beyond));
        inside.into_iter().any(|[_, from]| !cell.holds(*from))
    }
}

impl Corner {
    fn of(reach: &VertexReach) -> Self {
        let cell = usize::from(reach.cell);
        let mut at = place_of(cell).map(|c| c as i32);
        at[usize::from(reach.face / 2)] += if reach.face % 2 == 1 { 1 } else { -1 };
        let is_here = at.iter().all(|c| (0..SIDE as i32).contains(c));
        let beyond = is_here.then(|| number_at(at.map(|c| c as usize)));
        Self { cell, beyond, position: reach.position }
    }
}
