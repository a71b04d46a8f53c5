//! The region graph: regions of all bricks, united across brick borders and through empty space.
//!
//! A region is a set of corners joined by edges that no hit and no patch crosses. A second union,
//! in which even hits do not count, tells which volumes only the resolution seals.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};

use crate::monitor::{Gauge, Monitor, Resident};
use crate::octree::{
    ArchivedHitBrick, BrickIndex, BrickKey, FaceRegions, FlipRecord, Flips, HitEdge, Neighbour,
    Regions, SIDE, decode_hits, edge_position, find_regions,
};
use crate::sign::exterior::{Exterior, PastPanes, relabelled};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::sign::panes::PanesSay;
use crate::sign::thin::SPECK_EDGES;
use crate::sign::winding::{Votes, Windings};
use crate::sign::{FillRule, SignError};
use crate::store::{
    BrickFile, Record, Resources, Sorter, Spool, SpoolWriter, StoreError, Unite, ordered_by_weight,
};

/// A brick of the graph. 16 bytes.
#[derive(Clone, Copy, Debug)]
pub struct GraphBrick {
    /// Its key.
    pub key: u64,
    /// Number of its first region.
    pub first_region: u32,
    /// How many regions it has.
    pub regions: u16,
    /// Whether an odd number of marks lies on the x line through its min corner.
    pub odd_first_line: bool,
    /// Whether no hit of it can be lost, if the outside reaches one of its regions and not the other.
    pub is_parted: bool,
}

/// A piece of a face between two bricks, as one of them sees it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FacePiece {
    /// Key of the upper brick.
    upper: u64,
    /// Normal of the face.
    axis: u32,
    /// Number of the piece on the face.
    piece: u32,
    /// 1 when the upper brick says so, 0 when the lower does.
    side: u32,
    /// The region there.
    region: u32,
}

impl Record for FacePiece {
    type Key = (u64, u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.upper, self.axis, self.piece, self.side)
    }
}

/// Regions of all bricks and what joins them.
pub struct RegionGraph {
    /// The bricks in Morton order.
    pub bricks: Vec<GraphBrick>,
    pieces: Sorter<FacePiece>,
    /// Pairs of regions joined by an edge with even hits.
    even: Option<Spool<[u32; 2]>>,
    /// What hits say about winding numbers, where that is asked.
    votes: Option<Sorter<Votes>>,
    /// What there is of panes, where there are any.
    panes: Option<PaneGraph>,
    odd_regions: Option<Spool<u8>>,
    regions: u64,
}

/// What panes join.
pub struct PaneGraph {
    /// Pairs of regions joined by an edge that only panes hit.
    pairs: Spool<[u32; 2]>,
    /// What these edges say about winding numbers.
    votes: Sorter<Votes>,
    /// Of every region 1 where its parity is not that of its brick's min corner.
    odd: Spool<u8>,
}

/// Spools that live within the flood.
pub const PASSING: [&str; 3] = ["even.spool", "panes.spool", "odd.spool"];

/// What one brick says.
struct BrickSays {
    brick: BrickKey,
    regions: u16,
    odd_first_line: bool,
    is_parted: bool,
    sides: [FaceRegions; 6],
    even: Vec<[u16; 2]>,
    /// Regions at the lower and the upper end of edges, the change, and how many edges say so.
    votes: Vec<([u16; 2], i16, u32)>,
    /// Pairs of regions that only panes are between, and which regions are odd.
    panes: PanesSay,
}

