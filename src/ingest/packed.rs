//! Snapped points, edges and triangles packed into words, for sorting and hashing.

use std::collections::HashSet;
use std::hash::{BuildHasherDefault, Hasher};

use bytemuck::{Pod, Zeroable};

use crate::octree::LATTICE_BITS;
use crate::store::Record;

pub(crate) type Point = [u32; 3];

/// A triangle by its sorted corners.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triple {
    pub(crate) corners: [u64; 4],
    pub(crate) source: u64,
}

impl Record for Triple {
    type Key = ([u64; 4], u64);
    fn key(&self) -> Self::Key {
        (self.corners, self.source)
    }
}

/// An edge of a triangle, and the group of duplicates that the triangle is in.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct EdgeUse {
    pub(crate) ends: [u64; 3],
    pub(crate) group: u32,
    pub(crate) source: u32,
}

pub(crate) const NO_GROUP: u32 = u32::MAX;

impl Record for EdgeUse {
    type Key = ([u64; 3], u32, u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.group, self.source)
    }
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

/// Two ends of 84 bits in three words of 56.
pub(crate) fn pack_ends([p, q]: [Point; 2]) -> [u64; 3] {
    let [p, q] = [p, q].map(pack_point);
    let mask = (1 << 56) - 1;
    [(p >> 28) as u64, ((p << 28 | q >> 56) & mask) as u64, (q & mask) as u64]
}

pub(crate) fn pack_point(point: Point) -> u128 {
    point.iter().fold(0, |bits, &c| bits << LATTICE_BITS | u128::from(c))
}

pub(crate) fn unpack_ends([high, middle, low]: [u64; 3]) -> [Point; 2] {
    let mask = (1_u128 << LATTICE_BITS) - 1;
    let unpack = |bits: u128| [2, 1, 0].map(|i| (bits >> (i * LATTICE_BITS) & mask) as u32);
    let first = u128::from(high) << 28 | u128::from(middle) >> 28;
    let second = u128::from(middle & ((1 << 28) - 1)) << 56 | u128::from(low);
    [unpack(first), unpack(second)]
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
