//! Cuts a quad around a crossed edge into triangles.
//!
//! The diagonal whose surface passes nearer to the crossing is taken: it runs along creases. It
//! must keep the two triangles in the envelope of the quad, the four tetrahedra between the edge
//! and the dual segments around it, and neither may be degenerate; all of that exactly on the
//! lattice. Where no diagonal does, the quad becomes a fan around its crossing, which always does.
//! A component alone in its cells is then embedded, hence oriented outward.
//!
//! Units: lattice units from the min corner of the brick that owns the edge.
//! Source: envelopes after Ju and Udeshi 2006 (intersection-free contouring on an octree).

/// Residuals that differ by less than this share of a cell are equal: the shorter diagonal decides.
const EQUAL_RESIDUAL_CELLS: f64 = 1e-6;

/// How a quad is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Along the diagonal from the first to the third vertex.
    FirstThird,
    /// Along the diagonal from the second to the fourth vertex.
    SecondFourth,
    /// Into four triangles around the crossing.
    Fan,
}

/// A quad: its vertices in the order of the four cells around the edge, seen from the edge's
/// upper end: (-,-), (+,-), (+,+), (-,+) on the two axes after the edge's.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    /// The vertices.
    pub corners: [[i64; 3]; 4],
    /// The edge's direction.
    pub axis: usize,
    /// The crossing on the edge.
    pub crossing: [i64; 3],
}

impl Quad {
    /// The shorter diagonal, whether it keeps to the envelope or not.
    pub fn shorter_diagonal(&self) -> Cut {
        let square = |i: usize, j: usize| -> i64 {
            (0..3).map(|a| (self.corners[i][a] - self.corners[j][a]).pow(2)).sum()
        };
        if square(0, 2) <= square(1, 3) { Cut::FirstThird } else { Cut::SecondFourth }
    }

    /// Decides how to cut.
    pub fn cut(&self, cell_units: i64) -> Cut {
        let ring = Ring::new(self, cell_units);
        let diagonals = [0, 1].map(|first| Diagonal::new(&ring, first));
        let [first_third, second_fourth] = diagonals.each_ref().map(|d| d.residual(&ring));
        let close = (first_third - second_fourth).abs() <= EQUAL_RESIDUAL_CELLS * ring.cell;
        let prefer_first = if close {
            diagonals[0].square_length() <= diagonals[1].square_length()
        } else {
            first_third < second_fourth
        };
        let order = if prefer_first { [0, 1] } else { [1, 0] };
        for first in order {
            let diagonal = &diagonals[first];
            if !diagonal.is_degenerate() && diagonal.is_in_envelope(&ring) {
                return [Cut::FirstThird, Cut::SecondFourth][first];
            }
        }
        Cut::Fan
    }
}

/// A quad seen from the lower end of its edge: the two axes after the edge's, then the edge's.
///
/// Exact in f64: a vertex lies less than a cell away along each axis, and cells are at most 2^24
/// units. So are differences, and the products of two of them, and sums of two products.
struct Ring {
    corners: [[f64; 3]; 4],
    /// Height of the crossing.
    crossing: f64,
    /// Height of the edge's upper end.
    cell: f64,
}

impl Ring {
    fn new(quad: &Quad, cell_units: i64) -> Self {
        let axes = [(quad.axis + 1) % 3, (quad.axis + 2) % 3, quad.axis];
        // The crossing lies inside of the edge, whose ends are multiples of the cell.
        let crossing = quad.crossing[quad.axis].rem_euclid(cell_units);
        let mut lower = quad.crossing;
        lower[quad.axis] -= crossing;
        let corners = quad.corners.map(|corner| axes.map(|a| (corner[a] - lower[a]) as f64));
        Self { corners, crossing: crossing as f64, cell: cell_units as f64 }
    }
}

/// One way to cut: two triangles on a diagonal.
struct Diagonal {
    from: [f64; 3],
    along: [f64; 3],
    /// Cross products of the diagonal with the way to the vertex after its start, and to the one
    /// before: the normals of the two triangles. Exact.
    normals: [[f64; 3]; 2],
    /// On which side of the diagonal the edge passes: 1 where the vertex after its start is, -1
    /// where the one before is, 0 when the diagonal meets the edge's line.
    side: i32,
}

impl Diagonal {
    fn new(ring: &Ring, first: usize) -> Self {
        let [from, after, to, before] = [0, 1, 2, 3].map(|i| ring.corners[(first + i) % 4]);
        let along = difference(to, from);
        let normals = [after, before].map(|apex| cross(along, difference(apex, from)));
        let side = sign(from[0] * to[1] - from[1] * to[0]);
        Self { from, along, normals, side }
    }

    /// The normal of the triangle that the edge pierces.
    fn pierced(&self) -> &[f64; 3] {
        if self.side < 0 { &self.normals[1] } else { &self.normals[0] }
    }

    /// How far from the crossing the surface meets the edge.
    fn residual(&self, ring: &Ring) -> f64 {
        let [nu, nv, up] = *self.pierced();
        if up == 0.0 {
            return f64::INFINITY;
        }
        let [u, v, height] = self.from;
        (height - ring.crossing + (nu * u + nv * v) / up).abs()
    }

    fn square_length(&self) -> f64 {
        self.along.iter().map(|x| x * x).sum()
    }

    /// Whether the corners of one of its triangles lie on a line.
    fn is_degenerate(&self) -> bool {
        self.normals.contains(&[0.0; 3])
    }