/// Finds the regions of all bricks.
pub fn build_graph(
    hits: &BrickFile,
    flips: &Flips,
    (rule, has_panes): (FillRule, bool),
    resources: &Resources,
) -> Result<RegionGraph, SignError> {
    let mut items = LoadItems::new(hits, flips, resources);
    let mut bricks = Vec::with_capacity(hits.len());
    let mut pieces = Sorter::<FacePiece>::new(resources.scratch, resources.share_bytes / 4);
    let mut even = SpoolWriter::<[u32; 2]>::create(resources.scratch, PASSING[0])?;
    let mut pane_pairs = SpoolWriter::<[u32; 2]>::create(resources.scratch, PASSING[1])?;
    let mut pane_votes = Sorter::<Votes>::new(resources.scratch, resources.share_bytes / 16);
    let mut odd = SpoolWriter::<u8>::create(resources.scratch, PASSING[2])?;
    let mut votes = Sorter::<Votes>::new(resources.scratch, resources.share_bytes / 8);
    let mut regions = 0_u64;
    let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
    ordered_by_weight(
        resources.pool,
        resources.scales(|item: &LoadItem| item.weight_bytes(hits)),
        || Ok(items.next()?),
        Loaded::default,
        |loaded, item| {
            let _brick = resident.hold(1);
            let view = loaded.load_checked(hits, &item)?;
            let record = view.as_ref().map(|view| decode_hits(view)).transpose()?;
            let mut says = examine(loaded, record, &item);
            if let (FillRule::Nonzero, Some(record)) = (rule, record) {
                says.votes = votes_of(record, loaded, &item.flips);
            }
            if has_panes {
                says.panes = PanesSay::of(record, loaded, &item.flips);
            }
            Ok(says)
        },
        |says: BrickSays| {
            let base = u32::try_from(regions + u64::from(says.regions))
                .map_err(|_| StoreError::TooMany { what: "Regions", limit: u64::from(u32::MAX) })?
                - u32::from(says.regions);
            for pair in &says.even {
                even.push(pair.map(|region| base + u32::from(region)))?;
            }
            for &(regions, delta, count) in &says.panes.votes {
                let [a, b] = regions.map(|region| base + u32::from(region));
                pane_pairs.push([a, b])?;
                pane_votes.push(Votes { a, b, delta: delta.into(), count })?;
            }
            says.panes.odd.iter().try_for_each(|&is_odd| odd.push(is_odd.into()))?;
            for &(regions, delta, count) in &says.votes {
                let [a, b] = regions.map(|region| base + u32::from(region));
                votes.push(Votes { a, b, delta: delta.into(), count })?;
            }
            push_sides(&says, base, &mut pieces)?;
            bricks.push(GraphBrick {
                key: says.brick.0,
                first_region: base,
                regions: says.regions,
                odd_first_line: says.odd_first_line,
                is_parted: says.is_parted,
            });
            regions += u64::from(says.regions);
            resources.monitor.advance(1);
            Ok::<(), SignError>(())
        },
    )?;
    let even = Some(even.finish()?);
    let votes = (rule == FillRule::Nonzero).then_some(votes);
    let panes = PaneGraph { pairs: pane_pairs.finish()?, votes: pane_votes, odd: odd.finish()? };
    let panes = has_panes.then_some(panes);
    Ok(RegionGraph { bricks, pieces, even, votes, panes, odd_regions: None, regions })
}

fn examine(loaded: &Loaded, record: Option<&ArchivedHitBrick>, item: &LoadItem) -> BrickSays {
    let regions = find_regions(&loaded.barrier);
    let sides =
        std::array::from_fn(|side| regions.on_side(&loaded.barrier, side / 2, side % 2 == 1));
    let is_odd = loaded.barrier == loaded.marks;
    // No face is odd where nothing was patched. If all edges that are hit are odd as well, parity changes
    // there and nowhere else, so that their ends lie in both regions; and no speck has so many.
    let hit_edges = record.map_or(0, |record| record.edges.len());
    let is_parted =
        is_odd && item.flips.is_empty() && regions.count == 2 && hit_edges > SPECK_EDGES;
    BrickSays {
        brick: item.brick,
        regions: regions.count,
        odd_first_line: loaded.marks.rows(0)[0].count_ones() % 2 == 1,
        is_parted,
        sides,
        even: if is_odd { Vec::new() } else { even_pairs(loaded, &regions) },
        votes: Vec::new(),
        panes: PanesSay::default(),
    }
}

