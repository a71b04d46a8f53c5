//! The choice among the paths, and the box.

use crate::geom::qef::bounded::minimise;
use crate::geom::qef::jacobi::{Spectrum, apply};
use crate::geom::qef::ldl;
use crate::geom::qef::planes::{Bundle, is_full_rank, is_usable, with_exact_coordinates};
use crate::geom::qef::{Hit, Path, Qef, QefOptions, Solution};
use glam::DVec3;

/// Places the vertex of a cell.
///
/// Always finite and inside the box of `options`: contradictory, missing and broken hits included.
#[must_use]
pub fn solve(hits: &[Hit], options: &QefOptions) -> Solution {
    match begin(hits, options) {
        Attempt::Done(solution) => solution,
        Attempt::Waiting(cell) => {
            let [solution] = solve_together(&[cell], options);
            solution
        }
    }
}

/// What the cheap paths say.
#[derive(Clone, Copy, Debug)]
pub enum Attempt {
    /// The solution.
    Done(Solution),
    /// Nothing: the cell waits for [`solve_together`].
    Waiting(Waiting),
}

/// A cell that needs its eigenvalues.
#[derive(Clone, Copy, Debug, Default)]
pub struct Waiting {
    qef: Qef,
    exact: DVec3,
    has_normals: bool,
}

/// Tries the cheap paths. What waits is solved several at a time, faster than one by one.
#[inline]
#[must_use]
pub fn begin(hits: &[Hit], options: &QefOptions) -> Attempt {
    let bundle = Bundle::gather(hits);
    let mut qef = None;
    let (path, free) = by_cheap_paths(&bundle, hits, &mut qef, options);
    if let Some((free, rank)) = free {
        let position = bundle.with_exact_coordinates(free);
        if contains(options, position) {
            return Attempt::Done(Solution { position, rank, path, clamped: false });
        }
    }
    let qef = qef.unwrap_or_else(|| accumulate(hits));
    Attempt::Waiting(Waiting { qef, exact: bundle.exact, has_normals: bundle.normals > 0 })
}

/// The vertex, as if there were no box, and its rank, if a cheap path surely tells; with the sums that it
/// took.
#[inline]
fn by_cheap_paths(
    bundle: &Bundle,
    hits: &[Hit],
    qef: &mut Option<Qef>,
    options: &QefOptions,
) -> (Path, Option<(DVec3, u8)>) {
    match bundle.normals {
        0 => (Path::Mass, Some((bundle.mass_point, 0))),
        1 => (Path::Plane, bundle.closed_form(options)),
        2 => (Path::TwoPlanes, bundle.closed_form(options)),
        3 => (Path::ThreePlanes, bundle.closed_form(options)),
        _ => (Path::Ldl, full_rank(qef.insert(accumulate(hits)), bundle.mass_point, options)),
    }
}

/// The vertex of [`solve`] if the box leaves it alone, sooner than that.
#[inline]
#[must_use]
pub fn solve_inside(hits: &[Hit], options: &QefOptions) -> Option<DVec3> {
    let bundle = Bundle::gather(hits);
    let mut qef = None;
    let (_, free) = by_cheap_paths(&bundle, hits, &mut qef, options);
    let free = free.map_or_else(
        || {
            let qef = qef.unwrap_or_else(|| accumulate(hits));
            let (spectrum, m) = (Spectrum::of(&qef.ata), qef.mass_point());
            m + spectrum.solve(spectrum.rank(options.cutoff()), qef.residual(m))
        },
        |(free, _)| free,
    );
    let position = bundle.with_exact_coordinates(free);
    contains(options, position).then_some(position)
}

