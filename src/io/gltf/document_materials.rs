//! The materials of a file that we write, and the images that they show.
//!
//! In the order of their numbers, each before its patches; only those in use are written. Memory:
//! one material.

use serde::Serialize;

use crate::io::error::IoError;
use crate::io::gltf::document::Layout;
use crate::io::image_kind::ImageKind;
use crate::io::output::Output;
use crate::io::palette::Palette;
use crate::io::textures::Shown;
use crate::mesh::{Material, OtherMaps, Surface};

const STRENGTH: &str = "KHR_materials_emissive_strength";

/// Writes the materials in use, their images, and which extensions they need.
pub(crate) fn write_materials(
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
        let shown = textures.all_of_material(number as u32)?;
        let lost = material
            .maps
            .images()
            .into_iter()
            .zip(&shown[1..])
            .filter(|((_, image), shown)| image.is_some() && shown.is_none());
        let lost = lost.fold(OtherMaps::default(), |all, ((kind, _), _)| all.with(kind));
        material = material.losing(lost);
        for (suffix, _) in
            ["", Surface::PATCH_ENDING].iter().zip(used).filter(|&(_, count)| count > 0)
        {
            material.name.push_str(suffix);
            let text = Stated::new(&material, shown);
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
    normal_texture: Option<StatedTexture>,
    #[serde(skip_serializing_if = "Option::is_none")]
    occlusion_texture: Option<StatedTexture>,
    #[serde(skip_serializing_if = "Option::is_none")]
    emissive_texture: Option<StatedTexture>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    metallic_roughness_texture: Option<StatedTexture>,
    metallic_factor: f32,
    roughness_factor: f32,
}

#[derive(Serialize)]
struct StatedTexture {
    index: u32,
    /// Of normals.
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<f32>,
    /// Of the shadows of hollows.
    #[serde(skip_serializing_if = "Option::is_none")]
    strength: Option<f32>,
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
    fn new(material: &'m Material, shown: [Option<u32>; 5]) -> Self {
        let plain = |index| StatedTexture { index, scale: None, strength: None };
        let [texture, normal, gloss, emission, occlusion] = shown.map(|index| index.map(plain));
        let normal = normal.map(|normal| {
            let scale = material.maps.normal.as_ref().map(|(_, scale)| *scale);
            StatedTexture {
                scale: scale.filter(|&scale| scale != 1.0 && scale.is_finite()),
                ..normal
            }
        });
        let occlusion = occlusion.map(|occlusion| {
            let strength =
                material.maps.occlusion.as_ref().map(|(_, strength)| strength.clamp(0.0, 1.0));
            StatedTexture { strength: strength.filter(|&strength| strength < 1.0), ..occlusion }
        });
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
                base_color_texture: texture,
                metallic_roughness_texture: gloss,
                metallic_factor: unit(material.metallic.unwrap_or(0.0)),
                roughness_factor: unit(material.roughness.unwrap_or(1.0)),
            },
            normal_texture: normal,
            occlusion_texture: occlusion,
            emissive_texture: emission,
            emissive_factor: emissive
                .map(|colour| colour.map(|channel| unit(channel / strength.unwrap_or(1.0)))),
            extensions: strength.map(|emissive_strength| StatedExtensions {
                emissive: StatedStrength { emissive_strength },
            }),
        }
    }
}
