//! Whether a cell of the octree may be a cluster, and where its vertices go.
//!
//! Source: Schaefer, Ju, Warren 2007, section 4; the third rule is an addition of ours.

use glam::DVec3;

use crate::contour::mdc::cell::{cell_mask, cell_number, place_of, segments_on};
use crate::contour::mdc::cluster::cut::{Cut, Mark};
use crate::contour::mdc::cluster::node::Node;
use crate::contour::mdc::cluster::planes::{CellPlane, Group, PlaneHit, largest_distance, place};
use crate::contour::mdc::cluster::{Cell, ClusterOptions, Clustering};
use crate::contour::mdc::reach::SHARP_CELLS;
use crate::contour::mdc::table::AMBIGUOUS_FACES;

/// What comes of the vertex of a piece.
enum Placed {
    /// It lies there on the lattice, so far from a plane at most.
    Fits([i32; 3], f64),
    /// It is not in the cell; in a larger one it may be.
    Outside,
    /// It lies too far from a plane.
    TooFar,
}

impl Clustering {
    /// Makes the cell a cluster if all its pieces allow it; whether a larger one may still be.
    pub(super) fn judge(
        &mut self,
        cut: &mut Cut,
        cell: &Cell,
        first_node: usize,
        mark: &Mark,
    ) -> bool {
        let pieces = &self.nodes[first_node..];
        if pieces.iter().any(|node| node.groups == Node::TOO_MANY) {
            self.refusals.by_error += 1;
            return false;
        }
        let is_simple = pieces.iter().all(Node::is_simple)
            && pieces.len() <= usize::from(u8::MAX)
            && !self.corners.are_cut_by(cell)
            && !(self.has_ambiguous_faces && self.shares_ambiguous_face(cut, cell));
        if !is_simple {
            self.refusals.by_shape += 1;
            return true;
        }
        let mut placed = std::mem::take(&mut cut.placed);
        placed.clear();
        let mut largest = 0.0_f64;
        let mut is_near = true;
        let is_alone = self.nodes.len() == first_node + 1;
        let fits = (first_node..self.nodes.len()).all(|node| {
            match self.place(cut, cell, node, is_alone) {
                Placed::Fits(vertex, error) => {
                    placed.push(vertex);
                    largest = largest.max(error);
                    true
                }
                Placed::Outside => false,
                Placed::TooFar => {
                    is_near = false;
                    false
                }
            }
        });
        let fits = fits && self.keeps_corners(cut, cell, first_node, &placed);
        if fits && !cut.is_banned(cell) {
            self.refusals.largest_error = self.refusals.largest_error.max(largest);
            cut.collapse(cell, mark, &placed, &self.node_of, first_node);
        }
        cut.placed = placed;
        self.refusals.by_error += u64::from(!is_near);
        self.refusals.by_shape += u64::from(!fits && is_near);
        is_near
    }

    /// Whether every corner of the model that the cell holds has its vertex there.
    fn keeps_corners(
        &self,
        cut: &Cut,
        cell: &Cell,
        first_node: usize,
        placed: &[[i32; 3]],
    ) -> bool {
        let slack = (SHARP_CELLS * self.options.cell_units as f64) as i32 + 1;
        self.corners.within(cell).iter().all(|corner| {
            let component = cut.leaves.components[usize::from(self.ranks[corner.cell])];
            let node = self.node_of[component as usize] as usize - first_node;
            (0..3).all(|a| (placed[node][a] - corner.position[a]).abs() <= slack)
        })
    }

    /// Whether a piece has both segments of an ambiguous face on the cell's boundary.
    fn shares_ambiguous_face(&self, cut: &Cut, cell: &Cell) -> bool {
        let last = (1_usize << cell.level) - 1;
        cell.leaves.clone().any(|rank| {
            let packed = cut.brick.cells[rank];
            let mut faces = AMBIGUOUS_FACES[usize::from(cell_mask(packed))];
            if faces == 0 {
                return false;
            }
            let at = place_of(cell_number(packed));
            while faces != 0 {
                let face = faces.trailing_zeros() as usize;
                faces &= faces - 1;
                let bound = if face & 1 == 1 { last } else { 0 };
                if at[face / 2] & last != bound {
                    continue;
                }
                let [one, other] = [0, 1].map(|i| {
                    let edge = segments_on(packed, face).pairs()[i][0];
                    self.node_of[cut.component(rank, usize::from(edge))]
                });
                if one == other {
                    return true;
                }
            }
            false
        })
    }

    /// Places the vertex of a piece; `is_alone` tells that it is all that the cell has.
    fn place(&self, cut: &Cut, cell: &Cell, number: usize, is_alone: bool) -> Placed {
        let node = &self.nodes[number];
        let first = node.first_group as usize;
        let groups = &self.groups[first..first + node.groups as usize];
        let middle = node.points / node.count.max(1.0);
        let planes = &cut.leaves.planes;
        let Some(vertex) = self.vertex_of(cell, groups, middle, planes) else {
            return Placed::Outside;
        };
        let error = |components| self.error_of(vertex, cut.hits_in(components), planes);
        let all = cut.components_in(&cell.leaves);
        let largest = if is_alone {
            error(all)
        } else {
            let mut own = all.filter(|component| self.node_of[*component] as usize == number);
            own.try_fold(0.0_f64, |largest, one| Some(largest.max(error(one..one + 1)?)))
        };
        largest.map_or(Placed::TooFar, |error| Placed::Fits(vertex, error))
    }

    /// The vertex of these groups on the lattice, strictly inside the cell; `None` if it lies elsewhere.
    pub(super) fn vertex_of(
        &self,
        cell: &Cell,
        groups: &[Group],
        middle: DVec3,
        planes: &[CellPlane],
    ) -> Option<[i32; 3]> {
        let ClusterOptions { cell_units, inset_units, .. } = self.options;
        let size = (1 << cell.level) as f64;
        let low = place_of(cell.number).map(|c| (c << cell.level) as f64);
        let half = size * 0.5;
        let centre = DVec3::from(low) + half;
        let reach = half - inset_units as f64 / cell_units as f64;
        let mut options = self.options.qef;
        (options.lo, options.hi) = (DVec3::splat(-reach), DVec3::splat(reach));
        let at = place(groups, planes, centre, middle, &options)? + centre;
        Some(std::array::from_fn(|a| {
            let low = low[a] as i64 * cell_units;
            let units = (at[a] * cell_units as f64).round() as i64;
            units.clamp(low + inset_units, low + size as i64 * cell_units - inset_units) as i32
        }))
    }

    /// The largest distance of a vertex to the planes of `hits`; `None` if one is beyond the threshold.
    pub(super) fn error_of(
        &self,
        vertex: [i32; 3],
        hits: &[PlaneHit],
        planes: &[CellPlane],
    ) -> Option<f64> {
        let at = DVec3::from(vertex.map(f64::from)) / self.options.cell_units as f64;
        largest_distance(hits, planes, at, self.options.threshold_cells)
    }
}
