//! Whether a ray from a point towards -x crosses a triangle.
//!
//! Invariant:  every decision is exact; the ray is moved symbolically by (e, e^2) in y and z, so it
//!             meets no edge and no vertex.
//! Source:     Edelsbrunner and Muecke 1990 (simulation of simplicity), Shewchuk 1997 (orient).

use robust::{Coord, Coord3D, orient2d, orient3d};

/// How a ray and a triangle meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// Not at all.
    None,
    /// The triangle lies on the ray.
    Below,
    /// The point lies on the triangle.
    Touching,
}

/// Whether the ray from `point` towards -x crosses the triangle.
#[must_use]
pub fn crossing(point: [f64; 3], corners: &[[f64; 3]; 3]) -> Crossing {
    let flat = |p: [f64; 3]| Coord { x: p[1], y: p[2] };
    let [a, b, c] = *corners;
    let inside = passes_under(point, a, b) ^ passes_under(point, b, c) ^ passes_under(point, c, a);
    if !inside {
        return Crossing::None;
    }
    let solid = |p: [f64; 3]| Coord3D { x: p[0], y: p[1], z: p[2] };
    // Negative when the point lies on the side from which a, b, c turn left.
    let side = orient3d(solid(a), solid(b), solid(c), solid(point));
    let turn = orient2d(flat(a), flat(b), flat(c));
    if side == 0.0 {
        Crossing::Touching
    } else if (side < 0.0) == (turn > 0.0) {
        Crossing::Below
    } else {
        Crossing::None
    }
}

/// Whether, seen along x, the edge lies above (in z) the point that was moved by (e, e^2).
fn passes_under(point: [f64; 3], from: [f64; 3], to: [f64; 3]) -> bool {
    if (from[1] > point[1]) == (to[1] > point[1]) {
        return false;
    }
    let (left, right) = if from[1] < to[1] { (from, to) } else { (to, from) };
    let flat = |p: [f64; 3]| Coord { x: p[1], y: p[2] };
    let turn = orient2d(flat(left), flat(right), flat(point));
    if turn != 0.0 {
        return turn < 0.0;
    }
    // On the edge: moved by e in y it is below a rising edge; on a level one e^2 lifts it above.
    right[2] > left[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_a_shared_edge_or_vertex_crosses_one_triangle() {
        let square = [[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]];
        let halves = [[square[0], square[1], square[2]], [square[0], square[2], square[3]]];
        let hits = |point: [f64; 3]| {
            halves.iter().filter(|half| crossing(point, half) == Crossing::Below).count()
        };
        assert_eq!(hits([1.0, 0.0, 0.0]), 1);
        assert_eq!(hits([1.0, 0.5, 0.5]), 1);
        assert_eq!(hits([1.0, -1.0, -1.0]), 1);
        assert_eq!(hits([1.0, 1.0, 1.0]), 0);
        assert_eq!(hits([-1.0, 0.0, 0.25]), 0);
        assert_eq!(crossing([0.0, 0.5, 0.25], &halves[0]), Crossing::Touching);
    }
}
