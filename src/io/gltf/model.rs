//! The objects of a glTF file as tables, by their numbers in the file.
//!
//! Memory: the share; what exceeds it goes to the scratch folder.

use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};

use crate::io::error::{IoError, Place};
use crate::io::gltf::text::Segments;
use crate::mesh::Affine;
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// The number of what is not there.
pub(crate) const NONE: u32 = u32::MAX;

/// A buffer, and where its bytes are once that is known.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct BufferRecord {
    pub(crate) length: u64,
    /// In the file or among the segments.
    pub(crate) start: u64,
    /// Text number of its address.
    pub(crate) uri: u32,
    pub(crate) origin: u32,
}

/// Values of [`BufferRecord::origin`].
pub(crate) mod origin {
    /// Not looked for yet.
    pub(crate) const UNKNOWN: u32 = 0;
    /// The binary chunk of the model file.
    pub(crate) const CHUNK: u32 = 1;
    /// A decoded segment.
    pub(crate) const SEGMENT: u32 = 2;
    /// A file beside the model.
    pub(crate) const FILE: u32 = 3;
    /// Nowhere: its views are compressed in a way that we do not read.
    pub(crate) const COMPRESSED: u32 = 4;
}

/// A stretch of a buffer.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewRecord {
    pub(crate) offset: u64,
    pub(crate) length: u64,
    pub(crate) stride: u64,
    pub(crate) buffer: u32,
    pub(crate) padding: u32,
}

/// An array of numbers in a view, some of them replaced.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct AccessorRecord {
    pub(crate) offset: u64,
    pub(crate) count: u64,
    pub(crate) sparse_count: u64,
    pub(crate) sparse_indices_offset: u64,
    pub(crate) sparse_values_offset: u64,
    /// Where [`AccessorRecord::first_vertex`] was given.
    pub(crate) scope: u64,
    pub(crate) view: u32,
    pub(crate) component: u32,
    pub(crate) lanes: u32,
    pub(crate) is_normalized: u32,
    pub(crate) sparse_indices_view: u32,
    pub(crate) sparse_indices_component: u32,
    pub(crate) sparse_values_view: u32,
    /// The number of its first vertex in the file.
    pub(crate) first_vertex: u32,
    /// Whether its bytes are counted as read.
    pub(crate) is_counted: u32,
    /// Whether its sparse indices are known to ascend.
    pub(crate) is_checked: u32,
}

/// A range of primitives with a name.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MeshRecord {
    pub(crate) first: u64,
    pub(crate) count: u32,
    pub(crate) name: u32,
    /// The number of the part that it is, where parts are read by themselves, once it was read.
    pub(crate) part: u32,
    pub(crate) padding: u32,
}

/// Triangles of one material.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PrimitiveRecord {
    pub(crate) mode: u32,
    pub(crate) position: u32,
    pub(crate) indices: u32,
    pub(crate) uv: u32,
    pub(crate) second_uv: u32,
    pub(crate) colour: u32,
    pub(crate) material: u32,
    /// View of the compressed bytes.
    pub(crate) draco_view: u32,
    /// Numbers of the attributes in there.
    pub(crate) draco_position: u32,
    pub(crate) draco_uv: u32,
    pub(crate) draco_second_uv: u32,
    pub(crate) draco_colour: u32,
    /// The buffer that they were decoded into.
    pub(crate) decoded: u32,
    pub(crate) decoded_faces: u32,
}

/// A node of the scene.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct NodeRecord {
    /// Into its parent; into the scene once it was visited, where parts are read in their places.
    pub(crate) map: Affine,
    pub(crate) first_child: u64,
    pub(crate) child_count: u32,
    pub(crate) mesh: u32,
    pub(crate) name: u32,
    /// Accessors of the copies' translation, rotation and scale.
    pub(crate) instances: [u32; 3],
    pub(crate) is_child: u32,
    /// One more than its number among those that were visited.
    pub(crate) visited: u32,
}

/// A material, as far as it is stated; see [`crate::io::gltf::materials`].
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MaterialRecord {
    pub(crate) name: u32,
    pub(crate) flags: u32,
    pub(crate) base: [f32; 4],
    pub(crate) emissive: [f32; 3],
    pub(crate) metallic: f32,
    pub(crate) roughness: f32,
    pub(crate) alpha_cutoff: f32,
    pub(crate) texture: u32,
    /// The textures of its further maps: normals, gloss, emission, occlusion.
    pub(crate) maps: [u32; 4],
    pub(crate) normal_scale: f32,
    pub(crate) occlusion_strength: f32,
    /// Which texture coordinates it takes, and the map that they go through: rows of three.
    pub(crate) uv_set: u32,
    pub(crate) uv_map: [[f32; 3]; 2],
    /// One more than its number among the materials in use.
    pub(crate) used: u32,
}

/// An image: a file, a decoded segment, or a buffer view.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ImageRecord {
    /// Text number of its address, where it has one.
    pub(crate) uri: u32,
    pub(crate) view: u32,
    pub(crate) name: u32,
}

