//! Positions as exact keys: equal if and only if the points are equal.

/// Bits of a finite position, with one zero.
pub(crate) type PositionKey = [u64; 3];

/// The key of a finite position; -0 and 0 are one place.
#[inline]
pub(crate) fn key_of(position: [f64; 3]) -> PositionKey {
    position.map(|x| (x + 0.0).to_bits())
}

/// The position of a key.
pub(crate) fn position_of(key: PositionKey) -> [f64; 3] {
    key.map(f64::from_bits)
}

const EMPTY: u32 = u32::MAX;

/// A hash table of numbers whose positions lie in the caller's array.
///
/// Memory: at most 16 bytes per entry, 24 while it grows.
pub(crate) struct PositionIndex {
    slots: Vec<u32>,
    len: usize,
}

impl PositionIndex {
    /// An empty table.
    pub(crate) fn new() -> Self {
        Self { slots: vec![EMPTY; 64], len: 0 }
    }

    /// The number that was entered with this key before; else enters `number` and returns it.
    #[inline]
    pub(crate) fn find_or_enter(
        &mut self,
        key: PositionKey,
        number: u32,
        keys: &[PositionKey],
    ) -> u32 {
        if self.len * 2 >= self.slots.len() {
            self.grow(keys);
        }
        let mask = self.slots.len() - 1;
        let mut slot = hash(key) as usize & mask;
        loop {
            match self.slots[slot] {
                EMPTY => {
                    self.slots[slot] = number;
                    self.len += 1;
                    return number;
                }
                found if keys[found as usize] == key => return found,
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    fn grow(&mut self, keys: &[PositionKey]) {
        let wider = vec![EMPTY; self.slots.len() * 2];
        let mask = wider.len() - 1;
        let old = std::mem::replace(&mut self.slots, wider);
        for number in old.into_iter().filter(|&number| number != EMPTY) {
            let mut slot = hash(keys[number as usize]) as usize & mask;
            while self.slots[slot] != EMPTY {
                slot = (slot + 1) & mask;
            }
            self.slots[slot] = number;
        }
    }
}

/// Mixes all bits of a key by folded multiplication.
#[inline]
pub(crate) fn hash([x, y, z]: PositionKey) -> u64 {
    let fold = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        product as u64 ^ (product >> 64) as u64
    };
    let xy = fold(x ^ 0x9E37_79B9_7F4A_7C15, y ^ 0xD1B5_4A32_D192_ED03);
    fold(xy ^ 0x8CB9_2BA7_2F3D_8DD7, z ^ 0xAEF1_7502_108E_F2D9)
}
