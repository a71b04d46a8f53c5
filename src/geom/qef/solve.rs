//! The choice among the paths, and the box.

use crate::geom::qef::bounded::minimise;
use crate::geom::qef::jacobi::Spectrum;
use crate::geom::qef::ldl;
use crate::geom::qef::planes::{Bundle, is_full_rank, is_usable};
use crate::geom::qef::{Hit, Path, Qef, QefOptions, Solution};
use glam::DVec3;

/// Places the vertex of a cell.
///
/// Always finite and inside the box of `options`: contradictory, missing and broken hits included.
#[must_use]
pub fn solve(hits: &[Hit], options: &QefOptions) -> Solution {
    let bundle = Bundle::gather(hits);
    let path = match bundle.normals {
        0 => Path::Mass,
        1 => Path::Plane,
        2 => Path::TwoPlanes,
        3 => Path::ThreePlanes,
        _ => Path::Ldl,
    };
    if let Some((free, rank)) = free_solution(hits, &bundle, path, options) {
        let position = bundle.with_exact_coordinates(free);
        if contains(options, position) {
            return Solution { position, rank, path, clamped: false };
        }
    }
    by_spectrum(hits, &bundle, path, options)
}

/// The solution of one cheap path, without the box; `None` where it would not be the truncated one.
#[inline]
fn free_solution(
    hits: &[Hit],
    bundle: &Bundle,
    path: Path,
    options: &QefOptions,
) -> Option<(DVec3, u8)> {
    match path {
        Path::Mass => Some((bundle.mass_point, 0)),
        Path::Ldl => {
            let qef = accumulate(hits);
            if !is_full_rank(&qef.ata, options.cutoff()) {
                return None;
            }
            let m = bundle.mass_point;
            Some((m + ldl::solve(&qef.ata, qef.residual(m)), 3))
        }
        _ => bundle.closed_form(options).map(|at| (at, bundle.normals)),
    }
}

/// The reference path, and the only one that ends at the border of the box.
#[cold]
fn by_spectrum(hits: &[Hit], bundle: &Bundle, path: Path, options: &QefOptions) -> Solution {
    let free = by_jacobi(&accumulate(hits), options);
    let position = bundle.with_exact_coordinates(free.position);
    let clamped = free.clamped || !contains(options, position);
    let path = if path == Path::Mass { path } else { Path::Jacobi };
    Solution { position: confine(options, position), path, clamped, ..free }
}

/// Solves one quadric by its eigenvalues, and again inside the box if the answer is outside.
fn by_jacobi(qef: &Qef, options: &QefOptions) -> Solution {
    let m = qef.mass_point();
    let r = qef.residual(m);
    let spectrum = Spectrum::of(&qef.ata);
    let rank = spectrum.rank(options.cutoff());
    let free = m + spectrum.solve(rank, r);
    let path = if rank == 0 { Path::Mass } else { Path::Jacobi };
    if contains(options, free) {
        return Solution { position: free, rank, path, clamped: false };
    }
    // Of the right-hand side only what the truncated quadric knows of.
    let kept = spectrum.vectors[..usize::from(rank)]
        .iter()
        .fold(DVec3::ZERO, |sum, &v| sum + v * v.dot(r));
    let inner = minimise(&spectrum.truncated(rank), kept, options.lo - m, options.hi - m);
    Solution { position: confine(options, m + inner), rank, path, clamped: true }
}

impl Qef {
    /// The minimum of the quadric in the box of `options`, which is about the quadric's origin.
    #[must_use]
    pub fn solve(&self, options: &QefOptions) -> Solution {
        by_jacobi(self, options)
    }
}

#[inline]
fn accumulate(hits: &[Hit]) -> Qef {
    let mut qef = Qef::default();
    for hit in hits {
        if is_usable(hit.normal) {
            qef.add_plane(hit.point, hit.normal);
        } else {
            qef.add_point(hit.point);
        }
    }
    qef
}

/// False for NaN.
fn contains(options: &QefOptions, at: DVec3) -> bool {
    at.cmpge(options.lo).all() && at.cmple(options.hi).all()
}

/// The nearest point of the box; its lowest corner for NaN.
fn confine(options: &QefOptions, at: DVec3) -> DVec3 {
    let axis = |at: f64, lo: f64, hi: f64| at.max(lo).min(hi);
    let (lo, hi) = (options.lo, options.hi);
    DVec3::new(axis(at.x, lo.x, hi.x), axis(at.y, lo.y, hi.y), axis(at.z, lo.z, hi.z))
}

#[cfg(test)]
pub(crate) fn force(hits: &[Hit], path: Path, options: &QefOptions) -> Option<DVec3> {
    let qef = accumulate(hits);
    let m = qef.mass_point();
    match path {
        Path::Jacobi => {
            let spectrum = Spectrum::of(&qef.ata);
            Some(m + spectrum.solve(spectrum.rank(options.cutoff()), qef.residual(m)))
        }
        Path::Ldl => Some(m + ldl::solve(&qef.ata, qef.residual(m))),
        Path::Mass => Some(m),
        Path::Plane | Path::TwoPlanes | Path::ThreePlanes => {
            Bundle::gather(hits).closed_form(options)
        }
    }
}
