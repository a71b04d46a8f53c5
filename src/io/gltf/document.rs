//! The JSON of a file that we write: nodes, a mesh for each part, and a primitive for each surface
//! of a part.
//!
//! Surfaces of a part are in the order of their materials, each before its patches. Memory: what one
//! part, node or material says.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::gltf::document_materials::write_materials;
use crate::io::gltf::document_nodes::write_nodes;
use crate::io::gltf::values::ValuesLayout;
use crate::io::output::Output;
use crate::io::palette::Palette;
use crate::io::parts_written::{Extent, PartsWritten};
use crate::io::scene::SceneTree;
use crate::io::textures::Textures;
use crate::store::{Scratch, Table};

/// Triangles of each material: those of the input, and patches.
pub(crate) type Counts = Table<[u64; 2]>;

/// The triangles of a surface in a part.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Group {
    pub(crate) triangles: u64,
    pub(crate) material: u32,
    /// 1 for patches.
    pub(crate) lane: u32,
}

/// What is known of a part: the box of its vertices, and its groups.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PartShape {
    pub(crate) first_group: u64,
    pub(crate) end_group: u64,
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

/// What the binary chunk holds: positions, then what else vertices have, triangles, images.
pub(crate) struct Layout {
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
    pub(crate) parts: PartsWritten,
    /// By part.
    pub(crate) shapes: Table<PartShape>,
    /// Of all parts, in the order of the file.
    pub(crate) groups: Table<Group>,
    /// Of all triangles; `None` where they name no material.
    pub(crate) counts: Option<Counts>,
    pub(crate) values: ValuesLayout,
    pub(crate) textures: Textures,
    /// Of all images, once the document is written.
    pub(crate) image_bytes: u64,
    pub(crate) scene: Option<SceneTree>,
    /// What numbers are multiplied by for metres.
    pub(crate) metres: f64,
    pub(crate) scratch: Scratch,
}

impl Layout {
    pub(crate) fn vertex_bytes(&self) -> u64 {
        12 * self.vertices
    }

    pub(crate) fn index_bytes(&self) -> u64 {
        12 * self.triangles
    }

    pub(crate) fn values_bytes(&self) -> u64 {
        self.values.stride() * self.vertices
    }

    pub(crate) fn binary_bytes(&self) -> u64 {
        self.vertex_bytes() + self.values_bytes() + self.index_bytes() + self.image_bytes
    }

    pub(crate) fn extent(&self) -> Extent {
        Extent { vertices: self.vertices, triangles: self.triangles, bytes: 0 }
    }

    /// Accessors of the vertices of a part: positions, and one for each thing that they have besides.
    fn vertex_accessors(&self) -> u64 {
        let has = self.values.has;
        1 + [has.normals, has.uvs, has.colours].into_iter().map(u64::from).sum::<u64>()
    }

    /// The numbers of materials in the file, by material and lane: those in use are numbered on.
    fn material_numbers(&mut self) -> Result<Table<[u32; 2]>, IoError> {
        let mut numbers = Table::new(&self.scratch, SHARE_BYTES);
        let mut next = 0;
        let Some(counts) = &mut self.counts else { return Ok(numbers) };
        for material in 0..counts.len() {
            let used = counts.get(material)?.map(|count| u32::from(count > 0));
            numbers.push([next, next + used[0]])?;
            next += used[0] + used[1];
        }
        Ok(numbers)
    }
}

/// Memory for the numbers of materials.
const SHARE_BYTES: u64 = 64 << 10;

