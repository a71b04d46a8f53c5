//! Reads a surface: its triangles with finite corners, in file order, and its size.
//!
//! Memory:     an eighth of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::{DeviateError, Means};
use crate::geom::mix;
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

    /// Its normal, twice as long as its area is large.
    #[inline]
    pub(crate) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.points();
        (b - a).cross(c - a)
    }
}

/// A hash of numbers, the same for both zeros.
pub(crate) fn hash_of<'n>(numbers: impl IntoIterator<Item = &'n f64>) -> u64 {
    numbers.into_iter().fold(0, |bits, x| mix(bits ^ (x + 0.0).to_bits()))
}

/// A surface that was read.
pub(crate) struct Tape {
    pub(crate) triangles: Sequence<Triangle>,
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

/// Reads `source` to its end.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    means: &Means<'_>,
) -> Result<Tape, DeviateError<S::Error>> {
    read_with(source, means, |_, _| Ok(()))
}

/// The same; `note` hears of each triangle with the number of its part.
pub(crate) fn read_with<S: MeshSource + ?Sized>(
    source: &mut S,
    means: &Means<'_>,
    mut note: impl FnMut(u32, &Triangle) -> Result<(), StoreError>,
) -> Result<Tape, DeviateError<S::Error>> {
    let failed = |source| DeviateError::Source { source };
    let mut triangles = Sequence::new(means.scratch, means.share_bytes / 8);
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut area = 0.0;
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
            for (corner, axis) in corners.iter().flat_map(|c| (0..3).map(move |axis| (c, axis))) {
                bounds[0][axis] = bounds[0][axis].min(corner[axis]);
                bounds[1][axis] = bounds[1][axis].max(corner[axis]);
            }
            let number = triangles.len() as u32;
            let triangle = Triangle { corners: *corners, number, is_pane: u32::from(is_pane) };
            area += triangle.normal().length() / 2.0;
            note(part, &triangle)?;
            triangles.push(triangle)?;
        }
        means.monitor.advance(batch.len() as u64);
    }
    Ok(Tape { triangles, bounds, area })
}
