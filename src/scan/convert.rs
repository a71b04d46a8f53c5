//! Which edges of a brick a triangle crosses: exact, on the snapped corners.
//!
//! The grid is translated symbolically by (e0, e1, e2), e0 >> e1 >> e2 > 0. One translation of the
//! whole grid makes every answer that of a real generic configuration, so all answers agree.
//!
//! Sizes: corners are within 2^28 units of the brick, normals within 2^58, inside tests within
//! 2^59 (i64); the place along the edge is decided in f64 where its error bound allows, else in
//! i128.

use glam::DVec3;

use crate::octree::{BrickKey, Domain, LINES, SIDE, SoupTriangle, SourcePlane, edge_index};
use crate::scan::collect::{Collector, Hit};

/// Rounding of the f64 evaluation of a place along an edge, relative to the sizes of its terms:
/// a dozen operations of 2^-53 each, with room to spare.
const FILTER: f64 = 1.0 / (1_u64 << 46) as f64;

/// Finds the hits of triangles in one brick after another.
pub struct Converter {
    domain: Domain,
    cell: i64,
    /// About 1 / cell: a product takes less than a quotient.
    cells_per_unit: f64,
    base: [i64; 3],
}

/// A snapped triangle, relative to the brick's min corner.
struct Snapped {
    corners: [[i64; 3]; 3],
    normal: [i64; 3],
    /// What it covers along each axis.
    extents: [Extent; 3],
}

/// What a triangle covers of a brick along an axis.
#[derive(Clone, Copy)]
struct Extent {
    /// Whether it comes to the brick at all.
    is_there: bool,
    /// First and last of the lines across the axis that may pierce it; none if they do not ascend.
    lines: [i64; 2],
}

impl Converter {
    pub fn new(domain: &Domain) -> Self {
        let cell = i64::from(domain.cell_units);
        Self { domain: *domain, cell, cells_per_unit: 1.0 / cell as f64, base: [0; 3] }
    }

    /// Goes on with another brick.
    pub fn enter(&mut self, brick: BrickKey) {
        let side = self.domain.brick_units();
        self.base = brick.position().map(|c| i64::from(c) * side);
    }

    /// Hands every hit of the triangle in the brick to `collector`.
    pub fn convert(&self, triangle: &SoupTriangle, collector: &mut Collector) {
        let corners = triangle.corners.map(|corner| {
            let q = self.domain.snap(corner);
            std::array::from_fn(|a| i64::from(q[a]) - self.base[a])
        });
        let e: [i64; 3] = std::array::from_fn(|a| corners[1][a] - corners[0][a]);
        let f: [i64; 3] = std::array::from_fn(|a| corners[2][a] - corners[0][a]);
        let normal = std::array::from_fn(|a| {
            let (u, v) = ((a + 1) % 3, (a + 2) % 3);
            e[u] * f[v] - e[v] * f[u]
        });
        let extents = std::array::from_fn(|axis| self.extent(corners.map(|c: [i64; 3]| c[axis])));
        let snapped = Snapped { corners, normal, extents };
        let mut plane = None;
        for axis in 0..3 {
            if normal[axis] != 0 {
                self.convert_axis(&snapped, axis, &mut |column, place| {
                    let plane = *plane
                        .get_or_insert_with(|| collector.add_plane(self.source_plane(triangle)));
                    let mut at = [0; 3];
                    at[axis] = place;
                    at[(axis + 1) % 3] = column[0];
                    at[(axis + 2) % 3] = column[1];
                    let edge = edge_index(axis, at);
                    collector.add(Hit::new(edge, plane, normal[axis] > 0));
                });
            }
        }
    }

    /// The plane of the original corners, with its origin.
    fn source_plane(&self, triangle: &SoupTriangle) -> SourcePlane {
        let corners = triangle.corners.map(|corner| {
            let p = self.domain.to_units(corner);
            DVec3::from_array(std::array::from_fn(|a| p[a] - self.base[a] as f64))
        });
        let centre = DVec3::splat(self.domain.brick_units() as f64 * 0.5);
        SourcePlane {
            source: triangle.source,
            part: triangle.part,
            material: triangle.material,
            ..SourcePlane::through(corners, centre)
        }
    }

