//! Reads a surface: its triangles with finite corners, in file order, its size, and which of its
//! triangles lie beside those before them.
//!
//! Memory:     three sixteenths of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::runs::{Run, Runs};
use crate::deviate::{DeviateError, Means};
use crate::geom::mix_words;
use crate::mesh::{MeshSource, TriangleBatch};
use crate::store::{Sequence, StoreError};

/// Triangles at one time on their way from a tape.
pub(crate) const BLOCK: usize = 1024;

/// A triangle as it was read.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) corners: [[f64; 3]; 3],
    /// Its number among those with finite corners.
    pub(crate) number: u32,
    /// 1 where light passes, else 0.
    pub(crate) is_pane: u32,
}

impl Triangle {
    #[inline]
    pub(crate) fn points(&self) -> [DVec3; 3] {
        let [a, b, c] = self.corners;
        [DVec3::from_array(a), DVec3::from_array(b), DVec3::from_array(c)]
    }

    /// Its area.
    #[inline]
    pub(crate) fn area(&self) -> f64 {
        self.normal().length() / 2.0
    }

    /// Its normal, twice as long as its area is large.
    #[inline]
    pub(crate) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.points();
        (b - a).cross(c - a)
    }
}

/// A hash of numbers, the same for both zeros.
#[inline]
pub(crate) fn hash_of(numbers: &[f64]) -> u64 {
    mix_words(numbers.iter().map(|x| (x + 0.0).to_bits()))
}

/// A surface that was read.
pub(crate) struct Tape {
    pub(crate) triangles: Sequence<Triangle>,
    /// All triangles again, in runs of neighbours.
    pub(crate) runs: Sequence<Run>,
    /// Lowest and highest corner.
    pub(crate) bounds: [[f64; 3]; 2],
    pub(crate) area: f64,
}

impl Tape {
    /// Whether distances within the surface have squares, and its area is one.
    pub(crate) fn is_measurable(&self) -> bool {
        let [low, high] = self.bounds.map(DVec3::from);
        let square = (high - low).length_squared();
        self.area.is_normal() && square.is_normal() && (square * square).is_finite()
    }
}

/// A tape while triangles come.
pub(crate) struct TapeWriter {
    triangles: Sequence<Triangle>,
    runs: Runs,
    low: DVec3,
    high: DVec3,
    area: f64,
}

impl TapeWriter {
    /// No triangles yet.
    pub(crate) fn new(means: &Means<'_>) -> Self {
        Self {
            triangles: Sequence::new(means.scratch, means.share_bytes / 8),
            runs: Runs::new(means),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            area: 0.0,
        }
    }

    /// Takes in a triangle with finite corners, and tells how it stands on the tape.
    pub(crate) fn push(
        &mut self,
        corners: &[[f64; 3]; 3],
        is_pane: bool,
    ) -> Result<Triangle, StoreError> {
        let number = self.triangles.len() as u32;
        let triangle = Triangle { corners: *corners, number, is_pane: u32::from(is_pane) };
        let [a, b, c] = triangle.points();
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
        let area = triangle.area();
        self.area += area;
        self.runs.add(&triangle, [low, high], area)?;
        self.triangles.push(triangle)?;
        Ok(triangle)
    }

    /// All that came.
    pub(crate) fn finish(self) -> Result<Tape, StoreError> {
        Ok(Tape {
            triangles: self.triangles,
            runs: self.runs.finish()?,
            bounds: [self.low.into(), self.high.into()],
            area: self.area,
        })
    }
}

/// Reads `source` to its end; `note` hears of each triangle with the number of its part.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    means: &Means<'_>,
    mut note: impl FnMut(u32, &Triangle) -> Result<(), StoreError>,
) -> Result<Tape, DeviateError<S::Error>> {
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
