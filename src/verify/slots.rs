//! Finds the slots of the vertices that are being collected, by their names.
//!
//! Invariant:  linear probing without tombstones: what leaves moves its successors up.
//! Memory:     the names, and eight to sixteen bytes for each that was there at one time.

use crate::verify::positions::{PositionKey, hash};

/// What tells vertices apart: a number of the file, or a position.
pub(crate) trait Name: Copy + Eq {
    /// The same for equal names.
    fn hash(self) -> u64;
}

impl Name for u32 {
    #[inline]
    fn hash(self) -> u64 {
        mix(self)
    }
}

impl Name for PositionKey {
    #[inline]
    fn hash(self) -> u64 {
        hash(self)
    }
}

/// Spreads a number over all bits, one to one.
#[inline]
pub(crate) fn mix(number: u32) -> u64 {
    let spread = (u64::from(number) ^ 0x5851_F42D_4C95_7F2D).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (spread ^ (spread >> 32)).wrapping_mul(0xD1B5_4A32_D192_ED03)
}

const EMPTY: u32 = u32::MAX;

/// A hash table from names to slots.
pub(crate) struct Slots<N> {
    names: Vec<N>,
    table: Vec<u32>,
    len: usize,
}

impl<N: Name> Slots<N> {
    /// An empty table.
    pub(crate) fn new() -> Self {
        Self { names: Vec::new(), table: vec![EMPTY; 64], len: 0 }
    }

    /// An empty table that does not grow before so many names are there.
    pub(crate) fn with_room(names: usize) -> Self {
        let table = vec![EMPTY; (2 * names + 2).next_power_of_two()];
        Self { names: Vec::with_capacity(names), table, len: 0 }
    }

    /// Bytes held for this many slots at most.
    pub(crate) const fn bytes_per_slot() -> u64 {
        size_of::<N>() as u64 + 16
    }

    #[inline]
    fn home(&self, name: N) -> usize {
        (name.hash() >> 16) as usize & (self.table.len() - 1)
    }

    /// The slot of `name`; else enters it as `slot` and returns that.
    #[inline]
    pub(crate) fn find_or_enter(&mut self, name: N, slot: u32) -> u32 {
        let mask = self.table.len() - 1;
        let mut at = self.home(name);
        loop {
            match self.table[at] {
                EMPTY => break,
                found if self.names[found as usize] == name => return found,
                _ => at = (at + 1) & mask,
            }
        }
        self.table[at] = slot;
        if slot as usize == self.names.len() {
            self.names.push(name);
        } else {
            self.names[slot as usize] = name;
        }
        self.len += 1;
        if self.len * 2 > self.table.len() {
            self.grow();
        }
        slot
    }

    /// Forgets the name of `slot`.
    #[inline]
    pub(crate) fn remove(&mut self, slot: u32) {
        let mask = self.table.len() - 1;
        let mut hole = self.home(self.names[slot as usize]);
        while self.table[hole] != slot {
            hole = (hole + 1) & mask;
        }
        let mut at = hole;
        loop {
            at = (at + 1) & mask;
            let next = self.table[at];
            if next == EMPTY {
                break;
            }
            let home = self.home(self.names[next as usize]);
            // It may move up only if the hole is not in front of its home.
            if at.wrapping_sub(home) & mask >= at.wrapping_sub(hole) & mask {
                self.table[hole] = next;
                hole = at;
            }
        }
        self.table[hole] = EMPTY;
        self.len -= 1;
    }

    #[cold]
    fn grow(&mut self) {
        let wider = vec![EMPTY; self.table.len() * 2];
        let mask = wider.len() - 1;
        let old = std::mem::replace(&mut self.table, wider);
        for slot in old.into_iter().filter(|&slot| slot != EMPTY) {
            let mut at = self.home(self.names[slot as usize]);
            while self.table[at] != EMPTY {
                at = (at + 1) & mask;
            }
            self.table[at] = slot;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn slots_answer_like_a_map(steps in proptest::collection::vec(0..300_u32, 0..3000)) {
            let mut slots = Slots::<u32>::new();
            let mut map = BTreeMap::new();
            let mut free: Vec<u32> = (0..300).rev().collect();
            for name in steps {
                if let Some(slot) = map.remove(&name) {
                    prop_assert_eq!(slots.find_or_enter(name, u32::MAX - 1), slot);
                    slots.remove(slot);
                    free.push(slot);
                } else {
                    let slot = free.pop().expect("there are as many slots as names");
                    prop_assert_eq!(slots.find_or_enter(name, slot), slot);
                    map.insert(name, slot);
                }
            }
            for (name, slot) in map {
                prop_assert_eq!(slots.find_or_enter(name, u32::MAX - 1), slot);
            }
        }
    }
}
