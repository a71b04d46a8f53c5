//! Triangles whose surface the signs have lost, as sign tells them.

use bytemuck::{Pod, Zeroable};

use crate::store::Record;

/// How many hits of a triangle lie on edges whose two ends are both outside. 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LostHits {
    /// Source number of the triangle.
    pub source: u32,
    /// How many, in one brick.
    pub count: u32,
    /// Of these, on edges whose four parallel neighbours are hit as well: away from any rim.
    pub inner: u32,
}

impl Record for LostHits {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.source, self.count, self.inner)
    }
}
