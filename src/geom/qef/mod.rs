//! Where the vertex of a cell goes: the point with the least squared distance to its planes.
//!
//! In:         the [`Hit`]s of one cell about the cell's centre, normals possibly missing.
//! Out:        a [`Solution`] with the rank (1 flat, 2 crease, 3 corner) and the path it came by.
//! Invariant:  finite and in the box of [`QefOptions`], whatever the hits are. All paths give the
//!             truncated solution x = m + A⁺(b - A m) about the mass point m; the cheap ones stand
//!             aside where they would not. A plane across an axis keeps its coordinate bit by bit.
//! Units:      cells.
//! Determinism: only + - * / and square roots, in a fixed order.
//! Fails:      never.
//! Source:     Ju et al. 2002; Lindstrom 2000 (truncation about the mass point).
//!
//! ```text
//! one normal ------> mass point projected ------\
//! two, three ------> line or corner, closed -----+--> exact axis coordinates --> box
//! more, full rank -> LDLT ----------------------/                                 |
//! all others ------> Jacobi, truncated --------/         outside: bounded quadric (rare)
//! ```

mod bounded;
mod jacobi;
mod ldl;
mod planes;
mod quadric;
mod solve;

pub use quadric::Qef;
pub use solve::{
    Attempt, Waiting, begin, meet, solve, solve_flat, solve_inside, solve_smooth, solve_together,
};

use glam::DVec3;

/// Smallest relative cut-off: below it an eigenvalue is rounding.
const CUTOFF_MIN: f64 = 1e-8;

/// A crossing of the surface and a cell edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where, about the centre of the cell.
    pub point: DVec3,
    /// The surface's unit normal; zero when unknown (patches), of any sign.
    pub normal: DVec3,
}

/// What a vertex must respect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QefOptions {
    /// The lowest corner of the box that the vertex must stay in.
    pub lo: DVec3,
    /// The highest corner of that box.
    pub hi: DVec3,
    crease_deg: f64,
    cutoff: f64,
}

impl QefOptions {
    /// The crease angle that is used unless the user says otherwise.
    pub const CREASE_DEG: f64 = 12.0;

    /// Dihedral deviations below `crease_deg` (0 to 90) are noise; the vertex stays in `lo..=hi`.
    #[must_use]
    pub fn new(crease_deg: f64, lo: DVec3, hi: DVec3) -> Self {
        debug_assert!(lo.cmple(hi).all(), "the box has no inside: {lo} to {hi}");
        let crease_deg = crease_deg.clamp(0.0, 90.0);
        let half = tangent_squared(crease_deg * (std::f64::consts::PI / 360.0));
        Self { lo, hi, crease_deg, cutoff: half.max(CUTOFF_MIN) }
    }

    /// The angle below which a crease is noise.
    #[must_use]
    pub fn crease_deg(&self) -> f64 {
        self.crease_deg
    }

    /// Relative eigenvalue cut-off: two planes of equal weight at a deviation φ have eigenvalues
    /// in the ratio tan²(φ/2).
    #[must_use]
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }
}

impl Default for QefOptions {
    fn default() -> Self {
        Self::new(Self::CREASE_DEG, DVec3::splat(-0.5), DVec3::splat(0.5))
    }
}

/// tan² for 0..=π/4, by the power series of sine and cosine: libm's last bit differs by platform.
fn tangent_squared(angle: f64) -> f64 {
    let square = angle * angle;
    let (mut sine, mut cosine) = (1.0, 1.0);
    // Horner, innermost term first; at π/4 the first term left out is below 1e-20.
    for k in (1..=9).rev() {
        let k = f64::from(k);
        sine = 1.0 - square * sine / (2.0 * k * (2.0 * k + 1.0));
        cosine = 1.0 - square * cosine / (2.0 * k * (2.0 * k - 1.0));
    }
    let tangent = angle * sine / cosine;
    tangent * tangent
}

/// How a position was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Path {
    /// One normal: the mass point, projected.
    Plane,
    /// Two normals: the point of their line nearest to the mass point.
    TwoPlanes,
    /// Three normals: their corner.
    ThreePlanes,
    /// More normals, surely of full rank.
    Ldl,
    /// Eigenvalues, truncated at the cut-off.
    Jacobi,
    /// No usable normal: the mass point.
    Mass,
}

/// The vertex of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Where, about the centre of the cell.
    pub position: DVec3,
    /// 0 without a plane, 1 on a flat, 2 on a crease, 3 at a corner.
    pub rank: u8,
    /// Which path found it.
    pub path: Path,
    /// Whether the free minimum lay outside the box.
    pub clamped: bool,
}

#[cfg(test)]
mod tests;
