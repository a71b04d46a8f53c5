//! The vertex of one component of a leaf cell, from the crossings of its edges.
//!
//! In:         the crossings around a cell, and the planes that they lie on.
//! Out:        a position on the lattice.
//! Invariant:  strictly inside the cell; no two components of a cell share a position.

use glam::DVec3;

use crate::contour::mdc::INSET_UNITS;
use crate::contour::mdc::borders::BorderPlanes;
use crate::contour::mdc::features::Place;
use crate::contour::mdc::table::{axis_of_edge, corner_of_edge};
use crate::contour::mdc::workspace::{EdgeCrossing, Workspace};
use crate::contour::{ContourError, ContourStats};
use crate::geom::qef::{
    Attempt, Hit, QefOptions, Solution, Waiting, begin, solve, solve_flat, solve_smooth,
    solve_together,
};
use crate::octree::CellBrick;

/// Vertices that are placed together: enough to hide how long a root takes.
const TOGETHER: usize = 4;

/// Cells whose vertices wait until there are enough of them, at the end of a brick or before.
#[derive(Default)]
pub struct WaitingCells {
    count: usize,
    cells: [Waiting; TOGETHER],
    /// The cell, and the number of its vertex.
    places: [([usize; 3], usize); TOGETHER],
}

/// Solves for crossings and planes of borders together.
fn solve_with(hits: &[Hit], planes: &[Hit], options: &QefOptions) -> Solution {
    let mut all = [Hit { point: DVec3::ZERO, normal: DVec3::ZERO }; 14];
    let count = hits.len() + planes.len();
    all[..hits.len()].copy_from_slice(hits);
    all[hits.len()..count].copy_from_slice(planes);
    solve(&all[..count], options)
}

/// Crossings of one cell: places about its centre, in cells, numbers of normals, and surfaces.
pub(super) struct Around {
    pub(super) count: usize,
    pub(super) points: [DVec3; 12],
    pub(super) normals: [u32; 12],
    pub(super) surfaces: [u32; 12],
}

impl Around {
    fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }

    /// Numbers of the normals.
    #[inline]
    pub(super) fn own_normals(&self) -> &[u32] {
        &self.normals[..self.count]
    }

    /// The mean of the crossings.
    pub(super) fn middle(&self) -> DVec3 {
        self.points().iter().sum::<DVec3>() / self.count as f64
    }

    /// The one normal of all crossings.
    #[inline]
    fn flat_normal(&self) -> Option<u32> {
        let normals = &self.normals[..self.count];
        normals.iter().all(|normal| *normal == normals[0]).then_some(normals[0])
    }

    /// The first `count` of these.
    #[inline]
    fn hits(&self, normals: &[DVec3]) -> [Hit; 12] {
        let mut hits = [Hit { point: DVec3::ZERO, normal: DVec3::ZERO }; 12];
        for (i, hit) in hits[..self.count].iter_mut().enumerate() {
            *hit = Hit { point: self.points[i], normal: normals[self.normals[i] as usize] };
        }
        hits
    }
}

impl Workspace {
    /// The vertex of the only component of a cell, now or with others that wait.
    pub(super) fn place_alone(
        &mut self,
        place: Place,
        at: [usize; 3],
        around: &Around,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        let attempt = self.attempt(around);
        if let Some(near) = self.near_feature(place, at, around)? {
            self.take_in(&near.planes, at, near.position);
            match near.face {
                Some(face) => brick.reaches.push(self.reach(at, around, near.position, face)),
                None => {
                    brick.positions.push(self.to_lattice(at, near.position));
                    stats.feature_vertices += 1;
                    return Ok(());
                }
            }
        }
        match attempt {
            Attempt::Done(solution) => {
                let mut position = solution.position;
                if let Some((met, planes)) = self.toward_feature(place, at, around, &solution)? {
                    position = met;
                    self.take_in(&planes, at, met);
                    stats.feature_vertices += 1;
                }
                brick.positions.push(self.to_lattice(at, position));
                stats.clamped_vertices += u64::from(solution.clamped);
            }
            Attempt::Waiting(cell) => {
                brick.positions.push([0; 3]);
                self.wait(cell, (at, brick.positions.len() - 1), brick, stats);
            }
        }
        Ok(())
    }

    /// The vertex of crossings without features around, by the shortest way that they allow.
    pub(super) fn attempt(&self, around: &Around) -> Attempt {
        let attempt = match around.flat_normal() {
            Some(normal) => {
                let normal = self.normals[normal as usize];
                solve_flat(around.points(), normal, &self.qef).map(Attempt::Done)
            }
            None if self.is_smooth => {
                let hits = around.hits(&self.normals);
                solve_smooth(&hits[..around.count], &self.qef).map(Attempt::Done)
            }
            None => None,
        };
        attempt.unwrap_or_else(|| {
            let hits = around.hits(&self.normals);
            begin(&hits[..around.count], &self.qef)
        })
    }

    /// Leaves a vertex of the brick to wait for others.
    pub(super) fn wait(
        &mut self,
        cell: Waiting,
        place: ([usize; 3], usize),
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) {
        let waiting = &mut self.waiting;
        waiting.cells[waiting.count] = cell;
        waiting.places[waiting.count] = place;
        waiting.count += 1;
        if waiting.count == TOGETHER {
            self.place_waiting(brick, stats);
        }
    }

    /// The vertex of the only component of a cell, in which materials meet.
    pub(super) fn place_on_border(
        &self,
        at: [usize; 3],
        around: &Around,
        border: &BorderPlanes,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) {
        let hits = &around.hits(&self.normals)[..around.count];
        let solution = solve_with(hits, border.planes(), &self.qef);
        brick.positions.push(self.to_lattice(at, solution.position));
        stats.clamped_vertices += u64::from(solution.clamped);
    }

