//! Model files as streams: one folder per format, each with a reader and a writer.
//!
//! In: a path. Out: a [`MeshSource`] that delivers batches of at most [`BATCH_TRIANGLES`]
//! triangles in file order, or a [`MeshSink`] that takes vertices and triangles.
//!
//! Invariant: what is read depends on the file alone, never on the memory granted. Positions are
//! written exactly (OBJ, PLY, OFF and 3MF as `f64`, STL and GLB rounded to `f32`). Units: model
//! units.
//!
//! Inside, v of texture coordinates goes up. OBJ holds them, normals and colours (without alpha),
//! GLB all of it, PLY and 3MF no normals; a triangle of 3MF has either an image or colours. GLB and
//! 3MF hold the images of their materials (3MF PNG and JPEG, GLB also WebP, KTX 2 and AVIF), OBJ
//! and PLY name them: those beside the input where they are, those inside of it beside the output.
//! Each is one of a model in its own folder, or is left out and told.
//!
//! Memory: [`ReadOptions::share_bytes`] (at least 96 KiB, 512 KiB for glTF), the names of parts and
//! materials, and the largest polygon; OBJ files up to 4 MiB are held whole by `tobj`, primitives
//! that Draco has compressed are decoded whole, and of 3MF a tag of up to 1 MiB is held. A writer
//! holds 256 KiB for each file, and the vertices of one call; those of GLB and 3MF 8 MiB more in the
//! end.

#[cfg(test)]
mod attribute_tests;
mod beside;
mod detect;
mod error;
mod gltf;
#[cfg(test)]
mod hostile_tests;
mod image_kind;
mod images_beside;
mod input;
mod listed;
mod named;
mod names;
mod numbers;
mod obj;
mod off;
mod output;
mod output_names;
mod packed;
mod palette;
mod parts_written;
mod ply;
mod polygon;
mod scene;
mod stl;
#[cfg(test)]
mod tests;
mod textures;
mod threemf;
mod words;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::io::detect::open_model;
pub use crate::io::detect::{detect, format_of_extension, format_of_name};
pub use crate::io::error::{IoError, Place};
use crate::io::gltf::{GlbWriter, GltfReader};
pub use crate::io::images_beside::{ImageBeside, images_beside};
pub use crate::io::named::{MOST_NAMED, NamedFiles, named_files};
pub use crate::io::obj::{LIBRARY_MARK, library_name, write_library};
use crate::io::obj::{ObjWriter, open_obj};
use crate::io::off::{OffReader, OffWriter};
pub use crate::io::output::{ASIDE, check_output};
pub use crate::io::packed::content_name as unpacked_name;
pub use crate::io::palette::{IMAGES, LookMap, MATERIALS, Palette, PaletteWriter};
pub use crate::io::ply::{LooseKind, LooseShape, write_loose_shapes};
use crate::io::ply::{PlyReader, PlyWriter};
pub use crate::io::scene::{NODES, SEEN_NODES, SceneTree, SceneWriter};
use crate::io::stl::{StlWriter, open_stl};
pub use crate::io::textures::{is_image_of, lost_of_materials};
use crate::io::threemf::{ThreeMfReader, ThreeMfWriter};
use crate::mesh::{Attributes, LengthUnit, MeshSink, MeshSource, Placement, SinkState};
use crate::store::Scratch;

/// The most triangles in one batch.
pub const BATCH_TRIANGLES: usize = 4096;

/// A file format that is read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// Wavefront OBJ with its MTL files.
    Obj,
    /// Stereolithography, binary or text.
    Stl,
    /// Stanford polygons, text or binary of either byte order.
    Ply,
    /// Geomview's Object File Format, text.
    Off,
    /// 3D Manufacturing Format, XML in a zip archive.
    ThreeMf,
    /// glTF 2.0: GLB, also read as JSON with its buffers beside it.
    Glb,
}

/// The number type that a written file holds coordinates in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateType {
    /// Single precision.
    F32,
    /// Double precision, or text that gives the double back.
    F64,
}

impl Format {
    /// The extension of files of this format.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::ThreeMf => "3mf",
            Self::Glb => "glb",
        }
    }

    /// What the writer of this format holds coordinates in.
    #[must_use]
    pub fn coordinates(self) -> CoordinateType {
        match self {
            Self::Stl | Self::Glb => CoordinateType::F32,
            Self::Obj | Self::Ply | Self::Off | Self::ThreeMf => CoordinateType::F64,
        }
    }

    /// Whether triangles have materials.
    #[must_use]
    pub fn has_materials(self) -> bool {
        matches!(self, Self::Obj | Self::Ply | Self::ThreeMf | Self::Glb)
    }

    /// What the writer of this format can hold besides positions and materials.
    #[must_use]
    pub fn attributes(self) -> Attributes {
        match self {
            Self::Obj | Self::Glb => Attributes::ALL,
            Self::Ply | Self::ThreeMf => Attributes { normals: false, ..Attributes::ALL },
            Self::Stl | Self::Off => Attributes::NONE,
        }
    }

    /// Whether a reader of this format learns from it what a unit is: in GLB nodes scale numbers to
    /// metres.
    #[must_use]
    pub fn holds_unit(self) -> bool {
        self == Self::ThreeMf || self == Self::Glb
    }

    /// Whether files hold the nodes of a scene, which parts stand in.
    #[must_use]
    pub fn has_scenes(self) -> bool {
        matches!(self, Self::ThreeMf | Self::Glb)
    }

    /// Whether files hold the names of parts.
    #[must_use]
    pub fn has_parts(self) -> bool {
        matches!(self, Self::Obj | Self::ThreeMf | Self::Glb)
    }

    /// Whether triangles name vertices by number.
    #[must_use]
    pub fn has_indices(self) -> bool {
        self != Self::Stl
    }
}

