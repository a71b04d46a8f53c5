//! The one pass over the file: counts, box, degenerate triangles, and the tape.
//!
//! In:         a [`MeshSource`], read to its end.
//! Out:        the tape with corners, and with vertex numbers in formats that have them.
//! Invariant:  the degeneracy test is exact: a f64 filter with an error bound, then exact signs.
//! Source:     Shewchuk 1997 (adaptive precision), for the filter's bound and for orient2d.

use robust::{Coord, orient2d};

use crate::defect::{Defect, DegenerateTriangle, NonfiniteTriangle};
use crate::mesh::{MeshSource, TriangleBatch};
use crate::monitor::Monitor;
use crate::store::StoreError;
use crate::verify::VerifyError;
use crate::verify::places::MOST_PLACES;
use crate::verify::tape::{Tape, is_whole};

/// What the pass found.
#[derive(Default)]
pub(crate) struct Intake {
    pub(crate) triangles: u64,
    pub(crate) nonfinite: u64,
    pub(crate) degenerate: u64,
    pub(crate) discarded_faces: u64,
    pub(crate) bounds: Option<[[f64; 3]; 2]>,
    /// One more than the largest vertex number, or what the file lists; `None` without numbers.
    pub(crate) vertices: Option<u64>,
    pub(crate) nonfinite_places: Vec<Defect>,
    pub(crate) degenerate_places: Vec<Defect>,
}

/// Whether all three corners are places.
#[inline]
pub(crate) fn is_finite(corners: &[[f64; 3]; 3]) -> bool {
    corners.iter().flatten().all(|x| x.is_finite())
}

/// Reads the file onto the tape.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    tape: &mut Tape,
    monitor: &dyn Monitor,
) -> Result<Intake, VerifyError<S::Error>> {
    let mut intake = Intake::default();
    let mut batch = TriangleBatch::default();
    let mut indexed = false;
    while source.next_batch(&mut batch).map_err(|source| VerifyError::Source { source })? {
        if monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        indexed |= !batch.indices.is_empty();
        for (at, corners) in batch.corners.iter().enumerate() {
            let ids = batch.indices.get(at).copied();
            intake.add(corners, ids, tape)?;
        }
        monitor.advance(batch.len() as u64);
    }
    let listed = source.vertex_count();
    intake.vertices = match (indexed, listed) {
        (true, _) => Some(intake.vertices.unwrap_or(0).max(listed.unwrap_or(0))),
        (false, Some(listed)) if intake.triangles == 0 => Some(listed),
        (false, _) => None,
    };
    let discarded = source.discarded();
    intake.discarded_faces = discarded.wild_index_faces + discarded.short_faces;
    Ok(intake)
}

impl Intake {
    #[inline]
    fn add(
        &mut self,
        corners: &[[f64; 3]; 3],
        ids: Option<[u32; 3]>,
        tape: &mut Tape,
    ) -> Result<(), StoreError> {
        let triangle = self.triangles;
        self.triangles += 1;
        tape.push_corners(*corners)?;
        if let Some(ids) = ids {
            let most = u64::from(ids[0].max(ids[1]).max(ids[2])) + 1;
            self.vertices = Some(self.vertices.map_or(most, |so_far| so_far.max(most)));
        }
        if !is_finite(corners) {
            self.nonfinite += 1;
            if self.nonfinite_places.len() < MOST_PLACES {
                let defect = Defect::NonfiniteTriangle(NonfiniteTriangle { triangle });
                self.nonfinite_places.push(defect);
            }
            return if ids.is_some() { tape.push_ids([0; 3]) } else { Ok(()) };
        }
        self.widen(corners);
        if ids.is_some_and(|ids| !is_whole(ids)) || is_degenerate(corners) {
            self.degenerate += 1;
            if self.degenerate_places.len() < MOST_PLACES {
                let defect = DegenerateTriangle { triangle, corners: *corners };
                self.degenerate_places.push(Defect::DegenerateTriangle(defect));
            }
        }
        ids.map_or(Ok(()), |ids| tape.push_ids(ids))
    }

    #[inline]
    fn widen(&mut self, corners: &[[f64; 3]; 3]) {
        let [low, high] = self.bounds.get_or_insert([corners[0]; 2]);
        for corner in corners {
            for axis in 0..3 {
                // Adding zero turns -0 into 0, so that the box does not depend on the order.
                low[axis] = low[axis].min(corner[axis]) + 0.0;
                high[axis] = high[axis].max(corner[axis]) + 0.0;
            }
        }
    }
}

/// Relative error bound of a 2 x 2 determinant of differences.
const ORIENT_BOUND: f64 = 3.4e-16;

/// Whether the corners lie on one line, exactly.
#[inline]
fn is_degenerate(&[a, b, c]: &[[f64; 3]; 3]) -> bool {
    let certain = |u: usize, v: usize| {
        let left = (b[u] - a[u]) * (c[v] - a[v]);
        let right = (b[v] - a[v]) * (c[u] - a[u]);
        (left - right).abs() > ORIENT_BOUND * (left.abs() + right.abs())
    };
    if certain(0, 1) || certain(1, 2) || certain(2, 0) {
        return false;
    }
    let flat = |u: usize, v: usize| {
        let at = |p: [f64; 3]| Coord { x: p[u], y: p[v] };
        orient2d(at(a), at(b), at(c)) == 0.0
    };
    flat(0, 1) && flat(1, 2) && flat(2, 0)
}
