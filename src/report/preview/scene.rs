//! Streams both meshes: once for the bounds, and once more for every band.
//!
//! In:      two [`OpenSource`]s.
//! Out:     [`Camera`]s that fit, and triangles drawn into bands.
//! Memory:  one batch of the source.
//! Fails:   as [`PreviewError::Source`] and [`PreviewError::Cancelled`].

use glam::DVec3;

use crate::mesh::{MeshSource, Surface, TriangleBatch};
use crate::monitor::Monitor;
use crate::report::preview::camera::{Bounds, Camera, Frame};
use crate::report::preview::clip::clip;
use crate::report::preview::raster::{Band, Brush};
use crate::report::preview::shade;
use crate::report::preview::{PreviewError, PreviewOptions, Side, SideStats};
use crate::store::Scratch;

const PATCH_ENDING: &str = Surface::PATCH_ENDING;

/// Opens a mesh from its beginning; called again for every band.
pub type OpenSource<'a, E> = dyn Fn() -> Result<Box<dyn MeshSource<Error = E> + 'a>, E> + 'a;

/// What measuring may use besides memory.
#[derive(Clone, Copy)]
pub struct Measuring<'m> {
    /// Where files without names lie.
    pub scratch: &'m Scratch,
    /// Threads that measure; they change no number.
    pub threads: usize,
}

/// What is drawn, and by what means.
#[derive(Clone, Copy)]
pub struct Scene<'s, 'a, E> {
    /// The mesh before the repair.
    pub input: &'s OpenSource<'a, E>,
    /// The mesh after it, if there is one.
    pub output: Option<&'s OpenSource<'a, E>>,
    /// How deviations are measured; none are if `None`.
    pub measuring: Option<Measuring<'s>>,
    /// Asked between batches.
    pub monitor: &'s dyn Monitor,
}

/// A triangle as it is seen, for those who paint.
pub(crate) struct Face {
    /// Linear light.
    pub(crate) colour: [f32; 3],
    /// How bright it is lit, 0 to 1.
    pub(crate) light: f32,
    /// The unit normal in model space.
    pub(crate) normal: DVec3,
    /// The unit normal as the viewer sees it, turned towards the viewer.
    pub(crate) seen: DVec3,
    /// Whose it is.
    pub(crate) owner: Owner,
}

/// What a file says of a triangle besides its corners.
#[derive(Clone, Copy)]
pub(crate) struct Owner {
    /// Index into the parts of the source.
    pub(crate) part: u32,
    /// Index into its materials.
    pub(crate) material: u32,
    /// Whether the name of the material tells that it closes an opening; only where it is asked.
    pub(crate) is_patch: bool,
}

/// Turns a face into what a sample stores.
pub(crate) struct Painter<P> {
    /// Of a face, or of a line on it: the colour is the line's then.
    pub(crate) paint: fn(&Face) -> P,
    /// Width of the lines along edges, in samples.
    pub(crate) line_width: Option<f64>,
    /// Whether materials are asked for patches.
    pub(crate) asks_patches: bool,
}

