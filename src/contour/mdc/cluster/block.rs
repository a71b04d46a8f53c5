//! Blocks of cells that become one vertex at once, without the way up from their leaf cells.
//!
//! In:         a block whose surface is a disk ([`disk_in_block`]), with each of its crossings once.
//! Out:        the cluster that it is, if all its planes are one group or two, and near its vertex.
//! Invariant:  what is taken as a block would have passed the judgement of its leaf cells too, but for how
//!             its crossings are weighted. What is not taken is left to them.
//! Units:      as clusters.
//! Memory:     190 bytes a block.
//! Fails:      never.
//! Source:     ours.
//!
//! [`disk_in_block`]: crate::contour::mdc::cluster::disk_in_block

use glam::DVec3;

use crate::contour::mdc::cluster::cut::Cut;
use crate::contour::mdc::cluster::node::{EdgeCounts, Node};
use crate::contour::mdc::cluster::planes::{
    CellPlane, Group, largest_distance_of, one_or_two_groups,
};
use crate::contour::mdc::cluster::{Cell, Clustering};

/// The largest level of a block, at which its cells are the bits of a word.
pub const BLOCK_LEVEL: u32 = 2;

/// Where a block is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockPlace {
    /// Its level: 1 or 2, for two cells a side or four.
    pub level: u32,
    /// Its Morton number at its level.
    pub number: usize,
}

/// A block that is one vertex.
pub struct Block {
    place: BlockPlace,
    node: Node,
    groups: [Group; 2],
    /// The ways that these point.
    directions: [DVec3; 2],
    vertex: [i32; 3],
    error: f64,
}

impl Block {
    /// Whether its planes are one group: no crease passes it.
    pub fn is_flat(&self) -> bool {
        self.node.groups == 1
    }

    /// Whether a unit normal could be of one of its groups: the square of the cosine between them is not less
    /// than told.
    #[inline]
    pub fn is_along(&self, normal: DVec3, cosine_squared: f64) -> bool {
        self.directions.iter().any(|one| one.dot(normal).powi(2) >= cosine_squared)
    }

    /// Where its two groups of planes meet, if their normals have a cosine of less than `cosine`: the point
    /// nearest to the middle of its crossings, and the direction.
    pub fn crease(&self, planes: &[CellPlane], cosine: f64) -> Option<[DVec3; 2]> {
        if self.is_flat() {
            return None;
        }
        let middle = self.node.points / self.node.count;
        let [one, other] = self.groups.map(|group| group.mean(planes, middle));
        let dot = one.normal.dot(other.normal);
        let sine_squared = 1.0 - dot * dot;
        if dot.abs() >= cosine || sine_squared <= 0.0 {
            return None;
        }
        let (here, there) = (one.normal.dot(one.point), other.normal.dot(other.point));
        let from_middle = one.normal * (here - dot * there) + other.normal * (there - dot * here);
        let direction = one.normal.cross(other.normal).normalize_or_zero();
        Some([middle + from_middle / sine_squared, direction])
    }

    fn groups(&self) -> &[Group] {
        &self.groups[..self.node.groups as usize]
    }
}

impl BlockPlace {
    /// Cells along a side.
    pub fn side(self) -> usize {
        1 << self.level
    }

    /// The number of its first leaf cell.
    pub fn first(self) -> usize {
        self.number << (3 * self.level)
    }

    /// As it is packed in records, where it is a cell of the cut.
    pub fn packed(self) -> u32 {
        self.first() as u32 | self.level << 15
    }
}

impl Clustering {
    /// The block there, which crosses its edges so often, if its crossings, plane by plane, have one vertex.
    pub fn block(
        &self,
        place: BlockPlace,
        edges: EdgeCounts,
        of_planes: &[Group],
        planes: &[CellPlane],
    ) -> Option<Block> {
        let (count, groups) = one_or_two_groups(of_planes, planes, self.cosine_squared)?;
        let mut node = Node { groups: count as u32, ..Node::disk(edges) };
        for group in &groups[..count] {
            let (points, count) = group.crossings();
            node.points += points;
            node.count += count;
        }
        let cell = Cell { level: place.level, number: place.number, leaves: 0..0 };
        let vertex = self.vertex_of(&cell, &groups[..count], node.points / node.count, planes)?;
        let error = largest_distance_of(
            of_planes,
            planes,
            DVec3::from(vertex.map(f64::from)) / self.options.cell_units as f64,
            self.options.threshold_cells,
        )?;
        let directions = groups.map(|group| group.direction());
        Some(Block { place, node, groups, directions, vertex, error })
    }

    /// The next block, if it is this cell: whether its parent may still be a cluster, and then its piece is
    /// the last of `nodes`.
    pub(super) fn take_block(&mut self, cut: &mut Cut, cell: &Cell) -> Option<bool> {
        let leaves = cut.leaves;
        let place = BlockPlace { level: cell.level, number: cell.number };
        let block = leaves.blocks.get(self.next_block).filter(|block| block.place == place)?;
        self.next_block += 1;
        let components = cut.components_in(&cell.leaves);
        // A vertex of another cell may come to reach into it.
        if self.corners.are_cut_by(cell) {
            self.refusals.by_shape += 1;
            cut.brick.positions.extend_from_slice(&cut.positions[components]);
            return Some(false);
        }
        let mark = cut.mark();
        self.node_of[components].fill(self.nodes.len() as u32);
        self.nodes.push(Node { first_group: self.groups.len() as u32, ..block.node });
        self.groups.extend_from_slice(block.groups());
        cut.collapse(cell, &mark, &[block.vertex], &self.node_of, self.nodes.len() - 1);
        self.refusals.largest_error = self.refusals.largest_error.max(block.error);
        Some(true)
    }
}