/// How to read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Memory for vertices and buffers; what exceeds it goes to the scratch folder.
    pub share_bytes: u64,
    /// What becomes of the places of parts.
    pub placement: Placement,
}

impl ReadOptions {
    /// Every part where it stands, within `share_bytes`.
    #[must_use]
    pub const fn in_scene(share_bytes: u64) -> Self {
        Self { share_bytes, placement: Placement::InScene }
    }

    /// Every part once, in its own coordinates, within `share_bytes`.
    #[must_use]
    pub const fn by_itself(share_bytes: u64) -> Self {
        Self { share_bytes, placement: Placement::ByItself }
    }
}

/// How to write.
#[derive(Clone, Debug, Default)]
pub struct WriteOptions {
    /// The materials that triangles name; `None` where they name none.
    pub palette: Option<Palette>,
    /// Whether triangles that close what was open are told apart.
    pub tag_patches: bool,
    /// What vertices and corners will have besides; what [`Format::attributes`] lacks is not
    /// written. With texture coordinates, materials show their images.
    pub attributes: Attributes,
    /// Where parts stand, for formats that have scenes; each where its vertices are if `None`.
    pub scene: Option<SceneTree>,
    /// Whether images that the output names and does not hold lie beside it; else those that lie
    /// beside the input stay there.
    pub copies_images: bool,
    /// Where the output will be in the end: the ways to images lead from there.
    pub output: PathBuf,
    /// What a model unit is, for formats that say so (3MF, GLB).
    pub unit: Option<LengthUnit>,
    /// File name of the material library beside an OBJ file, see [`library_name`].
    pub library: String,
}

/// A model file being read.
pub type Source = Box<dyn MeshSource<Error = IoError> + Send>;

/// A model file being written.
pub type Sink = Box<dyn MeshSink<Error = IoError> + Send>;

/// Opens a model file; its content tells the format first, its extension second. A packed file is
/// unpacked into the scratch folder.
///
/// # Errors
/// The file is missing, is no regular file, has no known format, or is broken from the start; or
/// the scratch folder fails.
pub fn open(path: &Path, scratch: &Scratch, options: &ReadOptions) -> Result<Source, IoError> {
    let (input, format) = open_model(path, scratch, options.share_bytes)?;
    Ok(match format {
        Format::Obj => open_obj(input, scratch, options)?,
        Format::Stl => open_stl(input)?,
        Format::Ply => Box::new(PlyReader::open(input, scratch, options)?),
        Format::Off => Box::new(OffReader::open(input, scratch, options)?),
        Format::ThreeMf => Box::new(ThreeMfReader::open(input, scratch, options)?),
        Format::Glb => Box::new(GltfReader::open(input, scratch, options)?),
    })
}

/// Creates a model file, or empties the one that is there.
///
/// STL is written in binary, PLY in little-endian binary with doubles, OBJ and OFF as text, 3MF as
/// text that is packed, glTF as GLB. Until [`MeshSink::finish`] the file is not valid.
///
/// # Errors
/// The file or a scratch file cannot be created.
pub fn create(
    path: &Path,
    format: Format,
    scratch: &Scratch,
    options: &WriteOptions,
) -> Result<Sink, IoError> {
    Ok(match format {
        Format::Obj => Box::new(ObjWriter::create(path, scratch, options)?),
        Format::Stl => Box::new(StlWriter::create(path, scratch)?),
        Format::Ply => Box::new(PlyWriter::create(path, scratch, options)?),
        Format::Off => Box::new(OffWriter::create(path, scratch)?),
        Format::ThreeMf => Box::new(ThreeMfWriter::create(path, scratch, options)?),
        Format::Glb => Box::new(GlbWriter::create(path, scratch, options)?),
    })
}

/// Goes on writing a model file where an earlier sink was when it told its `state`.
///
/// # Errors
/// The files are gone, or are not what they were ([`crate::store::StoreError::Damaged`]).
pub fn reopen(
    path: &Path,
    format: Format,
    scratch: &Scratch,
    options: &WriteOptions,
    state: &SinkState,
) -> Result<Sink, IoError> {
    Ok(match format {
        Format::Obj => Box::new(ObjWriter::reopen(path, scratch, options, state)?),
        Format::Stl => Box::new(StlWriter::reopen(path, scratch, state)?),
        Format::Ply => Box::new(PlyWriter::reopen(path, scratch, options, state)?),
        Format::Off => Box::new(OffWriter::reopen(path, scratch, state)?),
        Format::ThreeMf => Box::new(ThreeMfWriter::reopen(path, scratch, options, state)?),
        Format::Glb => Box::new(GlbWriter::reopen(path, scratch, options, state)?),
    })
}
