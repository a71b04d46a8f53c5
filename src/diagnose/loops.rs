//! The rims of a model: boundary edges, traced to loops fan by fan.
//!
//! In:         the sides of triangles at edges that have not two.
//! Out:        the boundary edges with their places; loops of them with their lengths.
//! Invariant:  two boundary edges at a vertex follow each other if a fan of triangles has them at its
//!             ends: sheets that touch in a point have loops of their own, holes that touch in a
//!             point are one.
//! Memory:     three quarters of the share, and the wedges of one vertex.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::defect::{Defect, DefectKind, OpenLoop};
use crate::diagnose::Means;
use crate::diagnose::edges::{Side, SideReader};
use crate::diagnose::fans::{MOST_WEDGES, NO_RIM, Wedge, pairs};
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::model::{BLOCK, Model};
use crate::store::{Labels, Record, Sequence, SequencePeek, Sorter, StoreError, Table, Unite};

/// What is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopReport {
    /// Boundary edges.
    pub edges: u64,
    /// Loops that they make up.
    pub count: u64,
    /// Length of all together, model units.
    pub total_length: f64,
    /// Length of the longest loop, model units.
    pub longest: f64,
    /// Edges of the loop with the most.
    pub most_edges: u64,
}

/// A boundary edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rim {
    pub(crate) ends: [[f64; 3]; 2],
    pub(crate) vertices: [u32; 2],
    /// Three times its triangle, and the corner that it begins at.
    pub(crate) side: u32,
    unused: u32,
}

impl Rim {
    /// Three times its triangle, and the corners that its ends are there.
    pub(crate) fn corners(&self) -> [u32; 2] {
        let (first, corner) = (self.side / 3 * 3, self.side % 3);
        [first + corner, first + (corner + 1) % 3]
    }
}

pub(crate) fn distance([a, b]: [[f64; 3]; 2]) -> f64 {
    glam::DVec3::from(a).distance(glam::DVec3::from(b))
}

/// Lists the boundary edges in the order of their triangles; and the length of all edges with more
/// than two triangles.
pub(crate) fn open_edges(
    model: &Model,
    sides: &Sequence<Side>,
    means: &Means<'_>,
) -> Result<(Sequence<Rim>, f64), StoreError> {
    let mut crowded_length = 0.0;
    let mut rims = Sequence::new(means.scratch, means.share_bytes / 8);
    let mut reader = SideReader::new(sides);
    model.each(means, |triangle| {
        for side in reader.of(triangle.number)?.into_iter().flatten() {
            let (from, to) = (side.side as usize % 3, (side.side as usize % 3 + 1) % 3);
            let ends = [triangle.corners[from], triangle.corners[to]];
            if side.triangles > 2 && side.is_first == 1 {
                crowded_length += distance(ends);
            }
            if side.triangles == 1 {
                rims.push(Rim {
                    ends,
                    vertices: [triangle.vertices[from], triangle.vertices[to]],
                    side: side.side,
                    unused: 0,
                })?;
            }
        }
        Ok(())
    })?;
    Ok((rims, crowded_length))
}

/// A triangle at a vertex of the rim.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RimWedge {
    vertex: u32,
    neighbours: [u32; 2],
    rims: [u32; 2],
}

impl Record for RimWedge {
    type Key = (u32, [u32; 2], [u32; 2]);
    fn key(&self) -> Self::Key {
        (self.vertex, self.neighbours, self.rims)
    }
}

/// A boundary edge on its way to its loop.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Piece {
    label: u32,
    rim: u32,
    ends: [[f64; 3]; 2],
}

impl Record for Piece {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.label, self.rim)
    }
}

/// Joins boundary edges to loops.
pub(crate) fn trace(
    model: &Model,
    rims: &Sequence<Rim>,
    means: &Means<'_>,
) -> Result<(LoopReport, Vec<Finding>), StoreError> {
    let mut labels = join(model, rims, means)?;
    let mut pieces = Sorter::new(means.scratch, means.share_bytes / 4);
    let mut rim = 0;
    let mut report = LoopReport { edges: rims.len(), ..LoopReport::default() };
    rims.each_block(BLOCK, |block| {
        for &Rim { ends, .. } in block {
            report.total_length += distance(ends);
            pieces.push(Piece { label: labels.label(rim)?, rim, ends })?;
            rim += 1;
        }
        Ok(())
    })?;
    drop(labels);
    let mut largest = SizedPlaces::default();
    let mut close = |found: Option<OpenLoop>, report: &mut LoopReport| {
        if let Some(found) = found {
            report.count += 1;
            report.longest = report.longest.max(found.length);
            report.most_edges = report.most_edges.max(found.edges);
            largest.offer(found.length, report.count, Defect::OpenLoop(found));
        }
    };
    let mut sorted = pieces.finish()?;
    let mut at_hand: Option<OpenLoop> = None;
    let mut label = u32::MAX;
    while let Some(piece) = sorted.next()? {
        if piece.label != label {
            close(at_hand.take(), &mut report);
            label = piece.label;
        }
        let position = piece.ends[0];
        let found = at_hand.get_or_insert(OpenLoop {
            edges: 0,
            length: 0.0,
            position,
            bounds: [position; 2],
        });
        found.edges += 1;
        found.length += distance(piece.ends);
        for (end, axis) in piece.ends.iter().flat_map(|end| (0..3).map(move |axis| (end, axis))) {
            found.bounds[0][axis] = found.bounds[0][axis].min(end[axis]);
            found.bounds[1][axis] = found.bounds[1][axis].max(end[axis]);
        }
    }
    close(at_hand, &mut report);
    let size = (Measure::LongestLength, report.longest);
    let places = largest.into_places();
    let loops = Finding::sized(DefectKind::OpenLoop, report.count, size, places);
    Ok((report, vec![loops]))
}

