//! The parts and materials of a file, numbered in the order in which faces first use them.
//!
//! Memory: the share that each is given; what exceeds it goes to the scratch folder.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::mesh::{Maps, Material, OtherMaps, Part, Texture};
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// Numbered parts.
pub(crate) struct Parts {
    names: Dictionary,
}

impl Parts {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { names: Dictionary::new(scratch, share_bytes) }
    }

    pub(crate) fn count(&self) -> u64 {
        self.names.len()
    }

    /// The number of a part that a face of the file at `path` uses.
    pub(crate) fn number(&mut self, path: &Path, name: &str) -> Result<u32, IoError> {
        self.names.number(name.as_bytes()).map_err(|e| of_file(e, path, "parts"))
    }

    pub(crate) fn get(&mut self, number: u32) -> Result<Part, IoError> {
        Ok(Part { name: text(self.names.name(number)?) })
    }
}

/// What is known of a material besides its name.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Properties {
    diffuse: [f32; 3],
    emissive: [f32; 3],
    opacity: f32,
    metallic: f32,
    roughness: f32,
    /// One more than the number of the texture; 0 without one.
    texture: u32,
    flags: u32,
}

const TRANSPARENT: u32 = 1;
const HAS_DIFFUSE: u32 = 2;
const HAS_EMISSIVE: u32 = 4;
const HAS_OPACITY: u32 = 8;
const HAS_METALLIC: u32 = 16;
const HAS_ROUGHNESS: u32 = 32;
/// Where the set of further maps begins among the flags.
const MAPS_SHIFT: u32 = 8;

/// Numbered materials.
pub(crate) struct Materials {
    names: Dictionary,
    textures: Dictionary,
    properties: Table<Properties>,
}

impl Materials {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            names: Dictionary::new(scratch, share_bytes / 2),
            textures: Dictionary::new(scratch, share_bytes / 4),
            properties: Table::new(scratch, share_bytes / 4),
        }
    }

    pub(crate) fn count(&self) -> u64 {
        self.names.len()
    }

    /// The number of `name`, of which nothing else is known where it is new.
    pub(crate) fn number(&mut self, path: &Path, name: &str) -> Result<u32, IoError> {
        let number = self.names.number(name.as_bytes());
        let number = number.map_err(|e| of_file(e, path, "materials"))?;
        if u64::from(number) == self.properties.len() {
            self.properties.push(Properties::zeroed())?;
        }
        Ok(number)
    }

    /// The number of `name`, if it is known.
    pub(crate) fn find(&mut self, name: &str) -> Result<Option<u32>, IoError> {
        Ok(self.names.find(name.as_bytes())?)
    }

    pub(crate) fn get(&mut self, number: u32) -> Result<Material, IoError> {
        let properties = self.properties.get(number.into())?;
        let has = |flag: u32| properties.flags & flag != 0;
        let texture = properties.texture.checked_sub(1);
        Ok(Material {
            name: text(self.names.name(number)?),
            transparent: has(TRANSPARENT),
            diffuse: has(HAS_DIFFUSE).then_some(properties.diffuse),
            opacity: has(HAS_OPACITY).then_some(properties.opacity),
            emissive: has(HAS_EMISSIVE).then_some(properties.emissive),
            metallic: has(HAS_METALLIC).then_some(properties.metallic),
            roughness: has(HAS_ROUGHNESS).then_some(properties.roughness),
            alpha_cutoff: None,
            texture: texture.map(|number| self.texture(number)).transpose()?,
            maps: Maps::default(),
            other_maps: OtherMaps::from_bits((properties.flags >> MAPS_SHIFT) as u8),
        })
    }

    fn texture(&mut self, number: u32) -> Result<Texture, StoreError> {
        let text = self.textures.name(number)?;
        Ok(serde_json::from_slice(&text).expect("textures are numbered as we wrote them"))
    }

    /// Replaces what is known of a material besides its name.
    pub(crate) fn set(&mut self, number: u32, material: &Material) -> Result<(), IoError> {
        let flags = [
            (material.transparent, TRANSPARENT),
            (material.diffuse.is_some(), HAS_DIFFUSE),
            (material.emissive.is_some(), HAS_EMISSIVE),
            (material.opacity.is_some(), HAS_OPACITY),
            (material.metallic.is_some(), HAS_METALLIC),
            (material.roughness.is_some(), HAS_ROUGHNESS),
        ];
        let texture = match &material.texture {
            Some(texture) => {
                let text = serde_json::to_string(texture).expect("plain records serialise");
                1 + self.textures.number(text.as_bytes())?
            }
            None => 0,
        };
        let properties = Properties {
            diffuse: material.diffuse.unwrap_or_default(),
            emissive: material.emissive.unwrap_or_default(),
            opacity: material.opacity.unwrap_or_default(),
            metallic: material.metallic.unwrap_or_default(),
            roughness: material.roughness.unwrap_or_default(),
            texture,
            flags: flags.iter().map(|&(has, flag)| if has { flag } else { 0 }).sum::<u32>()
                | u32::from(material.other_maps.bits()) << MAPS_SHIFT,
        };
        Ok(self.properties.set(number.into(), properties)?)
    }
}

/// Too many names are the file's fault, a full disk is not.
fn of_file(error: StoreError, path: &Path, what: &'static str) -> IoError {
    match error {
        StoreError::TooMany { limit, .. } => IoError::too_many(path, what, limit),
        error => error.into(),
    }
}

fn text(name: Vec<u8>) -> String {
    String::from_utf8(name).expect("names are numbered as text")
}
