//! The JSON of a file that we write: one node with one mesh, and a primitive for each surface.
//!
//! Surfaces are in the order of their materials, each before its patches; only those in use are
//! written, and the images that they show. Memory: one material.

use serde::Serialize;

use crate::io::error::IoError;
use crate::io::gltf::values::ValuesLayout;
use crate::io::image_kind::ImageKind;
use crate::io::output::Output;
use crate::io::palette::Palette;
use crate::io::textures::{Shown, Textures};
use crate::mesh::{Material, Surface};
use crate::store::Table;

const STRENGTH: &str = "KHR_materials_emissive_strength";

/// Triangles of each material: those of the input, and patches.
pub(crate) type Counts = Table<[u64; 2]>;

/// What the binary chunk holds: positions, then what else vertices have, triangles, images.
pub(crate) struct Layout {
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
    /// Of the vertices.
    pub(crate) bounds: [[f32; 3]; 2],
    /// In the order of the file; `None` where triangles name no material.
    pub(crate) counts: Option<Counts>,
    pub(crate) values: ValuesLayout,
    pub(crate) textures: Textures,
    /// Of all images, once the document is written.
    pub(crate) image_bytes: u64,
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

    /// Accessors of vertices: positions, and one for each thing that they have besides.
    fn vertex_accessors(&self) -> u64 {
        let has = self.values.has;
        1 + [has.normals, has.uvs, has.colours].into_iter().map(u64::from).sum::<u64>()
    }

    /// Shows the triangles of each surface that has any.
    fn for_each_surface(
        &mut self,
        mut visit: impl FnMut(u64) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let Some(counts) = &mut self.counts else { return visit(self.triangles) };
        for material in 0..counts.len() {
            let used = counts.get(material)?.into_iter().filter(|&count| count > 0);
            used.into_iter().try_for_each(&mut visit)?;
        }
        Ok(())
    }
}

