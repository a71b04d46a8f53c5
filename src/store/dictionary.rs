//! Names with numbers: each new name gets the next number, and is found again by its bytes.
//!
//! In: names of any bytes. Out: numbers from 0 on, in the order of first appearance. Invariant: the
//! numbers depend on the order of the names alone. Memory: the share, as the tables that it is
//! made of; what exceeds it goes to the scratch folder. Fails: only as [`StoreError`]. Source:
//! open addressing with linear probing, Knuth 6.4.

use std::hash::{BuildHasher, RandomState};

use crate::store::{Scratch, StoreError, Table};

/// A place in the hash table: bits of the hash, and the name's number plus one; zero when empty.
type Slot = [u32; 2];

/// The most names of one dictionary; the two top bits of a number are free for its users.
pub const MOST_NAMES: u64 = 1 << 30;
/// Slots of a dictionary with its first name; always a power of two.
const FIRST_SLOTS: u64 = 64;

/// Numbered names that need not fit in memory.
pub struct Dictionary {
    scratch: Scratch,
    share_bytes: u64,
    /// Keyed anew in every process: nobody can prepare names that collide.
    hasher: RandomState,
    slots: Table<Slot>,
    text: Table<u8>,
    /// Where each name ends in the text.
    ends: Table<u64>,
}

impl Dictionary {
    /// An empty dictionary that keeps at most `share_bytes` (at least 48 KiB) in memory.
    #[must_use]
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            scratch: scratch.clone(),
            share_bytes,
            hasher: RandomState::new(),
            slots: Table::scattered(scratch, share_bytes / 2),
            text: Table::scattered(scratch, share_bytes / 4),
            ends: Table::new(scratch, share_bytes / 4),
        }
    }

    /// How many names there are.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.ends.len()
    }

    /// Whether there is no name.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The number of `name`, which is added if it is new.
    ///
    /// # Errors
    /// [`StoreError::TooMany`], or a block cannot be written or read back.
    pub fn number(&mut self, name: &[u8]) -> Result<u32, StoreError> {
        if 2 * (self.len() + 1) > self.slots.len() {
            self.grow()?;
        }
        let tag = self.tag(name);
        let (at, found) = self.find_slot(tag, name)?;
        if let Some(number) = found {
            return Ok(number);
        }
        let number = self.len();
        if number >= MOST_NAMES {
            return Err(StoreError::TooMany { what: "Names", limit: MOST_NAMES });
        }
        name.iter().try_for_each(|&byte| self.text.push(byte))?;
        self.ends.push(self.text.len())?;
        self.slots.set(at, [tag, number as u32 + 1])?;
        Ok(number as u32)
    }

    /// The number of `name`, if it is known.
    ///
    /// # Errors
    /// A block cannot be written or read back.
    pub fn find(&mut self, name: &[u8]) -> Result<Option<u32>, StoreError> {
        if self.is_empty() {
            return Ok(None);
        }
        let tag = self.tag(name);
        Ok(self.find_slot(tag, name)?.1)
    }

    /// The name of a number below [`Dictionary::len`].
    ///
    /// # Errors
    /// A block cannot be written or read back.
    pub fn name(&mut self, number: u32) -> Result<Vec<u8>, StoreError> {
        let (start, end) = self.range(number)?;
        (start..end).map(|at| self.text.get(at)).collect()
    }

    fn range(&mut self, number: u32) -> Result<(u64, u64), StoreError> {
        let start = match number.checked_sub(1) {
            Some(before) => self.ends.get(before.into())?,
            None => 0,
        };
        Ok((start, self.ends.get(number.into())?))
    }

    fn tag(&self, name: &[u8]) -> u32 {
        self.hasher.hash_one(name) as u32
    }

    /// Where `name` stands with its number, or the empty slot where it would stand.
    fn find_slot(&mut self, tag: u32, name: &[u8]) -> Result<(u64, Option<u32>), StoreError> {
        let mask = self.slots.len() - 1;
        let mut at = u64::from(tag) & mask;
        loop {
            let [other, number] = self.slots.get(at)?;
            match number.checked_sub(1) {
                None => return Ok((at, None)),
                Some(number) if other == tag && self.is_name(number, name)? => {
                    return Ok((at, Some(number)));
                }
                Some(_) => at = (at + 1) & mask,
            }
        }
    }

    fn is_name(&mut self, number: u32, name: &[u8]) -> Result<bool, StoreError> {
        let (start, end) = self.range(number)?;
        if end - start != name.len() as u64 {
            return Ok(false);
        }
        for (at, &byte) in (start..end).zip(name) {
            if self.text.get(at)? != byte {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Twice as many slots. What was in order stays in order, so this goes through two stretches
    /// of the new table side by side.
    fn grow(&mut self) -> Result<(), StoreError> {
        let count = (2 * self.slots.len()).max(FIRST_SLOTS);
        let empty = Table::scattered(&self.scratch, self.share_bytes / 2);
        let mut old = std::mem::replace(&mut self.slots, empty);
        for _ in 0..count {
            self.slots.push([0; 2])?;
        }
        for at in 0..old.len() {
            let [tag, number] = old.get(at)?;
            if number > 0 {
                let mut at = u64::from(tag) & (count - 1);
                while self.slots.get(at)?[1] > 0 {
                    at = (at + 1) & (count - 1);
                }
                self.slots.set(at, [tag, number])?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn names_beyond_the_share_are_found_again_with_their_numbers() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut names = Dictionary::new(&Scratch::new(folder.path()), 0);
        let name = |i: u32| format!("part {}", i.wrapping_mul(2_654_435_761)).into_bytes();
        for i in 0..20_000 {
            assert_eq!(names.number(&name(i)).expect("numbered"), i);
        }
        for i in (0..20_000).rev() {
            assert_eq!(names.number(&name(i)).expect("found"), i);
        }
        assert_eq!(names.name(17).expect("read"), name(17));
        assert_eq!(names.find(b"another").expect("sought"), None);
        assert_eq!(names.len(), 20_000);
    }

    proptest! {
        #[test]
        fn a_dictionary_answers_like_a_map(
            names in prop::collection::vec(prop::collection::vec(0..3_u8, 0..6), 0..200),
        ) {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let mut dictionary = Dictionary::new(&Scratch::new(folder.path()), 1 << 16);
            let mut map = HashMap::new();
            for name in names {
                let next = map.len() as u32;
                let known = map.get(&name).copied();
                prop_assert_eq!(dictionary.find(&name).expect("sought"), known);
                let number = *map.entry(name.clone()).or_insert(next);
                prop_assert_eq!(dictionary.number(&name).expect("numbered"), number);
                prop_assert_eq!(dictionary.name(number).expect("read"), name);
            }
        }
    }
}
