//! From the JSON into tables, object by object.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use serde::de::{
    DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor,
};

use crate::io::error::{IoError, Place};
use crate::io::gltf::materials;
use crate::io::gltf::model::{
    AccessorRecord, BufferRecord, ImageRecord, MeshRecord, Model, NONE, NodeRecord,
    PrimitiveRecord, ViewRecord, origin,
};
use crate::io::gltf::schema::{
    Accessor, Asset, Attributes, Buffer, BufferView, Image, Material, Mesh, Node, Primitive, Scene,
    Texture,
};
use crate::io::gltf::text::{Segments, Text};
use crate::io::gltf::transform::{from_columns, from_parts};
use crate::io::gltf::triangles::is_triangles;
use crate::io::input::Input;
use crate::mesh::IDENTITY;
use crate::store::Scratch;

/// Extensions that may be required: what they change is read, or is nothing that we read.
const KNOWN: [&str; 5] = [
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "MSFT_texture_dds",
];
const HARMLESS: [&str; 9] = [
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_animation",
];

/// Reads the JSON in `range`.
pub(crate) fn load(
    input: &mut Input,
    range: Range<u64>,
    is_text: bool,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<Model, IoError> {
    let path = input.path().to_path_buf();
    let mut model = Model::new(&path, scratch, share_bytes);
    // The text fills the segments while the objects fill the tables.
    let mut segments = Segments::new(scratch, share_bytes / 64);
    let mut text = Text::new(input, range, &mut segments)?;
    let mut loader = Loader { model: &mut model, failed: None };
    let mut parser = serde_json::Deserializer::from_reader(&mut text);
    let parsed = Root(&mut loader).deserialize(&mut parser).and_then(|()| parser.end());
    drop(parser);
    let (failed, offset) = (loader.failed.take(), text.offset());
    if let Err(error) = parsed {
        if let Some(failed) = failed.or(text.failed()) {
            return Err(failed);
        }
        let place = if is_text { Place::Line(error.line() as u64) } else { Place::Byte(offset) };
        return Err(IoError::unreadable(&path, place, "glTF 2.0 as JSON", error.to_string()));
    }
    segments.flush()?;
    model.segments = segments;
    if !model.has_version {
        let place = if is_text { Place::Line(1) } else { Place::Byte(offset) };
        return Err(IoError::unreadable(&path, place, "an asset with a version", "none"));
    }
    Ok(model)
}

/// The tables on their way, and what went wrong with them.
struct Loader<'m> {
    model: &'m mut Model,
    failed: Option<IoError>,
}

/// The outermost object.
struct Root<'l, 'm>(&'l mut Loader<'m>);

impl<'de> DeserializeSeed<'de> for Root<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Root<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let loader = self.0;
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "asset" => {
                    let asset = map.next_value::<Asset>()?;
                    loader.model.has_version = true;
                    if !asset.version.starts_with("2.") {
                        let found = format!("version {}", asset.version);
                        return Err(A::Error::custom(format!("{found}, not 2.0")));
                    }
                }
                "buffers" => map.next_value_seed(each(loader, add_buffer))?,
                "bufferViews" => map.next_value_seed(each(loader, add_view))?,
                "accessors" => map.next_value_seed(each(loader, add_accessor))?,
                "meshes" => map.next_value_seed(each(loader, add_mesh))?,
                "nodes" => map.next_value_seed(each(loader, add_node))?,
                "scenes" => map.next_value_seed(each(loader, add_scene))?,
                "scene" => loader.model.scene = map.next_value()?,
                "materials" => map.next_value_seed(each(loader, add_material))?,
                "textures" => map.next_value_seed(each(loader, add_texture))?,
                "images" => map.next_value_seed(each(loader, add_image))?,
                "extensionsRequired" => map.next_value_seed(each(loader, check_extension))?,
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        Ok(())
    }
}

type Add<T> = fn(&mut Model, T) -> Result<(), IoError>;

/// A list whose entries are handed on one by one.
struct Each<'l, 'm, T> {
    loader: &'l mut Loader<'m>,
    add: Add<T>,
    entry: PhantomData<T>,
}

fn each<'l, 'm, T>(loader: &'l mut Loader<'m>, add: Add<T>) -> Each<'l, 'm, T> {
    Each { loader, add, entry: PhantomData }
}

impl<'de, T: serde::Deserialize<'de>> DeserializeSeed<'de> for Each<'_, '_, T> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, T: serde::Deserialize<'de>> Visitor<'de> for Each<'_, '_, T> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while let Some(entry) = list.next_element::<T>()? {
            if let Err(error) = (self.add)(self.loader.model, entry) {
                self.loader.failed = Some(error);
                return Err(A::Error::custom("stopped"));
            }
        }
        Ok(())
    }
}

fn check_extension(model: &mut Model, name: String) -> Result<(), IoError> {
    model.required += 1;
    let is_known = KNOWN.contains(&name.as_str());
    if is_known || HARMLESS.iter().any(|prefix| name.starts_with(prefix)) {
        return Ok(());
    }
    let expected = "one that is known";
    let place = Place::Item { kind: "required extension", number: model.required - 1 };
    Err(IoError::unreadable(&model.path, place, expected, name.escape_debug().to_string()))
}

fn add_buffer(model: &mut Model, buffer: Buffer) -> Result<(), IoError> {
    let uri = model.text(buffer.uri.as_deref())?;
    let length = buffer.byte_length;
    let is_bare = buffer.uri.is_none() && buffer.extensions.meshopt.is_some();
    let origin = if is_bare { origin::COMPRESSED } else { origin::UNKNOWN };
    let record = BufferRecord { length, start: 0, uri, origin };
    Ok(model.buffers.push(record)?)
}

