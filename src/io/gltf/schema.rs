//! The objects of a glTF file as its JSON has them, and only what we read of them.
//!
//! Unknown members are passed over. Memory: one object at a time; lists in it have at most
//! [`MOST_ENTRIES`].

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, SeqAccess, Visitor};

/// The most entries of a list in an object: children of a node, primitives of a mesh.
pub(crate) const MOST_ENTRIES: usize = 1 << 20;

#[derive(serde::Deserialize)]
pub(crate) struct Asset {
    pub(crate) version: String,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: u64,
    #[serde(default)]
    pub(crate) extensions: BufferExtensions,
}

/// Ways to leave out the bytes of a buffer.
#[derive(Default, serde::Deserialize)]
pub(crate) struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
    pub(crate) meshopt: Option<IgnoredAny>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: u32,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    #[serde(default)]
    pub(crate) byte_stride: u64,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<u32>,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
    #[serde(default)]
    pub(crate) normalized: bool,
    pub(crate) count: u64,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) sparse: Option<Sparse>,
}

#[derive(serde::Deserialize)]
pub(crate) struct Sparse {
    pub(crate) count: u64,
    pub(crate) indices: SparsePart,
    pub(crate) values: SparsePart,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparsePart {
    pub(crate) buffer_view: u32,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    #[serde(default)]
    pub(crate) component_type: u32,
}

#[derive(serde::Deserialize)]
pub(crate) struct Mesh {
    pub(crate) name: Option<String>,
    pub(crate) primitives: List<Primitive>,
}

#[derive(serde::Deserialize)]
pub(crate) struct Primitive {
    #[serde(default)]
    pub(crate) attributes: Attributes,
    pub(crate) indices: Option<u32>,
    pub(crate) material: Option<u32>,
    pub(crate) mode: Option<u32>,
    #[serde(default)]
    pub(crate) extensions: PrimitiveExtensions,
}

#[derive(Default, serde::Deserialize)]
pub(crate) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(crate) position: Option<u32>,
    #[serde(rename = "TEXCOORD_0")]
    pub(crate) uv: Option<u32>,
    #[serde(rename = "TEXCOORD_1")]
    pub(crate) second_uv: Option<u32>,
    #[serde(rename = "COLOR_0")]
    pub(crate) colour: Option<u32>,
    #[serde(rename = "NORMAL")]
    pub(crate) normal: Option<u32>,
}

#[derive(Default, serde::Deserialize)]
pub(crate) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(crate) draco: Option<Draco>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Draco {
    pub(crate) buffer_view: u32,
    pub(crate) attributes: Attributes,
}

#[derive(serde::Deserialize)]
pub(crate) struct Node {
    pub(crate) name: Option<String>,
    pub(crate) mesh: Option<u32>,
    #[serde(default)]
    pub(crate) children: List<u32>,
    pub(crate) matrix: Option<[f64; 16]>,
    pub(crate) translation: Option<[f64; 3]>,
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
    #[serde(default)]
    pub(crate) extensions: NodeExtensions,
}

#[derive(Default, serde::Deserialize)]
pub(crate) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(crate) instancing: Option<Instancing>,
}

#[derive(serde::Deserialize)]
pub(crate) struct Instancing {
    pub(crate) attributes: InstanceAttributes,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) struct InstanceAttributes {
    pub(crate) translation: Option<u32>,
    pub(crate) rotation: Option<u32>,
    pub(crate) scale: Option<u32>,
}

#[derive(serde::Deserialize)]
pub(crate) struct Scene {
    #[serde(default)]
    pub(crate) nodes: List<u32>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Material {
    pub(crate) name: Option<String>,
    pub(crate) alpha_mode: Option<String>,
    pub(crate) alpha_cutoff: Option<f32>,
    pub(crate) emissive_factor: Option<[f32; 3]>,
    #[serde(default)]
    pub(crate) pbr_metallic_roughness: Pbr,
    pub(crate) normal_texture: Option<TextureInfo>,
    pub(crate) occlusion_texture: Option<TextureInfo>,
    pub(crate) emissive_texture: Option<TextureInfo>,
    #[serde(default)]
    pub(crate) extensions: MaterialExtensions,
}

#[derive(Default, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Pbr {
    pub(crate) base_color_factor: Option<[f32; 4]>,
    pub(crate) base_color_texture: Option<TextureInfo>,
    pub(crate) metallic_factor: Option<f32>,
    pub(crate) roughness_factor: Option<f32>,
    pub(crate) metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureInfo {
    pub(crate) index: u32,
    #[serde(default)]
    pub(crate) tex_coord: u32,
    /// Of normals, or of the shadows of hollows.
    #[serde(alias = "strength")]
    pub(crate) scale: Option<f32>,
    #[serde(default)]
    pub(crate) extensions: TextureInfoExtensions,
}

#[derive(Default, serde::Deserialize)]
pub(crate) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(crate) transform: Option<TextureTransform>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureTransform {
    #[serde(default)]
    pub(crate) offset: [f32; 2],
    #[serde(default)]
    pub(crate) rotation: f32,
    #[serde(default = "one_each")]
    pub(crate) scale: [f32; 2],
    pub(crate) tex_coord: Option<u32>,
}

fn one_each() -> [f32; 2] {
    [1.0; 2]
}

#[derive(Default, serde::Deserialize)]
pub(crate) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_transmission")]
    pub(crate) transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(crate) emissive_strength: Option<EmissiveStrength>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Transmission {
    #[serde(default)]
    pub(crate) transmission_factor: f32,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct EmissiveStrength {
    pub(crate) emissive_strength: Option<f32>,
}

#[derive(serde::Deserialize)]
pub(crate) struct Texture {
    pub(crate) source: Option<u32>,
    #[serde(default)]
    pub(crate) extensions: TextureExtensions,
}

/// Images of further kinds.
#[derive(Default, serde::Deserialize)]
pub(crate) struct TextureExtensions {
    #[serde(rename = "KHR_texture_basisu")]
    pub(crate) basisu: Option<ImageSource>,
    #[serde(rename = "EXT_texture_webp")]
    pub(crate) webp: Option<ImageSource>,
    #[serde(rename = "EXT_texture_avif")]
    pub(crate) avif: Option<ImageSource>,
}

#[derive(serde::Deserialize)]
pub(crate) struct ImageSource {
    pub(crate) source: Option<u32>,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Image {
    pub(crate) uri: Option<String>,
    pub(crate) buffer_view: Option<u32>,
    pub(crate) name: Option<String>,
}

/// A list of bounded length.
pub(crate) struct List<T>(pub(crate) Vec<T>);

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Vec<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of at most {MOST_ENTRIES} entries")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = list.next_element()? {
                    if entries.len() == MOST_ENTRIES {
                        return Err(A::Error::invalid_length(MOST_ENTRIES + 1, &self));
                    }
                    entries.push(entry);
                }
                Ok(entries)
            }
        }

        deserializer.deserialize_seq(Entries(PhantomData)).map(Self)
    }
}