impl<'a, E: std::error::Error> Scene<'_, 'a, E> {
    /// The bounds along each frame: of the output, or of the input where the output is empty.
    fn bounds(&self, frames: &[Frame]) -> Result<Vec<Bounds>, PreviewError<E>> {
        let mut bounds = vec![Bounds::EMPTY; frames.len()];
        for side in [Side::Output, Side::Input] {
            self.stream(side, false, |corners, _| {
                let mut used = true;
                for (bounds, frame) in bounds.iter_mut().zip(frames) {
                    used &= bounds.add(frame, corners);
                }
                used
            })?;
            if bounds.iter().any(|bounds| !bounds.is_empty()) {
                break;
            }
        }
        Ok(bounds)
    }

    /// One camera per view, row by row; each fits its view (size in samples).
    pub(crate) fn cameras(
        &self,
        options: &PreviewOptions,
        size: (u32, u32),
    ) -> Result<Vec<Camera>, PreviewError<E>> {
        let frames = Frame::all(options.views, options.up);
        let bounds = self.bounds(&frames)?;
        let fit = |(&frame, bounds)| Camera::new(frame, bounds, size);
        Ok(frames.iter().zip(&bounds).map(fit).collect())
    }

    /// Draws one side into bands that stand beside each other, each with its camera.
    pub(crate) fn draw<P: Copy>(
        &self,
        side: Side,
        bands: &mut [(Camera, Band<P>)],
        painter: &Painter<P>,
    ) -> Result<SideStats, PreviewError<E>> {
        let mut stats = self.stream(side, painter.asks_patches, |corners, owner| {
            let normal = normal_of(corners);
            let mut drawn = true;
            for (camera, band) in &mut *bands {
                drawn &= draw_face(camera, band, corners, painter, |back| {
                    let seen = camera.turn(if back { -normal } else { normal });
                    let light = shade::light(side, back, seen);
                    let colour = shade::shade(side, back, light);
                    Face { colour, light, normal, seen, owner }
                });
            }
            drawn
        })?;
        for sample in bands.iter().flat_map(|(_, band)| band.own_samples()) {
            let seen = sample.depth.is_finite();
            stats.front_samples += u64::from(seen && !sample.back);
            stats.back_samples += u64::from(seen && sample.back);
        }
        Ok(stats)
    }

    /// A side from its beginning, if there is one.
    pub(crate) fn open(
        &self,
        side: Side,
    ) -> Result<Option<Box<dyn MeshSource<Error = E> + 'a>>, PreviewError<E>> {
        let open = match side {
            Side::Input => Some(self.input),
            Side::Output => self.output,
        };
        let failed = |source| PreviewError::Source { side, source };
        open.map(|open| open().map_err(failed)).transpose()
    }

    /// Calls `take` for every triangle with finite corners; it tells whether it could use it.
    fn stream(
        &self,
        side: Side,
        asks_patches: bool,
        mut take: impl FnMut(&[DVec3; 3], Owner) -> bool,
    ) -> Result<SideStats, PreviewError<E>> {
        let mut stats = SideStats::default();
        let failed = |source| PreviewError::Source { side, source };
        let Some(mut source) = self.open(side)? else { return Ok(stats) };
        let mut batch = TriangleBatch::default();
        // The material that was asked for last, and whether it is one of patches.
        let mut last = None;
        while source.next_batch(&mut batch).map_err(failed)? {
            if self.monitor.cancelled() {
                return Err(PreviewError::Cancelled);
            }
            stats.triangles += batch.len() as u64;
            let owners = batch.parts.iter().zip(&batch.materials);
            for (corners, (&part, &material)) in batch.corners.iter().zip(owners) {
                let is_patch = match last {
                    _ if !asks_patches => false,
                    Some((number, is_patch)) if number == material => is_patch,
                    _ => source.material(material).map_err(failed)?.name.ends_with(PATCH_ENDING),
                };
                last = Some((material, is_patch));
                let owner = Owner { part, material, is_patch };
                let corners = corners.map(DVec3::from_array);
                let finite = corners.iter().all(|corner| corner.is_finite());
                stats.skipped_triangles += u64::from(!(finite && take(&corners, owner)));
            }
        }
        Ok(stats)
    }
}

/// Projects, cuts and fills one triangle; false when it lies too far off to be projected.
fn draw_face<P: Copy>(
    camera: &Camera,
    band: &mut Band<P>,
    corners: &[DVec3; 3],
    painter: &Painter<P>,
    face: impl Fn(bool) -> Face,
) -> bool {
    let projected = corners.map(|corner| camera.project(corner));
    let near_enough =
        projected.iter().all(|at| at.x.is_finite() && at.y.is_finite() && at.depth.is_finite());
    if !near_enough {
        return false;
    }
    clip(projected, |piece| {
        band.draw(piece, |back| {
            let mut face = face(back);
            let plain = (painter.paint)(&face);
            let line = painter.line_width.map(|width| {
                face.colour = shade::line(face.colour);
                ((painter.paint)(&face), width)
            });
            Brush { face: plain, line }
        });
    });
    true
}

/// The unit normal; zero for a triangle without area.
fn normal_of(corners: &[DVec3; 3]) -> DVec3 {
    let [a, b, c] = *corners;
    // Scaled first: products of tiny or huge edges would leave the range of f64.
    let size = (b - a).abs().max((c - a).abs()).max_element();
    ((b - a) / size).cross((c - a) / size).normalize_or_zero()
}