/// Writes the text, without padding.
pub(crate) fn write_document(
    output: &mut Output,
    layout: &mut Layout,
    palette: Option<&Palette>,
) -> Result<(), IoError> {
    output.write(br#"{"asset":{"version":"2.0","generator":"brickmend"},"scene":0,"#)?;
    if layout.vertices == 0 {
        return output.write(br#""scenes":[{"nodes":[0]}],"nodes":[{}]}"#);
    }
    write_nodes(output, layout)?;
    if let (Some(palette), true) = (palette, layout.triangles > 0) {
        write_materials(output, layout, palette)?;
    }
    write_meshes(output, layout)?;
    write_accessors(output, layout)?;
    write_views(output, layout)?;
    let bytes = layout.binary_bytes();
    output.write(format!(r#","buffers":[{{"byteLength":{bytes}}}]}}"#).as_bytes())
}

/// Writes the views of the buffer: positions, values, indices, and one for each image.
fn write_views(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    let (vertices, indices) = (layout.vertex_bytes(), layout.index_bytes());
    let (values, stride) = (layout.values_bytes(), layout.values.stride());
    // 34962 and 34963: for vertices, for indices. Several accessors of a view want a stride.
    let packed = if layout.parts.len() > 1 { r#""byteStride":12,"# } else { "" };
    let view = format!(r#"{{"buffer":0,{packed}"byteLength":{vertices},"target":34962}}"#);
    output.write(format!(r#","bufferViews":[{view}"#).as_bytes())?;
    let mut offset = vertices;
    if values > 0 {
        let place = format!(r#""byteOffset":{offset},"byteLength":{values},"byteStride":{stride}"#);
        output.write(format!(r#",{{"buffer":0,{place},"target":34962}}"#).as_bytes())?;
        offset += values;
    }
    if indices > 0 {
        let place = format!(r#""byteOffset":{offset},"byteLength":{indices}"#);
        output.write(format!(r#",{{"buffer":0,{place},"target":34963}}"#).as_bytes())?;
        offset += indices;
    }
    for number in 0..layout.textures.count() as u32 {
        let bytes = layout.textures.image(number)?.bytes;
        let place = format!(r#""byteOffset":{offset},"byteLength":{bytes}"#);
        output.write(format!(r#",{{"buffer":0,{place}}}"#).as_bytes())?;
        let padded = bytes.checked_next_multiple_of(4).unwrap_or(u64::MAX);
        offset = offset.saturating_add(padded);
        layout.image_bytes = layout.image_bytes.saturating_add(padded);
    }
    output.write(b"]")
}

/// The members of `attributes` in a primitive, from an accessor on.
fn attributes(values: ValuesLayout, first: u64) -> String {
    let mut text = format!(r#""POSITION":{first}"#);
    let names = [
        (values.has.normals, "NORMAL"),
        (values.has.uvs, "TEXCOORD_0"),
        (values.has.colours, "COLOR_0"),
    ];
    for ((_, name), number) in names.into_iter().filter(|(has, _)| *has).zip(first + 1..) {
        text.push_str(&format!(r#","{name}":{number}"#));
    }
    text
}

/// A member of an object, unless there is no name.
pub(crate) fn name_member(name: &str) -> String {
    match name {
        "" => String::new(),
        name => {
            format!(r#""name":{},"#, serde_json::to_string(name).expect("texts serialise"))
        }
    }
}

/// Writes a mesh for each part: points where there is no triangle.
fn write_meshes(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    output.write(br#","meshes":["#)?;
    let numbers = &mut layout.material_numbers()?;
    let has_materials = layout.counts.is_some();
    let mut accessor = 0;
    for part in 0..layout.parts.len() {
        let written = layout.parts.get(part, layout.extent())?;
        let comma = if part > 0 { "," } else { "" };
        let name = name_member(&written.name);
        output.write(format!(r#"{comma}{{{name}"primitives":["#).as_bytes())?;
        let attributes = attributes(layout.values, accessor);
        accessor += layout.vertex_accessors();
        let PartShape { first_group, end_group, .. } = layout.shapes.get(part)?;
        if first_group == end_group {
            let points = format!(r#"{{"attributes":{{{attributes}}},"mode":0}}"#);
            output.write(points.as_bytes())?;
        }
        for group in first_group..end_group {
            let Group { material, lane, .. } = layout.groups.get(group)?;
            let comma = if group > first_group { "," } else { "" };
            let material = match has_materials {
                true => {
                    let number = numbers.get(material.into())?[lane as usize];
                    format!(r#","material":{number}"#)
                }
                false => String::new(),
            };
            let indices = format!(r#""indices":{accessor}{material}"#);
            accessor += 1;
            let primitive = format!(r#"{comma}{{"attributes":{{{attributes}}},{indices}}}"#);
            output.write(primitive.as_bytes())?;
        }
        output.write(b"]}")?;
    }
    output.write(b"]")
}

/// Writes the accessors, part by part: positions, values, then the indices of each surface.
fn write_accessors(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    output.write(br#","accessors":["#)?;
    let index_view = if layout.values_bytes() > 0 { 2 } else { 1 };
    let mut offset = 0;
    for part in 0..layout.parts.len() {
        let written = layout.parts.get(part, layout.extent())?;
        let shape = layout.shapes.get(part)?;
        let comma = if part > 0 { "," } else { "" };
        output.write(comma.as_bytes())?;
        write_vertex_accessors(output, layout.values, written.vertices, &shape)?;
        for group in shape.first_group..shape.end_group {
            let triangles = layout.groups.get(group)?.triangles;
            let place = format!(r#""byteOffset":{offset},"count":{}"#, 3 * triangles);
            offset += 12 * triangles;
            let index = r#""componentType":5125,"type":"SCALAR","#;
            let accessor = format!(r#",{{"bufferView":{index_view},{index}{place}}}"#);
            output.write(accessor.as_bytes())?;
        }
    }
    output.write(b"]")
}

fn write_vertex_accessors(
    output: &mut Output,
    values: ValuesLayout,
    vertices: Range<u64>,
    shape: &PartShape,
) -> Result<(), IoError> {
    // The very numbers as doubles; what has no number in JSON is the largest there is.
    let [low, high] = [shape.low, shape.high].map(|corner| {
        let finite = corner.map(|x| f64::from(x.clamp(f32::MIN, f32::MAX)));
        serde_json::to_string(&finite).expect("numbers serialise")
    });
    let (first, count) = (vertices.start, vertices.end - vertices.start);
    let shift = |bytes: u64| match bytes {
        0 => String::new(),
        bytes => format!(r#""byteOffset":{bytes},"#),
    };
    let place = shift(12 * first);
    let position =
        format!(r#"{{"bufferView":0,{place}"componentType":5126,"type":"VEC3","count":{count}"#);
    output.write(format!(r#"{position},"min":{low},"max":{high}}}"#).as_bytes())?;
    let lists = [
        (values.has.normals, 0, r#""componentType":5126,"type":"VEC3""#),
        (values.has.uvs, values.uv_offset(), r#""componentType":5126,"type":"VEC2""#),
        (
            values.has.colours,
            values.colour_offset(),
            r#""componentType":5121,"normalized":true,"type":"VEC4""#,
        ),
    ];
    for (_, offset, kind) in lists.into_iter().filter(|(has, ..)| *has) {
        let offset = offset + values.stride() * first;
        let place = format!(r#""bufferView":1,"byteOffset":{offset},"count":{count}"#);
        output.write(format!(",{{{place},{kind}}}").as_bytes())?;
    }
    Ok(())
}
