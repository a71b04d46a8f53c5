//! What a brick says of panes, which the outside goes on behind.
//!
//! Past an edge that only panes hit, one looks: the region beyond is reached, though not by the
//! surface alone. What is reached so is outside if parity calls it so, and the winding number of
//! panes alone is zero: where two of them overlap, parity is even as well. Else it is the inside of
//! a pane. Slabs of ours face outward, so the number tells of them whatever the input faces.

use std::collections::BTreeMap;

use crate::octree::{
    ArchivedHitBrick, CornerBits, FlipRecord, HitEdge, ROWS, SourcePlane, TRANSPARENT,
    edge_position, find_regions,
};
use crate::sign::load::Loaded;

/// See the module. Regions are those of the brick.
#[derive(Clone, Debug, Default)]
pub struct PanesSay {
    /// Regions at the lower and the upper end of edges that only panes hit, by how much the winding
    /// number changes from one to the other, and how many edges say so.
    pub votes: Vec<([u16; 2], i16, u32)>,
    /// Of every region whether its parity is not that of the min corner.
    pub odd: Vec<bool>,
}

impl PanesSay {
    /// Looks at a loaded brick. An edge that a patch crosses is no pane.
    pub fn of(record: Option<&ArchivedHitBrick>, loaded: &Loaded, flips: &[FlipRecord]) -> Self {
        let regions = find_regions(&loaded.barrier);
        let mut parity = CornerBits::default();
        parity.from_marks(&loaded.marks, false);
        let mut odd = vec![false; usize::from(regions.count)];
        for row in 0..ROWS {
            // All corners of a region have one parity: between them is no mark.
            for (bits, region) in regions.row(row) {
                odd[usize::from(region)] = parity.rows[row] & bits != 0;
            }
        }
        let Some(record) = record else { return Self { votes: Vec::new(), odd } };
        let mut flips = flips.iter().peekable();
        let mut votes: BTreeMap<([u16; 2], i16), u32> = BTreeMap::new();
        let mut first = 0;
        for edge in record.edges.iter() {
            let edge = HitEdge::from(edge);
            let hits = &record.hits[first..first + edge.kept()];
            first += edge.kept();
            while flips.next_if(|flip| flip.edge < edge.edge()).is_some() {}
            let is_patched = flips.peek().is_some_and(|flip| flip.edge == edge.edge());
            let is_pane = |hit: &rkyv::rend::u32_le| {
                let plane = SourcePlane::from(&record.planes[hit.to_native() as usize]);
                plane.material & TRANSPARENT != 0
            };
            if is_patched || !hits.iter().all(is_pane) {
                continue;
            }
            let (axis, at) = edge_position(edge.edge());
            let mut beyond = at;
            beyond[axis] += 1;
            let ends = [regions.at(at), regions.at(beyond)];
            if ends[0] != ends[1] {
                *votes.entry((ends, -edge.signed_sum())).or_default() += 1;
            }
        }
        let votes = votes.into_iter().map(|((ends, delta), count)| (ends, delta, count));
        Self { votes: votes.collect(), odd }
    }
}
