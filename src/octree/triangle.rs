//! Triangles as the stages pass them on disk.

use bytemuck::{Pod, Zeroable};

use crate::mesh::Surface;
use crate::store::Record;

/// Set in [`SoupTriangle::material`] when light passes the material.
pub const TRANSPARENT: u32 = 1 << 31;

/// Set in [`SoupTriangle::material`] when the triangle closes what was open in the input.
pub const CLOSES: u32 = 1 << 30;

/// What a crossing on a triangle of this material, with its bits, gives the output.
#[must_use]
pub const fn surface_of(material: u32) -> Surface {
    Surface::new(material & !(TRANSPARENT | CLOSES), material & CLOSES != 0)
}

/// A triangle of the soup, as spooled by ingest. 88 bytes, and 48 on the disk where all are of single
/// precision; see docs/format.md.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SoupTriangle {
    /// Finite corners as read, model units.
    pub corners: [[f64; 3]; 3],
    /// Number of the triangle in the input, counted over all that were delivered.
    pub source: u32,
    /// Part number.
    pub part: u32,
    /// Material number, [`TRANSPARENT`], and [`CLOSES`].
    pub material: u32,
    /// For walls and fills: one more than the source number of a triangle that they stand for or
    /// close; 0 for triangles of the input.
    pub stands_for: u32,
}

impl SoupTriangle {
    /// Whether light passes it.
    #[must_use]
    pub const fn is_pane(&self) -> bool {
        self.material & TRANSPARENT != 0
    }
}

/// Where a triangle of the input is, and what its corners have besides. 112 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AttributeRecord {
    /// Corners as read, model units; those of a triangle that was dropped may be NaN or infinite.
    pub corners: [[f64; 3]; 3],
    /// Texture coordinates of the corners, finite, v up; zero where the file has none.
    pub uvs: [[f32; 2]; 3],
    /// RGBA colours of the corners; zero where the file has none.
    pub colours: [[u8; 4]; 3],
    /// Zero.
    pub unused: u32,
}

/// A triangle in the bin of a brick that it touches. 96 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BinTriangle {
    /// Key of the brick.
    pub brick: u64,
    /// The triangle.
    pub triangle: SoupTriangle,
}

impl Record for BinTriangle {
    type Key = (u64, u32);
    fn key(&self) -> (u64, u32) {
        (self.brick, self.triangle.source)
    }
}

/// A triangle that does not count in a bin: a copy that was settled away. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct DropRecord {
    /// Key of the brick.
    pub brick: u64,
    /// Source number.
    pub source: u32,
    /// Zero.
    pub unused: u32,
}

impl Record for DropRecord {
    type Key = (u64, u32);
    fn key(&self) -> (u64, u32) {
        (self.brick, self.source)
    }
}
