//! Surface that the outside touches, and surface that it does not, as sign tells of them.

use bytemuck::{Pod, Zeroable};

use crate::store::Record;

/// A place on the surface, seen from the outside. 32 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ExposedPlace {
    /// What it belongs to: a triangle's source number, or what triangles are judged with.
    pub of: u32,
    /// A hash of the edge: it says which places are looked at first.
    pub hash: u32,
    /// The end of the edge that is outside, in cells of the grid.
    pub corner: [u32; 3],
    /// Unit normal of the triangle, as it faces the outside.
    pub normal: [f32; 3],
}

impl Record for ExposedPlace {
    type Key = (u32, u32, [u32; 3], [u32; 3]);
    fn key(&self) -> Self::Key {
        (self.of, self.hash, self.corner, self.normal.map(f32::to_bits))
    }
}

/// How hits lie, in [`Touched::how`]: within the solid.
pub const BURIED: u32 = 1;
/// In [`Touched::how`]: with the outside at both ends of their edge.
pub const LOST: u32 = 2;

/// That some hits of a thing lie so. 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Touched {
    /// As in [`ExposedPlace::of`].
    pub of: u32,
    /// [`BURIED`] and [`LOST`].
    pub how: u32,
}

impl Record for Touched {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.of, self.how)
    }
}
