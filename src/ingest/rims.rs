//! How much of a soup is open, told in one pass and in constant memory.
//!
//! An odd sketch: every edge of every triangle toggles one bit of a bitmap, so edges that an even
//! number of triangles share leave no trace. The bits that stay set tell how many are left over.
//! Edges are spread over levels, half as many on each next one, so that some level is never too
//! full to be counted; and over classes of length, so that rims can be told by their length.
//!
//! In:         the corners of triangles.
//! Out:        [`Rims`]: number and length of the edges that an odd number of triangles shares.
//! Invariant:  a soup that is closed mod 2, corner for corner, gives exactly zero.
//! Memory:     3 KiB for each class of length that occurs, at most 2048.
//! Source:     Mitzenmacher, Pagh, Pham 2014, Efficient estimation for high similarities using odd
//!             sketches; the levels after Flajolet and Martin 1985.

use serde::{Deserialize, Serialize};

/// Bits of one level.
const BITS: usize = 1024;
const WORDS: usize = BITS / 64;
/// Level 23 sees one edge of 2^24: less than a bitmap for the largest soup that is read.
const LEVELS: usize = 24;
/// A level with more bits set than this is too full to be counted well.
const MOST_SET: u32 = 3 * BITS as u32 / 10;
/// One class per exponent of the squared length: two to an octave of length.
const CLASSES: usize = 2048;

/// The edges that an odd number of triangles shares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rims {
    /// How many, to a few percent; zero only where there are none.
    pub edges: f64,
    /// Their length, model units.
    pub length: f64,
}

/// Collects the edges of triangles.
pub struct RimSketch {
    classes: Vec<Option<Box<Class>>>,
}

struct Class {
    bits: [[u64; WORDS]; LEVELS],
    edges: u64,
    length: f64,
}

impl RimSketch {
    pub fn new() -> Self {
        Self { classes: (0..CLASSES).map(|_| None).collect() }
    }

    /// Adds the edges of a triangle with finite corners.
    pub fn add(&mut self, corners: &[[f64; 3]; 3]) {
        let hashes = corners.map(hash_of_point);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            // Equal corners bound nothing; what is left of such a triangle is an edge twice.
            if hashes[a] != hashes[b] {
                let square: f64 = (0..3).map(|i| (corners[a][i] - corners[b][i]).powi(2)).sum();
                self.toggle(hash_of_edge(hashes[a], hashes[b]), square);
            }
        }
    }

    fn toggle(&mut self, hash: u64, square: f64) {
        let class = self.classes[(square.to_bits() >> 52) as usize].get_or_insert_with(|| {
            Box::new(Class { bits: [[0; WORDS]; LEVELS], edges: 0, length: 0.0 })
        });
        let level = (hash.trailing_zeros() as usize).min(LEVELS - 1);
        let bit = (hash >> 40) as usize % BITS;
        class.bits[level][bit / 64] ^= 1 << (bit % 64);
        class.edges += 1;
        class.length += square.sqrt();
    }

    /// What is left over.
    pub fn finish(&self) -> Rims {
        let mut rims = Rims::default();
        for class in self.classes.iter().flatten() {
            let odd = class.odd_edges();
            if odd == 0.0 {
                continue;
            }
            rims.edges += odd;
            rims.length += odd * (class.length / class.edges as f64);
        }
        rims
    }
}

impl Class {
    /// The number of odd edges, from all levels that are not too full.
    fn odd_edges(&self) -> f64 {
        let set = self.bits.map(|words| words.iter().map(|word| word.count_ones()).sum::<u32>());
        let first = set.iter().rposition(|&set| set > MOST_SET).map_or(0, |full| full + 1);
        let seen: f64 = set[first.min(LEVELS - 1)..].iter().map(|&set| toggles(set)).sum();
        // Level 0 sees half of all edges, the next ones the other half.
        seen * (1_u64 << first.min(LEVELS - 1)) as f64
    }
}

/// The most likely number of odd keys that leave so many bits set.
fn toggles(set: u32) -> f64 {
    let bits = BITS as f64;
    let open = (1.0 - 2.0 * f64::from(set) / bits).max(1.0 / bits);
    -0.5 * bits * open.ln()
}

/// Mixes all bits by folded multiplication.
fn fold(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}

/// The same for equal points; -0 and 0 are one place.
fn hash_of_point(point: [f64; 3]) -> u64 {
    let [x, y, z] = point.map(|c| (c + 0.0).to_bits());
    let xy = fold(x ^ 0x9E37_79B9_7F4A_7C15, y ^ 0xC2B2_AE3D_27D4_EB4F);
    fold(xy ^ 0x1656_67B1_9E37_79F9, z ^ 0x27D4_EB2F_1656_67C5)
}

/// The same for both directions.
fn hash_of_edge(a: u64, b: u64) -> u64 {
    fold(a.wrapping_add(b) ^ 0xA076_1D64_78BD_642F, (a ^ b) ^ 0xE703_7ED1_A0B4_28DB)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Corners = [[f64; 3]; 3];

    fn rims(triangles: impl IntoIterator<Item = Corners>) -> Rims {
        let mut sketch = RimSketch::new();
        triangles.into_iter().for_each(|corners| sketch.add(&corners));
        sketch.finish()
    }

    /// `count` triangles far from each other, with legs of length `leg`.
    fn scattered(count: u32, leg: f64) -> impl Iterator<Item = Corners> {
        (0..count).map(move |i| {
            let x = f64::from(i);
            [[x, 0.0, 0.0], [x + leg, 0.0, 0.0], [x, leg, 0.0]]
        })
    }

    #[test]
    fn a_closed_soup_has_no_rim_at_all() {
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, -0.0], [0.0, 3.0, 0.0], [0.0, 0.5, 2.0]];
        let tetrahedron = [[a, b, c], [b, a, d], [d, c, b], [c, d, a]];
        assert_eq!(rims(tetrahedron), Rims::default());
        // Whatever the orientation and the copies: only the number of triangles counts.
        assert_eq!(rims([[a, b, c], [a, b, c]]), Rims::default());
        assert_eq!(rims([[a, b, b], [a, a, a]]), Rims::default());
    }

    #[test]
    fn few_rims_are_told_by_number_and_length() {
        let one = rims([[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]]);
        assert!((one.edges - 3.0).abs() < 0.01 && (one.length - 12.0).abs() < 0.1, "{one:?}");
    }

    #[test]
    fn many_rims_are_told_to_a_few_percent() {
        for count in [100, 3000, 100_000] {
            let leg = 0.25;
            let found = rims(scattered(count, leg));
            let edges = f64::from(3 * count);
            let length = f64::from(count) * leg * (2.0 + 2.0_f64.sqrt());
            assert!((found.edges / edges - 1.0).abs() < 0.15, "{count}: {found:?}");
            assert!((found.length / length - 1.0).abs() < 0.15, "{count}: {found:?}");
        }
    }
}
