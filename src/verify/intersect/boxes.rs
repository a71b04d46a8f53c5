//! Boxes of whole coordinates, three to a word, so that one subtraction compares all three.
//!
//! Units:      places of a grid of 2^20 a side over a cell.

/// Bits of a coordinate.
pub(crate) const PLACE_BITS: u32 = 20;
/// Above each of the three coordinates of a packed corner there is a bit to spare.
const FIELD_BITS: u32 = PLACE_BITS + 1;
pub(crate) const SPARE: u64 =
    1 << PLACE_BITS | 1 << (PLACE_BITS + FIELD_BITS) | 1 << (PLACE_BITS + 2 * FIELD_BITS);
pub(crate) const PLACE: u64 = (1 << PLACE_BITS) - 1;

/// Three coordinates in one word.
#[inline]
pub(crate) fn pack(corner: [u32; 3]) -> u64 {
    u64::from(corner[0])
        | u64::from(corner[1]) << FIELD_BITS
        | u64::from(corner[2]) << (2 * FIELD_BITS)
}

#[inline]
pub(crate) fn unpack(word: u64, axis: usize) -> u32 {
    (word >> (axis as u32 * FIELD_BITS) & PLACE) as u32
}

/// A mark for each axis along which `high` is not below `low`.
#[inline]
pub(crate) fn not_below(high: u64, low: u64) -> u64 {
    ((high | SPARE) - low) & SPARE
}

/// A box.
#[derive(Clone, Copy)]
pub(crate) struct NearBox {
    pub(crate) low: u64,
    pub(crate) high: u64,
    /// Marks of the axes along which it starts in the cell and not before.
    pub(crate) starts: u64,
}

impl NearBox {
    /// A box, and along which axes it starts in the cell.
    #[inline]
    pub(crate) fn new(low: [u32; 3], high: [u32; 3], starts: [bool; 3]) -> Self {
        let starts = pack(starts.map(u32::from)) << PLACE_BITS;
        Self { low: pack(low), high: pack(high), starts }
    }
}
