//! Winding numbers of regions, by the votes of the triangles between them.
//!
//! Every edge with hits says by how much the winding number changes across it: by one for each
//! triangle, up or down as it faces. Of each two regions that touch, the votes are counted; regions
//! are joined in the order of the votes, most first, so that a few triangles that face the wrong
//! way are outvoted. What contradicts is counted. Edges that a patch crosses have no vote.
//!
//! In:      votes between regions.
//! Out:     [`Windings`], relative to the outside.
//! Memory:  8 bytes a region and sorts, which spill.
//! Source:  the rule is that of winding numbers; joining with offsets after Tarjan 1975.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::store::{Record, Resources, Scratch, Sorter, StoreError, Table};

/// Share of votes in contradiction beyond which orientation tells nothing.
const MOST_CONFLICTS: f64 = 0.1;

/// How many edges say that the number changes by `delta` from region `a` to region `b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Votes {
    pub a: u32,
    pub b: u32,
    pub delta: i32,
    pub count: u32,
}

impl Record for Votes {
    type Key = (u32, u32, i32, u32);
    fn key(&self) -> Self::Key {
        (self.a, self.b, self.delta, self.count)
    }
}

impl Votes {
    /// The same, from the region with the smaller number.
    pub fn ordered(self) -> Self {
        if self.a <= self.b {
            self
        } else {
            Self { a: self.b, b: self.a, delta: -self.delta, count: self.count }
        }
    }
}

/// Votes by their number, most first.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Ranked {
    votes: Votes,
}

impl Record for Ranked {
    type Key = (u32, u32, u32, i32);
    fn key(&self) -> Self::Key {
        let Votes { a, b, delta, count } = self.votes;
        (u32::MAX - count, a, b, delta)
    }
}

/// What the votes came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VoteStats {
    /// Edges that voted.
    pub votes: u64,
    /// Edges whose vote contradicts the others.
    pub conflicts: u64,
    /// Whether there are so many that `solid` decided in the end.
    pub fell_back: bool,
}

/// The number of a region, if the votes lead there from outside.
pub struct Windings {
    parents: Table<u32>,
    /// The number less that of the parent.
    offsets: Table<i32>,
    outside: u32,
    pub stats: VoteStats,
}

impl Windings {
    /// Joins `regions` regions.
    pub fn count(
        votes: Sorter<Votes>,
        regions: u64,
        outside: u32,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let mut windings = Self::apart(regions, outside, resources)?;
        let ranked = rank(votes, resources.scratch, resources.share_bytes / 4)?;
        let mut sorted = ranked.finish()?;
        while let Some(Ranked { votes }) = sorted.next()? {
            windings.stats.votes += u64::from(votes.count);
            if !windings.join(votes)? {
                windings.stats.conflicts += u64::from(votes.count);
            }
        }
        let stats = &mut windings.stats;
        stats.fell_back = stats.conflicts as f64 > MOST_CONFLICTS * stats.votes as f64;
        Ok(windings)
    }

    fn apart(regions: u64, outside: u32, resources: &Resources) -> Result<Self, StoreError> {
        let share_bytes = resources.share_bytes / 8;
        let mut parents = Table::new(resources.scratch, share_bytes);
        let mut offsets = Table::new(resources.scratch, share_bytes);
        for region in 0..regions as u32 {
            parents.push(region)?;
            offsets.push(0)?;
        }
        Ok(Self { parents, offsets, outside, stats: VoteStats::default() })
    }

    /// The root of a region, and the region's number less that of the root.
    fn find(&mut self, region: u32) -> Result<(u32, i32), StoreError> {
        let (mut at, mut sum) = (region, 0);
        loop {
            let parent = self.parents.get(at.into())?;
            if parent == at {
                return Ok((at, sum));
            }
            let grandparent = self.parents.get(parent.into())?;
            let offset = self.offsets.get(at.into())? + self.offsets.get(parent.into())?;
            self.parents.set(at.into(), grandparent)?;
            self.offsets.set(at.into(), offset)?;
            sum += offset;
            at = grandparent;
        }
    }

    /// Joins two regions; whether that agrees with what was joined before.
    fn join(&mut self, votes: Votes) -> Result<bool, StoreError> {
        let ((a, from_a), (b, from_b)) = (self.find(votes.a)?, self.find(votes.b)?);
        // Number of b's root less that of a's.
        let between = from_a + votes.delta - from_b;
        if a == b {
            return Ok(between == 0);
        }
        let (low, high, offset) = if a < b { (a, b, between) } else { (b, a, -between) };
        self.parents.set(high.into(), low)?;
        self.offsets.set(high.into(), offset)?;
        Ok(true)
    }

    /// The winding number of a region; `None` where no votes lead.
    pub fn of(&mut self, region: u32) -> Result<Option<i32>, StoreError> {
        let ((root, number), (origin, zero)) = (self.find(region)?, self.find(self.outside)?);
        Ok((root == origin).then_some(number - zero))
    }
}

/// Adds up votes that say the same.
fn rank(
    votes: Sorter<Votes>,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<Sorter<Ranked>, StoreError> {
    let mut ranked = Sorter::new(scratch, share_bytes);
    let mut sorted = votes.finish()?;
    let mut open: Option<Votes> = None;
    while let Some(next) = sorted.next()? {
        match &mut open {
            Some(votes) if (votes.a, votes.b, votes.delta) == (next.a, next.b, next.delta) => {
                votes.count = votes.count.saturating_add(next.count);
            }
            _ => open.replace(next).map_or(Ok(()), |votes| ranked.push(Ranked { votes }))?,
        }
    }
    open.map_or(Ok(()), |votes| ranked.push(Ranked { votes }))?;
    Ok(ranked)
}
