//! The EXR: a layer for each view of the input and of the output, for measuring.
//!
//! In:         a [`Scene`].
//! Out:        layers `input.VIEW` and `output.VIEW`, channels R G B (linear light), Z, normal.X, normal.Y,
//!             normal.Z, part, material, patch and deviation, as docs/preview.md tells them.
//! Invariant:  both sides are seen by the same cameras; the same pixels whatever share and threads.
//! Memory:     the share: half for measuring, a quarter for bands, a quarter for texels that wait; beyond
//!             that they lie in a scratch file without a name. The compressor has blocks of 32 rows.
//! Fails:      as [`PreviewError`].

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use exr::prelude::{
    Encoding, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, SpecificChannels,
    Vec2, WritableImage,
};

use crate::report::image_staged::StagedFile;
use crate::report::preview::camera::names_of;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::scene::Scene;
use crate::report::preview::texels::{Texel, Texels, row_bytes};
use crate::report::preview::{PreviewError, PreviewOptions, PreviewStats, Side};
use crate::store::{Scratch, Sequence, StoreError};

/// Writes all layers.
pub(crate) fn write_exr<E: std::error::Error>(
    path: &Path,
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<E>> {
    let PreviewOptions { width_px, height_px, share_bytes, .. } = *options;
    let needed_bytes = 4 * row_bytes(options);
    if needed_bytes > share_bytes {
        let what = "A preview with layers";
        return Err(PreviewError::ShareTooSmall { what, needed_bytes, share_bytes });
    }
    let ruler = Ruler::read(scene, (scene.measuring, scene.monitor), &Side::ALL, share_bytes / 2)?;
    let cameras = scene.cameras(options, (width_px, height_px))?;
    let drawing = PreviewOptions { share_bytes: share_bytes / 4, ..*options };
    let texels = Texels { scene, options: &drawing, cameras: &cameras, ruler: ruler.as_ref() };
    let beside = Scratch::new(folder_of(path));
    let scratch = scene.measuring.map_or(&beside, |measuring| measuring.scratch);
    let mut sequence = Sequence::new(scratch, share_bytes / 4);
    let (input, input_bands) = texels.draw(Side::Input, &mut sequence)?;
    let (output, output_bands) = texels.draw(Side::Output, &mut sequence)?;
    let staged = StagedFile::create(path)?;
    let mut file = BufWriter::new(staged.file());
    let size = Vec2(width_px as usize, height_px as usize);
    let rows = Rows::new(&sequence, size.0);
    encode(&mut file, size, options, &rows).map_err(|source| staged.failed(source))?;
    rows.end().map_err(PreviewError::measure)?;
    drop(file);
    Ok(PreviewStats {
        width_px,
        height_px,
        bands: input_bands + output_bands,
        input,
        output,
        largest_deviation: None,
        bytes: staged.put_in_place()?,
    })
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The values of one pixel, in the order of the channels.
type Pixel = (f32, f32, f32, f32, f32, f32, f32, f32, u32, u32, u32);

/// Rows of texels for an encoder that asks for pixels, and cannot be told of a disk that fails.
struct Rows<'r> {
    texels: &'r Sequence<Texel>,
    width: usize,
    held: Mutex<Held>,
}

struct Held {
    /// The number of a row over all layers, and its texels.
    row: u64,
    texels: Vec<Texel>,
    room: Vec<Texel>,
    failure: Option<StoreError>,
}

impl<'r> Rows<'r> {
    fn new(texels: &'r Sequence<Texel>, width: usize) -> Self {
        let held = Held { row: u64::MAX, texels: Vec::new(), room: Vec::new(), failure: None };
        Self { texels, width, held: Mutex::new(held) }
    }

    fn pixel(&self, x: usize, row: u64) -> Pixel {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if held.row != row && held.failure.is_none() {
            let result = held.read(self.texels, row, self.width);
            held.failure = result.err();
        }
        let texel = held.texels.get(x).copied().unwrap_or(bytemuck::Zeroable::zeroed());
        let Texel { colour: [r, g, b], normal: [nx, ny, nz], depth, deviation, .. } = texel;
        (r, g, b, depth, nx, ny, nz, deviation, texel.part, texel.material, texel.patch)
    }

    /// What the disk said.
    fn end(self) -> Result<(), StoreError> {
        let held = self.held.into_inner().unwrap_or_else(PoisonError::into_inner);
        held.failure.map_or(Ok(()), Err)
    }
}

impl Held {
    fn read(&mut self, texels: &Sequence<Texel>, row: u64, width: usize) -> Result<(), StoreError> {
        self.texels.clear();
        while self.texels.len() < width {
            let (start, left) = (row * width as u64, width - self.texels.len());
            let at = start + self.texels.len() as u64;
            self.texels.extend_from_slice(texels.block(at, left, &mut self.room)?);
        }
        self.row = row;
        Ok(())
    }
}

fn encode(
    mut file: impl Write + io::Seek,
    size: Vec2<usize>,
    options: &PreviewOptions,
    rows: &Rows,
) -> io::Result<()> {
    let names =
        Side::ALL.into_iter().flat_map(|side| names_of(options.views).map(move |v| (side, v)));
    let layers = names.zip(0_u64..).map(|((side, view), number)| {
        let first = number * size.1 as u64;
        // The channels stand in the order of `Pixel`; the crate sorts them by name.
        let channels = SpecificChannels::build()
            .with_channel::<f32>("R")
            .with_channel::<f32>("G")
            .with_channel::<f32>("B")
            .with_channel::<f32>("Z")
            .with_channel::<f32>("normal.X")
            .with_channel::<f32>("normal.Y")
            .with_channel::<f32>("normal.Z")
            .with_channel::<f32>("deviation")
            .with_channel::<u32>("part")
            .with_channel::<u32>("material")
            .with_channel::<u32>("patch")
            .with_pixel_fn(move |Vec2(x, y): Vec2<usize>| rows.pixel(x, first + y as u64));
        let name = format!("{}.{view}", side.name());
        Layer::new(size, LayerAttributes::named(name.as_str()), Encoding::SMALL_LOSSLESS, channels)
    });
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let image = Image::from_layers(attributes, layers.collect::<Vec<_>>());
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
