//! Draws bands of both sides, and hands out finished rows: before, after, and what the map needs.
//!
//! In:         a [`Scene`]; two by two samples make a pixel.
//! Out:        [`Rows`]: pixels of both panels, and a [`MapPixel`] for each pixel of the output's.
//! Invariant:  the same rows whatever the share.
//! Memory:     the share: samples of one side of one band, and its finished rows; what a [`Ruler`] has
//!             of its own.
//! Fails:      as [`PreviewError`].

use std::mem::size_of;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::report::preview::camera::{Camera, Grid};
use crate::report::preview::creases::{Lines, REACH, Shown};
use crate::report::preview::measuring::Ruler;
use crate::report::preview::raster::{Band, Sample};
use crate::report::preview::scene::{Face, Painter, Scene};
use crate::report::preview::shade::{BACKGROUND, SEPARATOR, to_srgb};
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats, Side, SideStats};

/// Samples per pixel, each way.
const OVERSAMPLING: usize = 2;
/// Samples of a pixel.
const SAMPLES: usize = OVERSAMPLING * OVERSAMPLING;
/// Width of the line between panels.
pub(crate) const SEPARATOR_PX: u32 = 4;
/// Width of the lines along edges: half a pixel on each side of the edge.
const LINE_SAMPLES: f64 = 1.0;
/// What a line along a crease keeps of a colour, of 256.
const CREASE_KEEPS: u16 = 90;

/// A pixel of a map before its colours are known.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MapPixel {
    /// How far what it shows lies from the other surface.
    pub(crate) distance: f32,
    /// How bright its samples are lit, above zero; zero where they show nothing.
    pub(crate) lights: [u8; SAMPLES],
}

/// Rows of the picture.
pub(crate) struct Rows<'r> {
    /// Both panels with the line between them.
    pub(crate) pixels: &'r [u8],
    /// The output's panel; empty where there is no map.
    pub(crate) map: &'r [MapPixel],
}

/// How the picture is cut.
pub(crate) struct Layout {
    grid: Grid,
    /// Of a panel.
    pub(crate) side_px: u32,
    /// Of both panels.
    pub(crate) width_px: u32,
    /// Of all of them.
    pub(crate) height_px: u32,
    band_rows_px: u32,
}

impl Layout {
    /// Cuts it so that the share holds a band.
    pub(crate) fn new<E: std::error::Error>(
        options: &PreviewOptions,
        has_map: bool,
    ) -> Result<Self, PreviewError<E>> {
        let grid = Grid::of(options.views);
        let side_px = grid.columns * options.width_px;
        let width_px = 2 * side_px + SEPARATOR_PX;
        let sample_bytes = (side_px as usize * OVERSAMPLING * size_of::<Sample<Shown>>()) as u64;
        let map_bytes = if has_map { size_of::<MapPixel>() + 5 * size_of::<f64>() } else { 0 };
        let row_bytes = sample_bytes * OVERSAMPLING as u64
            + 3 * u64::from(width_px)
            + u64::from(side_px) * map_bytes as u64;
        let margin_bytes = sample_bytes * 2 * margin(options) as u64;
        let (share_bytes, needed_bytes) = (options.share_bytes, row_bytes + margin_bytes);
        if needed_bytes > share_bytes {
            let what = "One row of the preview";
            return Err(PreviewError::ShareTooSmall { what, needed_bytes, share_bytes });
        }
        let rows = ((share_bytes - margin_bytes) / row_bytes).min(u64::from(options.height_px));
        let height_px = grid.rows * options.height_px;
        Ok(Self { grid, side_px, width_px, height_px, band_rows_px: rows as u32 })
    }

    /// Width and height of one view in samples.
    pub(crate) fn samples_of_view(options: &PreviewOptions) -> (u32, u32) {
        let factor = OVERSAMPLING as u32;
        (options.width_px * factor, options.height_px * factor)
    }
}

/// Rows of samples beside those of a band that lines look at.
fn margin(options: &PreviewOptions) -> usize {
    if options.creases { REACH } else { 0 }
}

type View = (Camera, Band<Shown>);

/// Draws band after band, top down, and hands out their rows.
pub(crate) fn draw_bands<E: std::error::Error>(
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
    (layout, cameras, ruler): (&Layout, &[Camera], Option<&Ruler>),
    stats: &mut PreviewStats,
    mut write: impl FnMut(Rows) -> Result<(), PreviewError<E>>,
) -> Result<(), PreviewError<E>> {
    let line_width = options.edges.then_some(LINE_SAMPLES);
    let painter = Painter { paint: shown, line_width, asks_patches: false };
    let stride = 3 * layout.width_px as usize;
    let mut pixels = vec![0_u8; stride * layout.band_rows_px as usize];
    let mut map = Vec::new();
    for cameras in cameras.chunks(layout.grid.columns as usize) {
        let beside = |&camera| (camera, empty_band(options, layout.band_rows_px));
        let mut views: Vec<View> = cameras.iter().map(beside).collect();
        for first_px in (0..options.height_px).step_by(layout.band_rows_px as usize) {
            let rows_px = layout.band_rows_px.min(options.height_px - first_px);
            let pixels = &mut pixels[..stride * rows_px as usize];
            paint_blank(pixels, layout.width_px);
            for side in Side::ALL {
                restart(&mut views, options, first_px..first_px + rows_px);
                let drawn = scene.draw(side, &mut views, &painter)?;
                add(stats, side, drawn);
                if options.creases {
                    views.iter_mut().for_each(|(camera, band)| darken_lines(camera, band));
                }
                let left_px = if side == Side::Input { 0 } else { layout.side_px + SEPARATOR_PX };
                resolve(&views, pixels, stride, left_px as usize);
            }
            map.clear();
            if let Some(ruler) = ruler {
                measure(&views, layout, ruler, &mut map)?;
            }
            stats.bands += 1;
            write(Rows { pixels, map: &map })?;
        }
    }
    Ok(())
}

