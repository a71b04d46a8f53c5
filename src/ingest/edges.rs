//! Judges the edges of one bin: which are open, and what they say about groups of copies.
//!
//! In:      the uses of edges by triangles, by edge and group.
//! Out:     open edges as counts; [`Fact`]s of edges with copies.
//! Memory:  one edge is counted at a time, however many triangles meet it.

use crate::ingest::duplicates::SettleStats;
use crate::ingest::facts::{
    Fact, JOINED, RIM_ALONE_CLOSED, RIM_ALONE_OPEN, RIM_EVEN, RIM_FOLDED, RIM_ODD,
};
use crate::ingest::packed::{EdgeUse, NO_GROUP, NO_WIDTH};
use crate::octree::points::{length_of, unpack_ends};
use crate::store::{Outbox, Sorter, StoreError};

impl SettleStats {
    /// Counts an edge that an odd number of triangles meets.
    pub(crate) fn add_rim(&mut self, length: f64) {
        self.rim_edges += 1;
        self.rim_length += length;
    }
}

/// Two triangles at an edge lie on each other if they are turned by less than this, about three
/// degrees: facets of solids that touch part further.
const FOLDED_TURN: u32 = 1 << 25;

/// The uses of one edge so far.
struct Tally {
    ends: [u64; 3],
    /// The group whose uses come, and how many there were.
    run: (u32, u64),
    /// Even groups: the first and the last of them, and their number.
    even: Option<(u32, u32)>,
    even_count: u64,
    /// All that is not in an even group; odd groups are one each.
    others: u64,
    /// How the first two of them are turned.
    turns: [u32; 2],
    /// The turn of the last use.
    last_turn: u32,
    /// The edges as given, cancelled in pairs.
    given: u64,
}

impl Tally {
    fn new(ends: [u64; 3]) -> Self {
        Self {
            ends,
            run: (NO_GROUP, 0),
            even: None,
            even_count: 0,
            others: 0,
            turns: [0; 2],
            last_turn: 0,
            given: 0,
        }
    }

    fn add(&mut self, edge: &EdgeUse, facts: &mut Outbox<Fact>) -> Result<(), StoreError> {
        self.given ^= edge.given;
        if self.run.0 != edge.group {
            self.end_run(facts)?;
            self.run = (edge.group, 0);
        }
        self.run.1 += 1;
        self.last_turn = edge.turn;
        if edge.group == NO_GROUP {
            self.add_other(edge.turn);
        }
        Ok(())
    }

    fn end_run(&mut self, facts: &mut Outbox<Fact>) -> Result<(), StoreError> {
        let (group, uses) = self.run;
        match group {
            NO_WIDTH | NO_GROUP => {}
            _ if !uses.is_multiple_of(2) => self.add_other(self.last_turn),
            _ => {
                self.even_count += 1;
                if let Some((_, last)) = self.even {
                    facts.push(Fact { group: last, kind: JOINED, value: u64::from(group) })?;
                }
                self.even = Some((self.even.map_or(group, |(first, _)| first), group));
            }
        }
        Ok(())
    }

    fn add_other(&mut self, turn: u32) {
        if let Some(place) = self.turns.get_mut(self.others as usize) {
            *place = turn;
        }
        self.others += 1;
    }

    /// Whether the others are two that lie on each other.
    fn are_folded(&self) -> bool {
        let apart = self.turns[0].wrapping_sub(self.turns[1]);
        self.others == 2 && apart.min(apart.wrapping_neg()) < FOLDED_TURN
    }

    /// All uses are in.
    fn finish(
        mut self,
        unit: f64,
        facts: &mut Outbox<Fact>,
        stats: &mut SettleStats,
    ) -> Result<(), StoreError> {
        self.end_run(facts)?;
        let length = length_of(unpack_ends(self.ends), unit);
        let others_are_even = self.others.is_multiple_of(2);
        match self.even {
            // On the patch's rim: whether the edge is open depends on what becomes of the patch.
            Some((group, _)) if self.even_count % 2 == 1 => {
                let kind = match (self.others, others_are_even) {
                    (0, _) if self.given == 0 => RIM_ALONE_CLOSED,
                    (0, _) => RIM_ALONE_OPEN,
                    (_, true) if self.are_folded() => RIM_FOLDED,
                    (_, true) => RIM_EVEN,
                    (_, false) => RIM_ODD,
                };
                facts.push(Fact { group, kind, value: length.to_bits() })?;
            }
            _ if !others_are_even => stats.add_rim(length),
            _ => {}
        }
        Ok(())
    }
}

/// Goes through all uses of edges.
pub(crate) fn judge_edges(
    edges: Sorter<EdgeUse>,
    unit: f64,
    facts: &mut Outbox<Fact>,
    stats: &mut SettleStats,
) -> Result<(), StoreError> {
    let mut sorted = edges.finish()?;
    let mut open: Option<Tally> = None;
    while let Some(edge) = sorted.next()? {
        if open.as_ref().is_none_or(|tally| tally.ends != edge.ends)
            && let Some(done) = open.replace(Tally::new(edge.ends))
        {
            done.finish(unit, facts, stats)?;
        }
        if let Some(tally) = &mut open {
            tally.add(&edge, facts)?;
        }
    }
    open.map_or(Ok(()), |done| done.finish(unit, facts, stats))
}
