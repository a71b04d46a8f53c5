//! Materials of a glTF file: what is stated of them, and what it means to us.

use bytemuck::Zeroable;

use crate::io::error::IoError;
use crate::io::gltf::model::{MaterialRecord, Model, NONE};
use crate::io::gltf::schema::Material as Stated;
use crate::mesh::Material;

const TRANSPARENT: u32 = 1;
const HAS_BASE: u32 = 2;
const HAS_EMISSIVE: u32 = 4;
const HAS_METALLIC: u32 = 8;
const HAS_ROUGHNESS: u32 = 16;
const BLENDS: u32 = 32;

/// What is stated; the texture by its number.
pub(crate) fn record(material: &Stated, name: u32) -> MaterialRecord {
    let pbr = &material.pbr_metallic_roughness;
    let extensions = &material.extensions;
    let blends = material.alpha_mode.as_deref() == Some("BLEND");
    let transmits = extensions.transmission.as_ref().is_some_and(|t| t.transmission_factor > 0.0);
    let strength = extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength);
    let flags = [
        (blends || transmits, TRANSPARENT),
        (blends, BLENDS),
        (pbr.base_color_factor.is_some(), HAS_BASE),
        (material.emissive_factor.is_some(), HAS_EMISSIVE),
        // What is not stated is one, which other formats do not know.
        (true, HAS_METALLIC),
        (true, HAS_ROUGHNESS),
    ];
    let emissive = material.emissive_factor.unwrap_or_default();
    MaterialRecord {
        name,
        flags: flags.iter().map(|&(has, flag)| if has { flag } else { 0 }).sum(),
        base: pbr.base_color_factor.unwrap_or([1.0; 4]),
        emissive: emissive.map(|channel| channel * strength.unwrap_or(1.0)),
        metallic: pbr.metallic_factor.unwrap_or(1.0),
        roughness: pbr.roughness_factor.unwrap_or(1.0),
        texture: pbr.base_color_texture.as_ref().map_or(NONE, |texture| texture.index),
        ..MaterialRecord::zeroed()
    }
}

/// The material of a number in the file; without a number, one of which nothing is known.
pub(crate) fn material(model: &mut Model, number: u32) -> Result<Material, IoError> {
    if number == NONE {
        return Ok(Material::default());
    }
    let record = model.material(number)?;
    let has = |flag: u32| record.flags & flag != 0;
    // What is too large for a number is not stated.
    let is_finite = |colour: &[f32; 3]| colour.iter().all(|channel| channel.is_finite());
    let [red, green, blue, alpha] = record.base;
    Ok(Material {
        name: model.text_of(record.name)?.unwrap_or_default(),
        transparent: has(TRANSPARENT),
        diffuse: has(HAS_BASE).then_some([red, green, blue]).filter(is_finite),
        opacity: has(BLENDS).then_some(alpha.clamp(0.0, 1.0)),
        emissive: has(HAS_EMISSIVE).then_some(record.emissive).filter(is_finite),
        metallic: has(HAS_METALLIC).then_some(record.metallic).filter(|x| x.is_finite()),
        roughness: has(HAS_ROUGHNESS).then_some(record.roughness).filter(|x| x.is_finite()),
        texture: image_of(model, record.texture)?,
    })
}

/// The address of a texture's image, if it is a file.
fn image_of(model: &mut Model, texture: u32) -> Result<Option<String>, IoError> {
    if u64::from(texture) >= model.textures.len() {
        return Ok(None);
    }
    let image = model.textures.get(texture.into())?;
    if u64::from(image) >= model.images.len() {
        return Ok(None);
    }
    let uri = model.images.get(image.into())?;
    model.text_of(uri)
}
