//! Input and output as two pictures of one camera, in memory.
//!
//! In:         a [`Scene`]. Out: two [`Picture`]s of the same size, and a third one of the map.
//! Memory:     the pictures; the bands take what is left of the share.
//! Fails:      as [`PreviewError`].

use std::io;

use crate::report::preview::map::Map;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::panels::{Layout, Rows, draw_bands};
use crate::report::preview::scale::Scale;
use crate::report::preview::scene::Scene;
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats};

/// Pixels, three bytes each (sRGB), row after row.
pub(crate) struct Picture {
    /// Pixels of a row.
    pub(crate) width_px: u32,
    /// Rows.
    pub(crate) height_px: u32,
    /// All rows.
    pub(crate) bytes: Vec<u8>,
}

/// Draws both sides, and what a map needs where there is a `ruler`.
pub(crate) fn draw_pair<E: std::error::Error>(
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
    ruler: Option<&Ruler>,
) -> Result<([Picture; 2], Option<Map>), PreviewError<E>> {
    let held = 6 * u64::from(options.width_px) * u64::from(options.height_px);
    let share_bytes = options.share_bytes.saturating_sub(held);
    let options = PreviewOptions { share_bytes, ..*options };
    let layout = Layout::new(&options, ruler.is_some())?;
    let size = Layout::samples_of_view(&options);
    let cameras = scene.cameras(&options, size)?;
    let side_px = layout.side_px;
    let empty = || Picture { width_px: side_px, height_px: layout.height_px, bytes: Vec::new() };
    let mut pair = [empty(), empty()];
    let measuring = scene.measuring.filter(|_| ruler.is_some());
    let mut map = measuring.map(|measuring| Map::new(measuring.scratch, share_bytes));
    let row_bytes = 3 * layout.width_px as usize;
    let mut stats = PreviewStats::default();
    draw_bands(scene, &options, (&layout, &cameras, ruler), &mut stats, |rows| {
        for row in rows.pixels.chunks_exact(row_bytes) {
            let side_bytes = 3 * side_px as usize;
            pair[0].bytes.extend_from_slice(&row[..side_bytes]);
            pair[1].bytes.extend_from_slice(&row[row_bytes - side_bytes..]);
        }
        let of_map = Rows { pixels: &[], map: rows.map };
        map.as_mut().map_or(Ok(()), |map| map.keep(&of_map)).map_err(PreviewError::measure)
    })?;
    Ok((pair, map))
}

/// A map as a picture as wide as the others.
pub(crate) fn colour_map<E: std::error::Error>(
    map: &Map,
    scale: &Scale,
    width_px: u32,
) -> Result<Picture, PreviewError<E>> {
    let mut picture = Picture { width_px, height_px: 0, bytes: Vec::new() };
    map.each_row(scale, (0, width_px), |_, coloured| {
        picture.height_px += 1;
        picture.bytes.extend_from_slice(coloured.as_flattened());
        Ok(())
    })?;
    Ok(picture)
}

impl Picture {
    /// As a PNG file.
    pub(crate) fn encode(&self) -> io::Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width_px, self.height_px);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(io::Error::from)?;
        writer.write_image_data(&self.bytes).map_err(io::Error::from)?;
        writer.finish().map_err(io::Error::from)?;
        Ok(file)
    }

    /// Smaller by a whole factor, each pixel the mean of those that it stands for; what is left over
    /// at the right and below goes.
    pub(crate) fn shrunk(&self, factor: u32) -> Self {
        let factor = factor.max(1);
        let (width_px, height_px) = (self.width_px / factor, self.height_px / factor);
        let mut bytes = Vec::with_capacity(3 * width_px as usize * height_px as usize);
        let stride = 3 * self.width_px as usize;
        for y in 0..height_px as usize {
            for x in 0..width_px as usize {
                for channel in 0..3 {
                    let block = (0..factor as usize * factor as usize).map(|k| {
                        let (i, j) = (k % factor as usize, k / factor as usize);
                        let (column, row) = (x * factor as usize + i, y * factor as usize + j);
                        u32::from(self.bytes[row * stride + 3 * column + channel])
                    });
                    let pixels = factor * factor;
                    bytes.push(((block.sum::<u32>() + pixels / 2) / pixels) as u8);
                }
            }
        }
        Self { width_px, height_px, bytes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_picture_has_the_means() {
        let bytes = (0..5 * 4).flat_map(|pixel| [pixel * 10, 7, 0]).collect();
        let small = Picture { width_px: 5, height_px: 4, bytes }.shrunk(2);
        assert_eq!((small.width_px, small.height_px), (2, 2));
        assert_eq!(small.bytes[..6], [30, 7, 0, 50, 7, 0]);
    }
}
