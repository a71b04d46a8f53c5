//! Edges between vertices: what they join, and whose sides are rims or hang on others.
//!
//! In:         the whole triangles of a model.
//! Out:        triangles joined over all edges (shells), and over those of exactly two (sheets);
//!             the sides of triangles at edges that have not two, or two that run the same way.
//! Invariant:  depends on the vertices alone.
//! Memory:     three quarters of the share.

use bytemuck::{Pod, Zeroable};

use crate::defect::{DefectKind, Marks};
use crate::diagnose::Means;
use crate::diagnose::model::{BLOCK, Model};
use crate::store::{Labels, Record, Sequence, SequencePeek, Sorter, StoreError, Unite};

/// A side of a triangle at an edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    ends: [u32; 2],
    /// Three times the triangle, and the corner that it begins at.
    side: u32,
    /// 1 where the side runs from the first end, -1 from the second.
    way: i32,
}

impl Record for EdgeUse {
    type Key = ([u32; 2], u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.side)
    }
}

/// A side at an edge that has not two triangles, one each way.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Side {
    /// Three times the triangle, and the corner that it begins at.
    pub(crate) side: u32,
    /// How many triangles the edge has.
    pub(crate) triangles: u32,
    /// 1 for the first of them, else 0.
    pub(crate) is_first: u32,
    /// 1 where as many triangles run along the edge one way as the other, else 0.
    pub(crate) is_balanced: u32,
}

impl Record for Side {
    type Key = u32;
    fn key(&self) -> u32 {
        self.side
    }
}

/// What the edges tell.
pub(crate) struct Edges {
    /// Triangles joined over edges.
    pub(crate) shells: Labels,
    /// Triangles joined over edges of two.
    pub(crate) sheets: Labels,
    /// Sides at all other edges, in the order of triangles.
    pub(crate) sides: Sequence<Side>,
    /// All edges.
    pub(crate) count: u64,
}

impl Edges {
    /// Finds all edges.
    pub(crate) fn find(model: &Model, means: &Means<'_>) -> Result<Self, StoreError> {
        let Means { scratch, share_bytes, .. } = *means;
        let mut sorter = Sorter::new(scratch, share_bytes / 8);
        model.each(means, |triangle| {
            if triangle.is_whole() {
                for corner in 0..3 {
                    let (a, b) = (triangle.vertices[corner], triangle.vertices[(corner + 1) % 3]);
                    let side = triangle.number as u32 * 3 + corner as u32;
                    let way = if a < b { 1 } else { -1 };
                    sorter.push(EdgeUse { ends: [a.min(b), a.max(b)], side, way })?;
                }
            }
            Ok(())
        })?;
        let triangles = model.corners.len();
        let mut joining = Joining {
            shells: Unite::scattered(scratch, share_bytes / 4, triangles)?,
            sheets: Unite::scattered(scratch, share_bytes / 4, triangles)?,
            sides: Sorter::new(scratch, share_bytes / 16),
            count: 0,
            first: [0; 2],
            more: Sequence::new(scratch, share_bytes / 64),
            triangles: 0,
            balance: 0,
        };
        let mut sorted = sorter.finish()?;
        let mut ends = [u32::MAX; 2];
        while let Some(next) = sorted.next()? {
            if next.ends != ends {
                joining.close()?;
                ends = next.ends;
            }
            joining.add(next)?;
        }
        joining.close()?;
        drop(sorted);
        joining.finish(means)
    }
}

/// Marks all edges that have not two triangles, one each way, by their first side.
pub(crate) fn mark(sides: &Sequence<Side>, marks: &Marks) -> Result<(), StoreError> {
    sides.each_block(BLOCK, |block| {
        block.iter().filter(|side| side.is_first == 1).try_for_each(|side| {
            let kind = match side.triangles {
                1 => DefectKind::BoundaryEdge,
                2 => DefectKind::InconsistentEdge,
                _ => DefectKind::NonmanifoldEdge,
            };
            marks.corner(kind, side.side / 3, side.side % 3)
        })
    })
}

struct Joining {
    shells: Unite,
    sheets: Unite,
    sides: Sorter<Side>,
    count: u64,
    /// Of the edge at hand: its first two sides, the others, how many there are, and how many more
    /// run one way than the other.
    first: [u32; 2],
    more: Sequence<u32>,
    triangles: u32,
    balance: i64,
}

impl Joining {
    fn add(&mut self, EdgeUse { side, way, .. }: EdgeUse) -> Result<(), StoreError> {
        match self.triangles {
            0 => self.first = [side; 2],
            1 => self.first[1] = side,
            _ => self.more.push(side)?,
        }
        self.triangles += 1;
        self.balance += i64::from(way);
        self.shells.unite(self.first[0] / 3, side / 3)
    }

    /// Ends the edge at hand.
    fn close(&mut self) -> Result<(), StoreError> {
        let triangles = std::mem::take(&mut self.triangles);
        let is_balanced = u32::from(std::mem::take(&mut self.balance) == 0);
        self.count += u64::from(triangles > 0);
        let [first, second] = self.first;
        if triangles == 2 {
            self.sheets.unite(first / 3, second / 3)?;
        }
        if triangles == 0 || triangles == 2 && is_balanced == 1 {
            return Ok(());
        }
        let sides = &mut self.sides;
        let mut list =
            |side: u32, is_first: u32| sides.push(Side { side, triangles, is_first, is_balanced });
        list(first, 1)?;
        if triangles > 1 {
            list(second, 0)?;
            self.more
                .each_block(BLOCK, |block| block.iter().try_for_each(|&side| list(side, 0)))?;
            self.more.clear();
        }
        Ok(())
    }

    fn finish(self, means: &Means<'_>) -> Result<Edges, StoreError> {
        let mut sides = Sequence::new(means.scratch, means.share_bytes / 16);
        let mut sorted = self.sides.finish()?;
        while let Some(side) = sorted.next()? {
            sides.push(side)?;
        }
        drop(sorted);
        let (shells, sheets) = (self.shells.finish()?, self.sheets.finish()?);
        Ok(Edges { shells, sheets, sides, count: self.count })
    }
}

/// Reads sides beside the triangles that they belong to.
pub(crate) struct SideReader<'s> {
    sides: SequencePeek<'s, Side>,
}

impl<'s> SideReader<'s> {
    pub(crate) fn new(sides: &'s Sequence<Side>) -> Self {
        Self { sides: SequencePeek::new(sides) }
    }

    /// The sides of a triangle, by the corners that they begin at; triangles are asked in order.
    pub(crate) fn of(&mut self, triangle: u64) -> Result<[Option<Side>; 3], StoreError> {
        let mut found = [None; 3];
        while let Some((_, side)) = self.sides.peek()?
            && u64::from(side.side) < triangle * 3 + 3
        {
            found[side.side as usize % 3] = Some(side);
            self.sides.pass();
        }
        Ok(found)
    }
}
