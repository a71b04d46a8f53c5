//! Morton order of three coordinates: monotone in each of them, and post-order of an octree.
//!
//! Source: Morton 1966, A computer oriented geodetic data base.

/// Largest coordinate that [`encode`] takes.
pub const MAX_COORDINATE: u32 = (1 << 21) - 1;

/// The Morton key of a point with coordinates up to [`MAX_COORDINATE`]; x is the lowest bit.
#[must_use]
pub const fn encode(point: [u32; 3]) -> u64 {
    spread(point[0]) | spread(point[1]) << 1 | spread(point[2]) << 2
}

/// The point of a Morton key.
#[must_use]
pub const fn decode(key: u64) -> [u32; 3] {
    [gather(key), gather(key >> 1), gather(key >> 2)]
}

const fn spread(coordinate: u32) -> u64 {
    debug_assert!(coordinate <= MAX_COORDINATE);
    let mut x = coordinate as u64;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

const fn gather(key: u64) -> u32 {
    let mut x = key & 0x1249_2492_4924_9249;
    x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
    x = (x | x >> 16) & 0x001f_0000_0000_ffff;
    ((x | x >> 32) & 0x001f_ffff) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn keys_decode_and_grow_with_each_coordinate(
            point in proptest::array::uniform3(0..MAX_COORDINATE), axis in 0..3_usize,
        ) {
            prop_assert_eq!(decode(encode(point)), point);
            let mut further = point;
            further[axis] += 1;
            prop_assert!(encode(further) > encode(point));
        }
    }
}
