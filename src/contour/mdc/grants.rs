//! Decides which vertices reach into an empty cell beside their own.
//!
//! In:         bricks of cells with the [`VertexReach`]es that their planes suggest.
//! Out:        the bricks in which a vertex moved; clusters to split because they cover a cell that
//!             a vertex of another brick reaches into.
//! Invariant:  one vertex at most reaches into a cell, and none into a cell with surface or within
//!             a cluster: so the boxes of the cut stay apart. What was granted stays so until its
//!             brick is made again.
//! Units:      places in cells from the own brick's min corner.
//! Memory:     the numbers of the cells of a brick and of those around that are asked for.
//! Fails:      [`ContourError`].
//! Source:     ours.

use std::collections::HashMap;
use std::ops::Range;

use crate::contour::ContourError;
use crate::contour::mdc::cell::{cell_number, components_of, number_at, place_of};
use crate::contour::mdc::flags_of;
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::look::Looked;
use crate::octree::{
    ArchivedCellBrick, BrickKey, CellBrick, SIDE, VertexReach, cluster_over, encode,
};

/// What a brick tells of the cells that others may reach into.
struct Ground {
    number: usize,
    cells: Vec<u16>,
    clusters: Vec<u32>,
    reaches: Vec<VertexReach>,
}

impl Ground {
    fn new(number: usize, record: &ArchivedCellBrick) -> Self {
        let cells = record.cells.iter().map(|cell| cell_number(cell.to_native()) as u16);
        Self {
            number,
            cells: cells.collect(),
            clusters: record.clusters.iter().map(|cluster| cluster.to_native()).collect(),
            reaches: record.to_reaches(),
        }
    }

    fn has_surface(&self, cell: usize) -> bool {
        self.cells.binary_search(&(cell as u16)).is_ok()
    }

    /// What the vertex of a cell wants beyond a face.
    fn reach(&self, cell: usize, face: usize) -> Option<&VertexReach> {
        let at = self.reaches.binary_search_by_key(&cell, |reach| usize::from(reach.cell)).ok()?;
        Some(&self.reaches[at]).filter(|reach| usize::from(reach.face) == face)
    }
}

/// The own brick and those around it, as far as they were asked for.
struct Grounds<'l> {
    layers: &'l Layers<'l>,
    key: BrickKey,
    known: HashMap<u64, Option<Ground>>,
}

impl Grounds<'_> {
    /// The brick of a cell; `None` outside of the grid.
    fn key_at(&self, place: [i32; 3]) -> Option<BrickKey> {
        let mut position = self.key.position();
        for (coordinate, c) in position.iter_mut().zip(place) {
            *coordinate = coordinate.checked_add_signed(c.div_euclid(SIDE as i32))?;
        }
        Some(BrickKey::new(position))
    }

    /// The brick of a cell, and the cell's number there; `None` where no surface is.
    fn at(&mut self, place: [i32; 3]) -> Result<Option<(&Ground, usize)>, ContourError> {
        let side = SIDE as i32;
        let Some(key) = self.key_at(place) else { return Ok(None) };
        if !self.known.contains_key(&key.0) {
            let ground = match self.layers.find(key) {
                Some(number) => {
                    Some(self.layers.read(number, |record| Ok(Ground::new(number, record)))?)
                }
                None => None,
            };
            self.known.insert(key.0, ground);
        }
        let number = number_at(place.map(|c| c.rem_euclid(side) as usize));
        Ok(self.known[&key.0].as_ref().map(|ground| (ground, number)))
    }

    /// Whether another vertex reaches into the cell at `place`, or would rather than `mine`, which
    /// does so through `face` of its own cell.
    fn is_taken(
        &mut self,
        place: [i32; 3],
        face: usize,
        mine: &VertexReach,
    ) -> Result<bool, ContourError> {
        for other_face in (0..6).filter(|other| *other != face) {
            let other = beyond(place, other_face ^ 1);
            let Some((ground, number)) = self.at(other)? else { continue };
            if let Some(reach) = ground.reach(number, other_face)
                && (reach.is_granted || (reach.far, other_face) < (mine.far, face))
            {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Grants what can be granted in brick `number`; nothing in bricks with keys in `covered`, which
/// ascend.
///
/// # Errors
/// [`ContourError`].
pub fn grant(
    layers: &Layers,
    covered: &[Range<u64>],
    number: usize,
) -> Result<Looked, ContourError> {
    let key = layers.key(number);
    let reaches = layers.read(number, |record| Ok(record.to_reaches()))?;
    let mut grounds = Grounds { layers, key, known: HashMap::new() };
    let mut banned = Vec::new();
    let mut granted = Vec::new();
    for (at, reach) in reaches.iter().enumerate().filter(|(_, reach)| !reach.is_granted) {
        let face = usize::from(reach.face);
        let place = beyond(place_of(usize::from(reach.cell)).map(|c| c as i32), face);
        if grounds.key_at(place).is_none_or(|key| is_within(key, covered)) {
            continue;
        }
        if let Some((ground, cell)) = grounds.at(place)? {
            if ground.has_surface(cell) {
                continue;
            }
            if let Some(cluster) = cluster_over(&ground.clusters, cell as u32) {
                // Without the number of its vertices.
                banned.push((ground.number, cluster & 0x3_ffff));
                continue;
            }
        }
        if !grounds.is_taken(place, face, reach)? {
            granted.push(at);
        }
    }
    let has_grown = !granted.is_empty();
    if !has_grown && !layers.is_anew(number) {
        return Ok(Looked { number, key, flags: 0, bytes: None, has_grown, banned });
    }
    let mut brick = layers.read(number, |record| Ok(record.to_brick()))?;
    move_vertices(&mut brick, &granted);
    let (flags, bytes) = (flags_of(&brick), Some(encode(&brick)));
    Ok(Looked { number, key, flags, bytes, has_grown, banned })
}

fn beyond(mut place: [i32; 3], face: usize) -> [i32; 3] {
    place[face / 2] += if face % 2 == 1 { 1 } else { -1 };
    place
}

/// Moves the vertices of these reaches, by ascending number, to where they want.
fn move_vertices(brick: &mut CellBrick, granted: &[usize]) {
    let CellBrick { cells, clusters, reaches, positions, .. } = brick;
    let mut granted = granted.iter().copied().peekable();
    let mut clusters = clusters.iter().peekable();
    let (mut vertex, mut end) = (0, 0);
    for &packed in &*cells {
        let number = cell_number(packed);
        if number < end {
            continue;
        }
        if let Some(cluster) = clusters.next_if(|c| (**c & 0x7fff) as usize <= number) {
            end = (cluster & 0x7fff) as usize + (1 << (3 * (cluster >> 15 & 7)));
            vertex += (cluster >> 18) as usize;
            continue;
        }
        if let Some(at) = granted.next_if(|at| usize::from(reaches[*at].cell) == number) {
            reaches[at].is_granted = true;
            positions[vertex] = reaches[at].position;
        }
        vertex += usize::from(components_of(packed).count);
    }
    debug_assert!(granted.peek().is_none(), "reaches are of leaf cells of the cut");
}

/// Whether a key lies in one of these ranges.
fn is_within(key: BrickKey, ranges: &[Range<u64>]) -> bool {
    let after = ranges.partition_point(|range| range.start <= key.0);
    after.checked_sub(1).is_some_and(|at| ranges[at].contains(&key.0))
}
