//! The edges of a soup: which join two triangles, and which are borders.
//!
//! In:      the bins of a soup; every triangle at an edge lies in the bin of the brick that holds
//!          the edge's lower end.
//! Out:     [`TrianglePair`]s on edges of two; [`BorderUse`]s of all other edges, and of those
//!          between panes and opaque triangles where panes are to be apart.
//! Units:   lattice points; an edge is what two triangles have in common on the lattice.
//! Memory:  the share.

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

use crate::octree::points::{owner, pack_ends, snapped};
use crate::octree::{BinnedSoup, Domain, SoupBin};
use crate::store::{Outbox, Record, Resources, Scratch, Sorter, Spool, StoreError, ordered};

/// Two triangles that share an edge with no third.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TrianglePair {
    /// One source number.
    pub one: u32,
    /// The other.
    pub other: u32,
    /// 1 where both run along the edge in the same way, so that one of them is turned over.
    pub turned: u32,
}

impl Record for TrianglePair {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.one, self.other, self.turned)
    }
}

/// A triangle at an edge that one triangle meets, or more than two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BorderUse {
    /// The edge.
    pub ends: [u64; 3],
    /// The triangle.
    pub source: u32,
    /// The corner at which the edge begins, on the way around the triangle; plus
    /// [`Self::BACKWARD`] and [`Self::PANE`].
    pub corner: u32,
}

impl BorderUse {
    /// Added to the corner where the triangle runs from the edge's upper end to its lower.
    pub const BACKWARD: u32 = 4;

    /// Added to the corner where light passes the triangle.
    pub const PANE: u32 = 8;

    /// Which of the triangle's corners the edge begins at.
    #[must_use]
    pub const fn begins_at(&self) -> usize {
        (self.corner & 3) as usize
    }
}

impl Record for BorderUse {
    type Key = ([u64; 3], u32, u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.source, self.corner)
    }
}

/// Whether transparent triangles are joined with others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Panes {
    /// Edges between them count as any.
    Joined,
    /// Edges of two, one of which is transparent, are borders of both.
    Apart,
}

/// Edges of a soup on their way into sorts.
pub struct SoupEdges {
    /// Edges of two triangles.
    pub pairs: Sorter<TrianglePair>,
    /// All other edges.
    pub borders: Sorter<BorderUse>,
}

/// Sorts of one bin and of all that are alive at one time.
const SORTS: u64 = 4;

impl SoupEdges {
    /// Finds the edges of all bins.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn find(
        soup: &BinnedSoup,
        domain: &Domain,
        panes: Panes,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        Self::find_in(soup, domain, panes, |_| true, resources)
    }

    /// Finds the edges of the bins that `wants` takes.
    ///
    /// # Errors
    /// As [`Self::find`].
    pub fn find_in(
        soup: &BinnedSoup,
        domain: &Domain,
        panes: Panes,
        wants: impl Fn(&SoupBin) -> bool + Send,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let scratch = resources.scratch;
        let workers = resources.pool.current_num_threads() as u64;
        let share_bytes = resources.share_bytes / 2 / workers / SORTS;
        let pairs = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
        let borders = Mutex::new(Sorter::new(scratch, resources.share_bytes / 8));
        let mut walk = soup.walk();
        ordered(
            resources.pool,
            || {
                while let Some(bin) = walk.next_bin()? {
                    if resources.monitor.cancelled() {
                        return Err(StoreError::Cancelled);
                    }
                    if wants(&bin) {
                        return Ok(Some(bin));
                    }
                }
                Ok(None)
            },
            || {
                let (pairs, borders) = (Outbox::new(&pairs), Outbox::new(&borders));
                EdgeFinder { soup: *soup, domain, panes, scratch, share_bytes, pairs, borders }
            },
            |finder, bin| finder.find(&bin),
            |()| Ok(()),
        )?;
        let pairs = pairs.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Self { pairs, borders: borders.into_inner().unwrap_or_else(PoisonError::into_inner) })
    }
}

/// Finds the edges of one bin after another.
struct EdgeFinder<'f> {
    soup: BinnedSoup<'f>,
    domain: &'f Domain,
    panes: Panes,
    scratch: &'f Scratch,
    share_bytes: u64,
    pairs: Outbox<'f, TrianglePair>,
    borders: Outbox<'f, BorderUse>,
}

impl EdgeFinder<'_> {
    fn find(&mut self, bin: &SoupBin) -> Result<(), StoreError> {
        let mut uses = Sorter::<BorderUse>::new(self.scratch, self.share_bytes);
        let domain = self.domain;
        bin.each(&self.soup, |triangle| {
            let corners = snapped(domain, triangle);
            if (0..3).any(|i| corners[i] == corners[(i + 1) % 3]) {
                return Ok(());
            }
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let ends = [a.min(b), a.max(b)];
                if owner(domain, ends[0]) == bin.brick.0 {
                    let pane = if triangle.is_pane() { BorderUse::PANE } else { 0 };
                    let corner = i as u32 + if a > b { BorderUse::BACKWARD } else { 0 } + pane;
                    let (ends, source) = (pack_ends(ends), triangle.source);
                    uses.push(BorderUse { ends, source, corner })?;
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

    fn are_joined(&self, one: &BorderUse, other: &BorderUse) -> bool {
        self.panes == Panes::Joined || (one.corner ^ other.corner) & BorderUse::PANE == 0
    }

    /// Tells of an edge by its last uses, three of which stand for any number from three on.
    fn tell(&mut self, held: &mut Vec<BorderUse>) -> Result<(), StoreError> {
        match held[..] {
            [one, other] if self.are_joined(&one, &other) => {
                let turned = u32::from((one.corner ^ other.corner) & BorderUse::BACKWARD == 0);
                let (one, other) = (one.source, other.source);
                self.pairs.push(TrianglePair { one, other, turned })?;
            }
            _ => held.iter().try_for_each(|border| self.borders.push(*border))?,
        }
        held.clear();
        Ok(())
    }
}

/// Uses of one edge that are told at one time.
pub const MOST_USES: usize = 64;

/// Visits the uses of edge after edge; of a crowded one [`MOST_USES`] at a time.
///
/// # Errors
/// The scratch disk fails, or as `visit`.
pub fn each_border(
    borders: &Spool<BorderUse>,
    mut visit: impl FnMut(&[BorderUse]) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut reader = borders.reader(0, borders.len());
    let mut around: Vec<BorderUse> = Vec::with_capacity(MOST_USES);
    while let Some(block) = reader.next_block()? {
        for border in block {
            if around.first().is_some_and(|first| first.ends != border.ends) {
                visit(&around)?;
                around.clear();
            } else if around.len() == MOST_USES {
                visit(&around)?;
                around.remove(0);
            }
            around.push(*border);
        }
    }
    if around.is_empty() { Ok(()) } else { visit(&around) }
}
