//! The edges of a record of hits, as they are passed one after the other, and the planes that are used of it.
//!
//! In:        a record of hits, or none.
//! Out:       edges with their hits, ascending; planes in their old order.
//! Memory:    4 bytes a plane of the record.
//! Fails:     never.

use crate::octree::{ArchivedHitBrick, Crossing, HitEdge, NO_PLANE, PATCH, SourcePlane};

/// Walks the hit edges of a record.
pub struct HitEdges<'r> {
    record: Option<&'r ArchivedHitBrick>,
    next: usize,
    first_hit: usize,
}

impl<'r> HitEdges<'r> {
    /// Before the first edge.
    pub fn new(record: Option<&'r ArchivedHitBrick>) -> Self {
        Self { record, next: 0, first_hit: 0 }
    }

    fn peek(&self) -> Option<HitEdge> {
        self.record?.edges.get(self.next).map(HitEdge::from)
    }

    fn advance(&mut self, edge: HitEdge) -> &'r [rkyv::rend::u32_le] {
        let range = self.first_hit..self.first_hit + edge.kept();
        self.next += 1;
        self.first_hit = range.end;
        self.record.map_or(&[], |record| &record.hits[range])
    }

    /// The next edge and its hits, if its number is below `limit`.
    pub fn next_below(&mut self, limit: u32) -> Option<(u32, &'r [rkyv::rend::u32_le])> {
        let edge = self.peek().filter(|edge| edge.edge() < limit)?;
        Some((edge.edge(), self.advance(edge)))
    }

    /// The hits of the next edge, if it is the one that is wanted.
    pub fn next_at(&mut self, wanted: u32) -> Option<&'r [rkyv::rend::u32_le]> {
        let edge = self.peek().filter(|edge| edge.edge() == wanted)?;
        Some(self.advance(edge)).filter(|hits| !hits.is_empty())
    }
}

/// Keeps the planes that are used, in their old order.
pub struct PlanePicker<'r> {
    record: Option<&'r ArchivedHitBrick>,
    used: Vec<u32>,
}

impl<'r> PlanePicker<'r> {
    /// None is used yet.
    pub fn new(record: Option<&'r ArchivedHitBrick>) -> Self {
        Self { record, used: vec![NO_PLANE; record.map_or(0, |r| r.planes.len())] }
    }

    /// Uses a plane: its old number.
    pub fn pick(&mut self, plane: rkyv::rend::u32_le) -> u32 {
        self.used[plane.to_native() as usize] = 0;
        plane.to_native()
    }

    /// The planes in use; crossings get their new numbers.
    pub fn finish(mut self, crossings: &mut [Crossing]) -> Vec<SourcePlane> {
        let mut planes = Vec::new();
        for (old, new) in self.used.iter_mut().enumerate().filter(|(_, new)| **new != NO_PLANE) {
            *new = planes.len() as u32;
            planes.extend(self.record.map(|record| SourcePlane::from(&record.planes[old])));
        }
        for crossing in crossings.iter_mut().filter(|crossing| crossing.plane & PATCH == 0) {
            crossing.plane = self.used[crossing.plane as usize];
        }
        planes
    }
}
