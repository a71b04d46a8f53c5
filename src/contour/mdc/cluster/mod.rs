//! Clusters: one vertex for all the surface in a cell of the octree, where nothing is lost by it.
//!
//! In:         the leaf cells of a brick with their vertices and the planes of their crossings.
//! Out:        the [`Cut`]: which cells have vertices, and those vertices.
//! Invariant:  a cell is in the cut if it is the topmost one of which every piece of surface is a
//!             disk with one arc per face at most, and has a vertex within the threshold of all its
//!             planes. So two vertices share at most one arc, and the cells of the cut tile the
//!             surface. The result depends on the brick alone.
//! Units:      cells; vertices in lattice units.
//! Memory:     a path down the octree: about 600 bytes a piece of surface in the brick.
//! Fails:      never.
//! Source:     Schaefer, Ju, Warren 2007 (vertex clustering); the cut of whole cells and the third
//!             rule are additions of ours.

mod block;
mod corners;
mod cut;
mod disk;
mod judge;
mod node;
mod planes;
mod summary;

#[cfg(test)]
mod tests;

use std::ops::Range;

use glam::DVec3;

pub use block::{BLOCK_LEVEL, Block, BlockPlace};
pub use disk::disk_in_block;
pub use node::EdgeCounts;
pub use planes::{CellPlane, Group, JUDGES_ONLY, PlaneHit};
pub use summary::{Part, join};

use crate::contour::mdc::cell::{
    cell_mask, cell_number, components_of, edge_below, number_at, place_of, segments_on,
};
use crate::contour::mdc::cluster::corners::Corners;
use crate::contour::mdc::cluster::cut::Cut;
use crate::contour::mdc::cluster::node::Node;
use crate::contour::mdc::cluster::planes::{add_group, add_hit};
use crate::contour::mdc::table::AMBIGUOUS_FACES;
use crate::geom::qef::QefOptions;
use crate::octree::{CellBrick, MAX_LEVEL, SIDE};

/// Where no leaf cell is.
const NO_RANK: u16 = u16::MAX;

/// How clusters are judged.
#[derive(Clone, Copy, Debug)]
pub struct ClusterOptions {
    /// Largest distance of a vertex to the planes that it stands for, in cells.
    pub threshold_cells: f64,
    /// Rank and crease; its box is not used.
    pub qef: QefOptions,
    /// Lattice units of a cell, and of the gap that a vertex keeps from its cell's walls.
    pub cell_units: i64,
    /// See `cell_units`.
    pub inset_units: i64,
}

/// The leaf cells of a brick, in Morton order.
#[derive(Default)]
pub struct Leaves {
    /// Planes that hits name.
    pub planes: Vec<CellPlane>,
    /// First component of every cell, and their total.
    pub components: Vec<u32>,
    /// First hit of every component, and their total.
    pub hit_starts: Vec<u32>,
    /// Crossings, component after component; of a block one for each plane, at its first component.
    pub hits: Vec<PlaneHit>,
    /// Blocks of cells that are one vertex.
    pub blocks: Vec<Block>,
}

/// Why pieces of surface are not one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Refusals {
    /// Cells in which a vertex would lie too far from a plane, or there are too many planes.
    pub by_error: u64,
    /// Cells in which a piece is no disk, or meets a face more than once, or has its vertex outside,
    /// or would lose a corner of the model.
    pub by_shape: u64,
    /// Largest distance of a vertex to a plane of its cluster.
    pub largest_error: f64,
}

/// Makes the cut of one brick after another.
pub struct Clustering {
    options: ClusterOptions,
    cosine_squared: f64,
    ranks: Vec<u16>,
    /// Pieces and groups on the way from the leaves to the cell under way.
    nodes: Vec<Node>,
    groups: Vec<Group>,
    /// The piece of every component at the level under way, as its number in `nodes`.
    node_of: Vec<u32>,
    joined: Vec<u32>,
    corners: Corners,
    /// Whether any cell of the brick has one.
    has_ambiguous_faces: bool,
    merged: Vec<Node>,
    merged_groups: Vec<Group>,
    next_block: usize,
    /// Refusals so far in the brick.
    pub refusals: Refusals,
}

/// A cell under way: its level, Morton number at that level, and the leaf cells in it.
struct Cell {
    level: u32,
    number: usize,
    leaves: Range<usize>,
}

impl Cell {
    /// The numbers of the leaf cells that it has room for.
    fn range(&self) -> Range<usize> {
        self.number << (3 * self.level)..(self.number + 1) << (3 * self.level)
    }

    /// Whether a leaf cell with this number is in it.
    fn holds(&self, leaf: usize) -> bool {
        leaf >> (3 * self.level) == self.number
    }
}

