//! Edges of triangles that pass through given cells of a brick, and which of them may be borders.

use glam::DVec3;

use crate::octree::{Border, BrickKey, Domain, SIDE, SoupTriangle};
use crate::transfer::mixed::{MixedCells, cell_number, told};

/// Most edges of one brick that are looked at.
pub const MOST_EDGES: u64 = 1 << 14;
/// Memory of one of them.
pub const EDGE_BYTES: u64 = size_of::<Edge>() as u64;
/// An edge this near to a cell, in cells, is in it as well: it may run along a plane of the grid.
const SLACK_CELLS: f64 = 1e-3;

/// An edge of a triangle.
struct Edge {
    /// Its ends on the lattice, in order: what triangles have in common.
    ends: [[i32; 3]; 2],
    material: u32,
    normal: DVec3,
    /// Its ends in cells.
    from: DVec3,
    to: DVec3,
}

/// The edges of one brick after another.
pub struct Edges<'d> {
    domain: &'d Domain,
    cosine: f64,
    with_patches: bool,
    base: DVec3,
    edges: Vec<Edge>,
    is_crowded: bool,
    /// Where an edge passes planes of the grid, as shares of it.
    passed: Vec<f64>,
}

impl<'d> Edges<'d> {
    /// Of no brick yet.
    pub fn new(domain: &'d Domain, crease_deg: f64, with_patches: bool) -> Self {
        Self {
            domain,
            cosine: crease_deg.to_radians().cos(),
            with_patches,
            base: DVec3::ZERO,
            edges: Vec::new(),
            is_crowded: false,
            passed: Vec::new(),
        }
    }

    /// Forgets the edges of another brick.
    pub fn begin(&mut self, brick: BrickKey) {
        self.edges.clear();
        self.is_crowded = false;
        self.base = DVec3::from(brick.position().map(f64::from)) * SIDE as f64;
    }

    /// Whether there were more than are looked at.
    pub fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Takes in the edges of a triangle that pass through mixed cells.
    pub fn take(&mut self, triangle: &SoupTriangle, mixed: &MixedCells) {
        let cell_units = f64::from(self.domain.cell_units);
        let corners = triangle
            .corners
            .map(|corner| DVec3::from(self.domain.to_units(corner)) / cell_units - self.base);
        let [p, q, r] = corners;
        let normal = (q - p).cross(r - p).normalize_or_zero();
        for i in 0..3 {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            if !self.is_in_any(from, to, mixed) {
                continue;
            }
            if self.edges.len() as u64 == MOST_EDGES {
                self.is_crowded = true;
                return;
            }
            let mut ends =
                [i, (i + 1) % 3].map(|corner| self.domain.snap(triangle.corners[corner]));
            ends.sort_unstable();
            let material = told(triangle.material, self.with_patches);
            self.edges.push(Edge { ends, material, normal, from, to });
        }
    }

    fn is_in_any(&mut self, from: DVec3, to: DVec3, mixed: &MixedCells) -> bool {
        let mut is_in = false;
        self.each_piece(from, to, mixed, |_, _| is_in = true);
        is_in
    }

    /// The pieces of edges that may be borders, by cell.
    pub fn borders(&mut self, mixed: &MixedCells) -> Vec<Border> {
        let mut edges = std::mem::take(&mut self.edges);
        edges.sort_by_key(|edge| (edge.ends, edge.material));
        let mut borders = Vec::new();
        for group in edges.chunk_by(|a, b| a.ends == b.ends) {
            let is_shared = group.iter().any(|edge| edge.material != group[0].material);
            if !is_shared && self.is_inside_of_a_face(group) {
                continue;
            }
            let Edge { from, to, .. } = group[0];
            let Some(direction) = (to - from).try_normalize() else { continue };
            let direction = direction.as_vec3().to_array();
            self.each_piece(from, to, mixed, |cell, point| {
                let (cell, point) = (cell_number(cell) as u16, point.as_vec3().to_array());
                borders.push(Border { cell, is_shared, point, direction });
            });
        }
        edges.clear();
        self.edges = edges;
        borders.sort_by_key(|border| border.cell);
        borders
    }

    /// Whether the edge is one of two triangles, with no crease between.
    fn is_inside_of_a_face(&self, group: &[Edge]) -> bool {
        match group {
            [one, other] => one.normal.dot(other.normal).abs() >= self.cosine,
            _ => false,
        }
    }

    /// Visits the mixed cells that a segment passes, with the middle of the piece there.
    fn each_piece(
        &mut self,
        from: DVec3,
        to: DVec3,
        mixed: &MixedCells,
        mut visit: impl FnMut([usize; 3], DVec3),
    ) {
        let along = to - from;
        let Some((start, end)) = clip(from, along) else { return };
        self.passed.clear();
        self.passed.extend([start, end]);
        for axis in 0..3 {
            let (a, b) = (from[axis] + along[axis] * start, from[axis] + along[axis] * end);
            let (low, high) = (a.min(b), a.max(b));
            let mut plane = low.ceil();
            while plane <= high && along[axis] != 0.0 {
                let share = (plane - from[axis]) / along[axis];
                if share > start && share < end {
                    self.passed.push(share);
                }
                plane += 1.0;
            }
        }
        self.passed.sort_unstable_by(f64::total_cmp);
        for i in 1..self.passed.len() {
            let middle = from + along * (0.5 * (self.passed[i - 1] + self.passed[i]));
            each_cell_at(middle, |cell| {
                if mixed.is_mixed(cell) {
                    visit(cell, middle);
                }
            });
        }
    }
}

/// The share of a segment that lies in the brick, or so near that it counts.
fn clip(from: DVec3, along: DVec3) -> Option<(f64, f64)> {
    let (low, high) = (-SLACK_CELLS, SIDE as f64 + SLACK_CELLS);
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if !(low..=high).contains(&from[axis]) {
                return None;
            }
            continue;
        }
        let one = (low - from[axis]) / along[axis];
        let other = (high - from[axis]) / along[axis];
        start = start.max(one.min(other));
        end = end.min(one.max(other));
    }
    (start < end).then_some((start, end))
}

/// Visits the cells of the brick that hold a point, or come as near as the slack.
fn each_cell_at(point: DVec3, mut visit: impl FnMut([usize; 3])) {
    let range = |axis: usize| {
        let first = (point[axis] - SLACK_CELLS).floor().max(0.0) as usize;
        let last = (point[axis] + SLACK_CELLS).floor().min(SIDE as f64 - 1.0);
        first..(last + 1.0).max(0.0) as usize
    };
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                visit([x, y, z]);
            }
        }
    }
}