    /// All lines along `axis` that pierce the triangle within the brick.
    fn convert_axis(
        &self,
        triangle: &Snapped,
        axis: usize,
        visit: &mut impl FnMut([usize; 2], usize),
    ) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let [first_u, last_u] = triangle.extents[u].lines;
        let [first_v, last_v] = triangle.extents[v].lines;
        if first_u > last_u || first_v > last_v || !triangle.extents[axis].is_there {
            return;
        }
        let sides = Sides::new(triangle, axis);
        let step = sides.direction.map(|[_, dv]| dv * self.cell);
        let per_normal = 1.0 / triangle.normal[axis] as f64;
        for j in first_v..=last_v {
            let line_v = j * self.cell;
            let (from, to) = sides.span(line_v, first_u, last_u, self.cell);
            let mut values = sides.values(from * self.cell, line_v);
            for i in from..=to {
                // Inside of all three: none is negative.
                let is_inside = values[0] | values[1] | values[2] >= 0;
                if is_inside
                    && let Some(place) =
                        self.place_along(triangle, (axis, per_normal), i * self.cell, line_v)
                {
                    visit([i as usize, j as usize], place);
                }
                values = std::array::from_fn(|k| values[k] - step[k]);
            }
        }
    }

    /// The lines of the brick with lo <= line < hi of the triangle: the grid sits at +e.
    fn extent(&self, [p, q, r]: [i64; 3]) -> Extent {
        let (lo, hi) = (p.min(q).min(r), p.max(q).max(r));
        let last_line = LINES as i64 - 1;
        let end = last_line * self.cell;
        if hi <= 0 || lo > end {
            return Extent { is_there: hi >= 0 && lo <= end, lines: [1, 0] };
        }
        // Both are above zero and within the lattice, which has fewer units a side than a u32.
        let lines_below = |x: i64| i64::from((x - 1) as u32 / self.cell as u32);
        let first = if lo <= 0 { 0 } else { lines_below(lo) + 1 };
        Extent { is_there: true, lines: [first, lines_below(hi).min(last_line)] }
    }

    /// The edge on which the line at (line_u, line_v) pierces the triangle's plane; `per_normal` is about one
    /// by the normal along the axis.
    fn place_along(
        &self,
        t: &Snapped,
        (axis, per_normal): (usize, f64),
        line_u: i64,
        line_v: i64,
    ) -> Option<usize> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let [x0, u0, v0] = [t.corners[0][axis], t.corners[0][u], t.corners[0][v]];
        let [na, nu, nv] = [t.normal[axis], t.normal[u], t.normal[v]];
        let place = if nu == 0 && nv == 0 {
            let (place, rest) = (x0.div_euclid(self.cell), x0.rem_euclid(self.cell));
            if rest != 0 { place } else { place - before_tie(t.normal, axis) }
        } else {
            let (a, b) = (nu as f64 * (line_u - u0) as f64, nv as f64 * (line_v - v0) as f64);
            let cells = (x0 as f64 - (a + b) * per_normal) * self.cells_per_unit;
            let size = x0.abs() as f64 + (a.abs() + b.abs()) * per_normal.abs();
            let error = size * self.cells_per_unit * FILTER;
            let below = if error < 0.5 { floor(cells) } else { 0 };
            let rest = cells - below as f64;
            if rest > error && 1.0 - rest > error {
                below
            } else {
                let shift = i128::from(nu) * i128::from(line_u - u0)
                    + i128::from(nv) * i128::from(line_v - v0);
                let numerator = i128::from(x0) * i128::from(na) - shift;
                self.place_of(numerator, i128::from(na), t.normal, axis)
            }
        };
        (0..SIDE as i64).contains(&place).then_some(place as usize)
    }

    /// The edge at numerator / denominator units, ties decided by the translation of the grid.
    fn place_of(&self, numerator: i128, denominator: i128, normal: [i64; 3], axis: usize) -> i64 {
        let (numerator, denominator) =
            if denominator < 0 { (-numerator, -denominator) } else { (numerator, denominator) };
        let step = denominator * i128::from(self.cell);
        let place = numerator.div_euclid(step) as i64;
        if numerator.rem_euclid(step) != 0 {
            return place;
        }
        place - before_tie(normal, axis)
    }
}

/// 1 where the translation of the grid puts a plane through a corner on the edge before it, else 0.
fn before_tie(normal: [i64; 3], axis: usize) -> i64 {
    let leading = normal.iter().find(|&&n| n != 0).map_or(0, |n| n.signum());
    i64::from(leading * normal[axis].signum() > 0)
}

/// The largest integer that is not above a number of less than 2^62: the method for that takes longer.
#[inline]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(x < whole as f64)
}

/// The three edge functions of a triangle in the plane across an axis.
struct Sides {
    /// Start of each side.
    from: [[i64; 2]; 3],
    /// Direction of each side, turned so that the inside is positive.
    direction: [[i64; 2]; 3],
    /// 0 where a point on the side counts as inside, -1 where it does not.
    bias: [i64; 3],
}

impl Sides {
    fn new(triangle: &Snapped, axis: usize) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let turn = triangle.normal[axis].signum();
        let corner = |i: usize| [triangle.corners[i % 3][u], triangle.corners[i % 3][v]];
        let from = [corner(0), corner(1), corner(2)];
        let direction = std::array::from_fn(|k| {
            let (p, q) = (corner(k), corner(k + 1));
            [(q[0] - p[0]) * turn, (q[1] - p[1]) * turn]
        });
        let bias = std::array::from_fn(|k| {
            let [du, dv]: [i64; 2] = direction[k];
            // F grows by -dv along u and by du along v; the lower axis has the larger shift.
            let (first, second) = if u < v { (-dv, du) } else { (du, -dv) };
            let tie = if first == 0 { second } else { first };
            if tie > 0 { 0 } else { -1 }
        });
        Self { from, direction, bias }
    }

    /// The edge functions at a line: negative beyond a side.
    #[inline]
    fn values(&self, line_u: i64, line_v: i64) -> [i64; 3] {
        std::array::from_fn(|k| {
            let ([pu, pv], [du, dv]) = (self.from[k], self.direction[k]);
            du * (line_v - pv) - dv * (line_u - pu) + self.bias[k]
        })
    }

    /// Columns of row `line_v` that can be inside: each side cuts the row once. In f64, with one
    /// column to spare on both ends.
    fn span(&self, line_v: i64, first: i64, last: i64, cell: i64) -> (i64, i64) {
        if last - first < 4 {
            return (first, last);
        }
        let (mut lo, mut hi) = (first as f64, last as f64);
        for k in 0..3 {
            let ([pu, pv], [du, dv]) = (self.from[k], self.direction[k]);
            if dv == 0 {
                continue;
            }
            let cut = pu as f64 + du as f64 * (line_v - pv) as f64 / dv as f64;
            let column = cut / cell as f64;
            if dv > 0 {
                hi = hi.min(column + 1.0);
            } else {
                lo = lo.max(column - 1.0);
            }
        }
        (lo.ceil() as i64, hi.floor() as i64)
    }
}
