//! Images of materials, and which of their maps go no further.

use serde::{Deserialize, Serialize};

/// The image of a material's base colour.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Texture {
    /// A file: its path from the folder of the model, as written there.
    Beside(String),
    /// A part of the model file.
    Inside(Image),
}

impl Texture {
    /// What a person would call it.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Beside(path) => path.clone(),
            Self::Inside(image) if image.name.is_empty() => format!("image {}", image.number),
            Self::Inside(image) => image.name.clone(),
        }
    }
}

/// An image inside of a model file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    /// Its number in the file, for [`crate::mesh::MeshSource::image_block`].
    pub number: u32,
    /// Its name in the file; may be empty.
    pub name: String,
    /// Where it begins among the bytes of all images, once they are kept.
    pub first_byte: u64,
    /// How many bytes it has there; none where it could not be read.
    pub bytes: u64,
}

/// Maps of a material that lie on the texture coordinates of its base colour. What a map has factors
/// for is multiplied by them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Maps {
    /// Normals against the surface, and how far they lean: a factor.
    pub normal: Option<(Texture, f32)>,
    /// Roughness in green and metalness in blue; the material's are its factors.
    pub gloss: Option<Texture>,
    /// Light of its own, in sRGB; the material's is its factor.
    pub emission: Option<Texture>,
    /// Share of the light around that reaches the hollows, in red, and how much of that counts.
    pub occlusion: Option<(Texture, f32)>,
}

impl Maps {
    /// Each kind with its image, if there is one: normals, gloss, emission, occlusion.
    pub fn images(&self) -> [(OtherMaps, Option<&Texture>); 4] {
        [
            (OtherMaps::NORMAL, self.normal.as_ref().map(|(image, _)| image)),
            (OtherMaps::GLOSS, self.gloss.as_ref()),
            (OtherMaps::EMISSION, self.emission.as_ref()),
            (OtherMaps::OCCLUSION, self.occlusion.as_ref().map(|(image, _)| image)),
        ]
    }

    /// The images, to be changed.
    pub fn images_mut(&mut self) -> impl Iterator<Item = &mut Texture> {
        let normal = self.normal.as_mut().map(|(image, _)| image);
        let occlusion = self.occlusion.as_mut().map(|(image, _)| image);
        [normal, self.gloss.as_mut(), self.emission.as_mut(), occlusion].into_iter().flatten()
    }

    /// Leaves out the maps of some kinds.
    pub fn leave_out(&mut self, kinds: OtherMaps) {
        self.normal.take_if(|_| kinds.has(OtherMaps::NORMAL));
        self.gloss.take_if(|_| kinds.has(OtherMaps::GLOSS));
        self.emission.take_if(|_| kinds.has(OtherMaps::EMISSION));
        self.occlusion.take_if(|_| kinds.has(OtherMaps::OCCLUSION));
    }

    /// The kinds there are.
    #[must_use]
    pub fn kinds(&self) -> OtherMaps {
        let there = self.images().into_iter().filter(|(_, image)| image.is_some());
        there.fold(OtherMaps::default(), |all, (kind, _)| all.with(kind))
    }
}

/// Kinds of maps of a material, as a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OtherMaps(u8);

impl OtherMaps {
    /// Bumps and normals of the surface.
    pub const NORMAL: Self = Self(1);
    /// Roughness, metalness and other ways of shining.
    pub const GLOSS: Self = Self(2);
    /// Light of its own.
    pub const EMISSION: Self = Self(4);
    /// Opacity that is no part of the image of the base colour.
    pub const OPACITY: Self = Self(8);
    /// Shadows of its own hollows.
    pub const OCCLUSION: Self = Self(16);

    const NAMES: [(Self, &str); 5] = [
        (Self::NORMAL, "normal maps"),
        (Self::GLOSS, "roughness and metalness maps"),
        (Self::EMISSION, "emission maps"),
        (Self::OPACITY, "opacity maps"),
        (Self::OCCLUSION, "occlusion maps"),
    ];

    /// Those of either.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether it has all of those.
    #[must_use]
    pub const fn has(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }

    /// As a number, for records.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The set of a number that [`OtherMaps::bits`] gave.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// What they are called, in the plural.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().filter(move |(map, _)| self.0 & map.0 != 0).map(|(_, name)| name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_maps_are_named_in_order() {
        let maps = OtherMaps::OPACITY.with(OtherMaps::NORMAL);
        assert_eq!(OtherMaps::from_bits(maps.bits()), maps);
        assert_eq!(maps.names().collect::<Vec<_>>(), ["normal maps", "opacity maps"]);
        assert_eq!(OtherMaps::default().names().count(), 0);
    }
}
