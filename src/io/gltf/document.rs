//! The JSON of a file that we write: one node with one mesh, and a primitive for each surface.
//!
//! Surfaces are in the order of their materials, each before its patches; only those in use are
//! written. Memory: one material.

use serde::Serialize;

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::io::palette::Palette;
use crate::mesh::{Material, Surface};
use crate::store::Table;

const STRENGTH: &str = "KHR_materials_emissive_strength";

/// Triangles of each material: those of the input, and patches.
pub(crate) type Counts = Table<[u64; 2]>;

/// What the binary chunk holds: vertices first, then triangles.
pub(crate) struct Layout {
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
    /// Of the vertices.
    pub(crate) bounds: [[f32; 3]; 2],
    /// In the order of the file; `None` where triangles name no material.
    pub(crate) counts: Option<Counts>,
}

impl Layout {
    pub(crate) fn vertex_bytes(&self) -> u64 {
        12 * self.vertices
    }

    pub(crate) fn index_bytes(&self) -> u64 {
        12 * self.triangles
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
    let (vertices, indices) = (layout.vertex_bytes(), layout.index_bytes());
    // 34962 and 34963: for vertices, for indices.
    let view = format!(r#"{{"buffer":0,"byteLength":{vertices},"target":34962}}"#);
    output.write(format!(r#","bufferViews":[{view}"#).as_bytes())?;
    if indices > 0 {
        let offset = format!(r#""byteOffset":{vertices},"byteLength":{indices}"#);
        output.write(format!(r#",{{"buffer":0,{offset},"target":34963}}"#).as_bytes())?;
    }
    output.write(format!(r#"],"buffers":[{{"byteLength":{}}}]}}"#, vertices + indices).as_bytes())
}

/// Writes the mesh: points where there is no triangle.
fn write_mesh(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    output.write(br#","meshes":[{"primitives":["#)?;
    if layout.triangles == 0 {
        return output.write(br#"{"attributes":{"POSITION":0},"mode":0}]}]"#);
    }
    let has_materials = layout.counts.is_some();
    let mut number = 0;
    layout.for_each_surface(|_| {
        let comma = if number > 0 { "," } else { "" };
        let indices = number + 1;
        let material =
            if has_materials { format!(r#","material":{number}"#) } else { String::new() };
        number += 1;
        let attributes = r#"{"attributes":{"POSITION":0},"indices":"#;
        output.write(format!("{comma}{attributes}{indices}{material}}}").as_bytes())
    })?;
    output.write(b"]}]")
}

/// Writes the accessors: positions, then the indices of each surface.
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
    let has_triangles = layout.triangles > 0;
    let mut offset = 0;
    layout.for_each_surface(|triangles| {
        if !has_triangles {
            return Ok(());
        }
        let place = format!(r#""byteOffset":{offset},"count":{}"#, 3 * triangles);
        offset += 12 * triangles;
        let index = r#"{"bufferView":1,"componentType":5125,"type":"SCALAR","#;
        output.write(format!(",{index}{place}}}").as_bytes())
    })?;
    output.write(b"]")
}

/// Writes the materials in use, and which extension they need.
fn write_materials(
    output: &mut Output,
    layout: &mut Layout,
    palette: &Palette,
) -> Result<(), IoError> {
    let Some(counts) = &mut layout.counts else { return Ok(()) };
    let count = counts.len();
    output.write(br#","materials":["#)?;
    let mut written = 0;
    let mut has_strength = false;
    let mut write = |number: u64, mut material: Material| {
        let used = if number < count { counts.get(number)? } else { [0; 2] };
        for (suffix, _) in
            ["", Surface::PATCH_ENDING].iter().zip(used).filter(|&(_, count)| count > 0)
        {
            material.name.push_str(suffix);
            let text = Stated::new(&material);
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
    if has_strength {
        output.write(format!(r#","extensionsUsed":["{STRENGTH}"]"#).as_bytes())?;
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
    metallic_factor: f32,
    roughness_factor: f32,
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
    fn new(material: &'m Material) -> Self {
        let unit = |number: f32| if number.is_nan() { 0.0 } else { number.clamp(0.0, 1.0) };
        let [red, green, blue] = material.diffuse.unwrap_or([1.0; 3]).map(unit);
        let alpha = if material.transparent { unit(material.opacity.unwrap_or(1.0)) } else { 1.0 };
        // Light beyond 1 is a factor of its own.
        let emissive = material.emissive.map(|colour| colour.map(|c| c.clamp(0.0, f32::MAX)));
        let strongest = emissive.map_or(0.0, |colour| colour.into_iter().fold(0.0, f32::max));
        let strength = (strongest > 1.0).then_some(strongest);
        Self {
            name: &material.name,
            alpha_mode: material.transparent.then_some("BLEND"),
            pbr_metallic_roughness: StatedPbr {
                base_color_factor: [red, green, blue, alpha],
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