fn shown(face: &Face) -> Shown {
    let light = (face.light * 254.0).round() as u8 + 1;
    Shown { colour: to_srgb(face.colour), light, normal: Shown::normal_of(face.seen) }
}

fn nothing() -> Shown {
    Shown { colour: to_srgb(BACKGROUND), light: 0, normal: [0; 3] }
}

fn empty_band(options: &PreviewOptions, rows_px: u32) -> Band<Shown> {
    let rows = rows_px as usize * OVERSAMPLING + 2 * margin(options);
    Band::new(options.width_px as usize * OVERSAMPLING, rows, nothing())
}

fn restart(views: &mut [View], options: &PreviewOptions, rows_px: Range<u32>) {
    let [first, end] = [rows_px.start, rows_px.end].map(|row| row as usize * OVERSAMPLING);
    let last = options.height_px as usize * OVERSAMPLING;
    let held = first.saturating_sub(margin(options))..(end + margin(options)).min(last);
    for (_, band) in views {
        band.restart(held.clone(), first..end, nothing());
    }
}

/// Draws dark lines along creases into the band's own rows.
fn darken_lines(camera: &Camera, band: &mut Band<Shown>) {
    let (rows, width) = (band.own_rows(), band.width);
    let lines = Lines { band, depth_samples: camera.depth_samples() };
    let all = rows.flat_map(|y| (0..width).map(move |x| (x, y)));
    let dark: Vec<u32> =
        all.filter(|&(x, y)| lines.has(x, y)).map(|(x, y)| (y * width + x) as u32).collect();
    for place in dark {
        let shown = &mut band.samples[place as usize].paint;
        let darker = |part: u8| ((u16::from(part) * CREASE_KEEPS) >> 8) as u8;
        shown.colour = shown.colour.map(darker);
        shown.light = darker(shown.light).max(1);
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
fn resolve(views: &[View], pixels: &mut [u8], stride: usize, left_px: usize) {
    let n = OVERSAMPLING;
    let mut left_px = left_px;
    for (_, band) in views {
        let width_px = band.width / n;
        let samples = band.own_samples().chunks(n * band.width);
        for (row, rows) in pixels.chunks_exact_mut(stride).zip(samples) {
            for x in 0..width_px {
                let mut sums = [0_usize; 3];
                for line in rows.chunks_exact(band.width) {
                    for sample in &line[n * x..n * (x + 1)] {
                        for (sum, channel) in sums.iter_mut().zip(sample.paint.colour) {
                            *sum += usize::from(channel);
                        }
                    }
                }
                let pixel = &mut row[3 * (left_px + x)..][..3];
                for (byte, sum) in pixel.iter_mut().zip(sums) {
                    *byte = ((sum + SAMPLES / 2) / SAMPLES) as u8;
                }
            }
        }
        left_px += width_px;
    }
}

/// Measures what the pixels of the output show, row by row.
fn measure<E: std::error::Error>(
    views: &[View],
    layout: &Layout,
    ruler: &Ruler,
    map: &mut Vec<MapPixel>,
) -> Result<(), PreviewError<E>> {
    let rows_px = views.first().map_or(0, |(_, band)| band.own_rows().len() / OVERSAMPLING);
    let blank = MapPixel { distance: 0.0, lights: [0; SAMPLES] };
    map.resize(rows_px * layout.side_px as usize, blank);
    let (mut points, mut places) = (Vec::new(), Vec::new());
    let mut left_px = 0;
    for (camera, band) in views {
        let width_px = band.width / OVERSAMPLING;
        for y in 0..rows_px {
            for x in 0..width_px {
                let place = y * layout.side_px as usize + left_px + x;
                if let Some(point) = look(camera, band, (x, y), &mut map[place].lights) {
                    points.push(point);
                    places.push(place as u32);
                }
            }
        }
        left_px += width_px;
    }
    for (place, distance) in places.iter().zip(ruler.distances(Side::Output, &points)?) {
        map[*place as usize].distance = distance as f32;
    }
    Ok(())
}

/// The lights of a pixel's samples, and the place that the nearest of them shows, of equals the first.
fn look(
    camera: &Camera,
    band: &Band<Shown>,
    (x_px, y_px): (usize, usize),
    lights: &mut [u8; SAMPLES],
) -> Option<[f64; 3]> {
    let first = band.own_rows().start;
    let mut nearest: Option<(f32, usize, usize)> = None;
    for (i, light) in lights.iter_mut().enumerate() {
        let x = x_px * OVERSAMPLING + i % OVERSAMPLING;
        let y = first + y_px * OVERSAMPLING + i / OVERSAMPLING;
        let sample = &band.samples[y * band.width + x];
        if sample.depth.is_finite() {
            *light = sample.paint.light;
            if nearest.is_none_or(|(depth, ..)| sample.depth < depth) {
                nearest = Some((sample.depth, x, band.first_row + y));
            }
        }
    }
    let (depth, x, y) = nearest?;
    Some(camera.unproject(x as f64 + 0.5, y as f64 + 0.5, f64::from(depth)).to_array())
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
