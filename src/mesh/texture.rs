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

/// Maps of a material that no output holds yet, as a set.
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