/// Where up to three planes meet, one hit of each: the point of theirs nearest to the middle of the hits, if
/// it is in the box, and if their normals differ enough for [`solve`] to say so. Sooner than that.
#[inline]
#[must_use]
pub fn meet(planes: &[Hit], options: &QefOptions) -> Option<DVec3> {
    let bundle = Bundle::gather(planes);
    if usize::from(bundle.normals) != planes.len() {
        return None;
    }
    match bundle.closed_form(options) {
        Some((free, _)) => {
            Some(bundle.with_exact_coordinates(free)).filter(|at| contains(options, *at))
        }
        // Near the cut the eigenvalues decide.
        None if planes.len() == 3 => {
            let met = solve(planes, options);
            (!met.clamped && met.rank == 3).then_some(met.position)
        }
        None => None,
    }
}

/// Places the vertex of a cell whose hits all have one normal: the same as [`begin`], sooner.
#[inline]
#[must_use]
pub fn solve_flat(points: &[DVec3], unit_normal: DVec3, options: &QefOptions) -> Option<Solution> {
    let bundle = Bundle::flat(points, unit_normal)?;
    let (free, rank) = bundle.closed_form(options)?;
    let position = bundle.with_exact_coordinates(free);
    contains(options, position).then_some(Solution {
        position,
        rank,
        path: Path::Plane,
        clamped: false,
    })
}

/// Steps to the largest eigenvalue's vector: each takes away all but the cut-off of what is wrong.
const POWER_STEPS: usize = 4;

/// Places the vertex of a cell whose normals differ by less than the crease angle, up to sign: the
/// same as [`begin`] up to rounding, sooner. `None` where it is not surely that.
#[inline]
#[must_use]
pub fn solve_smooth(hits: &[Hit], options: &QefOptions) -> Option<Solution> {
    let mut qef = Qef::default();
    for hit in hits {
        // Planes across an axis keep their coordinate: that is for the other paths.
        if !is_usable(hit.normal) || hit.normal.abs().max_element() == 1.0 {
            return None;
        }
        qef.add_plane(hit.point, hit.normal);
    }
    let m = qef.mass_point();
    let mut along = hits[0].normal;
    let mut grown = along;
    for _ in 0..POWER_STEPS {
        grown = apply(&qef.ata, along);
        along = grown * grown.length_squared().sqrt().recip();
    }
    // Of unit length before the last step, so that grew by the eigenvalue.
    let largest = grown.length_squared().sqrt();
    let position = m + along * (along.dot(qef.residual(m)) / largest);
    contains(options, position).then_some(Solution {
        position,
        rank: 1,
        path: Path::Jacobi,
        clamped: false,
    })
}

/// The solution of a quadric of full rank; `None` where it is not surely that.
#[inline]
fn full_rank(qef: &Qef, mass_point: DVec3, options: &QefOptions) -> Option<(DVec3, u8)> {
    is_full_rank(&qef.ata, options.cutoff())
        .then(|| (mass_point + ldl::solve(&qef.ata, qef.residual(mass_point)), 3))
}

/// The reference path, and the only one that ends at the border of the box.
#[must_use]
pub fn solve_together<const N: usize>(cells: &[Waiting; N], options: &QefOptions) -> [Solution; N] {
    let spectra = Spectrum::of_all(&cells.each_ref().map(|cell| cell.qef.ata));
    std::array::from_fn(|lane| {
        let Waiting { qef, exact, has_normals } = &cells[lane];
        let free = by_spectrum(qef, &spectra[lane], options);
        let position = with_exact_coordinates(*exact, free.position);
        let clamped = free.clamped || !contains(options, position);
        let path = if *has_normals { Path::Jacobi } else { Path::Mass };
        Solution { position: confine(options, position), path, clamped, ..free }
    })
}

/// Solves one quadric by its eigenvalues, and again inside the box if the answer is outside.
fn by_spectrum(qef: &Qef, spectrum: &Spectrum, options: &QefOptions) -> Solution {
    let m = qef.mass_point();
    let r = qef.residual(m);
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
        by_spectrum(self, &Spectrum::of(&self.ata), options)
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
            Bundle::gather(hits).closed_form(options).map(|(at, _)| at)
        }
    }
}