impl Clustering {
    /// A maker of cuts.
    pub fn new(options: ClusterOptions) -> Self {
        Self {
            options,
            // The cut-off of the quadrics is tan² of half the crease angle.
            cosine_squared: 1.0 / (1.0 + options.qef.cutoff()),
            ranks: vec![NO_RANK; SIDE * SIDE * SIDE],
            nodes: Vec::new(),
            groups: Vec::new(),
            node_of: Vec::new(),
            joined: Vec::new(),
            corners: Corners::default(),
            has_ambiguous_faces: false,
            merged: Vec::new(),
            merged_groups: Vec::new(),
            next_block: 0,
            refusals: Refusals::default(),
        }
    }

    /// The square of the cosine of half the crease angle, within which normals are one group.
    pub fn cosine_squared(&self) -> f64 {
        self.cosine_squared
    }

    /// Clusters the vertices of `brick`, which are one for every component of its cells; no cell
    /// of `brick.banned` becomes a cluster.
    pub fn cut(&mut self, brick: &mut CellBrick, leaves: &Leaves) {
        self.refusals = Refusals::default();
        self.nodes.clear();
        self.groups.clear();
        self.next_block = 0;
        self.node_of.clear();
        self.node_of.resize(brick.positions.len(), 0);
        self.corners.reset(&brick.reaches);
        self.has_ambiguous_faces = false;
        for (rank, &cell) in brick.cells.iter().enumerate() {
            self.ranks[cell_number(cell)] = rank as u16;
            self.has_ambiguous_faces |= AMBIGUOUS_FACES[usize::from(cell_mask(cell))] != 0;
        }
        let positions = std::mem::take(&mut brick.positions);
        let mut cut = Cut { brick, leaves, positions, placed: Vec::new() };
        let all = 0..cut.brick.cells.len();
        self.visit(&mut cut, &Cell { level: MAX_LEVEL, number: 0, leaves: all });
        for &cell in &brick.cells {
            self.ranks[cell_number(cell)] = NO_RANK;
        }
    }

    /// Makes the cut within a cell; whether its parent may still be a cluster, and then its pieces
    /// are the last of `nodes`.
    fn visit(&mut self, cut: &mut Cut, cell: &Cell) -> bool {
        if cell.level == 0 {
            self.visit_leaf(cut, cell.leaves.start);
            return true;
        }
        if cell.level <= BLOCK_LEVEL
            && let Some(is_alive) = self.take_block(cut, cell)
        {
            return is_alive;
        }
        let before = (self.nodes.len(), self.groups.len());
        let mark = cut.mark();
        let mut is_alive = true;
        let mut octants = [0_u8; 8];
        let mut child_ends = [0_usize; 8];
        let mut children = 0;
        let mut start = cell.leaves.start;
        while start < cell.leaves.end {
            let shift = 3 * (cell.level - 1);
            let number = cell_number(cut.brick.cells[start]) >> shift;
            let end = cut.end_of(start, cell.leaves.end, number, shift);
            let child = Cell { level: cell.level - 1, number, leaves: start..end };
            is_alive &= self.visit(cut, &child);
            octants[children] = (number & 7) as u8;
            child_ends[children] = self.nodes.len();
            children += 1;
            start = end;
        }
        if is_alive {
            self.merge(cut, cell, before, &octants[..children], &child_ends);
            is_alive = self.judge(cut, cell, before.0, &mark);
        }
        if !is_alive {
            self.nodes.truncate(before.0);
            self.groups.truncate(before.1);
        }
        is_alive
    }

    /// The pieces of a leaf cell, which is in the cut until a larger cell takes its place. Their crossings
    /// are added where they are joined.
    fn visit_leaf(&mut self, cut: &mut Cut, rank: usize) {
        let leaves = cut.leaves;
        let components = components_of(cut.brick.cells[rank]);
        let first = leaves.components[rank] as usize;
        for (i, &edges) in components.edge_masks[..usize::from(components.count)].iter().enumerate()
        {
            let component = first + i;
            self.node_of[component] = self.nodes.len() as u32;
            self.nodes.push(Node::leaf(edges));
            cut.brick.positions.push(cut.positions[component]);
        }
    }

    /// Joins the pieces of the children of a cell, which lie in `nodes` from `before` on.
    fn merge(
        &mut self,
        cut: &Cut,
        cell: &Cell,
        (first_node, first_group): (usize, usize),
        octants: &[u8],
        child_ends: &[usize; 8],
    ) {
        let count = self.nodes.len() - first_node;
        self.joined.clear();
        self.joined.extend(0..count as u32);
        if count > 1 {
            self.join_across(cut, cell, first_node);
        }
        // Roots are the smallest of their sets, so pieces are numbered by their first child.
        self.merged.clear();
        self.merged_groups.clear();
        let pieces = (0..count).filter(|i| self.joined[*i] as usize == *i).count();
        self.merged.resize(pieces, Node::EMPTY);
        self.number_and_add(first_node, octants, child_ends);
        if cell.level == 1 {
            self.group_hits(cut, cell);
        } else {
            self.merge_groups(&cut.leaves.planes, first_node, first_group);
        }
        let components = cut.components_in(&cell.leaves);
        for node in &mut self.node_of[components] {
            *node = first_node as u32 + self.joined[*node as usize - first_node];
        }
        self.nodes.truncate(first_node);
        self.nodes.extend_from_slice(&self.merged);
    }

