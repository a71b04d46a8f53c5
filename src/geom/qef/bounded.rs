//! The least error inside a box: the rare case of a vertex that wants to leave its cell.
//!
//! In:         the truncated quadric about the mass point, and the box about the same point.
//! Out:        the point of the box with the least error; of several, the one nearest to the mass
//!             point.
//! Invariant:  the result lies in the box. The quadric gets a small weight toward the mass point,
//!             which makes the minimum unique: it is the stationary point of exactly one of the
//!             box, its 6 faces, 12 edges and 8 corners, so the best stationary point wins.
//! Units:      cells.
//! Fails:      never.
//! Source:     active sets by enumeration, 27 at most; Nocedal, Wright 2006, chapter 16.

use crate::geom::qef::jacobi::{Symmetric, apply, trace};
use glam::DVec3;

/// Weight toward the mass point, relative to the trace: moves a vertex by 1e-9 / cut-off of its
/// distance at most, and still is seven digits above rounding.
const PULL: f64 = 1e-9;

/// Minimises xᵀ A x - 2 rᵀ x over the box from `lo` to `hi`.
pub(crate) fn minimise(a: &Symmetric, r: DVec3, lo: DVec3, hi: DVec3) -> DVec3 {
    let pull = (PULL * trace(a)).max(f64::MIN_POSITIVE);
    let a = [a[0] + pull, a[1], a[2], a[3] + pull, a[4], a[5] + pull];
    let mut best = (f64::INFINITY, DVec3::ZERO.max(lo).min(hi));
    // One base-3 digit an axis: free, at the low side, at the high side.
    for set in 0..27_usize {
        let state = [set % 3, set / 3 % 3, set / 9];
        let Some(x) = stationary(&a, r, lo, hi, state) else { continue };
        let error = x.dot(apply(&a, x)) - 2.0 * r.dot(x);
        if error < best.0 {
            best = (error, x);
        }
    }
    best.1
}

/// The stationary point of one face, edge or corner, if it lies in the box.
fn stationary(a: &Symmetric, r: DVec3, lo: DVec3, hi: DVec3, state: [usize; 3]) -> Option<DVec3> {
    const AT: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
    let mut m = AT.map(|row| row.map(|i| a[i]));
    let mut right = r.to_array();
    for axis in 0..3 {
        if state[axis] != 0 {
            m[axis] = [0.0; 3];
            m[axis][axis] = 1.0;
            right[axis] = if state[axis] == 1 { lo[axis] } else { hi[axis] };
        }
    }
    // A pivot of an unfixed axis is a Schur complement of a definite matrix: never zero.
    for pivot in 0..3 {
        for row in pivot + 1..3 {
            let factor = m[row][pivot] / m[pivot][pivot];
            let above = m[pivot];
            for (value, above) in m[row].iter_mut().zip(above) {
                *value -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    let z = right[2] / m[2][2];
    let y = (right[1] - m[1][2] * z) / m[1][1];
    let x = (right[0] - m[0][1] * y - m[0][2] * z) / m[0][0];
    let at = DVec3::new(x, y, z);
    let inside =
        (0..3).all(|axis| state[axis] != 0 || (at[axis] >= lo[axis] && at[axis] <= hi[axis]));
    inside.then_some(at)
}
