//! What a look at each triangle tells: counts, box, area, volume, degenerates; and the tape.
//!
//! In:         a [`MeshSource`], read to its end.
//! Out:        the tape with corners, and with vertex numbers in formats that have them.
//! Invariant:  the degeneracy test is exact: a f64 filter with an error bound, then exact signs.
//! Source:     Shewchuk 1997 (adaptive precision), for the filter's bound and exact signs.

use crate::defect::{
    Defect, DefectKind, DegenerateTriangle, MOST_PLACES, Marks, NonfiniteTriangle,
};
use crate::geom::signs::{Signs, is_tame};
use crate::mesh::{Discarded, MeshSource, TriangleBatch};
use crate::monitor::Monitor;
use crate::store::StoreError;
use crate::verify::cone::{Compensated, Cone};
use crate::verify::intersect::Intersections;
use crate::verify::tape::{Tape, is_whole, stop_if_asked};
use crate::verify::{Proof, VerifyError, Vertices};

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
    /// Where cones are seen from: the first finite corner.
    origin: [f64; 3],
    area: Compensated,
    volume: Compensated,
    pub(crate) nonfinite_places: Vec<Defect>,
    pub(crate) degenerate_places: Vec<Defect>,
    /// Whether the last triangle is degenerate.
    is_degenerate: bool,
}

/// Whether all three corners are places.
#[inline]
pub(crate) fn is_finite(corners: &[[f64; 3]; 3]) -> bool {
    corners.iter().flatten().all(|x| x.is_finite())
}

/// Reads the file onto the tape, and marks degenerate triangles.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    tape: &mut Tape,
    (vertices, marks): (Vertices, Option<&Marks>),
    mut intersections: Option<&mut Intersections<'_>>,
    monitor: &dyn Monitor,
) -> Result<Intake, VerifyError<S::Error>> {
    let mut intake = Intake::default();
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).map_err(|source| VerifyError::Source { source })? {
        stop_if_asked(monitor)?;
        if vertices == Vertices::Positions {
            batch.indices.clear();
        }
        for (at, corners) in batch.corners.iter().enumerate() {
            let ids = batch.indices.get(at).copied();
            let number = intake.triangles;
            let cone = intake.add(corners, ids);
            intake.mark(number, marks)?;
            if let (Some(found), true) = (&mut intersections, cone.is_some_and(|c| c.has_area)) {
                found.add(number, ids, corners)?;
            }
            let is_finite = cone.is_some();
            tape.push_corners(*corners)?;
            if let Some(ids) = ids {
                tape.push_ids(if is_finite { ids } else { [0; 3] })?;
            }
        }
        monitor.advance(batch.len() as u64);
    }
    let listed = source.vertex_count().filter(|_| vertices == Vertices::Numbers);
    intake.close(listed, source.discarded());
    Ok(intake)
}

impl Intake {
    /// Counts a triangle; `None` if it has a corner at infinity. Its cone has an area if and only if
    /// it has one exactly.
    #[inline]
    pub(crate) fn add(&mut self, corners: &[[f64; 3]; 3], ids: Option<[u32; 3]>) -> Option<Cone> {
        let triangle = self.triangles;
        self.triangles += 1;
        self.is_degenerate = false;
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
            return None;
        }
        let [low, high] = self.bounds.get_or_insert_with(|| {
            self.origin = corners[0];
            [corners[0]; 2]
        });
        widen(low, high, corners);
        let mut cone = Cone::of(corners, self.origin);
        cone.has_area = cone.has_area || !is_flat(corners);
        self.area.add(cone.square.sqrt());
        self.volume.add(cone.volume);
        if ids.is_some_and(|ids| !is_whole(ids)) || !cone.has_area {
            self.degenerate += 1;
            self.is_degenerate = true;
            if self.degenerate_places.len() < MOST_PLACES {
                let defect = DegenerateTriangle { triangle, corners: *corners };
                self.degenerate_places.push(Defect::DegenerateTriangle(defect));
            }
        }
        Some(cone)
    }

    /// Marks the triangle that was counted last, of this number, if it is degenerate.
    #[inline]
    pub(crate) fn mark(&self, triangle: u64, marks: Option<&Marks>) -> Result<(), StoreError> {
        match marks {
            Some(marks) if self.is_degenerate => {
                marks.triangles(DefectKind::DegenerateTriangle, &[triangle as u32])
            }
            _ => Ok(()),
        }
    }

    /// Ends the file, which lists so many vertices.
    pub(crate) fn close(&mut self, listed: Option<u64>, discarded: Discarded) {
        self.vertices = match (self.vertices, listed) {
            (Some(named), listed) => Some(named.max(listed.unwrap_or(0))),
            (None, listed) => listed.filter(|_| self.triangles == 0),
        };
        self.discarded_faces = discarded.wild_index_faces + discarded.short_faces;
    }

    /// Enters what needs no topology.
    pub(crate) fn enter_into(&self, proof: &mut Proof) {
        proof.triangles = self.triangles;
        proof.nonfinite_triangles = self.nonfinite;
        proof.degenerate_triangles = self.degenerate;
        proof.discarded_faces = self.discarded_faces;
        proof.bounds = self.bounds;
        proof.area = self.area.value() / 2.0;
        proof.volume = self.volume.value() / 6.0;
    }
}

#[inline]
fn widen(low: &mut [f64; 3], high: &mut [f64; 3], corners: &[[f64; 3]; 3]) {
    for corner in corners {
        for axis in 0..3 {
            // Adding zero turns -0 into 0, so that the box does not depend on the order.
            low[axis] = low[axis].min(corner[axis]) + 0.0;
            high[axis] = high[axis].max(corner[axis]) + 0.0;
        }
    }
}

/// Whether the corners lie on one line, exactly.
#[cold]
fn is_flat(&[a, b, c]: &[[f64; 3]; 3]) -> bool {
    let signs = Signs { tame: [a, b, c].iter().all(is_tame) };
    (0..3).all(|axis| signs.turn(axis, a, b, c) == 0)
}
