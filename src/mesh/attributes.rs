//! What triangles may have besides a place and a material.

use serde::{Deserialize, Serialize};

/// Kinds of attributes, as those that a file has, holds or is to hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Attributes {
    /// Texture coordinates of corners.
    pub uvs: bool,
    /// Colours of vertices.
    pub colours: bool,
    /// Normals.
    pub normals: bool,
}

impl Attributes {
    /// All kinds.
    pub const ALL: Self = Self { uvs: true, colours: true, normals: true };
    /// None of them.
    pub const NONE: Self = Self { uvs: false, colours: false, normals: false };

    /// Whether there is any.
    #[must_use]
    pub const fn any(self) -> bool {
        self.uvs || self.colours || self.normals
    }

    /// Those that are in both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            uvs: self.uvs && other.uvs,
            colours: self.colours && other.colours,
            normals: self.normals && other.normals,
        }
    }
}
