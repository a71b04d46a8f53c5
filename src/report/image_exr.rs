//! The EXR: layers `input` and `output` with colour, depth, normal and part, for measuring.
//!
//! In:         a [`Scene`]; one sample per pixel, because depths and numbers cannot be averaged.
//! Out:        two layers of `columns x width` by `rows x height`, channels R G B (linear light),
//!             Z (model units from the near end of the view; infinite where nothing is),
//!             normal.X normal.Y normal.Z (unit, model space) and part (u32, [`NO_PART`] if none).
//! Invariant:  both layers are seen by the same cameras.
//! Memory:     both layers whole, inside the share.
//! Fails:      as [`PreviewError`].

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::mem::size_of;
use std::path::Path;

use exr::prelude::{
    Encoding, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, SpecificChannels,
    Vec2, WritableImage,
};

use crate::report::image_staged::StagedFile;
use crate::report::preview::camera::{Camera, Grid};
use crate::report::preview::raster::{Band, Sample};
use crate::report::preview::scene::{Face, Painter, Scene};
use crate::report::preview::shade::BACKGROUND;
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats, Side, SideStats};

/// The part of a pixel that shows nothing.
pub(crate) const NO_PART: u32 = u32::MAX;
/// Width of the lines along edges, half a pixel on each side of the edge.
const LINE_SAMPLES: f64 = 0.5;

/// What a pixel of a layer holds beside its depth.
#[derive(Clone, Copy)]
struct Texel {
    colour: [f32; 3],
    normal: [f32; 3],
    part: u32,
}

const NOTHING: Texel = Texel { colour: BACKGROUND, normal: [0.0; 3], part: NO_PART };

impl Texel {
    fn of(face: &Face) -> Self {
        Self { colour: face.colour, normal: face.normal.as_vec3().to_array(), part: face.part }
    }
}

/// All views of one side.
struct LayerViews {
    views: Vec<(Camera, Band<Texel>)>,
    grid: Grid,
    height: usize,
    width: usize,
}

/// The values of one pixel, in the order of the channels.
type Pixel = (f32, f32, f32, f32, f32, f32, f32, u32);

impl LayerViews {
    fn pixel(&self, Vec2(x, y): Vec2<usize>) -> Pixel {
        let index = y / self.height * self.grid.columns as usize + x / self.width;
        let (camera, band) = &self.views[index];
        let sample = band.samples[y % self.height * self.width + x % self.width];
        let depth_world = camera.distance_world(sample.depth);
        let Texel { colour: [r, g, b], normal: [nx, ny, nz], part } = sample.paint;
        (r, g, b, depth_world, nx, ny, nz, part)
    }
}

/// Writes both layers.
pub(crate) fn write_exr<E: std::error::Error>(
    path: &Path,
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<E>> {
    let grid = Grid::of(options.views);
    let (width_px, height_px) = (grid.columns * options.width_px, grid.rows * options.height_px);
    let texels = 2 * u64::from(width_px) * u64::from(height_px);
    let needed_bytes = texels * size_of::<Sample<Texel>>() as u64;
    let share_bytes = options.share_bytes;
    if needed_bytes > share_bytes {
        let what = "A preview with layers";
        return Err(PreviewError::ShareTooSmall { what, needed_bytes, share_bytes });
    }
    let cameras = scene.cameras(options, (options.width_px, options.height_px))?;
    let (input, input_stats) = draw_layer(scene, Side::Input, options, &cameras)?;
    let (output, output_stats) = draw_layer(scene, Side::Output, options, &cameras)?;
    let staged = StagedFile::create(path)?;
    let mut file = BufWriter::new(staged.file());
    let size = Vec2(width_px as usize, height_px as usize);
    encode(&mut file, size, &input, &output).map_err(|source| staged.failed(source))?;
    drop(file);
    Ok(PreviewStats {
        width_px,
        height_px,
        bands: 1,
        input: input_stats,
        output: output_stats,
        largest_deviation: None,
        bytes: staged.put_in_place()?,
    })
}

fn draw_layer<E: std::error::Error>(
    scene: &Scene<'_, '_, E>,
    side: Side,
    options: &PreviewOptions,
    cameras: &[Camera],
) -> Result<(LayerViews, SideStats), PreviewError<E>> {
    let grid = Grid::of(options.views);
    let (width, height) = (options.width_px as usize, options.height_px as usize);
    let empty = |&camera| (camera, Band::new(width, height, NOTHING));
    let mut views: Vec<_> = cameras.iter().map(empty).collect();
    let painter = Painter { paint: Texel::of, line_width: options.edges.then_some(LINE_SAMPLES) };
    let stats = scene.draw(side, &mut views, &painter)?;
    Ok((LayerViews { views, grid, height, width }, stats))
}

fn encode(
    mut file: impl Write + io::Seek,
    size: Vec2<usize>,
    input: &LayerViews,
    output: &LayerViews,
) -> io::Result<()> {
    // The channels stand in the order of `Pixel`; the crate sorts them by name.
    let layer = |side: Side, views| {
        let channels = SpecificChannels::build()
            .with_channel::<f32>("R")
            .with_channel::<f32>("G")
            .with_channel::<f32>("B")
            .with_channel::<f32>("Z")
            .with_channel::<f32>("normal.X")
            .with_channel::<f32>("normal.Y")
            .with_channel::<f32>("normal.Z")
            .with_channel::<u32>("part")
            .with_pixel_fn(move |at| LayerViews::pixel(views, at));
        Layer::new(size, LayerAttributes::named(side.name()), Encoding::SMALL_LOSSLESS, channels)
    };
    let image = Image::empty(ImageAttributes::new(IntegerBounds::from_dimensions(size)))
        .with_layer(layer(Side::Input, input))
        .with_layer(layer(Side::Output, output));
    image.write().to_buffered(&mut file).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        exr::error::Error::NotSupported(text) | exr::error::Error::Invalid(text) => other(text),
        exr::error::Error::Aborted => io::ErrorKind::Interrupted.into(),
    })?;
    file.flush()
}

fn other(text: Cow<'static, str>) -> io::Error {
    io::Error::other(text)
}
