//! What views show as numbers: each view of each side in bands, measured, and kept in order.
//!
//! In:         a [`Scene`]; one sample per pixel, because depths and numbers cannot be averaged.
//! Out:        a sequence of [`Texel`]s: side after side, view after view, row after row.
//! Invariant:  the same texels whatever the share and the threads.
//! Memory:     half of the share beside what a [`Ruler`] has: bands, and texels until they go to disk.
//! Fails:      as [`PreviewError`].

use bytemuck::{Pod, Zeroable};

use crate::report::preview::camera::Camera;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::raster::{Band, Sample};
use crate::report::preview::scene::{Face, Painter, Scene};
use crate::report::preview::shade::BACKGROUND;
use crate::report::preview::{PatchRule, PreviewError, PreviewOptions, Side, SideStats};
use crate::store::Sequence;

/// Part, material and patch of a pixel that shows nothing; patch where it is not known.
pub(crate) const NO_PART: u32 = u32::MAX;
/// Width of the lines along edges, half a pixel on each side of the edge.
const LINE_SAMPLES: f64 = 0.5;
/// Points that are measured at a time.
const MOST_POINTS: usize = 1 << 14;

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Texel {
    /// Linear light.
    pub(crate) colour: [f32; 3],
    /// Unit normal in model space; zero where nothing is.
    pub(crate) normal: [f32; 3],
    /// Model units from the near end of the view; infinite where nothing is.
    pub(crate) depth: f32,
    /// Model units from the other side; infinite where nothing is, NaN where nothing is measured.
    pub(crate) deviation: f32,
    /// Index into the parts of the file.
    pub(crate) part: u32,
    /// Index into its materials.
    pub(crate) material: u32,
    /// 1 where it closes an opening, else 0.
    pub(crate) patch: u32,
}

const NOTHING: Texel = Texel {
    colour: BACKGROUND,
    normal: [0.0; 3],
    depth: f32::INFINITY,
    deviation: f32::INFINITY,
    part: NO_PART,
    material: NO_PART,
    patch: NO_PART,
};

impl Texel {
    fn of(face: &Face) -> Self {
        Self {
            colour: face.colour,
            normal: face.normal.as_vec3().to_array(),
            depth: 0.0,
            deviation: f32::NAN,
            part: face.owner.part,
            material: face.owner.material,
            patch: face.owner.is_patch.into(),
        }
    }
}

/// Memory for one row of a band.
pub(crate) fn row_bytes(options: &PreviewOptions) -> u64 {
    u64::from(options.width_px) * size_of::<Sample<Texel>>() as u64
}

/// The views on their way into a sequence.
pub(crate) struct Texels<'t, 's, 'a, E> {
    /// What is drawn.
    pub(crate) scene: &'t Scene<'s, 'a, E>,
    /// How; the share is that for bands.
    pub(crate) options: &'t PreviewOptions,
    /// The views.
    pub(crate) cameras: &'t [Camera],
    /// What measures, if anything does.
    pub(crate) ruler: Option<&'t Ruler<'s>>,
}

type View = (Camera, Band<Texel>);

impl<E: std::error::Error> Texels<'_, '_, '_, E> {
    /// Draws all views of a side; what was drawn, and how many bands that took.
    pub(crate) fn draw(
        &self,
        side: Side,
        texels: &mut Sequence<Texel>,
    ) -> Result<(SideStats, u32), PreviewError<E>> {
        let PreviewOptions { width_px, height_px, share_bytes, .. } = *self.options;
        let row_bytes = row_bytes(self.options);
        let view_bytes = row_bytes * u64::from(height_px);
        let views = (share_bytes / view_bytes).max(1) as usize;
        let rows = (share_bytes / row_bytes).clamp(1, height_px.into()) as usize;
        let (width, height) = (width_px as usize, height_px as usize);
        let painter = Painter {
            paint: Texel::of,
            line_width: self.options.edges.then_some(LINE_SAMPLES),
            asks_patches: side == Side::Output && self.options.patches == PatchRule::Tagged,
        };
        let (mut stats, mut bands) = (SideStats::default(), 0);
        for cameras in self.cameras.chunks(views) {
            let beside = |&camera| (camera, Band::new(width, rows, NOTHING));
            let mut views: Vec<View> = cameras.iter().map(beside).collect();
            for first in (0..height).step_by(rows) {
                let held = first..height.min(first + rows);
                for (_, band) in &mut views {
                    band.restart(held.clone(), held.clone(), NOTHING);
                }
                let drawn = self.scene.draw(side, &mut views, &painter)?;
                stats = SideStats {
                    front_samples: stats.front_samples + drawn.front_samples,
                    back_samples: stats.back_samples + drawn.back_samples,
                    ..drawn
                };
                bands += 1;
                for view in &views {
                    self.keep(side, view, texels)?;
                }
            }
        }
        Ok((stats, bands))
    }

    /// Measures the samples of a view, and appends them.
    fn keep(
        &self,
        side: Side,
        (camera, band): &View,
        texels: &mut Sequence<Texel>,
    ) -> Result<(), PreviewError<E>> {
        let (mut points, mut done) = (Vec::new(), Vec::new());
        for (number, samples) in band.samples.chunks(MOST_POINTS).enumerate() {
            points.clear();
            done.clear();
            for (i, sample) in samples.iter().enumerate() {
                let at = number * MOST_POINTS + i;
                let (x, y) = (at % band.width, band.first_row + at / band.width);
                if sample.depth.is_finite() {
                    let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
                    points.push(camera.unproject(x, y, sample.depth.into()).to_array());
                }
                done.push(Texel { depth: camera.distance_world(sample.depth), ..sample.paint });
            }
            if let Some(ruler) = self.ruler {
                let shown = done.iter_mut().filter(|texel| texel.depth.is_finite());
                for (texel, distance) in shown.zip(ruler.distances(side, &points)?) {
                    texel.deviation = distance as f32;
                }
            }
            done.iter_mut().for_each(|texel| self.tell_patch(side, texel));
            texels.extend(&done).map_err(PreviewError::measure)?;
        }
        Ok(())
    }

    /// Says whether what it shows is a patch. The input has none.
    fn tell_patch(&self, side: Side, texel: &mut Texel) {
        if side == Side::Input || !texel.depth.is_finite() {
            return;
        }
        texel.patch = match self.options.patches {
            PatchRule::Tagged => texel.patch,
            PatchRule::Beyond(length) if !texel.deviation.is_nan() => {
                u32::from(f64::from(texel.deviation) > length)
            }
            PatchRule::Beyond(_) | PatchRule::Unknown => NO_PART,
        };
    }
}
