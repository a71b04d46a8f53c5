//! The map of deviations: pixels wait on disk until the largest distance is known, then get colours.
//!
//! In:         [`Rows`], top down.
//! Out:        the same rows again, with those of the map.
//! Memory:     a quarter of the share; beyond that, scratch files without names.
//! Fails:      as [`PreviewError`].

use crate::report::preview::PreviewError;
use crate::report::preview::panels::{MapPixel, Rows};
use crate::report::preview::scale::Scale;
use crate::report::preview::shade::{BACKGROUND, to_srgb};
use crate::store::{Scratch, Sequence, StoreError};

/// Colours of the scale keep this share of their light in the darkest shade.
const AMBIENT: f64 = 0.5;

/// A map under way.
pub(crate) struct Map {
    pixels: Sequence<u8>,
    map: Sequence<MapPixel>,
    largest: f32,
}

impl Map {
    /// Nothing yet.
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let (pixels, map) =
            (Sequence::new(scratch, share_bytes / 8), Sequence::new(scratch, share_bytes / 8));
        Self { pixels, map, largest: 0.0 }
    }

    /// Keeps rows.
    pub(crate) fn keep(&mut self, rows: &Rows) -> Result<(), StoreError> {
        let distances = rows.map.iter().map(|pixel| pixel.distance);
        self.largest = distances.fold(self.largest, f32::max);
        self.pixels.extend(rows.pixels)?;
        self.map.extend(rows.map)
    }

    /// The largest distance so far.
    pub(crate) fn largest(&self) -> f64 {
        f64::from(self.largest)
    }

    /// Hands out row by row: the pixels of `width_px` before it, and `map_px` of the map.
    pub(crate) fn each_row<E: std::error::Error>(
        &self,
        scale: &Scale,
        (width_px, map_px): (u32, u32),
        mut write: impl FnMut(&[u8], &[[u8; 3]]) -> Result<(), PreviewError<E>>,
    ) -> Result<(), PreviewError<E>> {
        let (mut beside, mut coloured) = (Vec::new(), Vec::new());
        let rows = self.map.len() / u64::from(map_px.max(1));
        for row in 0..rows {
            let bytes = 3 * u64::from(width_px);
            read_row(&self.pixels, row * bytes, bytes, &mut beside)?;
            let mut map = Vec::new();
            read_row(&self.map, row * u64::from(map_px), map_px.into(), &mut map)?;
            coloured.clear();
            coloured.extend(map.iter().map(|pixel| colour_of(pixel, scale)));
            write(&beside, &coloured)?;
        }
        Ok(())
    }
}

fn read_row<R: bytemuck::Pod, E: std::error::Error>(
    sequence: &Sequence<R>,
    start: u64,
    count: u64,
    row: &mut Vec<R>,
) -> Result<(), PreviewError<E>> {
    let mut room = Vec::new();
    row.clear();
    while (row.len() as u64) < count {
        let at = row.len();
        let block = sequence.block(start + at as u64, count as usize - at, &mut room);
        row.extend_from_slice(block.map_err(PreviewError::measure)?);
    }
    Ok(())
}

/// The mean of a pixel's samples.
fn colour_of(pixel: &MapPixel, scale: &Scale) -> [u8; 3] {
    let (background, colour) = (to_srgb(BACKGROUND), scale.colour(pixel.distance.into()));
    let sample = |light: u8, channel: usize| match light {
        0 => f64::from(background[channel]),
        light => {
            f64::from(colour[channel]) * (AMBIENT + (1.0 - AMBIENT) * f64::from(light) / 255.0)
        }
    };
    std::array::from_fn(|channel| {
        let sum: f64 = pixel.lights.iter().map(|&light| sample(light, channel)).sum();
        (sum / pixel.lights.len() as f64).round() as u8
    })
}
