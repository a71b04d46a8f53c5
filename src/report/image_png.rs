//! The PNG: input left, output right, written row by row while bands are drawn.
//!
//! In:         a [`Scene`]; two by two samples make a pixel.
//! Out:        an 8-bit sRGB picture of `2 x columns x width + separator` by `rows x height`.
//! Invariant:  the same bytes whatever the share.
//! Memory:     the share: samples of one side of one band, and the band's finished rows. The
//!             compressor adds a fixed state of less than a megabyte.
//! Fails:      as [`PreviewError`].

use std::io::{self, BufWriter, Write};
use std::mem::size_of;
use std::path::Path;

use crate::report::image_staged::StagedFile;
use crate::report::preview::camera::{Camera, Grid};
use crate::report::preview::raster::{Band, Sample};
use crate::report::preview::scene::{Painter, Scene};
use crate::report::preview::shade::{BACKGROUND, SEPARATOR, to_srgb};
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats, Side, SideStats};

/// Samples per pixel, each way.
const OVERSAMPLING: u32 = 2;
/// Width of the line between input and output.
pub(crate) const SEPARATOR_PX: u32 = 4;
/// Width of the lines along edges: half a pixel on each side of the edge.
const LINE_SAMPLES: f64 = 1.0;

type Srgb = [u8; 3];

/// How the picture is cut.
pub(crate) struct Layout {
    grid: Grid,
    /// Of the whole picture.
    pub(crate) width_px: u32,
    /// See `width_px`.
    pub(crate) height_px: u32,
    band_rows_px: u32,
}

impl Layout {
    /// Cuts it so that the share holds a band.
    pub(crate) fn new<E: std::error::Error>(
        options: &PreviewOptions,
    ) -> Result<Self, PreviewError<E>> {
        let grid = Grid::of(options.views);
        let side_px = grid.columns * options.width_px;
        let width_px = 2 * side_px + SEPARATOR_PX;
        let samples = u64::from(side_px) * u64::from(OVERSAMPLING * OVERSAMPLING);
        let row_bytes = samples * size_of::<Sample<Srgb>>() as u64 + 3 * u64::from(width_px);
        let share_bytes = options.share_bytes;
        if row_bytes > share_bytes {
            let what = "One row of the preview";
            return Err(PreviewError::ShareTooSmall { what, needed_bytes: row_bytes, share_bytes });
        }
        let rows = (share_bytes / row_bytes).min(u64::from(options.height_px));
        let height_px = grid.rows * options.height_px;
        Ok(Self { grid, width_px, height_px, band_rows_px: rows as u32 })
    }

    /// Width and height of one view in samples.
    pub(crate) fn samples_of_view(options: &PreviewOptions) -> (u32, u32) {
        (options.width_px * OVERSAMPLING, options.height_px * OVERSAMPLING)
    }
}

