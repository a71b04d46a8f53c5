//! Reads a surface: its triangles with finite corners, in file order, its size, and which of its
//! triangles lie beside those before them.
//!
//! Memory:     three sixteenths of the share.

use glam::DVec3;

use crate::deviate::runs::{Run, Runs};
use crate::deviate::triangles::{BLOCK, Measured, Triangle, Triangles, each_of_soup};
use crate::deviate::{DeviateError, Means};
use crate::mesh::{MeshSource, TriangleBatch};
use crate::octree::SoupSpool;
use crate::store::{Sequence, StoreError};

/// A surface that was read.
pub(crate) struct Tape<'s> {
    pub(crate) triangles: Triangles<'s>,
    /// All triangles again, in runs of neighbours.
    pub(crate) runs: Sequence<Run>,
    /// Lowest and highest corner.
    pub(crate) bounds: [[f64; 3]; 2],
    pub(crate) area: f64,
}

impl Tape<'_> {
    /// Whether distances within the surface have squares, and its area is one.
    pub(crate) fn is_measurable(&self) -> bool {
        let [low, high] = self.bounds.map(DVec3::from);
        let square = (high - low).length_squared();
        self.area.is_normal() && square.is_normal() && (square * square).is_finite()
    }
}

/// What is known of triangles while they come.
struct Survey {
    runs: Runs,
    low: DVec3,
    high: DVec3,
    area: f64,
}

impl Survey {
    fn new(means: &Means<'_>) -> Self {
        let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        Self { runs: Runs::new(means), low, high, area: 0.0 }
    }

    fn add(&mut self, measured: &Measured) -> Result<(), StoreError> {
        let [a, b, c] = measured.triangle.points();
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
        self.area += measured.area;
        self.runs.add(measured, [low, high])
    }

    fn finish(self, triangles: Triangles<'_>) -> Result<Tape<'_>, StoreError> {
        let bounds = [self.low.into(), self.high.into()];
        Ok(Tape { triangles, runs: self.runs.finish()?, bounds, area: self.area })
    }
}

/// A tape while triangles come.
pub(crate) struct TapeWriter {
    triangles: Sequence<Triangle>,
    survey: Survey,
}

impl TapeWriter {
    /// No triangles yet.
    pub(crate) fn new(means: &Means<'_>) -> Self {
        let triangles = Sequence::new(means.scratch, means.share_bytes / 8);
        Self { triangles, survey: Survey::new(means) }
    }

    /// Takes in a triangle with finite corners, and tells what is known of it.
    pub(crate) fn push(
        &mut self,
        corners: &[[f64; 3]; 3],
        is_pane: bool,
    ) -> Result<Measured, StoreError> {
        let number = self.triangles.len() as u32;
        let triangle = Triangle { corners: *corners, number, is_pane: u32::from(is_pane) };
        let measured = Measured::new(triangle);
        self.survey.add(&measured)?;
        self.triangles.push(triangle)?;
        Ok(measured)
    }

    /// All that came.
    pub(crate) fn finish(self) -> Result<Tape<'static>, StoreError> {
        self.survey.finish(Triangles::Taped(self.triangles))
    }
}

/// Goes through a soup, which is finite, and leaves its triangles where they are; `note` hears of each.
pub(crate) fn survey_soup<'s>(
    spool: &'s SoupSpool,
    means: &Means<'_>,
    mut note: impl FnMut(&Measured) -> Result<(), StoreError>,
) -> Result<Tape<'s>, StoreError> {
    let mut survey = Survey::new(means);
    each_of_soup(spool, |triangle| {
        if u64::from(triangle.number).is_multiple_of(BLOCK as u64) {
            means.stop_if_asked()?;
            means.monitor.advance((spool.len() - u64::from(triangle.number)).min(BLOCK as u64));
        }
        let measured = Measured::new(*triangle);
        survey.add(&measured)?;
        note(&measured)
    })?;
    survey.finish(Triangles::Spooled(spool))
}

/// Reads `source` to its end; `note` hears of each triangle with the number of its part.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    means: &Means<'_>,
    mut note: impl FnMut(u32, &Measured) -> Result<(), StoreError>,
) -> Result<Tape<'static>, DeviateError<S::Error>> {
    let failed = |source| DeviateError::Source { source };
    let mut tape = TapeWriter::new(means);
    let mut batch = TriangleBatch::default();
    // The material that was asked for last, and whether light passes it.
    let mut last = None;
    while source.next_batch(&mut batch).map_err(failed)? {
        means.stop_if_asked()?;
        let marks = batch.materials.iter().zip(&batch.parts);
        for (corners, (&material, &part)) in batch.corners.iter().zip(marks) {
            if !corners.iter().flatten().all(|x| x.is_finite()) {
                continue;
            }
            let is_pane = match last {
                Some((number, is_pane)) if number == material => is_pane,
                _ => source.material(material).map_err(failed)?.transparent,
            };
            last = Some((material, is_pane));
            note(part, &tape.push(corners, is_pane)?)?;
        }
        means.monitor.advance(batch.len() as u64);
    }
    Ok(tape.finish()?)
}
