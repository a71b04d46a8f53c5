//! The cut of a brick while it is made: cells in Morton order, the last ones replaced by a larger.

use std::ops::Range;

use crate::contour::mdc::cell::cell_number;
use crate::contour::mdc::cluster::{Cell, Leaves, PlaneHit};
use crate::octree::CellBrick;

/// The cut so far, and what it is made from.
pub struct Cut<'c> {
    /// Its clusters, members and positions grow; its cells stay.
    pub brick: &'c mut CellBrick,
    /// The leaf cells.
    pub leaves: &'c Leaves,
    /// Vertices of the leaf cells, component after component.
    pub positions: Vec<[i32; 3]>,
    /// Vertices of the cell under way.
    pub placed: Vec<[i32; 3]>,
}

/// How long the cut was when a cell began.
pub struct Mark {
    clusters: usize,
    members: usize,
    positions: usize,
}

impl Cut<'_> {
    /// How long the cut is.
    pub fn mark(&self) -> Mark {
        Mark {
            clusters: self.brick.clusters.len(),
            members: self.brick.members.len(),
            positions: self.brick.positions.len(),
        }
    }

    /// Puts `cell` in the place of all since `mark`. `node_of` tells the piece of each component.
    pub fn collapse(
        &mut self,
        cell: &Cell,
        mark: &Mark,
        vertices: &[[i32; 3]],
        node_of: &[u32],
        first_node: usize,
    ) {
        let components = self.components_in(&cell.leaves);
        let brick = &mut *self.brick;
        brick.clusters.truncate(mark.clusters);
        brick.members.truncate(mark.members);
        brick.positions.truncate(mark.positions);
        brick.clusters.push(packed(cell) | (vertices.len() as u32) << 18);
        brick.positions.extend_from_slice(vertices);
        if vertices.len() > 1 {
            let members =
                node_of[components].iter().map(|node| (*node as usize - first_node) as u8);
            brick.members.extend(members);
        }
    }

    /// Whether the cell must not be a cluster.
    pub fn is_banned(&self, cell: &Cell) -> bool {
        self.brick.banned.binary_search(&packed(cell)).is_ok()
    }

    /// Where the leaf cells end whose number, shifted, is `number`; they begin at `start`.
    pub fn end_of(&self, start: usize, limit: usize, number: usize, shift: u32) -> usize {
        if shift == 0 {
            return start + 1;
        }
        let cells = &self.brick.cells[start..limit];
        start + cells.partition_point(|cell| cell_number(*cell) >> shift == number)
    }

    /// The components of these leaf cells.
    pub fn components_in(&self, leaves: &Range<usize>) -> Range<usize> {
        let starts = &self.leaves.components;
        starts[leaves.start] as usize..starts[leaves.end] as usize
    }

    /// The component of leaf cell `rank` that crosses `edge`.
    pub fn component(&self, rank: usize, edge: usize) -> usize {
        let components = crate::contour::mdc::cell::components_of(self.brick.cells[rank]);
        let component = usize::from(components.component_of_edge[edge]);
        self.leaves.components[rank] as usize + component
    }

    /// The crossings of these components.
    pub fn hits_in(&self, components: Range<usize>) -> &[PlaneHit] {
        let starts = &self.leaves.hit_starts;
        &self.leaves.hits[starts[components.start] as usize..starts[components.end] as usize]
    }
}

/// First leaf and level, as in records.
fn packed(cell: &Cell) -> u32 {
    (cell.number << (3 * cell.level)) as u32 | cell.level << 15
}
