//! Union of numbered things into sets, in memory while it fits its share, on paged blocks beyond.
//!
//! The label of a set is its smallest member, so it depends on the pairs alone.
//!
//! Source: Tarjan 1975 (union-find), with path halving; linked by smaller number.

use crate::store::{Scratch, StoreError, Table};

/// Unites numbers `0..len`.
pub struct Unite {
    parents: Table<u32>,
}

impl Unite {
    /// `len` sets of one member each, in at most `share_bytes` of memory.
    ///
    /// # Errors
    /// More than 2^32 - 1 members, or the scratch disk fails.
    pub fn new(scratch: &Scratch, share_bytes: u64, len: u64) -> Result<Self, StoreError> {
        Self::of(Table::new(scratch, share_bytes), len)
    }

    /// As [`Unite::new`], where members that are united lie far from each other.
    ///
    /// # Errors
    /// As [`Unite::new`].
    pub fn scattered(scratch: &Scratch, share_bytes: u64, len: u64) -> Result<Self, StoreError> {
        Self::of(Table::scattered(scratch, share_bytes), len)
    }

    fn of(mut parents: Table<u32>, len: u64) -> Result<Self, StoreError> {
        let limit = u64::from(u32::MAX);
        if len > limit {
            return Err(StoreError::TooMany { what: "Things to unite", limit });
        }
        for member in 0..len as u32 {
            parents.push(member)?;
        }
        Ok(Self { parents })
    }

    /// The smallest member known of the set of `member`.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn find(&mut self, member: u32) -> Result<u32, StoreError> {
        let mut at = member;
        loop {
            let parent = self.parents.get(u64::from(at))?;
            if parent == at {
                return Ok(at);
            }
            let grandparent = self.parents.get(u64::from(parent))?;
            if grandparent == parent {
                return Ok(parent);
            }
            self.parents.set(u64::from(at), grandparent)?;
            at = grandparent;
        }
    }

    /// Joins the sets of `a` and `b`.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn unite(&mut self, a: u32, b: u32) -> Result<(), StoreError> {
        let (a, b) = (self.find(a)?, self.find(b)?);
        if a != b {
            self.parents.set(u64::from(a.max(b)), a.min(b))?;
        }
        Ok(())
    }

    /// Ends the unions; every member's label is then one look-up away.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn finish(mut self) -> Result<Labels, StoreError> {
        for member in 0..self.parents.len() {
            // Parents are smaller, hence final already.
            let parent = self.parents.get(member)?;
            let root = self.parents.get(u64::from(parent))?;
            if root != parent {
                self.parents.set(member, root)?;
            }
        }
        Ok(Labels { labels: self.parents })
    }
}

/// The set of every member.
pub struct Labels {
    labels: Table<u32>,
}

impl Labels {
    /// The smallest member of the set of `member`.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn label(&mut self, member: u32) -> Result<u32, StoreError> {
        self.labels.get(u64::from(member))
    }

    /// The number of members.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.labels.len()
    }

    /// Whether there is no member.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_the_smallest_members_whatever_the_share() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let labels = |share_bytes: u64| {
            let mut unite = Unite::new(&scratch, share_bytes, 30_000).expect("30 000 members");
            for i in (0..29_990_u32).rev() {
                unite.unite(i, i + 7).expect("unite works");
            }
            let mut labels = unite.finish().expect("finish works");
            (0..30_000).map(|i| labels.label(i).expect("label works")).collect::<Vec<_>>()
        };
        let small = labels(16 << 10);
        assert_eq!(small, labels(1 << 20));
        assert!(small[..29_990].iter().enumerate().all(|(i, &label)| label as usize == i % 7));
    }
}
