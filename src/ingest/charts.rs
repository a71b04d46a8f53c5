//! Sets of triangles that go on into each other, and in which no seam has both its sides.
//!
//! Of an image that is wrapped around a tube both sides of the seam belong together, the long way
//! around. Such sets are made anew: triangles are united as before, but for sets that a seam parts.
//! What is left over where two such sets meet, away from the seam, is a border as well.
//!
//! In:         pairs of triangles that go on into each other, and pairs that a seam parts.
//! Out:        a label for each triangle.
//! Invariant:  depends on the pairs and their order alone.
//! Memory:     the share; tables that spill.
//! Source:     Kruskal 1956, with sets that must not meet; their seams in lists that are joined.

use bytemuck::{Pod, Zeroable};

use crate::store::{Labels, Resources, StoreError, Table, Unite};

/// No seam in a list.
const END: u32 = u32::MAX;
/// Refusals that are remembered; a power of two.
const REMEMBERED: usize = 4096;

/// Pairs so far.
pub struct Charts<'r> {
    resources: &'r Resources<'r>,
    triangles: u64,
    sets: Unite,
    joints: Table<[u32; 2]>,
    seams: Table<[u32; 2]>,
}

/// The seams of a set: a list of [`SeamEnd`]s.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SeamList {
    first: u32,
    last: u32,
    count: u32,
}

/// A seam as one of its sides sees it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SeamEnd {
    /// A triangle on the other side.
    beyond: u32,
    next: u32,
}

impl<'r> Charts<'r> {
    /// Each of so many triangles by itself.
    pub fn new(triangles: u64, resources: &'r Resources<'r>) -> Result<Self, StoreError> {
        let (scratch, share_bytes) = (resources.scratch, resources.share_bytes / 12);
        Ok(Self {
            resources,
            triangles,
            sets: Unite::new(scratch, share_bytes, triangles)?,
            joints: Table::new(scratch, share_bytes),
            seams: Table::new(scratch, share_bytes),
        })
    }

    /// Adds a pair that goes on into each other, or that a seam parts.
    pub fn add(&mut self, pair: [u32; 2], goes_on: bool) -> Result<(), StoreError> {
        if !goes_on {
            return self.seams.push(pair);
        }
        self.sets.unite(pair[0], pair[1])?;
        self.joints.push(pair)
    }

    /// The labels.
    pub fn finish(mut self) -> Result<Labels, StoreError> {
        let mut whole = self.sets.finish()?;
        let mut parted = Parted::new(self.triangles, self.resources)?;
        let mut is_any = false;
        for number in 0..self.seams.len() {
            let [a, b] = self.seams.get(number)?;
            if whole.label(a)? == whole.label(b)? {
                parted.add_seam([a, b])?;
                is_any = true;
            }
        }
        if !is_any {
            return Ok(whole);
        }
        for number in 0..self.joints.len() {
            parted.unite(self.joints.get(number)?)?;
        }
        parted.sets.finish()
    }
}

/// Sets that keep their seams apart.
struct Parted {
    sets: Unite,
    /// By the label of a set.
    lists: Table<SeamList>,
    ends: Table<SeamEnd>,
    refused: Vec<[u32; 2]>,
}

impl Parted {
    fn new(triangles: u64, resources: &Resources) -> Result<Self, StoreError> {
        let (scratch, share_bytes) = (resources.scratch, resources.share_bytes / 12);
        let mut lists = Table::new(scratch, share_bytes);
        for _ in 0..triangles {
            lists.push(SeamList { first: END, last: END, count: 0 })?;
        }
        Ok(Self {
            sets: Unite::new(scratch, share_bytes, triangles)?,
            lists,
            ends: Table::new(scratch, share_bytes),
            refused: vec![[END; 2]; REMEMBERED],
        })
    }

    fn add_seam(&mut self, [a, b]: [u32; 2]) -> Result<(), StoreError> {
        let limit = u64::from(END) - 2;
        if self.ends.len() >= limit {
            return Err(StoreError::TooMany { what: "Edges of seams", limit });
        }
        for (own, beyond) in [(a, b), (b, a)] {
            let number = self.ends.len() as u32;
            let list = self.lists.get(own.into())?;
            self.ends.push(SeamEnd { beyond, next: list.first })?;
            let last = if list.count == 0 { number } else { list.last };
            let list = SeamList { first: number, last, count: list.count + 1 };
            self.lists.set(own.into(), list)?;
        }
        Ok(())
    }

    /// Unites the sets of two triangles, unless a seam parts them.
    fn unite(&mut self, [a, b]: [u32; 2]) -> Result<(), StoreError> {
        let (a, b) = (self.sets.find(a)?, self.sets.find(b)?);
        let (a, b) = (a.min(b), a.max(b));
        if a == b {
            return Ok(());
        }
        let slot = (a ^ b.wrapping_mul(0x9E37_79B1)) as usize % REMEMBERED;
        if self.refused[slot] == [a, b] {
            return Ok(());
        }
        let (one, other) = (self.lists.get(a.into())?, self.lists.get(b.into())?);
        let (shorter, label) = if one.count < other.count { (one, b) } else { (other, a) };
        let mut at = shorter.first;
        while at != END {
            let end = self.ends.get(at.into())?;
            if self.sets.find(end.beyond)? == label {
                self.refused[slot] = [a, b];
                return Ok(());
            }
            at = end.next;
        }
        let list = match (one.count, other.count) {
            (_, 0) => one,
            (0, _) => other,
            _ => {
                let end = self.ends.get(one.last.into())?;
                self.ends.set(one.last.into(), SeamEnd { next: other.first, ..end })?;
                SeamList { first: one.first, last: other.last, count: one.count + other.count }
            }
        };
        self.lists.set(a.into(), list)?;
        self.sets.unite(a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Void;
    use crate::store::{Backing, NoCheckpoints, Scratch};

    /// Labels of a ring of triangles that is cut between the last and the first.
    fn ring(count: u32, share_bytes: u64, is_cut: bool) -> Vec<u32> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let resources = Resources {
            scratch: &scratch,
            pool: &pool,
            share_bytes,
            cached_windows: 2,
            backing: Backing::Mapped,
            checkpoints: &NoCheckpoints,
            monitor: &Void,
        };
        let mut charts = Charts::new(count.into(), &resources).expect("tables");
        for number in (0..count).step_by(2).chain((1..count).step_by(2)) {
            let (pair, is_last) = ([number, (number + 1) % count], number + 1 == count);
            charts.add(pair, !(is_last && is_cut)).expect("added");
        }
        let mut labels = charts.finish().expect("labels");
        (0..count).map(|number| labels.label(number).expect("a label")).collect()
    }

    #[test]
    fn a_seam_that_one_can_walk_around_has_two_sets_at_its_sides() {
        assert!(ring(30_000, 1 << 20, false).iter().all(|label| *label == 0));
        let labels = ring(30_000, 1 << 20, true);
        assert_ne!(labels[0], labels[29_999]);
        let borders = labels.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert_eq!(borders, 1, "and one border more");
        assert_eq!(labels, ring(30_000, 16 << 10, true));
    }
}
