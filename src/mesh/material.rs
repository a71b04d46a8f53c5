//! What a surface is made of, and how a triangle of the output names it.

use serde::{Deserialize, Serialize};

use crate::mesh::{Maps, OtherMaps, Texture};

/// A material of a file. What the file does not state is `None`.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Material {
    /// The name as written in the file; may be empty.
    pub name: String,
    /// Whether light passes (MTL `d` < 1 or `Tr` > 0, glTF `BLEND` or transmission): such a surface
    /// neither seals nor hides.
    pub transparent: bool,
    /// Base colour, as the file states it, 0..1.
    pub diffuse: Option<[f32; 3]>,
    /// 0 lets all light pass, 1 none.
    pub opacity: Option<f32>,
    /// Light of its own, 0 and up.
    pub emissive: Option<[f32; 3]>,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: Option<f32>,
    /// 0 for mirrors, 1 for chalk.
    pub roughness: Option<f32>,
    /// Where the image lets more light pass than this it is not there at all (glTF `MASK`).
    #[serde(default)]
    pub alpha_cutoff: Option<f32>,
    /// Image of the base colour.
    pub texture: Option<Texture>,
    /// Its further maps.
    #[serde(default)]
    pub maps: Maps,
    /// Kinds of maps, of which no more is known: no output has them.
    #[serde(default)]
    pub other_maps: OtherMaps,
}

/// Colour of a material that states none.
const GREY: [f32; 3] = [0.8; 3];

impl Material {
    /// As it is where maps of some kinds are lost: their factors mean nothing without them.
    #[must_use]
    pub fn losing(mut self, kinds: OtherMaps) -> Self {
        self.maps.leave_out(kinds);
        if kinds.has(OtherMaps::GLOSS) {
            (self.metallic, self.roughness) = (None, None);
        }
        if kinds.has(OtherMaps::EMISSION) {
            self.emissive = None;
        }
        self.other_maps = self.other_maps.with(kinds);
        self
    }

    /// Whether it shows any image.
    #[must_use]
    pub fn is_mapped(&self) -> bool {
        let others = self.other_maps.with(self.maps.kinds());
        self.texture.is_some() || others != OtherMaps::default()
    }

    /// Colour and opacity as bytes, for formats that must have them.
    #[must_use]
    pub fn rgba(&self) -> [u8; 4] {
        let [red, green, blue] = self.diffuse.unwrap_or(GREY);
        let opacity = self.opacity.unwrap_or(if self.transparent { 0.5 } else { 1.0 });
        [red, green, blue, opacity].map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
    }
}

/// What a triangle of the output is: its material, and whether it closes what was open. Packed in
/// four bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Surface(u32);

impl Surface {
    const PATCH: u32 = 1 << 31;
    /// What files add to the name of a material for its patches.
    pub const PATCH_ENDING: &str = ".patch";

    /// A surface of this material; `is_patch` where it is not in the input.
    #[must_use]
    pub const fn new(material: u32, is_patch: bool) -> Self {
        Self(material & !Self::PATCH | if is_patch { Self::PATCH } else { 0 })
    }

    /// The number of the material.
    #[must_use]
    pub const fn material(self) -> u32 {
        self.0 & !Self::PATCH
    }

    /// Whether it closes what was open in the input.
    #[must_use]
    pub const fn is_patch(self) -> bool {
        self.0 & Self::PATCH != 0
    }

    /// The packed number: the material, and the top bit for patches.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The surface of a packed number.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}
