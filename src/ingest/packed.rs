//! Edges and triangles packed into words, for sorting and hashing.

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::hash::{BuildHasherDefault, Hasher};

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::geom::mix_words;
use crate::octree::points::{Point, pack_point};
use crate::store::Record;

/// A triangle by its sorted corners on the lattice.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triple {
    pub(crate) corners: [u64; 4],
    /// See [`given_triangle`].
    pub(crate) given: u64,
    pub(crate) source: u64,
}

impl Record for Triple {
    type Key = ([u64; 4], u64);
    fn key(&self) -> Self::Key {
        (self.corners, self.source)
    }
}

/// A triangle of a group of copies; by source number.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Member {
    pub(crate) source: u32,
    pub(crate) group: u32,
}

impl Record for Member {
    type Key = u32;
    fn key(&self) -> u32 {
        self.source
    }
}

/// An edge of a triangle, and the group of copies that the triangle is in.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct EdgeUse {
    pub(crate) ends: [u64; 3],
    /// See [`given_edge`].
    pub(crate) given: u64,
    pub(crate) group: u32,
    /// See [`turn_of`].
    pub(crate) turn: u32,
}

/// How far the triangle to a third corner is turned around an edge, from a direction that the edge
/// alone decides; a whole turn is 2^32.
pub(crate) fn turn_of(ends: [Point; 2], corner: Point) -> u32 {
    let [p, q, r] = [ends[0], ends[1], corner].map(|point| DVec3::from(point.map(f64::from)));
    let along = q - p;
    let first = along.cross(DVec3::AXES[along.abs().min_position()]);
    let second = along.cross(first);
    let [x, y] = [first, second].map(|axis| (r - p).dot(axis) / axis.length());
    // The cast takes what lies below 2^32, and rounds down.
    (y.atan2(x).rem_euclid(TAU) / TAU * 2_f64.powi(32)) as u32
}

/// The triangle has no copy.
pub(crate) const NO_GROUP: u32 = u32::MAX;
/// Two corners of the triangle are one on the lattice: it counts nowhere, with or without copies.
pub(crate) const NO_WIDTH: u32 = u32::MAX - 1;

impl Record for EdgeUse {
    type Key = ([u64; 3], u32, u64);
    fn key(&self) -> Self::Key {
        (self.ends, self.group, self.given)
    }
}

/// A corner as the file gives it, as words; -0 and 0 are one place.
pub(crate) type Given = [u64; 3];

pub(crate) fn given(corner: [f64; 3]) -> Given {
    corner.map(|c| (c + 0.0).to_bits())
}

/// The corners of a triangle as given, whatever their order.
pub(crate) fn given_corners(corners: &[[f64; 3]; 3]) -> [Given; 3] {
    let mut corners = corners.map(given);
    corners.sort_unstable();
    corners
}

/// Tells triangles apart by their corners as given.
pub(crate) fn given_triangle(corners: &[[f64; 3]; 3]) -> u64 {
    mix(given_corners(corners).as_flattened())
}

/// Tells edges apart by their ends as given.
pub(crate) fn given_edge(a: [f64; 3], b: [f64; 3]) -> u64 {
    let (a, b) = (given(a), given(b));
    mix([a.min(b), a.max(b)].as_flattened())
}

/// Mixes words.
#[inline]
pub(crate) fn mix(words: &[u64]) -> u64 {
    mix_words(words.iter().copied())
}

/// Three corners of 84 bits, one bit short of four words: comparing words is comparing corners.
pub(crate) fn pack_corners([p, q, r]: [Point; 3]) -> [u64; 4] {
    let [p, q, r] = [p, q, r].map(pack_point);
    let mask = (1 << 63) - 1;
    [
        (p >> 21) as u64,
        ((p << 42 | q >> 42) & mask) as u64,
        ((q << 21 | r >> 63) & mask) as u64,
        (r & mask) as u64,
    ]
}

/// Mixes the words of a packed key (Fibonacci hashing, Knuth 6.4).
#[derive(Clone, Copy, Default)]
pub(crate) struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }
    fn write(&mut self, bytes: &[u8]) {
        // Keys are arrays of words, which arrive as their bytes.
        for word in bytes.chunks(8) {
            let mut padded = [0; 8];
            padded[..word.len()].copy_from_slice(word);
            self.write_u64(u64::from_le_bytes(padded));
        }
    }
    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
    fn write_usize(&mut self, _: usize) {
        // The length of a key, the same for all.
    }
}

pub(crate) type KeySet<K> = HashSet<K, BuildHasherDefault<KeyHasher>>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::LATTICE_BITS;
    use crate::octree::points::{pack_ends, unpack_ends};
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        proptest::array::uniform3(0..1_u32 << LATTICE_BITS)
    }

    proptest! {
        #[test]
        fn packed_keys_order_and_unpack_like_points(
            a in proptest::array::uniform3(point()), b in proptest::array::uniform3(point()),
        ) {
            prop_assert_eq!(pack_corners(a).cmp(&pack_corners(b)), a.cmp(&b));
            let (e, f) = ([a[0], a[1]], [b[0], b[1]]);
            prop_assert_eq!(pack_ends(e).cmp(&pack_ends(f)), e.cmp(&f));
            prop_assert_eq!(unpack_ends(pack_ends(e)), e);
        }
    }
}
