//! Materials of a glTF file: what is stated of them, and what it means to us.

use bytemuck::Zeroable;

use crate::io::error::IoError;
use crate::io::gltf::buffers::unescaped;
use crate::io::gltf::model::{MaterialRecord, Model, NONE};
use crate::io::gltf::schema::Material as Stated;
use crate::io::gltf::schema::TextureInfo;
use crate::io::gltf::text::DATA_MARK;
use crate::mesh::{Image, Maps, Material, OtherMaps, Texture};

const TRANSPARENT: u32 = 1;
const HAS_BASE: u32 = 2;
const HAS_EMISSIVE: u32 = 4;
const BLENDS: u32 = 32;
const HAS_CUTOFF: u32 = 64;
/// Where images are cut off, if it is not stated.
const CUTOFF: f32 = 0.5;
/// Where the set of further maps begins among the flags.
const MAPS_SHIFT: u32 = 8;

/// Texture coordinates as they are.
pub(crate) const UV_IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Kinds of further maps, in the order of [`MaterialRecord::maps`].
const KINDS: [OtherMaps; 4] =
    [OtherMaps::NORMAL, OtherMaps::GLOSS, OtherMaps::EMISSION, OtherMaps::OCCLUSION];

/// What is stated; the texture by its number.
pub(crate) fn record(material: &Stated, name: u32) -> MaterialRecord {
    let pbr = &material.pbr_metallic_roughness;
    let extensions = &material.extensions;
    let blends = material.alpha_mode.as_deref() == Some("BLEND");
    let cuts = material.alpha_mode.as_deref() == Some("MASK");
    let transmits = extensions.transmission.as_ref().is_some_and(|t| t.transmission_factor > 0.0);
    let strength = extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength);
    let flags = [
        (blends || transmits, TRANSPARENT),
        (blends, BLENDS),
        (pbr.base_color_factor.is_some(), HAS_BASE),
        (material.emissive_factor.is_some(), HAS_EMISSIVE),
        (cuts, HAS_CUTOFF),
    ];
    let flags: u32 = flags.iter().map(|&(has, flag)| if has { flag } else { 0 }).sum();
    let maps = [
        &material.normal_texture,
        &pbr.metallic_roughness_texture,
        &material.emissive_texture,
        &material.occlusion_texture,
    ];
    // There are one pair of coordinates: those of the first map. Others on the same are kept.
    let leading = [&pbr.base_color_texture].into_iter().chain(maps).flatten().next();
    let (uv_set, uv_map) = leading.map_or((0, UV_IDENTITY), uv_map_of);
    let kept = maps.map(|map| map.as_ref().filter(|map| uv_map_of(map) == (uv_set, uv_map)));
    let lost = (0..4).filter(|&i| maps[i].is_some() && kept[i].is_none());
    let lost = lost.fold(OtherMaps::default(), |all, i| all.with(KINDS[i]));
    let scale_of =
        |map: &Option<TextureInfo>| map.as_ref().and_then(|map| map.scale).unwrap_or(1.0);
    let emissive = material.emissive_factor.unwrap_or_default();
    MaterialRecord {
        name,
        flags: flags | u32::from(lost.bits()) << MAPS_SHIFT,
        uv_set,
        uv_map,
        base: pbr.base_color_factor.unwrap_or([1.0; 4]),
        emissive: emissive.map(|channel| channel * strength.unwrap_or(1.0)),
        metallic: pbr.metallic_factor.unwrap_or(1.0),
        roughness: pbr.roughness_factor.unwrap_or(1.0),
        alpha_cutoff: material.alpha_cutoff.unwrap_or(CUTOFF),
        texture: pbr.base_color_texture.as_ref().map_or(NONE, |texture| texture.index),
        maps: kept.map(|map| map.map_or(NONE, |texture| texture.index)),
        normal_scale: scale_of(&material.normal_texture),
        occlusion_strength: scale_of(&material.occlusion_texture),
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
    let [normal, gloss, emission, occlusion] = record.maps;
    let maps = Maps {
        normal: image_of(model, normal)?.map(|image| (image, record.normal_scale)),
        gloss: image_of(model, gloss)?,
        emission: image_of(model, emission)?,
        occlusion: image_of(model, occlusion)?.map(|image| (image, record.occlusion_strength)),
    };
    let named = (0..4).filter(|&i| record.maps[i] != NONE).map(|i| KINDS[i]);
    let lost = named.filter(|kind| !maps.kinds().has(*kind));
    let lost = lost.fold(OtherMaps::from_bits((record.flags >> MAPS_SHIFT) as u8), OtherMaps::with);
    let material = Material {
        name: model.text_of(record.name)?.unwrap_or_default(),
        transparent: has(TRANSPARENT),
        diffuse: has(HAS_BASE).then_some([red, green, blue]).filter(is_finite),
        opacity: has(BLENDS).then_some(alpha.clamp(0.0, 1.0)),
        emissive: has(HAS_EMISSIVE).then_some(record.emissive).filter(is_finite),
        // What is not stated is one, which other formats do not know.
        metallic: Some(record.metallic).filter(|x| x.is_finite()),
        roughness: Some(record.roughness).filter(|x| x.is_finite()),
        alpha_cutoff: has(HAS_CUTOFF).then_some(record.alpha_cutoff).filter(|x| x.is_finite()),
        texture: image_of(model, record.texture)?,
        maps,
        other_maps: OtherMaps::default(),
    };
    Ok(material.losing(lost))
}

/// Which texture coordinates a texture takes, and how they are mapped.
fn uv_map_of(texture: &TextureInfo) -> (u32, [[f32; 3]; 2]) {
    let Some(transform) = &texture.extensions.transform else {
        return (texture.tex_coord, UV_IDENTITY);
    };
    let (sin, cos) = transform.rotation.sin_cos();
    let ([x, y], [along_u, along_v]) = (transform.offset, transform.scale);
    let map = [[cos * along_u, sin * along_v, x], [-sin * along_u, cos * along_v, y]];
    (transform.tex_coord.unwrap_or(texture.tex_coord), map)
}

/// A texture coordinate of the file, in whose images v goes down, as we have it: up.
#[inline]
pub(crate) fn mapped(map: &[[f32; 3]; 2], [u, v]: [f32; 2]) -> [f32; 2] {
    let [u, v] = match *map {
        UV_IDENTITY => [u, v],
        _ => map.map(|[along_u, along_v, offset]| along_u * u + along_v * v + offset),
    };
    [u, 1.0 - v]
}

/// The image of a texture, if it has one.
fn image_of(model: &mut Model, texture: u32) -> Result<Option<Texture>, IoError> {
    if u64::from(texture) >= model.textures.len() {
        return Ok(None);
    }
    let number = model.textures.get(texture.into())?;
    if u64::from(number) >= model.images.len() {
        return Ok(None);
    }
    let image = model.images.get(number.into())?;
    if let Some(uri) = model.text_of(image.uri)?
        && !uri.starts_with(DATA_MARK)
    {
        let path = String::from_utf8_lossy(&unescaped(&uri)).into_owned();
        return Ok(Some(Texture::Beside(path)));
    }
    let name = model.text_of(image.name)?.unwrap_or_default();
    Ok(Some(Texture::Inside(Image { number, name, ..Image::default() })))
}