/// Writes the text, without padding.
pub(crate) fn write_document(
    output: &mut Output,
    layout: &mut Layout,
    palette: Option<&Palette>,
) -> Result<(), IoError> {
    output.write(br#"{"asset":{"version":"2.0","generator":"brickmend"},"scene":0,"#)?;
    output.write(br#""scenes":[{"nodes":[0]}],"nodes":["#)?;
    if layout.vertices == 0 {
        return output.write(b"{}]}");
    }
    output.write(br#"{"mesh":0}]"#)?;
    if let (Some(palette), true) = (palette, layout.triangles > 0) {
        write_materials(output, layout, palette)?;
    }
    write_mesh(output, layout)?;
    write_accessors(output, layout)?;
    write_views(output, layout)?;
    let bytes = layout.binary_bytes();
    output.write(format!(r#","buffers":[{{"byteLength":{bytes}}}]}}"#).as_bytes())
}

/// Writes the views of the buffer: positions, values, indices, and one for each image.
fn write_views(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    let (vertices, indices) = (layout.vertex_bytes(), layout.index_bytes());
    let (values, stride) = (layout.values_bytes(), layout.values.stride());
    // 34962 and 34963: for vertices, for indices.
    let view = format!(r#"{{"buffer":0,"byteLength":{vertices},"target":34962}}"#);
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

/// Writes images and textures, one of each for an image; the extensions that they need.
fn write_textures(output: &mut Output, layout: &mut Layout) -> Result<Vec<&'static str>, IoError> {
    let mut extensions = Vec::new();
    let count = layout.textures.count() as u32;
    if count == 0 {
        return Ok(extensions);
    }
    let first = 1 + u32::from(layout.values_bytes() > 0) + u32::from(layout.triangles > 0);
    output.write(br#","images":["#)?;
    for number in 0..count {
        let Shown { texture, kind, .. } = layout.textures.image(number)?;
        let name = serde_json::to_string(&texture.name()).expect("texts serialise");
        let comma = if number > 0 { "," } else { "" };
        let (view, media) = (first + number, kind.media_type());
        let image = format!(r#"{comma}{{"bufferView":{view},"mimeType":"{media}","name":{name}}}"#);
        output.write(image.as_bytes())?;
    }
    // 10497: images repeat.
    output.write(br#"],"samplers":[{"wrapS":10497,"wrapT":10497}],"textures":["#)?;
    for number in 0..count {
        let comma = if number > 0 { "," } else { "" };
        let source = match extension_of(layout.textures.image(number)?.kind) {
            None => format!(r#""source":{number}"#),
            Some(name) => {
                if !extensions.contains(&name) {
                    extensions.push(name);
                }
                format!(r#""extensions":{{"{name}":{{"source":{number}}}}}"#)
            }
        };
        output.write(format!(r#"{comma}{{"sampler":0,{source}}}"#).as_bytes())?;
    }
    output.write(b"]")?;
    Ok(extensions)
}

/// The extension that a kind of image needs.
fn extension_of(kind: ImageKind) -> Option<&'static str> {
    match kind {
        ImageKind::WebP => Some("EXT_texture_webp"),
        ImageKind::Ktx2 => Some("KHR_texture_basisu"),
        ImageKind::Avif => Some("EXT_texture_avif"),
        ImageKind::Png | ImageKind::Jpeg | ImageKind::Other => None,
    }
}

/// The members of `attributes` in a primitive.
fn attributes(values: ValuesLayout) -> String {
    let mut text = r#""POSITION":0"#.to_owned();
    let names = [
        (values.has.normals, "NORMAL"),
        (values.has.uvs, "TEXCOORD_0"),
        (values.has.colours, "COLOR_0"),
    ];
    for ((_, name), number) in names.into_iter().filter(|(has, _)| *has).zip(1..) {
        text.push_str(&format!(r#","{name}":{number}"#));
    }
    text
}

/// Writes the mesh: points where there is no triangle.
fn write_mesh(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    output.write(br#","meshes":[{"primitives":["#)?;
    let attributes = attributes(layout.values);
    if layout.triangles == 0 {
        let points = format!(r#"{{"attributes":{{{attributes}}},"mode":0}}]}}]"#);
        return output.write(points.as_bytes());
    }
    let first = layout.vertex_accessors();
    let has_materials = layout.counts.is_some();
    let mut number = 0;
    layout.for_each_surface(|_| {
        let comma = if number > 0 { "," } else { "" };
        let indices = number + first;
        let material =
            if has_materials { format!(r#","material":{number}"#) } else { String::new() };
        number += 1;
        let indices = format!(r#""indices":{indices}{material}"#);
        output.write(format!(r#"{comma}{{"attributes":{{{attributes}}},{indices}}}"#).as_bytes())
    })?;
    output.write(b"]}]")
}

/// Writes the accessors: positions, values, then the indices of each surface.
fn write_accessors(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    // The very numbers as doubles; what has no number in JSON is the largest there is.
    let [low, high] = layout.bounds.map(|corner| {
        let finite = corner.map(|x| f64::from(x.clamp(f32::MIN, f32::MAX)));
        serde_json::to_string(&finite).expect("numbers serialise")
    });
    let position = r#"{"bufferView":0,"componentType":5126,"type":"VEC3","count":"#;
    let vertices = layout.vertices;
    output.write(
        format!(r#","accessors":[{position}{vertices},"min":{low},"max":{high}}}"#).as_bytes(),
    )?;
    let values = layout.values;
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
        let place = format!(r#""bufferView":1,"byteOffset":{offset},"count":{vertices}"#);
        output.write(format!(",{{{place},{kind}}}").as_bytes())?;
    }
    let has_triangles = layout.triangles > 0;
    let view = if layout.values_bytes() > 0 { 2 } else { 1 };
    let mut offset = 0;
    layout.for_each_surface(|triangles| {
        if !has_triangles {
            return Ok(());
        }
        let place = format!(r#""byteOffset":{offset},"count":{}"#, 3 * triangles);
        offset += 12 * triangles;
        let index = r#""componentType":5125,"type":"SCALAR","#;
        output.write(format!(r#",{{"bufferView":{view},{index}{place}}}"#).as_bytes())
    })?;
    output.write(b"]")
}

/// Writes the materials in use, their images, and which extensions they need.
fn write_materials(
    output: &mut Output,
    layout: &mut Layout,
    palette: &Palette,
) -> Result<(), IoError> {
    let Layout { counts: Some(counts), textures, .. } = layout else { return Ok(()) };
    let count = counts.len();
    output.write(br#","materials":["#)?;
    let mut written = 0;
    let mut has_strength = false;
    let mut write = |number: u64, mut material: Material| {
        let used = if number < count { counts.get(number)? } else { [0; 2] };
        let texture = textures.of_material(number as u32)?;
        for (suffix, _) in
            ["", Surface::PATCH_ENDING].iter().zip(used).filter(|&(_, count)| count > 0)
        {
            material.name.push_str(suffix);
            let text = Stated::new(&material, texture);
            has_strength |= text.extensions.is_some();
            let text = serde_json::to_string(&text).expect("numbers and texts serialise");
            let comma = if written > 0 { "," } else { "" };
            output.write(format!("{comma}{text}").as_bytes())?;
            written += 1;
        }
        Ok::<_, IoError>(())
    };
    let mut known = 0;
    palette.for_each(|number, material| {
        known = u64::from(number) + 1;
        write(number.into(), material)
    })?;
    // Of what the palette does not know, at least the number is right.
    (known..count).try_for_each(|number| write(number, Material::default()))?;
    output.write(b"]")?;
    let required = write_textures(output, layout)?;
    let quoted = |names: &[&str]| format!("[\"{}\"]", names.join("\",\""));
    if !required.is_empty() {
        output.write(format!(r#","extensionsRequired":{}"#, quoted(&required)).as_bytes())?;
    }
    let used: Vec<_> = has_strength.then_some(STRENGTH).into_iter().chain(required).collect();
    if !used.is_empty() {
        output.write(format!(r#","extensionsUsed":{}"#, quoted(&used)).as_bytes())?;
    }
    Ok(())
}

/// A material as the file has it.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Stated<'m> {
    #[serde(skip_serializing_if = "str::is_empty")]
    name: &'m str,
    #[serde(skip_serializing_if = "Option::is_none")]
    alpha_mode: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alpha_cutoff: Option<f32>,
    pbr_metallic_roughness: StatedPbr,
    #[serde(skip_serializing_if = "Option::is_none")]
    emissive_factor: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    extensions: Option<StatedExtensions>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StatedPbr {
    base_color_factor: [f32; 4],
    #[serde(skip_serializing_if = "Option::is_none")]
    base_color_texture: Option<StatedTexture>,
    metallic_factor: f32,
    roughness_factor: f32,
}

#[derive(Serialize)]
struct StatedTexture {
    index: u32,
}

#[derive(Serialize)]
struct StatedExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    emissive: StatedStrength,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StatedStrength {
    emissive_strength: f32,
}

impl<'m> Stated<'m> {
    fn new(material: &'m Material, texture: Option<u32>) -> Self {
        let unit = |number: f32| if number.is_nan() { 0.0 } else { number.clamp(0.0, 1.0) };
        let [red, green, blue] = material.diffuse.unwrap_or([1.0; 3]).map(unit);
        let alpha = if material.transparent { unit(material.opacity.unwrap_or(1.0)) } else { 1.0 };
        let cutoff = material.alpha_cutoff.filter(|_| !material.transparent && texture.is_some());
        let cutoff = cutoff.map(|cutoff| cutoff.max(0.0));
        // Light beyond 1 is a factor of its own.
        let emissive = material.emissive.map(|colour| colour.map(|c| c.clamp(0.0, f32::MAX)));
        let strongest = emissive.map_or(0.0, |colour| colour.into_iter().fold(0.0, f32::max));
        let strength = (strongest > 1.0).then_some(strongest);
        Self {
            name: &material.name,
            alpha_mode: if material.transparent { Some("BLEND") } else { cutoff.map(|_| "MASK") },
            alpha_cutoff: cutoff,
            pbr_metallic_roughness: StatedPbr {
                base_color_factor: [red, green, blue, alpha],
                base_color_texture: texture.map(|index| StatedTexture { index }),
                metallic_factor: unit(material.metallic.unwrap_or(0.0)),
                roughness_factor: unit(material.roughness.unwrap_or(1.0)),
            },
            emissive_factor: emissive
                .map(|colour| colour.map(|channel| unit(channel / strength.unwrap_or(1.0)))),
            extensions: strength.map(|emissive_strength| StatedExtensions {
                emissive: StatedStrength { emissive_strength },
            }),
        }
    }
}
