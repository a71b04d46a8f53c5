//! Draws input beside output with one camera, so that a repair can be judged by eye.
//!
//! In:         a [`Scene`]; each mesh is streamed once for the bounds at most, once per band, and once
//!             to be measured against.
//! Out:        a PNG (input, output, map of deviations) or an EXR with layers.
//! Invariant:  the pixels depend on the meshes and the options, never on share and threads. Where two faces are equally near, a front face wins over a back face, then the earlier.
//! Units:      positions in model units; pictures in pixels, y down.
//! Memory:     the share; beside it a fixed encoder state and what the sources hold. With a map, scratch
//!             files without names: 96 bytes a triangle.
//! Fails:      as [`PreviewError`]; triangles with NaN or infinite corners are left out, counted.
//! Source:     J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (edge functions);
//!             I. Sutherland and G. Hodgman, Reentrant Polygon Clipping, 1974.

pub(crate) mod camera;
mod clip;
mod creases;
mod error;
pub(crate) mod legend;
mod lettering;
pub(crate) mod map;
pub(crate) mod measuring;
mod options;
pub(crate) mod panels;
pub(crate) mod raster;
pub(crate) mod scale;
pub(crate) mod scene;
pub(crate) mod shade;
#[cfg(test)]
mod tests;
pub(crate) mod texels;

pub use error::{PreviewError, Side};
pub use options::{PatchRule, PreviewOptions, PreviewStats, SideStats, UpAxis, Views};
pub use scene::{Measuring, OpenSource, Scene};

use std::path::Path;

use crate::report::image_exr::write_exr;
use crate::report::image_png::write_png;

/// The largest edge of one view; keeps all coordinates far inside the exact range of `f64`.
const LIMIT_PX: u32 = 1 << 15;

/// Draws a scene into `path`, a `.png` or an `.exr`.
///
/// The camera looks at the bounds of the output, or of the input where the output is missing or
/// empty; what the input has outside of them is cut off, so that one stray triangle cannot shrink
/// the model to a dot.
///
/// # Errors
/// The ending is neither `png` nor `exr`; a view has no pixels or too many; the share holds less
/// than one row (PNG) or than the picture (EXR); a source or the disk fails; cancelled.
pub fn write_preview<E: std::error::Error>(
    path: &Path,
    scene: &Scene<'_, '_, E>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<E>> {
    let PreviewOptions { width_px, height_px, .. } = *options;
    let supported = 1..=LIMIT_PX;
    if !supported.contains(&width_px) || !supported.contains(&height_px) {
        return Err(PreviewError::SizeUnsupported { width_px, height_px, limit_px: LIMIT_PX });
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("png") => write_png(path, scene, options),
        Some("exr") => write_exr(path, scene, options),
        _ => Err(PreviewError::UnknownFormat { path: path.to_path_buf() }),
    }
}
