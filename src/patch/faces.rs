//! Odd faces: their records, and the components that they form in a brick.
//!
//! Two odd faces belong together when they bound the same cell. Every cell has an even number of
//! odd faces, so a component can be closed on its own.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};

use crate::octree::{ArchivedHitBrick, BrickKey, EdgeBits, HitEdge, SIDE, SourcePlane, edge_index};
use crate::store::{Parts, Record};

/// A face with an odd number of marks. Its normal is `axis`, its min corner is in cells of the
/// grid; `sub` is where the rim pierces it, in 1/256 along the axes after `axis`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct OddFace {
    /// Axis and min corner, see [`OddFace::new`].
    pub place: u64,
    /// Where the surface's rim pierces the face, 1..=255 each.
    pub sub: [u8; 2],
    /// Zero.
    pub unused: [u8; 6],
}

const COORDINATE_BITS: u32 = 16;

impl OddFace {
    /// The face with normal `axis` at min corner `at`, in cells.
    #[must_use]
    pub fn new(axis: usize, at: [u32; 3], sub: [u8; 2]) -> Self {
        let mut place = axis as u64;
        for coordinate in [at[2], at[1], at[0]] {
            place = place << COORDINATE_BITS | u64::from(coordinate);
        }
        Self { place, sub, unused: [0; 6] }
    }

    /// Its normal.
    #[must_use]
    pub fn axis(self) -> usize {
        (self.place >> (3 * COORDINATE_BITS)) as usize
    }

    /// Its min corner in cells.
    #[must_use]
    pub fn at(self) -> [u32; 3] {
        let mask = (1 << COORDINATE_BITS) - 1;
        std::array::from_fn(|a| (self.place >> (a as u32 * COORDINATE_BITS) & mask) as u32)
    }
}

impl Record for OddFace {
    type Key = (u64, [u8; 2]);
    fn key(&self) -> Self::Key {
        (self.place, self.sub)
    }
}

/// An odd face with the label of its component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ComponentFace {
    /// The face.
    pub face: OddFace,
    /// Its component.
    pub label: u32,
    /// 0 when the brick owns the face, 1 when it lies on the brick's max side.
    pub on_max_side: u16,
    /// 1 when labels come first in the order, 0 when places do.
    pub by_label: u16,
}

impl Record for ComponentFace {
    type Key = (u32, u64, u16, u32, [u8; 2]);
    fn key(&self) -> Self::Key {
        let first = if self.by_label == 1 { self.label } else { 0 };
        (first, self.face.place, self.on_max_side, self.label, self.face.sub)
    }
}

/// The components of odd faces in one brick.
#[derive(Default)]
pub struct LocalComponents {
    /// Components that touch no face of the brick's border.
    pub inner: Vec<Vec<OddFace>>,
    /// Faces of all others, labelled from 0.
    pub border: Vec<ComponentFace>,
    /// How many labels there are in `border`.
    pub border_labels: u32,
}

/// A face in brick coordinates.
#[derive(Clone, Copy)]
struct LocalFace {
    axis: usize,
    at: [usize; 3],
}

/// Finds the odd faces of a brick and their components.
pub fn find_components(
    hits: &ArchivedHitBrick,
    brick: BrickKey,
    cell_units: f64,
    marks: &mut EdgeBits,
) -> LocalComponents {
    let offsets = mark_offsets(hits, cell_units, marks);
    let faces: Vec<LocalFace> = (0..3)
        .flat_map(|axis| {
            let found: Vec<_> = marks.odd_faces(axis).iter().collect();
            found.into_iter().map(move |at| LocalFace { axis, at })
        })
        .collect();
    let roots = unite_by_cell(&faces);
    let mut found = LocalComponents::default();
    let mut members: Vec<(usize, usize)> = roots.iter().copied().zip(0..).collect();
    members.sort_unstable();
    for component in members.chunk_by(|a, b| a.0 == b.0) {
        let touches = component.iter().any(|&(_, i)| faces[i].on_border());
        let odd = component.iter().map(|&(_, i)| faces[i].record(brick, &offsets, marks));
        if touches {
            let label = found.border_labels;
            found.border.extend(odd.zip(component).map(|(face, &(_, i))| ComponentFace {
                face,
                label,
                on_max_side: u16::from(faces[i].at[faces[i].axis] == SIDE),
                by_label: 0,
            }));
            found.border_labels += 1;
        } else {
            found.inner.push(odd.collect());
        }
    }
    found
}

/// Sets the marks of a brick; the offset of the surface on every marked edge.
fn mark_offsets(
    hits: &ArchivedHitBrick,
    cell_units: f64,
    marks: &mut EdgeBits,
) -> HashMap<u32, f64> {
    marks.clear();
    let mut offsets = HashMap::new();
    let mut first = 0;
    for edge in hits.edges.iter() {
        let edge = HitEdge::from(edge);
        if edge.class() & 1 == 1 {
            let plane = SourcePlane::from(&hits.planes[hits.hits[first].to_native() as usize]);
            let (axis, at) = crate::octree::edge_position(edge.edge());
            marks.set(edge.edge());
            offsets.insert(edge.edge(), plane.offset_on_edge(axis, at, cell_units));
        }
        first += edge.kept();
    }
    offsets
}

/// The smallest face of each face's component.
fn unite_by_cell(faces: &[LocalFace]) -> Vec<usize> {
    let mut at_cell: Vec<(u32, usize)> = faces
        .iter()
        .enumerate()
        .flat_map(|(i, face)| face.cells().map(move |cell| (cell, i)))
        .collect();
    at_cell.sort_unstable();
    let mut parts = Parts::new(faces.len());
    for pair in at_cell.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        parts.unite(pair[0].1, pair[1].1);
    }
    parts.firsts().to_vec()
}

impl LocalFace {
    fn on_border(self) -> bool {
        matches!(self.at[self.axis], 0 | SIDE)
    }

    /// The cells of the brick on both sides.
    fn cells(self) -> impl Iterator<Item = u32> {
        [0, 1].into_iter().filter_map(move |below| {
            let mut cell = self.at;
            cell[self.axis] = cell[self.axis].checked_sub(below)?;
            (cell[self.axis] < SIDE).then(|| (cell[0] + SIDE * (cell[1] + SIDE * cell[2])) as u32)
        })
    }

    /// The face in the grid, pierced at the mean of its marks.
    fn record(self, brick: BrickKey, offsets: &HashMap<u32, f64>, marks: &EdgeBits) -> OddFace {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let mut sum = [0.0; 2];
        let mut count = 0.0;
        for (side, (along, across)) in [(u, v), (v, u)].into_iter().enumerate() {
            for far in 0..2 {
                let mut at = self.at;
                at[across] += far;
                let edge = edge_index(along, at);
                if marks.get(edge) {
                    sum[side] += offsets[&edge];
                    sum[1 - side] += far as f64;
                    count += 1.0;
                }
            }
        }
        let sub = sum.map(|s| (s / count * 256.0).clamp(1.0, 255.0) as u8);
        let base = brick.position();
        let at = std::array::from_fn(|a| base[a] * SIDE as u32 + self.at[a] as u32);
        OddFace::new(self.axis, at, sub)
    }
}
