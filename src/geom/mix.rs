//! Bits that look random and are the same everywhere.

/// A hash of 64 bits: equal for equal bits, spread over all of them for others.
///
/// Source: Steele, Lea, Flood 2014, Fast splittable pseudorandom number generators (splitmix64).
#[must_use]
pub const fn mix(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// Mixes several words into one, by folded multiplication (Wang Yi, wyhash).
#[must_use]
#[inline]
pub fn mix_words(words: impl IntoIterator<Item = u64>) -> u64 {
    words.into_iter().fold(0x2d35_8dcc_aa6c_78a5, |mixed, word| {
        let product = u128::from(mixed ^ word) * 0x9e37_79b9_7f4a_7c15_u128;
        (product as u64 ^ (product >> 64) as u64).rotate_left(29) ^ word
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_differ_in_about_half_of_their_bits() {
        let differing: u32 = (0..1000).map(|i| (mix(i) ^ mix(i + 1)).count_ones()).sum();
        assert!((31_000..33_000).contains(&differing), "{differing}");
    }
}