/// The whole file but for its buffers' bytes.
pub(crate) struct Model {
    pub(crate) path: PathBuf,
    pub(crate) has_version: bool,
    /// Required extensions so far.
    pub(crate) required: u64,
    pub(crate) buffers: Table<BufferRecord>,
    pub(crate) views: Table<ViewRecord>,
    pub(crate) accessors: Table<AccessorRecord>,
    pub(crate) meshes: Table<MeshRecord>,
    pub(crate) primitives: Table<PrimitiveRecord>,
    pub(crate) nodes: Table<NodeRecord>,
    /// Of all nodes, one after another; then those of the scenes.
    pub(crate) children: Table<u32>,
    /// First entry in `children` and number of them.
    pub(crate) scenes: Table<[u64; 2]>,
    pub(crate) scene: u32,
    pub(crate) materials: Table<MaterialRecord>,
    /// The image of each texture.
    pub(crate) textures: Table<u32>,
    pub(crate) images: Table<ImageRecord>,
    pub(crate) texts: Dictionary,
    pub(crate) segments: Segments,
    /// Whether any triangle has texture coordinates, or colours.
    pub(crate) has_uvs: bool,
    pub(crate) has_colours: bool,
    pub(crate) has_normals: bool,
}

impl Model {
    pub(crate) fn new(path: &Path, scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            path: path.to_path_buf(),
            has_version: false,
            required: 0,
            buffers: Table::new(scratch, share_bytes / 32),
            views: Table::new(scratch, share_bytes / 16),
            accessors: Table::new(scratch, share_bytes / 8),
            meshes: Table::new(scratch, share_bytes / 32),
            primitives: Table::new(scratch, share_bytes / 8),
            nodes: Table::new(scratch, share_bytes / 4),
            children: Table::new(scratch, share_bytes / 32),
            scenes: Table::new(scratch, 0),
            scene: NONE,
            materials: Table::new(scratch, share_bytes / 16),
            textures: Table::new(scratch, share_bytes / 64),
            images: Table::new(scratch, share_bytes / 64),
            texts: Dictionary::new(scratch, share_bytes / 8),
            segments: Segments::new(scratch, share_bytes / 64),
            has_uvs: false,
            has_colours: false,
            has_normals: false,
        }
    }

    /// The error that names a numbered object.
    pub(crate) fn wrong(
        &self,
        (kind, number): (&'static str, u32),
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> IoError {
        let place = Place::Item { kind, number: number.into() };
        IoError::unreadable(&self.path, place, expected, found)
    }

    /// The number of a text.
    pub(crate) fn text(&mut self, text: Option<&str>) -> Result<u32, IoError> {
        let Some(text) = text else { return Ok(NONE) };
        self.texts.number(text.as_bytes()).map_err(|error| match error {
            StoreError::TooMany { limit, .. } => IoError::too_many(&self.path, "names", limit),
            error => error.into(),
        })
    }

    /// The text of a number.
    pub(crate) fn text_of(&mut self, number: u32) -> Result<Option<String>, IoError> {
        if number == NONE {
            return Ok(None);
        }
        let bytes = self.texts.name(number)?;
        Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
    }

    pub(crate) fn buffer(&mut self, number: u32) -> Result<BufferRecord, IoError> {
        look_up(&self.path, &mut self.buffers, ("buffer", number))
    }

    pub(crate) fn view(&mut self, number: u32) -> Result<ViewRecord, IoError> {
        look_up(&self.path, &mut self.views, ("buffer view", number))
    }

    pub(crate) fn accessor(&mut self, number: u32) -> Result<AccessorRecord, IoError> {
        look_up(&self.path, &mut self.accessors, ("accessor", number))
    }

    pub(crate) fn mesh(&mut self, number: u32) -> Result<MeshRecord, IoError> {
        look_up(&self.path, &mut self.meshes, ("mesh", number))
    }

    pub(crate) fn node(&mut self, number: u32) -> Result<NodeRecord, IoError> {
        look_up(&self.path, &mut self.nodes, ("node", number))
    }

    /// A primitive, with those texture coordinates that its material takes.
    pub(crate) fn primitive(&mut self, number: u64) -> Result<PrimitiveRecord, IoError> {
        let mut record = self.primitives.get(number)?;
        let is_second = record.material != NONE && self.material(record.material)?.uv_set == 1;
        if is_second {
            (record.uv, record.draco_uv) = (record.second_uv, record.draco_second_uv);
        }
        Ok(record)
    }

    pub(crate) fn material(&mut self, number: u32) -> Result<MaterialRecord, IoError> {
        look_up(&self.path, &mut self.materials, ("material", number))
    }
}

/// An object that the file names by number, if it is there.
fn look_up<R: Pod>(
    path: &Path,
    table: &mut Table<R>,
    (kind, number): (&'static str, u32),
) -> Result<R, IoError> {
    if u64::from(number) < table.len() {
        return Ok(table.get(number.into())?);
    }
    let place = Place::Item { kind, number: number.into() };
    let found = format!("{} of that kind", table.len());
    Err(IoError::unreadable(path, place, "an object with that number", found))
}
