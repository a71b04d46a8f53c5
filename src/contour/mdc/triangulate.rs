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
    /// Decides how to cut.
    pub fn cut(&self, cell_units: i64) -> Cut {
        let [p, q, r, s] = self.corners;
        let first_third = self.residual(0);
        let second_fourth = self.residual(1);
        let close = (first_third - second_fourth).abs() <= EQUAL_RESIDUAL_CELLS * cell_units as f64;
        let prefer_first = if close {
            square_distance(p, r) <= square_distance(q, s)
        } else {
            first_third < second_fourth
        };
        let order = if prefer_first { [0, 1] } else { [1, 0] };
        for first in order {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.corners[(first + i) % 4]);
            let sound = !is_degenerate(a, b, c) && !is_degenerate(a, c, d);
            if sound && self.is_in_envelope(first, cell_units) {
                return [Cut::FirstThird, Cut::SecondFourth][first];
            }
        }
        Cut::Fan
    }

    /// Whether the two triangles on the diagonal from `first` lie in the quad's envelope.
    fn is_in_envelope(&self, first: usize, cell_units: i64) -> bool {
        let [p, q, r, s] = [0, 1, 2, 3].map(|i| self.corners[(first + i) % 4]);
        let mut lower = self.crossing;
        // The crossing lies inside of the edge, whose ends are multiples of the cell.
        lower[self.axis] = lower[self.axis].div_euclid(cell_units) * cell_units;
        let mut upper = lower;
        upper[self.axis] += cell_units;
        let opposite = |apex| {
            let (low, high) = (orientation(p, r, apex, lower), orientation(p, r, apex, upper));
            low * high < 0
        };
        let side = orientation(p, r, lower, upper);
        if side == 0 {
            return opposite(q) && opposite(s);
        }
        // The edge passes the diagonal on the side of the vertex whose triangle it pierces.
        let pairs = if self.passes_fourth(first) { [(q, s), (s, q)] } else { [(s, q), (q, s)] };
        pairs.into_iter().any(|(beyond, pierced)| {
            opposite(pierced)
                && orientation(p, r, upper, beyond) == side
                && orientation(p, r, beyond, lower) == side
        })
    }

    /// Whether the edge lies on the fourth vertex's side of the diagonal from `first`.
    fn passes_fourth(&self, first: usize) -> bool {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let [from, to] = [0, 2].map(|i| {
            let corner = self.corners[(first + i) % 4];
            [u, v].map(|a| (corner[a] - self.crossing[a]) as f64)
        });
        from[0] * to[1] - from[1] * to[0] < 0.0
    }

    /// How far from the crossing the surface cut along the diagonal from `first` meets the edge.
    fn residual(&self, first: usize) -> f64 {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let local = |i: usize| {
            let corner = self.corners[(first + i) % 4];
            [u, v, self.axis].map(|a| (corner[a] - self.crossing[a]) as f64)
        };
        let (from, to) = (local(0), local(2));
        let apex = if self.passes_fourth(first) { local(3) } else { local(1) };
        height_at_origin(from, to, apex).abs()
    }
}

/// Height at (0, 0) of the plane through three points.
fn height_at_origin(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> f64 {
    let (a, b) = ([q[0] - p[0], q[1] - p[1], q[2] - p[2]], [r[0] - p[0], r[1] - p[1], r[2] - p[2]]);
    let up = a[0] * b[1] - a[1] * b[0];
    if up == 0.0 {
        return f64::INFINITY;
    }
    let (nu, nv) = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]);
    p[2] + (nu * p[0] + nv * p[1]) / up
}

/// Rounding of a determinant of exact differences in f64, relative to the sizes of its terms.
const FILTER: f64 = 1.0 / (1_u64 << 48) as f64;

/// The sign of the volume of (q - p, r - p, s - p): in f64 where that is sure, else in i128.
fn orientation(p: [i64; 3], q: [i64; 3], r: [i64; 3], s: [i64; 3]) -> i32 {
    let [a, b, c] = [q, r, s].map(|t| [t[0] - p[0], t[1] - p[1], t[2] - p[2]]);
    let (af, bf, cf) = (a.map(|x| x as f64), b.map(|x| x as f64), c.map(|x| x as f64));
    let (mut sum, mut size) = (0.0, 0.0);
    for (i, along) in af.into_iter().enumerate() {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (x, y) = (bf[j] * cf[k], bf[k] * cf[j]);
        sum += along * (x - y);
        size += along.abs() * (x.abs() + y.abs());
    }
    if sum.abs() > size * FILTER {
        return if sum > 0.0 { 1 } else { -1 };
    }
    let exact: i128 = (0..3)
        .map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let minor = i128::from(b[j]) * i128::from(c[k]) - i128::from(b[k]) * i128::from(c[j]);
            i128::from(a[i]) * minor
        })
        .sum();
    exact.signum() as i32
}

fn square_distance(p: [i64; 3], q: [i64; 3]) -> i128 {
    (0..3).map(|a| i128::from(p[a] - q[a]).pow(2)).sum()
}

/// Whether three lattice points lie on a line. Exact: differences are below 2^30.
pub fn is_degenerate(p: [i64; 3], q: [i64; 3], r: [i64; 3]) -> bool {
    (0..3).all(|a| {
        let (u, v) = ((a + 1) % 3, (a + 2) % 3);
        (q[u] - p[u]) * (r[v] - p[v]) == (q[v] - p[v]) * (r[u] - p[u])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(is_degenerate(line[0], line[1], line[2]));
        assert_eq!(quad(line, 30).cut(100), Cut::SecondFourth);
        // Both: the four points lie on one line.
        let all = [[-40, -20, 30], [10, -5, 30], [60, 10, 30], [-20, -14, 30]];
        assert!(is_degenerate(all[0], all[3], all[2]));
        assert_eq!(quad(all, 30).cut(100), Cut::Fan);
    }
}