/// Boundary edges that follow each other, by fans.
fn join(model: &Model, rims: &Sequence<Rim>, means: &Means<'_>) -> Result<Labels, StoreError> {
    let Means { scratch, share_bytes, .. } = *means;
    let mut at_rim = Table::<u64>::scattered(scratch, share_bytes / 8);
    if !rims.is_empty() {
        (0..model.space.div_ceil(64)).try_for_each(|_| at_rim.push(0))?;
    }
    rims.each_block(BLOCK, |block| {
        for &vertex in block.iter().flat_map(|rim| &rim.vertices) {
            let (word, bit) = (u64::from(vertex) / 64, vertex % 64);
            let bits = at_rim.get(word)?;
            at_rim.set(word, bits | 1 << bit)?;
        }
        Ok(())
    })?;
    let mut wedges = Sorter::new(scratch, share_bytes / 4);
    let mut reader = RimReader { rims: SequencePeek::new(rims) };
    let mut visit = |vertices: [u32; 3], number: u64| {
        let own = reader.of(number)?;
        for corner in 0..3 {
            let vertex = vertices[corner];
            if at_rim.get(u64::from(vertex) / 64)? >> (vertex % 64) & 1 == 1 {
                let neighbours = [vertices[(corner + 1) % 3], vertices[(corner + 2) % 3]];
                let rims = [own[corner], own[(corner + 2) % 3]];
                wedges.push(RimWedge { vertex, neighbours, rims })?;
            }
        }
        Ok(())
    };
    if !rims.is_empty() {
        model.each(means, |triangle| match triangle.is_whole() {
            true => visit(triangle.vertices, triangle.number),
            false => Ok(()),
        })?;
    }
    drop(at_rim);
    let mut loops = Unite::scattered(scratch, share_bytes / 4, rims.len())?;
    let mut sorted = wedges.finish()?;
    let mut group: Vec<Wedge> = Vec::new();
    let mut vertex = u32::MAX;
    let mut crowd = Crowd::None;
    while let Some(wedge) = sorted.next()? {
        if wedge.vertex != vertex {
            pairs(&group).into_iter().try_for_each(|[a, b]| loops.unite(a, b))?;
            group.clear();
            (vertex, crowd) = (wedge.vertex, Crowd::None);
        }
        if crowd == Crowd::None && group.len() < MOST_WEDGES {
            group.push(Wedge { neighbours: wedge.neighbours, rims: wedge.rims });
            continue;
        }
        let before = group.drain(..).flat_map(|wedge| wedge.rims);
        for rim in before.chain(wedge.rims).filter(|&rim| rim != NO_RIM) {
            match crowd {
                Crowd::Rim(first) => loops.unite(first, rim)?,
                _ => crowd = Crowd::Rim(rim),
            }
        }
        if crowd == Crowd::None {
            crowd = Crowd::NoRim;
        }
    }
    pairs(&group).into_iter().try_for_each(|[a, b]| loops.unite(a, b))?;
    loops.finish()
}

/// Whether the vertex at hand has too many wedges for fans, and the first of its rims.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Crowd {
    None,
    NoRim,
    Rim(u32),
}

/// Reads boundary edges beside the triangles that they belong to.
struct RimReader<'r> {
    rims: SequencePeek<'r, Rim>,
}

impl RimReader<'_> {
    /// Numbers of the rims of a triangle, by the corners that they begin at; triangles are asked in
    /// order.
    fn of(&mut self, triangle: u64) -> Result<[u32; 3], StoreError> {
        let mut found = [NO_RIM; 3];
        while let Some((number, rim)) = self.rims.peek()?
            && u64::from(rim.side) < triangle * 3 + 3
        {
            found[rim.side as usize % 3] = number as u32;
            self.rims.pass();
        }
        Ok(found)
    }
}
