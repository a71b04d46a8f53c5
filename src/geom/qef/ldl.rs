//! The usual path for cells of full rank: one factorisation without roots.
//!
//! In:         A and b - A m about the mass point.
//! Out:        the offset from the mass point.
//! Invariant:  a small weight toward the mass point keeps every pivot above zero.
//! Fails:      never; whether the answer may be used is told by `planes::is_full_rank`.
//! Source:     LDLᵀ without pivoting (Golub, Van Loan 2013, 4.1.2).

use crate::geom::qef::jacobi::{Symmetric, trace};
use glam::DVec3;

/// Weight toward the mass point, relative to the trace. At the default cut-off it moves a vertex
/// by at most 2e-4 of its distance from the mass point.
const PULL: f64 = 1e-6;

/// Solves (A + λE) x = r.
#[inline]
pub(crate) fn solve(a: &Symmetric, r: DVec3) -> DVec3 {
    let pull = PULL * trace(a);
    let first = a[0] + pull;
    let (xy, xz) = (a[1] / first, a[2] / first);
    let second = a[3] + pull - xy * a[1];
    let below = a[4] - xz * a[1];
    let yz = below / second;
    let third = a[5] + pull - xz * a[2] - yz * below;
    let y = r.y - xy * r.x;
    let z = (r.z - xz * r.x - yz * y) / third;
    let y = y / second - yz * z;
    DVec3::new(r.x / first - xy * y - xz * z, y, z)
}
