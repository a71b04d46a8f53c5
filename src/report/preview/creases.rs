//! Dark lines in a picture: where the surface is creased, and where it ends before another one.
//!
//! In:         a [`Band`] of samples that know the normals of what they show.
//! Out:        whether a sample lies on a line.
//! Invariant:  depends on the samples up to [`REACH`] away alone. A place that is creased all over, as
//!             leaves of a tree are, has no lines: it would be black.
//! Units:      samples.
//! Source:     T. Saito, T. Takahashi, Comprehensible Rendering of 3-D Shapes, 1990 (lines from images
//!             of depths and normals).

use crate::report::preview::raster::{Band, Sample};

/// Samples that a line looks away from itself.
pub(crate) const REACH: usize = 2;
/// Cosine of the angle between the normals at a crease: 30 degrees, as where creases are measured.
const CREASE: f32 = 0.866_025_4;
/// Cosine of the angle up to which a surface is calm beside a line: 15 degrees.
const CALM: f32 = 0.965_925_8;
/// Where one surface lies so far behind the plane of another, it is another one.
const STEP_SAMPLES: f32 = 4.0;
/// Parts of a unit normal as whole numbers.
const UNIT: f32 = 127.0;

/// What a sample of a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shown {
    /// In sRGB.
    pub(crate) colour: [u8; 3],
    /// How bright it is lit.
    pub(crate) light: u8,
    /// The normal as the viewer sees it: x right, y up, z towards the viewer; 127 is 1.
    pub(crate) normal: [i8; 3],
}

impl Shown {
    /// The normal of a sample, from a unit vector.
    pub(crate) fn normal_of(seen: glam::DVec3) -> [i8; 3] {
        seen.to_array().map(|part| (part * f64::from(UNIT)).round() as i8)
    }

    fn cosine(&self, other: &Self) -> f32 {
        let parts = self.normal.iter().zip(other.normal);
        let sum: i32 = parts.map(|(one, other)| i32::from(*one) * i32::from(other)).sum();
        sum as f32 / (UNIT * UNIT)
    }

    /// How far from its plane a place lies that is so far right, down and behind.
    fn off_plane(&self, [right, down, behind]: [f32; 3]) -> f32 {
        let [x, y, z] = self.normal.map(|part| f32::from(part) / UNIT);
        (x * right - y * down - z * behind).abs()
    }
}

/// The lines of a band.
pub(crate) struct Lines<'b> {
    /// All its samples, with [`REACH`] rows more at each end where the view has them.
    pub(crate) band: &'b Band<Shown>,
    /// Samples from the near to the far end of the depths.
    pub(crate) depth_samples: f64,
}

impl Lines<'_> {
    /// Whether the sample in column `x` of row `y` of the band is on a line.
    pub(crate) fn has(&self, x: usize, y: usize) -> bool {
        let place = (x as isize, y as isize);
        let Some(here) = self.at(place) else { return false };
        [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().any(|way| self.is_parted(here, place, way))
    }

    /// Whether the sample and its neighbour show different faces, both of them calm.
    fn is_parted(&self, here: &Sample<Shown>, (x, y): (isize, isize), way: (isize, isize)) -> bool {
        let next = (x + way.0, y + way.1);
        let Some(there) = self.at(next) else { return false };
        let (one, other) = (&here.paint, &there.paint);
        let behind = (there.depth - here.depth) * self.depth_samples as f32;
        if one.cosine(other) >= CREASE {
            let to = [way.0 as f32, way.1 as f32, behind];
            let step = one.off_plane(to).min(other.off_plane(to));
            // What is behind has no line.
            if step < STEP_SAMPLES || behind < 0.0 {
                return false;
            }
        }
        self.is_calm(one, (x - way.0, y - way.1))
            && self.is_calm(other, (next.0 + way.0, next.1 + way.1))
    }

    fn is_calm(&self, shown: &Shown, beside: (isize, isize)) -> bool {
        self.at(beside).is_none_or(|sample| sample.paint.cosine(shown) >= CALM)
    }

    /// The sample there, if it shows anything.
    fn at(&self, (x, y): (isize, isize)) -> Option<&Sample<Shown>> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        let sample =
            (x < self.band.width).then(|| self.band.samples.get(y * self.band.width + x))??;
        sample.depth.is_finite().then_some(sample)
    }
}