fn add_view(model: &mut Model, view: BufferView) -> Result<(), IoError> {
    Ok(model.views.push(ViewRecord {
        offset: view.byte_offset,
        length: view.byte_length,
        stride: view.byte_stride,
        buffer: view.buffer,
        padding: 0,
    })?)
}

fn add_accessor(model: &mut Model, accessor: Accessor) -> Result<(), IoError> {
    let lanes = match accessor.kind.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        // Nothing that we read is a matrix.
        _ => 0,
    };
    let mut record = AccessorRecord {
        offset: accessor.byte_offset,
        count: accessor.count,
        view: accessor.buffer_view.unwrap_or(NONE),
        component: accessor.component_type,
        lanes,
        is_normalized: accessor.normalized.into(),
        ..AccessorRecord::default()
    };
    if let Some(sparse) = accessor.sparse {
        record.sparse_count = sparse.count;
        record.sparse_indices_offset = sparse.indices.byte_offset;
        record.sparse_indices_view = sparse.indices.buffer_view;
        record.sparse_indices_component = sparse.indices.component_type;
        record.sparse_values_offset = sparse.values.byte_offset;
        record.sparse_values_view = sparse.values.buffer_view;
    }
    Ok(model.accessors.push(record)?)
}

fn add_mesh(model: &mut Model, mesh: Mesh) -> Result<(), IoError> {
    let first = model.primitives.len();
    let count = mesh.primitives.0.len() as u32;
    for primitive in mesh.primitives.0 {
        add_primitive(model, primitive)?;
    }
    let name = model.text(mesh.name.as_deref())?;
    Ok(model.meshes.push(MeshRecord { first, count, name, part: NONE, padding: 0 })?)
}

fn add_primitive(model: &mut Model, primitive: Primitive) -> Result<(), IoError> {
    let or_none = |number: Option<u32>| number.unwrap_or(NONE);
    let Attributes { position, uv, second_uv, colour, normal } = primitive.attributes;
    let record = PrimitiveRecord {
        // Triangles, where nothing is said.
        mode: primitive.mode.unwrap_or(4),
        position: or_none(position),
        indices: or_none(primitive.indices),
        uv: or_none(uv),
        second_uv: or_none(second_uv),
        colour: or_none(colour),
        material: or_none(primitive.material),
        draco_view: NONE,
        draco_position: NONE,
        draco_uv: NONE,
        draco_second_uv: NONE,
        draco_colour: NONE,
        decoded: NONE,
        decoded_faces: 0,
    };
    let record = match primitive.extensions.draco {
        None => record,
        Some(draco) => PrimitiveRecord {
            draco_view: draco.buffer_view,
            draco_position: or_none(draco.attributes.position),
            draco_uv: or_none(draco.attributes.uv),
            draco_second_uv: or_none(draco.attributes.second_uv),
            draco_colour: or_none(draco.attributes.colour),
            ..record
        },
    };
    let has_triangles = is_triangles(record.mode) && position.is_some();
    model.has_uvs |= has_triangles && uv.or(second_uv).is_some();
    model.has_colours |= has_triangles && colour.is_some();
    model.has_normals |= has_triangles && normal.is_some();
    Ok(model.primitives.push(record)?)
}

fn add_node(model: &mut Model, node: Node) -> Result<(), IoError> {
    let map = match &node.matrix {
        Some(columns) => from_columns(columns),
        None if node.translation.is_none() && node.rotation.is_none() && node.scale.is_none() => {
            IDENTITY
        }
        None => from_parts(
            node.translation.unwrap_or_default(),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    };
    let instances = node.extensions.instancing.map_or([NONE; 3], |instancing| {
        let attributes = instancing.attributes;
        [attributes.translation, attributes.rotation, attributes.scale]
            .map(|number| number.unwrap_or(NONE))
    });
    let record = NodeRecord {
        map,
        first_child: model.children.len(),
        child_count: node.children.0.len() as u32,
        mesh: node.mesh.unwrap_or(NONE),
        name: model.text(node.name.as_deref())?,
        instances,
        is_child: 0,
        visited: 0,
    };
    node.children.0.iter().try_for_each(|&child| model.children.push(child))?;
    Ok(model.nodes.push(record)?)
}

fn add_scene(model: &mut Model, scene: Scene) -> Result<(), IoError> {
    model.scenes.push([model.children.len(), scene.nodes.0.len() as u64])?;
    Ok(scene.nodes.0.iter().try_for_each(|&node| model.children.push(node))?)
}

fn add_material(model: &mut Model, material: Material) -> Result<(), IoError> {
    let name = model.text(material.name.as_deref())?;
    Ok(model.materials.push(materials::record(&material, name))?)
}

fn add_texture(model: &mut Model, texture: Texture) -> Result<(), IoError> {
    let extensions = texture.extensions;
    let others = [extensions.basisu, extensions.webp, extensions.avif];
    let other = others.into_iter().flatten().find_map(|image| image.source);
    Ok(model.textures.push(texture.source.or(other).unwrap_or(NONE))?)
}

fn add_image(model: &mut Model, image: Image) -> Result<(), IoError> {
    let uri = model.text(image.uri.as_deref())?;
    let name = model.text(image.name.as_deref())?;
    let view = image.buffer_view.unwrap_or(NONE);
    Ok(model.images.push(ImageRecord { uri, view, name })?)
}