/// What the hits of a brick say about the winding numbers of its regions. An edge that a patch
/// crosses says nothing.
fn votes_of(
    brick: &ArchivedHitBrick,
    loaded: &Loaded,
    flips: &[FlipRecord],
) -> Vec<([u16; 2], i16, u32)> {
    let regions = find_regions(&loaded.barrier);
    let mut flips = flips.iter().peekable();
    let mut votes: BTreeMap<([u16; 2], i16), u32> = BTreeMap::new();
    for edge in brick.edges.iter() {
        let edge = HitEdge::from(edge);
        while flips.next_if(|flip| flip.edge < edge.edge()).is_some() {}
        let is_patched = flips.peek().is_some_and(|flip| flip.edge == edge.edge());
        let (axis, at) = edge_position(edge.edge());
        if is_patched || at.contains(&SIDE) {
            continue;
        }
        let mut beyond = at;
        beyond[axis] += 1;
        let ends = [regions.at(at), regions.at(beyond)];
        // A triangle that faces up the axis has the inside below it.
        *votes.entry((ends, -edge.signed_sum())).or_default() += 1;
    }
    votes.into_iter().map(|((ends, delta), count)| (ends, delta, count)).collect()
}

/// Pairs of regions on both sides of an edge that is a barrier and not marked.
fn even_pairs(loaded: &Loaded, regions: &Regions) -> Vec<[u16; 2]> {
    let mut pairs = Vec::new();
    loaded.barrier.for_each(|edge| {
        if !loaded.marks.get(edge) {
            let (axis, at) = edge_position(edge);
            let mut beyond = at;
            beyond[axis] += 1;
            let (a, b) = (regions.at(at), regions.at(beyond));
            if a != b {
                pairs.push([a.min(b), a.max(b)]);
            }
        }
    });
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn push_sides(
    says: &BrickSays,
    base: u32,
    pieces: &mut Sorter<FacePiece>,
) -> Result<(), StoreError> {
    for (side, regions) in says.sides.iter().enumerate() {
        let (axis, high) = (side / 2, side % 2 == 1);
        let upper = if high { says.brick.upper(axis) } else { says.brick };
        for (piece, &region) in regions.iter().enumerate() {
            pieces.push(FacePiece {
                upper: upper.0,
                axis: axis as u32,
                piece: piece as u32,
                side: u32::from(!high),
                region: base + u32::from(region),
            })?;
        }
    }
    Ok(())
}

impl RegionGraph {
    /// Which regions are odd, where there are panes and the flood is done.
    pub fn odd_regions(&self) -> Option<&Spool<u8>> {
        self.odd_regions.as_ref()
    }

    /// The number of regions.
    pub fn region_count(&self) -> u64 {
        self.regions
    }

    /// Unites all and finds what the outside reaches.
    pub fn flood(
        &mut self,
        index: &BrickIndex,
        resources: &Resources,
    ) -> Result<Exterior, SignError> {
        let outside = self.regions + index.empty_count() as u64;
        // Panes need a union and winding numbers of their own.
        let share = resources.share_bytes / if self.panes.is_some() { 8 } else { 4 };
        let mut strict = Unite::new(resources.scratch, share, outside + 1)?;
        let mut loose = Unite::new(resources.scratch, share, outside + 1)?;
        let outside = outside as u32;
        let first_empty = self.regions as u32;
        let mut past_panes = match &self.panes {
            Some(_) => Some(Unite::new(resources.scratch, share, u64::from(outside) + 1)?),
            None => None,
        };
        let mut join = |a: u32, b: u32| -> Result<(), StoreError> {
            strict.unite(a, b)?;
            past_panes.as_mut().map_or(Ok(()), |labels| labels.unite(a, b))?;
            loose.unite(a, b)
        };
        let none = Sorter::new(resources.scratch, 0);
        let pieces = std::mem::replace(&mut self.pieces, none);
        join_pieces(pieces, index, first_empty, outside, &mut join, resources.monitor)?;
        index.for_each_empty_contact(|empty, other| {
            let other = other.map_or(outside, |other| first_empty + other as u32);
            join(first_empty + empty as u32, other)
        })?;
        if let Some(even) = self.even.take() {
            let mut reader = even.reader(0, even.len());
            while let Some(block) = reader.next_block()? {
                block.iter().try_for_each(|&[a, b]| loose.unite(a, b))?;
            }
        }
        if let (Some(panes), Some(labels)) = (&self.panes, &mut past_panes) {
            let mut reader = panes.pairs.reader(0, panes.pairs.len());
            while let Some(block) = reader.next_block()? {
                block.iter().try_for_each(|&[a, b]| labels.unite(a, b))?;
            }
        }
        let (mut strict, mut loose) = (strict.finish()?, loose.finish()?);
        let strict_outside = strict.label(outside)?;
        let loose_outside = loose.label(outside)?;
        let windings = match self.votes.take() {
            Some(votes) => {
                let votes = relabelled(votes, &mut strict, resources)?;
                let regions = u64::from(outside) + 1;
                Some(Windings::count(votes, regions, strict_outside, resources)?)
            }
            None => None,
        };
        let past_panes = match (self.panes.take(), past_panes) {
            (Some(panes), Some(labels)) => {
                let votes = relabelled(panes.votes, &mut strict, resources)?;
                let regions = u64::from(outside) + 1;
                let windings = Windings::count(votes, regions, strict_outside, resources)?;
                self.odd_regions = Some(panes.odd);
                let mut labels = labels.finish()?;
                Some(PastPanes { outside: labels.label(outside)?, labels, windings })
            }
            _ => None,
        };
        Ok(Exterior { strict, strict_outside, loose, loose_outside, past_panes, windings })
    }
}

/// Joins what the two sides of every face say, or one side and the empty space beyond.
fn join_pieces(
    pieces: Sorter<FacePiece>,
    index: &BrickIndex,
    first_empty: u32,
    outside: u32,
    join: &mut impl FnMut(u32, u32) -> Result<(), StoreError>,
    monitor: &dyn Monitor,
) -> Result<(), SignError> {
    let mut sorted = pieces.finish()?;
    let mut waiting: Option<FacePiece> = None;
    loop {
        let next = sorted.next()?;
        if waiting.map(|piece| piece.upper) != next.map(|piece| piece.upper) && monitor.cancelled()
        {
            return Err(StoreError::Cancelled.into());
        }
        if let Some(first) = waiting.take() {
            let same = |other: &FacePiece| {
                (other.upper, other.axis, other.piece) == (first.upper, first.axis, first.piece)
            };
            match next {
                Some(second) if same(&second) => {
                    join(first.region, second.region)?;
                    continue;
                }
                _ => join(first.region, beyond(&first, index, first_empty, outside)?)?,
            }
        }
        if next.is_none() {
            return Ok(());
        }
        waiting = next;
    }
}

/// The empty space on the side of a face from which no brick spoke.
fn beyond(
    piece: &FacePiece,
    index: &BrickIndex,
    first_empty: u32,
    outside: u32,
) -> Result<u32, SignError> {
    let mut position = BrickKey(piece.upper).position();
    if piece.side == 1 {
        let axis = piece.axis as usize;
        position[axis] = position[axis].wrapping_sub(1);
    }
    match index.locate(position) {
        Neighbour::Empty(number) => Ok(first_empty + number as u32),
        Neighbour::Outside => Ok(outside),
        Neighbour::Brick(_) => Err(SignError::Contradiction {
            brick: position,
            expected: "both bricks at a face to find the same pieces of it",
        }),
    }
}