    /// Whether the two triangles lie in the quad's envelope.
    fn is_in_envelope(&self, ring: &Ring) -> bool {
        let [after, before] = self.normals.each_ref().map(|normal| self.edge_ends(normal, ring));
        let opposite = |ends: [i32; 2]| ends[0] * ends[1] < 0;
        if self.side == 0 {
            return opposite(after) && opposite(before);
        }
        // The edge passes the diagonal on the side of the vertex whose triangle it pierces.
        let pairs = if self.side < 0 {
            [(after, before), (before, after)]
        } else {
            [(before, after), (after, before)]
        };
        pairs.into_iter().any(|(beyond, pierced)| {
            opposite(pierced) && beyond[0] == self.side && beyond[1] == -self.side
        })
    }

    /// On which side of the plane across `normal` through the diagonal the edge's ends lie: in f64
    /// where that is sure, else in i128.
    fn edge_ends(&self, normal: &[f64; 3], ring: &Ring) -> [i32; 2] {
        let terms: [f64; 3] = std::array::from_fn(|a| normal[a] * self.from[a]);
        let lower = -(terms[0] + terms[1] + terms[2]);
        let rise = normal[2] * ring.cell;
        let upper = lower + rise;
        let size = terms.iter().map(|term| term.abs()).sum::<f64>() + rise.abs();
        if lower.abs() > size * FILTER && upper.abs() > size * FILTER {
            return [sign(lower), sign(upper)];
        }
        let product = |x: f64, y: f64| i128::from(x as i64) * i128::from(y as i64);
        let lower = -(0..3).map(|a| product(normal[a], self.from[a])).sum::<i128>();
        [lower, lower + product(normal[2], ring.cell)].map(|value| value.signum() as i32)
    }
}

/// Rounding of half a dozen products and sums in f64, relative to the sizes of the products.
const FILTER: f64 = 1.0 / (1_u64 << 48) as f64;

fn difference(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| p[a] - q[a])
}

fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// -1, 0 or 1.
fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quad(corners: [[i64; 3]; 4], height: i64) -> Quad {
        Quad { corners, axis: 2, crossing: [0, 0, height] }
    }

    #[test]
    fn a_crease_runs_along_the_diagonal() {
        let ridge = [[-50, -50, 40], [50, -50, 10], [50, 50, 40], [-50, 50, 10]];
        assert_eq!(quad(ridge, 40).cut(100), Cut::FirstThird);
        assert_eq!(quad(ridge, 10).cut(100), Cut::SecondFourth);
    }

    #[test]
    fn a_degenerate_half_moves_the_diagonal_and_two_make_a_fan() {
        let flat = [[-50, -50, 30], [50, -10, 30], [50, 50, 30], [-50, 50, 30]];
        assert_ne!(quad(flat, 30).cut(100), Cut::Fan);
        // First, second and third vertex on a line: the other diagonal.
        let line = [[-40, -20, 30], [10, -5, 30], [60, 10, 30], [-50, 50, 30]];
        assert!(Diagonal::new(&Ring::new(&quad(line, 30), 100), 0).is_degenerate());
        assert_eq!(quad(line, 30).cut(100), Cut::SecondFourth);
        // Both: the four points lie on one line.
        let all = [[-40, -20, 30], [10, -5, 30], [60, 10, 30], [-20, -14, 30]];
        assert!(Diagonal::new(&Ring::new(&quad(all, 30), 100), 1).is_degenerate());
        assert_eq!(quad(all, 30).cut(100), Cut::Fan);
    }

    fn orientation(p: [i64; 3], q: [i64; 3], r: [i64; 3], s: [i64; 3]) -> i32 {
        let [a, b, c] = [q, r, s].map(|t| [0, 1, 2].map(|i| i128::from(t[i] - p[i])));
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        (a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)).signum() as i32
    }

    proptest! {
        /// Few places of a coarse grid, so that planes often pass the ends of the edge.
        #[test]
        fn sides_are_those_of_whole_numbers(
            places in prop::array::uniform4(prop::array::uniform3(1..8_i64)),
            height in 1..8_i64,
            axis in 0..3_usize,
            scale in prop::sample::select(vec![2_i64, 1 << 10, (1 << 21) - 1]),
        ) {
            let cell = 8 * scale;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut corners = places.map(|p| p.map(|c| c * scale));
            for (corner, [du, dv]) in corners.iter_mut().zip([[1, 1], [0, 1], [0, 0], [1, 0]]) {
                corner[u] -= du * cell;
                corner[v] -= dv * cell;
            }
            let mut crossing = [0; 3];
            crossing[axis] = height * scale;
            let quad = Quad { corners, axis, crossing };
            let ring = Ring::new(&quad, cell);
            let mut upper = [0; 3];
            upper[axis] = cell;
            for first in 0..2 {
                let [p, q, r, s] = [0, 1, 2, 3].map(|i| corners[(first + i) % 4]);
                let diagonal = Diagonal::new(&ring, first);
                prop_assert_eq!(diagonal.side, orientation(p, r, [0; 3], upper));
                for (normal, apex) in diagonal.normals.iter().zip([q, s]) {
                    let ends = [[0; 3], upper].map(|end| orientation(p, r, apex, end));
                    prop_assert_eq!(diagonal.edge_ends(normal, &ring), ends);
                }
            }
        }
    }
}