    pub(super) fn place_waiting(&mut self, brick: &mut CellBrick, stats: &mut ContourStats) {
        if self.waiting.count == 0 {
            return;
        }
        let solutions = solve_together(&self.waiting.cells, &self.qef);
        let places = self.waiting.places[..self.waiting.count].iter();
        for (&(at, number), solution) in places.zip(solutions) {
            brick.positions[number] = self.to_lattice(at, solution.position);
            stats.clamped_vertices += u64::from(solution.clamped);
        }
        self.waiting.count = 0;
    }

    /// The vertices of a cell with several components.
    pub(super) fn place_apart(
        &self,
        at: [usize; 3],
        edge_masks: &[u16],
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) {
        let first = brick.positions.len();
        for &edges in edge_masks {
            let around = self.around(at, edges);
            let hits = &around.hits(&self.normals)[..around.count];
            let within = self.within_crossings(hits);
            let border = self.border_planes(at, &around);
            let solution = solve_with(hits, border.planes(), &within);
            let position = self.to_lattice(at, solution.position);
            let outward = hits.iter().fold(DVec3::ZERO, |sum, hit| sum + hit.normal);
            let position = self.apart_from(position, at, outward, &brick.positions[first..]);
            brick.positions.push(position);
            stats.clamped_vertices += u64::from(solution.clamped);
        }
    }

    /// The vertices of a cell in the middle of their crossings.
    pub(super) fn place_in_middle(
        &self,
        at: [usize; 3],
        edge_masks: &[u16],
        brick: &mut CellBrick,
    ) {
        let first = brick.positions.len();
        for &edges in edge_masks {
            let around = self.around(at, edges);
            let points = around.points();
            let sum = points.iter().fold(DVec3::ZERO, |sum, point| sum + *point);
            let position = self.to_lattice(at, sum / points.len() as f64);
            let position = self.apart_from(position, at, DVec3::ZERO, &brick.positions[first..]);
            brick.positions.push(position);
        }
    }

    /// The crossings on these edges of a cell.
    #[inline]
    pub(super) fn around(&self, at: [usize; 3], edges: u16) -> Around {
        let mut around =
            Around { count: 0, points: [DVec3::ZERO; 12], normals: [0; 12], surfaces: [0; 12] };
        self.each_crossing(at, edges, |point, crossing| {
            around.points[around.count] = point;
            around.normals[around.count] = crossing.normal;
            around.surfaces[around.count] = crossing.surface;
            around.count += 1;
        });
        around
    }

    /// Shows the crossings on these edges of a cell, with their places about its centre, in cells.
    #[inline]
    pub(super) fn each_crossing(
        &self,
        at: [usize; 3],
        edges: u16,
        mut visit: impl FnMut(DVec3, EdgeCrossing),
    ) {
        let mut left = edges;
        while left != 0 {
            let edge = left.trailing_zeros() as u8;
            left &= left - 1;
            let axis = usize::from(axis_of_edge(edge));
            let corner = corner_of_edge(edge, 0);
            let corner = [0, 1, 2].map(|a| usize::from(corner >> a & 1));
            let crossing = self.crossing(axis, [0, 1, 2].map(|a| at[a] + corner[a]));
            let mut point = DVec3::from(corner.map(|c| c as f64 - 0.5));
            point[axis] = crossing.offset - 0.5;
            visit(point, crossing);
        }
    }

    /// Where several components share a cell, each stays in the box of its own crossings: there
    /// they cannot pass one another.
    fn within_crossings(&self, hits: &[Hit]) -> QefOptions {
        let first = hits[0].point;
        let (lo, hi) = hits
            .iter()
            .fold((first, first), |(lo, hi), hit| (lo.min(hit.point), hi.max(hit.point)));
        let QefOptions { lo: cell_lo, hi: cell_hi, .. } = self.qef;
        let mut options = self.qef;
        options.lo = lo.clamp(cell_lo, cell_hi);
        options.hi = hi.clamp(cell_lo, cell_hi);
        options
    }

    /// Rounds to the lattice, strictly inside the cell.
    pub(super) fn to_lattice(&self, at: [usize; 3], position: DVec3) -> [i32; 3] {
        std::array::from_fn(|a| {
            let units = ((position[a] + 0.5) * self.cell_units as f64).round() as i64;
            let units = units.clamp(INSET_UNITS, self.cell_units - INSET_UNITS);
            (at[a] as i64 * self.cell_units + units) as i32
        })
    }

    /// Moves a vertex whose place another component of the cell has taken, toward its inside.
    fn apart_from(
        &self,
        position: [i32; 3],
        at: [usize; 3],
        outward: DVec3,
        taken: &[[i32; 3]],
    ) -> [i32; 3] {
        if !taken.contains(&position) {
            return position;
        }
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| outward[b].abs().total_cmp(&outward[a].abs()));
        for step in 1..=taken.len() as i32 + 1 {
            for axis in axes {
                let inward = if outward[axis] > 0.0 { -1 } else { 1 };
                for direction in [inward, -inward] {
                    let mut moved = position;
                    moved[axis] += direction * step;
                    let low = at[axis] as i64 * self.cell_units;
                    let within = i64::from(moved[axis]) - low;
                    if within > 0 && within < self.cell_units && !taken.contains(&moved) {
                        return moved;
                    }
                }
            }
        }
        unreachable!("a cell has room for four vertices")
    }
}
