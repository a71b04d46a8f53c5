//! Edges between vertices: what they join, and whose sides are rims or hang on others.
//!
//! In:         the whole triangles of a model.
//! Out:        triangles joined over all edges (shells), and over those of exactly two (patches);
//!             the sides of triangles at all other edges.
//! Invariant:  depends on the vertices alone.
//! Memory:     three quarters of the share.

use bytemuck::{Pod, Zeroable};

use crate::diagnose::Means;
use crate::diagnose::model::{BLOCK, Model};
use crate::store::{Labels, Record, Sequence, Sorter, StoreError, Unite};

/// A side of a triangle at an edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EdgeUse {
    ends: [u32; 2],
    /// Three times the triangle, and the corner that it begins at.
    side: u32,
}

impl Record for EdgeUse {
    type Key = ([u32; 2], u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.side)
    }
}

/// A side at an edge that has not two triangles.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Side {
    /// Three times the triangle, and the corner that it begins at.
    pub(crate) side: u32,
    /// How many triangles the edge has.
    pub(crate) triangles: u32,
    /// 1 for the first of them, else 0.
    pub(crate) is_first: u32,
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
    pub(crate) patches: Labels,
    /// Sides at all other edges, in the order of triangles.
    pub(crate) sides: Sequence<Side>,
    /// All edges.
    pub(crate) count: u64,
}

impl Edges {
    /// Finds all edges.
    pub(crate) fn find(model: &Model, means: &Means<'_>) -> Result<Self, StoreError> {
        let Means { scratch, share_bytes, .. } = *means;
        let mut sorter = Sorter::new(scratch, share_bytes / 4);
        model.each(means, |triangle| {
            if triangle.is_whole() {
                for corner in 0..3 {
                    let (a, b) = (triangle.vertices[corner], triangle.vertices[(corner + 1) % 3]);
                    let side = triangle.number as u32 * 3 + corner as u32;
                    sorter.push(EdgeUse { ends: [a.min(b), a.max(b)], side })?;
                }
            }
            Ok(())
        })?;
        let triangles = model.corners.len();
        let mut joining = Joining {
            shells: Unite::new(scratch, share_bytes / 8, triangles)?,
            patches: Unite::new(scratch, share_bytes / 8, triangles)?,
            sides: Sorter::new(scratch, share_bytes / 8),
            more: Sequence::new(scratch, share_bytes / 64),
            count: 0,
        };
        let mut sorted = sorter.finish()?;
        // Of the edge at hand: its ends, its first two sides, and how many there are.
        let mut edge = ([u32::MAX; 2], [0; 2], 0);
        while let Some(EdgeUse { ends, side }) = sorted.next()? {
            if ends != edge.0 {
                joining.close(edge.1, edge.2)?;
                edge = (ends, [side; 2], 1);
                continue;
            }
            edge.2 += 1;
            if edge.2 == 2 {
                edge.1[1] = side;
            } else {
                joining.more.push(side)?;
            }
            joining.shells.unite(edge.1[0] / 3, side / 3)?;
        }
        joining.close(edge.1, edge.2)?;
        drop(sorted);
        joining.finish(means)
    }
}

struct Joining {
    shells: Unite,
    patches: Unite,
    sides: Sorter<Side>,
    /// All but the first two sides of the edge at hand.
    more: Sequence<u32>,
    count: u64,
}

impl Joining {
    /// Ends an edge with its first two sides.
    fn close(&mut self, first: [u32; 2], triangles: u32) -> Result<(), StoreError> {
        self.count += u64::from(triangles > 0);
        match triangles {
            0 => Ok(()),
            2 => self.patches.unite(first[0] / 3, first[1] / 3),
            _ => {
                self.sides.push(Side { side: first[0], triangles, is_first: 1 })?;
                if triangles > 1 {
                    let sides = &mut self.sides;
                    sides.push(Side { side: first[1], triangles, is_first: 0 })?;
                    self.more.each_block(BLOCK, |block| {
                        let mut more = block.iter();
                        more.try_for_each(|&side| sides.push(Side { side, triangles, is_first: 0 }))
                    })?;
                    self.more.clear();
                }
                Ok(())
            }
        }
    }

    fn finish(self, means: &Means<'_>) -> Result<Edges, StoreError> {
        let mut sides = Sequence::new(means.scratch, means.share_bytes / 16);
        let mut sorted = self.sides.finish()?;
        while let Some(side) = sorted.next()? {
            sides.push(side)?;
        }
        drop(sorted);
        let (shells, patches) = (self.shells.finish()?, self.patches.finish()?);
        Ok(Edges { shells, patches, sides, count: self.count })
    }
}

/// Reads sides beside the triangles that they belong to.
pub(crate) struct SideReader<'s> {
    sides: &'s Sequence<Side>,
    next: u64,
    buffer: Vec<Side>,
    at: usize,
}

impl<'s> SideReader<'s> {
    pub(crate) fn new(sides: &'s Sequence<Side>) -> Self {
        Self { sides, next: 0, buffer: Vec::new(), at: 0 }
    }

    /// The sides of a triangle, by the corners that they begin at; triangles are asked in order.
    pub(crate) fn of(&mut self, triangle: u64) -> Result<[Option<Side>; 3], StoreError> {
        let mut found = [None; 3];
        while let Some(side) = self.peek()?
            && u64::from(side.side) < triangle * 3 + 3
        {
            found[side.side as usize % 3] = Some(side);
            self.at += 1;
        }
        Ok(found)
    }

    fn peek(&mut self) -> Result<Option<Side>, StoreError> {
        if self.at == self.buffer.len() {
            let mut room = Vec::new();
            let block = self.sides.block(self.next, 1024, &mut room)?;
            self.next += block.len() as u64;
            self.buffer.clear();
            self.buffer.extend_from_slice(block);
            self.at = 0;
        }
        Ok(self.buffer.get(self.at).copied())
    }
}
