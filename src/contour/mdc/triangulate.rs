//! Cuts a quad around a crossed edge into triangles.
//!
//! The diagonal whose surface passes nearer to the crossing is taken: it runs along creases. No
//! triangle may be degenerate on the lattice; where both diagonals give one, the quad becomes a
//! fan around its crossing, which never does.
//!
//! Units: lattice units from the min corner of the brick that owns the edge.

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
        let sound = [
            !is_degenerate(p, q, r) && !is_degenerate(p, r, s),
            !is_degenerate(q, r, s) && !is_degenerate(q, s, p),
        ];
        match (sound, prefer_first) {
            ([true, _], true) | ([true, false], false) => Cut::FirstThird,
            ([_, true], _) => Cut::SecondFourth,
            ([false, false], _) => Cut::Fan,
        }
    }

    /// How far from the crossing the surface cut along the diagonal from `first` meets the edge.
    fn residual(&self, first: usize) -> f64 {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let local = |i: usize| {
            let corner = self.corners[(first + i) % 4];
            [u, v, self.axis].map(|a| (corner[a] - self.crossing[a]) as f64)
        };
        let (from, to) = (local(0), local(2));
        // The edge is at the origin: on which side of the diagonal does it lie?
        let side = from[0] * to[1] - from[1] * to[0];
        let apex = if side < 0.0 { local(3) } else { local(1) };
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
        let ridge = [[-50, -50, 40], [50, -50, 0], [50, 50, 40], [-50, 50, 0]];
        assert_eq!(quad(ridge, 40).cut(100), Cut::FirstThird);
        assert_eq!(quad(ridge, 0).cut(100), Cut::SecondFourth);
    }

    #[test]
    fn a_degenerate_half_moves_the_diagonal_and_two_make_a_fan() {
        let folded = [[-50, -50, 0], [50, -10, 0], [50, 50, 0], [-50, 50, 0]];
        assert_ne!(quad(folded, 0).cut(100), Cut::Fan);
        // First, second and third vertex on a line: the other diagonal.
        let line = [[-40, -20, 0], [10, -5, 0], [60, 10, 0], [-50, 50, 0]];
        assert!(is_degenerate(line[0], line[1], line[2]));
        assert_eq!(quad(line, 0).cut(100), Cut::SecondFourth);
        // Both: the four points lie on one line.
        let all = [[-40, -20, 0], [10, -5, 0], [60, 10, 0], [-20, -14, 0]];
        assert!(is_degenerate(all[0], all[3], all[2]));
        assert_eq!(quad(all, 0).cut(100), Cut::Fan);
    }
}
