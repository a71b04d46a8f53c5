//! The PNG: input left, output beside it, and right of that the map of deviations with its legend.
//!
//! In:         a [`Scene`].
//! Out:        an 8-bit sRGB picture: panels of `columns x width` by `rows x height`, with lines between
//!             them.
//! Invariant:  the same bytes whatever the share and the threads.
//! Memory:     the share: a band without a map; with one a quarter for the band, a quarter for the rows
//!             that wait, half for measuring. The compressor adds a fixed state of less than a megabyte.
//! Fails:      as [`PreviewError`].

use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::report::image_staged::StagedFile;
use crate::report::preview::legend::{Legend, WIDTH_PX};
use crate::report::preview::map::Map;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::panels::{Layout, SEPARATOR_PX, draw_bands};
use crate::report::preview::scale::Scale;
use crate::report::preview::scene::Scene;
use crate::report::preview::shade::{SEPARATOR, to_srgb};
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats, Side};
use crate::store::Scratch;

/// Writes the picture.
pub(crate) fn write_png<E: std::error::Error>(
    path: &Path,
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<E>> {
    let ruler = Ruler::read(
        scene,
        (scene.measuring, scene.monitor),
        &[Side::Output],
        options.share_bytes / 2,
    )?;
    let beside = scene.measuring.as_ref().zip(ruler.as_ref());
    let share_bytes = if beside.is_some() { options.share_bytes / 4 } else { options.share_bytes };
    let drawing = PreviewOptions { share_bytes, ..*options };
    let layout = Layout::new(&drawing, beside.is_some())?;
    let mut stats = PreviewStats::default();
    let staged = StagedFile::create(path)?;
    match beside {
        Some((measuring, ruler)) => {
            let frame = Framed { scene, options, drawing, layout, ruler };
            frame.write(measuring.scratch, &staged, &mut stats)?;
        }
        None => write_pair(scene, &drawing, &layout, &staged, &mut stats)?,
    }
    stats.bytes = staged.put_in_place()?;
    Ok(stats)
}

/// Writes before and after, row by row while bands are drawn.
fn write_pair<E: std::error::Error>(
    scene: &Scene<'_, '_, E>,
    drawing: &PreviewOptions,
    layout: &Layout,
    staged: &StagedFile,
    stats: &mut PreviewStats,
) -> Result<(), PreviewError<E>> {
    let cameras = scene.cameras(drawing, Layout::samples_of_view(drawing))?;
    (stats.width_px, stats.height_px) = (layout.width_px, layout.height_px);
    encode(staged, (layout.width_px, layout.height_px), |rows| {
        draw_bands(scene, drawing, (layout, &cameras, None), stats, |drawn| {
            rows.write_all(drawn.pixels).map_err(|source| staged.failed(source))
        })
    })
}

/// A picture with a map.
struct Framed<'p, 's, 'a, E> {
    scene: &'p Scene<'s, 'a, E>,
    options: &'p PreviewOptions,
    drawing: PreviewOptions,
    layout: Layout,
    ruler: &'p Ruler<'s>,
}

impl<E: std::error::Error> Framed<'_, '_, '_, E> {
    /// Draws everything, then writes it with the colours of the map.
    fn write(
        &self,
        scratch: &Scratch,
        staged: &StagedFile,
        stats: &mut PreviewStats,
    ) -> Result<(), PreviewError<E>> {
        let Self { scene, options, drawing, layout, ruler } = self;
        let cameras = scene.cameras(drawing, Layout::samples_of_view(drawing))?;
        let mut map = Map::new(scratch, options.share_bytes);
        draw_bands(scene, drawing, (layout, &cameras, Some(ruler)), stats, |rows| {
            map.keep(&rows).map_err(PreviewError::measure)
        })?;
        let scale = Scale::reaching(map.largest(), ruler.diagonal());
        let legend = Legend::new(&scale, ruler.unit(), layout.height_px);
        stats.width_px = layout.width_px + SEPARATOR_PX + layout.side_px + WIDTH_PX;
        stats.height_px = layout.height_px;
        stats.largest_deviation = Some(map.largest());
        let separator = [to_srgb(SEPARATOR); SEPARATOR_PX as usize];
        encode(staged, (stats.width_px, stats.height_px), |out| {
            let mut row = 0;
            let widths = (layout.width_px, layout.side_px);
            map.each_row(&scale, widths, |beside, coloured| {
                let parts = [
                    beside,
                    separator.as_flattened(),
                    coloured.as_flattened(),
                    legend.row(row).as_flattened(),
                ];
                row += 1;
                let mut parts = parts.iter();
                parts
                    .try_for_each(|part| out.write_all(part))
                    .map_err(|source| staged.failed(source))
            })
        })
    }
}

/// Writes a PNG of that size, whose rows `draw` hands over.
fn encode<E: std::error::Error>(
    staged: &StagedFile,
    (width_px, height_px): (u32, u32),
    draw: impl FnOnce(&mut dyn Write) -> Result<(), PreviewError<E>>,
) -> Result<(), PreviewError<E>> {
    let failed = |error: png::EncodingError| staged.failed(io::Error::from(error));
    let mut file = BufWriter::new(staged.file());
    let mut encoder = png::Encoder::new(&mut file, width_px, height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut rows = writer.stream_writer().map_err(failed)?;
    draw(&mut rows)?;
    rows.finish().map_err(failed)?;
    writer.finish().map_err(failed)?;
    file.flush().map_err(|source| staged.failed(source))
}