    /// Turns `joined` from roots into the numbers of new pieces, and adds children to them.
    fn number_and_add(&mut self, first_node: usize, octants: &[u8], child_ends: &[usize; 8]) {
        let mut next = 0;
        let mut child = 0;
        for i in 0..self.joined.len() {
            while first_node + i >= child_ends[child] {
                child += 1;
            }
            let root = self.joined[i] as usize;
            // A root comes before all others of its set, so its own number is there already.
            let number = if root == i {
                next += 1;
                next - 1
            } else {
                self.joined[root]
            };
            self.joined[i] = number;
            let octant = usize::from(octants[child]);
            self.merged[number as usize].add(&self.nodes[first_node + i], octant);
        }
        self.merged.iter_mut().for_each(Node::close);
    }

    /// Joins pieces that share an arc on the planes that halve the cell.
    fn join_across(&mut self, cut: &Cut, cell: &Cell, first_node: usize) {
        let half = 1 << (cell.level - 1);
        // Of a cell beyond the plane across the first axis the place ends in a one and zeros.
        let (low_bits, beyond) = (number_at([2 * half - 1, 0, 0]), number_at([half, 0, 0]));
        for rank in cell.leaves.clone() {
            let packed = cut.brick.cells[rank];
            let number = cell_number(packed);
            if (0..3).all(|axis| number >> axis & low_bits != beyond) {
                continue;
            }
            let at = place_of(number);
            for axis in 0..3 {
                if number >> axis & low_bits != beyond {
                    continue;
                }
                let pairs = segments_on(packed, 2 * axis).pairs();
                if pairs.is_empty() {
                    continue;
                }
                let mut below = at;
                below[axis] -= 1;
                let other = usize::from(self.ranks[number_at(below)]);
                for &[edge, _] in pairs {
                    let here = cut.component(rank, usize::from(edge));
                    let there = cut.component(other, usize::from(edge_below(edge, axis)));
                    let (a, b) = (self.node_of[here], self.node_of[there]);
                    unite(&mut self.joined, a - first_node as u32, b - first_node as u32);
                }
            }
        }
        for i in 0..self.joined.len() as u32 {
            self.joined[i as usize] = find(&mut self.joined, i);
        }
    }

    /// The crossings of the new pieces of a cell whose children are leaves, and their groups.
    fn group_hits(&mut self, cut: &Cut, cell: &Cell) {
        let planes = &cut.leaves.planes;
        let components = cut.components_in(&cell.leaves);
        for (number, node) in self.merged.iter_mut().enumerate() {
            let from = self.groups.len();
            let mut fits = true;
            let joined = components.clone().zip(&self.joined);
            for (component, _) in joined.filter(|(_, n)| **n as usize == number) {
                for hit in cut.hits_in(component..component + 1) {
                    node.points += DVec3::from(hit.point.map(f64::from));
                    node.count += 1.0;
                    if hit.plane & JUDGES_ONLY == 0 && fits {
                        fits = add_hit(&mut self.groups, from, hit, planes, self.cosine_squared);
                    }
                }
            }
            node.first_group = from as u32;
            node.groups = (self.groups.len() - from) as u32;
            if !fits {
                self.groups.truncate(from);
                node.groups = Node::TOO_MANY;
            }
        }
    }

    /// The groups of the new pieces, in place of those of their children.
    fn merge_groups(&mut self, planes: &[CellPlane], first_node: usize, first_group: usize) {
        for (number, node) in self.merged.iter_mut().enumerate() {
            let from = self.merged_groups.len();
            let mut fits = true;
            for (i, _) in self.joined.iter().enumerate().filter(|(_, n)| **n as usize == number) {
                let child = &self.nodes[first_node + i];
                fits &= child.groups != Node::TOO_MANY;
                if !fits {
                    break;
                }
                let range = child.first_group as usize..(child.first_group + child.groups) as usize;
                for group in &self.groups[range] {
                    let groups = &mut self.merged_groups;
                    fits = fits && add_group(groups, from, group, planes, self.cosine_squared);
                }
            }
            node.first_group = (first_group + from) as u32;
            node.groups = (self.merged_groups.len() - from) as u32;
            if !fits {
                self.merged_groups.truncate(from);
                node.groups = Node::TOO_MANY;
            }
        }
        self.groups.truncate(first_group);
        self.groups.extend_from_slice(&self.merged_groups);
    }
}

fn find(joined: &mut [u32], mut i: u32) -> u32 {
    while joined[i as usize] != i {
        joined[i as usize] = joined[joined[i as usize] as usize];
        i = joined[i as usize];
    }
    i
}

fn unite(joined: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(joined, a), find(joined, b));
    joined[a.max(b) as usize] = a.min(b);
}
