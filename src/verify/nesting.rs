//! Which components lie inside an odd number of others: one sweep over the triangles per chunk.
//!
//! In:         components with an anchor point each; the tape; the labels.
//! Out:        per component whether a ray from its anchor towards -x crosses the others an odd
//!             number of times.
//! Invariant:  every decision is exact; the ray is moved symbolically by (e, e^2) in y and z, so it
//!             meets no edge and no vertex. An anchor on another component is not decided.
//! Memory:     the chunk of components.
//! Source:     Edelsbrunner and Muecke 1990 (simulation of simplicity), Shewchuk 1997 (orient).

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::monitor::Monitor;
use crate::store::{Labels, StoreError};
use crate::verify::components::Component;
use crate::verify::tape::Tape;

/// Where an anchor lies with respect to all other components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Nesting {
    /// Inside an odd number of them.
    pub(crate) odd: bool,
    /// On the surface of one of them.
    pub(crate) touches: bool,
}

/// Finds the nesting of each of `components`.
pub(crate) fn nest(
    components: &[Component],
    tape: &Tape,
    labels: &mut Labels,
    monitor: &dyn Monitor,
) -> Result<Vec<Nesting>, StoreError> {
    let mut by_y: Vec<usize> = (0..components.len()).collect();
    by_y.sort_unstable_by(|&a, &b| components[a].anchor[1].total_cmp(&components[b].anchor[1]));
    let mut nestings = vec![Nesting::default(); components.len()];
    tape.each(monitor, |triangle| {
        if triangle.is_whole() {
            let ys = triangle.corners.map(|corner| corner[1]);
            let (low, high) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
            let from = by_y.partition_point(|&at| components[at].anchor[1] < low);
            for &at in &by_y[from..] {
                let Component { anchor, label, .. } = components[at];
                if anchor[1] > high {
                    break;
                }
                if labels.label(triangle.ids[0])? != label {
                    match crossing(anchor, triangle.corners) {
                        Crossing::None => {}
                        Crossing::Below => nestings[at].odd ^= true,
                        Crossing::Touching => nestings[at].touches = true,
                    }
                }
            }
        }
        Ok(true)
    })?;
    Ok(nestings)
}

#[derive(Debug, PartialEq, Eq)]
enum Crossing {
    None,
    Below,
    Touching,
}

/// Whether the ray from `point` towards -x crosses the triangle.
fn crossing(point: [f64; 3], corners: &[[f64; 3]; 3]) -> Crossing {
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