/// Writes the picture.
pub(crate) fn write_png<E: std::error::Error>(
    path: &Path,
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<E>> {
    let layout = Layout::new(options)?;
    let cameras = scene.cameras(options, Layout::samples_of_view(options))?;
    let staged = StagedFile::create(path)?;
    let failed = |error: png::EncodingError| staged.failed(io::Error::from(error));
    let mut file = BufWriter::new(staged.file());
    let mut stats = PreviewStats {
        width_px: layout.width_px,
        height_px: layout.height_px,
        ..PreviewStats::default()
    };
    let mut encoder = png::Encoder::new(&mut file, layout.width_px, layout.height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut rows = writer.stream_writer().map_err(failed)?;
    draw_bands(scene, options, &layout, &cameras, &mut stats, |bytes| {
        rows.write_all(bytes).map_err(|source| staged.failed(source))
    })?;
    rows.finish().map_err(failed)?;
    writer.finish().map_err(failed)?;
    file.flush().map_err(|source| staged.failed(source))?;
    drop(file);
    stats.bytes = staged.put_in_place()?;
    Ok(stats)
}

/// Draws band after band, top down, and hands out their rows.
pub(crate) fn draw_bands<E: std::error::Error>(
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
    layout: &Layout,
    cameras: &[Camera],
    stats: &mut PreviewStats,
    mut write: impl FnMut(&[u8]) -> Result<(), PreviewError<E>>,
) -> Result<(), PreviewError<E>> {
    let painter = Painter {
        paint: |face| to_srgb(face.colour),
        line_width: options.edges.then_some(LINE_SAMPLES),
    };
    let stride = 3 * layout.width_px as usize;
    let mut pixels = vec![0_u8; stride * layout.band_rows_px as usize];
    for cameras in cameras.chunks(layout.grid.columns as usize) {
        let beside = |&camera| (camera, empty_band(options.width_px, layout.band_rows_px));
        let mut views: Vec<_> = cameras.iter().map(beside).collect();
        for first_px in (0..options.height_px).step_by(layout.band_rows_px as usize) {
            let rows_px = layout.band_rows_px.min(options.height_px - first_px);
            let pixels = &mut pixels[..stride * rows_px as usize];
            paint_blank(pixels, layout.width_px);
            for side in Side::ALL {
                restart(&mut views, first_px, rows_px);
                let drawn = scene.draw(side, &mut views, &painter)?;
                add(stats, side, drawn);
                let side_px = layout.grid.columns * options.width_px;
                let left_px = if side == Side::Input { 0 } else { side_px + SEPARATOR_PX };
                resolve(&views, pixels, stride, left_px as usize);
            }
            stats.bands += 1;
            write(pixels)?;
        }
    }
    Ok(())
}

fn empty_band(width_px: u32, rows_px: u32) -> Band<Srgb> {
    Band::new(
        (width_px * OVERSAMPLING) as usize,
        (rows_px * OVERSAMPLING) as usize,
        to_srgb(BACKGROUND),
    )
}

fn restart(views: &mut [(Camera, Band<Srgb>)], first_px: u32, rows_px: u32) {
    let (first, rows) = (first_px * OVERSAMPLING, rows_px * OVERSAMPLING);
    for (_, band) in views {
        band.restart(first as usize, rows as usize, to_srgb(BACKGROUND));
    }
}

/// Fills rows with background, and with the separator in the middle.
fn paint_blank(pixels: &mut [u8], width_px: u32) {
    let (background, separator) = (to_srgb(BACKGROUND), to_srgb(SEPARATOR));
    let first = (width_px - SEPARATOR_PX) as usize / 2;
    let line = first..first + SEPARATOR_PX as usize;
    for row in pixels.chunks_exact_mut(3 * width_px as usize) {
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(if line.contains(&x) { &separator } else { &background });
        }
    }
}

/// Averages samples into pixels, from column `left_px` on.
fn resolve(views: &[(Camera, Band<Srgb>)], pixels: &mut [u8], stride: usize, left_px: usize) {
    let n = OVERSAMPLING as usize;
    let mut left_px = left_px;
    for (_, band) in views {
        let width_px = band.width / n;
        for (row, rows) in pixels.chunks_exact_mut(stride).zip(band.samples.chunks(n * band.width))
        {
            for x in 0..width_px {
                let mut sums = [0_usize; 3];
                for line in rows.chunks_exact(band.width) {
                    for sample in &line[n * x..n * (x + 1)] {
                        for (sum, channel) in sums.iter_mut().zip(sample.paint) {
                            *sum += usize::from(channel);
                        }
                    }
                }
                let pixel = &mut row[3 * (left_px + x)..][..3];
                for (byte, sum) in pixel.iter_mut().zip(sums) {
                    *byte = ((sum + n * n / 2) / (n * n)) as u8;
                }
            }
        }
        left_px += width_px;
    }
}

/// Every band sees all triangles, but its own samples only.
fn add(stats: &mut PreviewStats, side: Side, drawn: SideStats) {
    let side = match side {
        Side::Input => &mut stats.input,
        Side::Output => &mut stats.output,
    };
    *side = SideStats {
        front_samples: side.front_samples + drawn.front_samples,
        back_samples: side.back_samples + drawn.back_samples,
        ..drawn
    };
}
