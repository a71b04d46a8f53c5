//! The edges that a bin owns: which join two triangles, and which are borders.
//!
//! In:      the triangles of a bin that count.
//! Out:     [`Pair`]s of triangles on an edge of two; [`BorderUse`]s of all other edges.
//! Memory:  the share of a worker.

use bytemuck::{Pod, Zeroable};

use crate::ingest::bins::Bins;
use crate::ingest::duplicates::Settled;
use crate::ingest::examine::owner;
use crate::ingest::facts::Outbox;
use crate::ingest::kept::KeptBin;
use crate::ingest::packed::{pack_ends, snapped};
use crate::octree::Domain;
use crate::store::{Record, Scratch, Sorter, StoreError};

/// Two triangles that share an edge with no third.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Pair {
    pub one: u32,
    pub other: u32,
}

impl Record for Pair {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.one, self.other)
    }
}

/// A triangle on an edge that one triangle meets, or more than two.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct BorderUse {
    /// The edge.
    pub ends: [u64; 3],
    /// The triangle.
    pub source: u32,
    pub unused: u32,
}

impl Record for BorderUse {
    type Key = ([u64; 3], u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.source)
    }
}

/// Finds the edges of one bin after another.
pub struct EdgeFinder<'f> {
    pub bins: &'f Bins,
    pub settled: &'f Settled,
    pub domain: &'f Domain,
    pub scratch: &'f Scratch,
    pub share_bytes: u64,
    pub pairs: Outbox<'f, Pair>,
    pub borders: Outbox<'f, BorderUse>,
}

impl EdgeFinder<'_> {
    /// Finds those of one bin.
    pub fn find(&mut self, bin: &KeptBin) -> Result<(), StoreError> {
        let mut uses = Sorter::<BorderUse>::new(self.scratch, self.share_bytes);
        let domain = self.domain;
        bin.each(self.bins, self.settled, |triangle| {
            let corners = snapped(domain, triangle);
            if (0..3).any(|i| corners[i] == corners[(i + 1) % 3]) {
                return Ok(());
            }
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let ends = [a.min(b), a.max(b)];
                if owner(domain, ends[0]) == bin.entry.brick {
                    let (ends, source) = (pack_ends(ends), triangle.source);
                    uses.push(BorderUse { ends, source, unused: 0 })?;
                }
            }
            Ok(())
        })?;
        let mut sorted = uses.finish()?;
        // The first three uses of the edge under way; more go out as they come.
        let mut held: Vec<BorderUse> = Vec::with_capacity(3);
        while let Some(next) = sorted.next()? {
            if held.first().is_some_and(|first| first.ends != next.ends) {
                self.tell(&mut held)?;
            }
            held.push(next);
            if held.len() > 3 {
                self.borders.push(held.remove(0))?;
            }
        }
        self.tell(&mut held)?;
        self.pairs.send()?;
        self.borders.send()
    }

    /// Tells of an edge by its last uses, three of which stand for any number from three on.
    fn tell(&mut self, held: &mut Vec<BorderUse>) -> Result<(), StoreError> {
        match held[..] {
            [one, other] => self.pairs.push(Pair { one: one.source, other: other.source })?,
            _ => held.iter().try_for_each(|border| self.borders.push(*border))?,
        }
        held.clear();
        Ok(())
    }
}
