//! Manifold dual contouring: one vertex per boundary cycle of a cell, not one per cell.
//!
//! [`table`] answers, for each of the 256 sign patterns of a cell, which crossed edges share a
//! vertex; `vertices` and `leaf_vertex` place them; `cluster` lets one vertex stand for many;
//! `separate` finds where surfaces would cross in a cell; `polygons` joins vertices around crossed
//! edges, `triangulate` cuts the quads.
//!
//! Source: Schaefer, Ju, Warren 2007 (Manifold Dual Contouring); Ju et al. 2002 (quadrics).

pub mod table;

mod above;
mod angles;
mod arcs;
mod around_cell;
mod around_edge;
mod block_creases;
mod block_planes;
mod blocks;
mod borders;
mod cell;
mod cluster;
mod cut_cell;
mod cut_walk;
mod face_points;
mod far_points;
mod features;
mod grants;
mod joined_faces;
mod layers;
mod leaf_vertex;
mod leaves;
mod loaded;
mod look;
mod neighbourhood;
mod patch_surfaces;
mod plain;
mod polygons;
mod reach;
mod separate;
mod shape;
mod triangulate;
mod vertices;
mod workspace;

pub use layers::Layers;
pub use polygons::{BrickTriangles, FAN_POINT, Polygons};
pub use separate::{LOOKS, separate};
pub use vertices::place_vertices;

use crate::contour::mdc::cell::components_of;
use crate::octree::CellBrick;

/// A vertex keeps this many lattice units from the walls of its cell.
const INSET_UNITS: i64 = 2;

/// In the flags of a brick of cells: the number of its vertices, those on faces included.
pub const VERTICES: u32 = (1 << 24) - 1;
/// In the flags of a brick of cells: some cell of the cut has several vertices.
const HAS_MULTI: u32 = 1 << 31;
/// In the flags of a brick of cells: it has clusters.
const HAS_CLUSTERS: u32 = 1 << 30;
/// In the flags of a brick of cells: it has flagged cells.
const HAS_FLAGGED: u32 = 1 << 29;
/// In the flags of a brick of cells: it may be part of a cluster above the brick.
const HAS_SUMMARY: u32 = 1 << 28;
/// In the flags of a brick of cells: it is part of a cluster above the brick.
const IS_IN_ABOVE: u32 = 1 << 27;
/// In the flags of a brick of cells: vertices may reach beyond their cells.
const HAS_REACHES: u32 = 1 << 26;
/// In the flags of a brick of cells: vertices do.
const HAS_GRANTED: u32 = 1 << 25;
/// In the flags of a brick of cells that was made anew: its record has nothing but its face points, and all else
/// is as it was.
const HAS_POINTS_ONLY: u32 = 1 << 24;

/// What the directory says of a brick of cells.
fn flags_of(brick: &CellBrick) -> u32 {
    let vertices = (brick.positions.len() + brick.points.len()) as u32;
    let multi = !brick.members.is_empty() || has_multi_leaf(brick);
    vertices
        | if multi { HAS_MULTI } else { 0 }
        | if brick.clusters.is_empty() { 0 } else { HAS_CLUSTERS }
        | if brick.reaches.is_empty() { 0 } else { HAS_REACHES }
        | if brick.reaches.iter().any(|reach| reach.is_granted) { HAS_GRANTED } else { 0 }
        | if brick.flagged.is_empty() { 0 } else { HAS_FLAGGED }
        | if brick.summary.is_some() { HAS_SUMMARY } else { 0 }
        | if brick.above.is_some() { IS_IN_ABOVE } else { 0 }
}

/// Whether a leaf cell that no cluster covers has several vertices.
fn has_multi_leaf(brick: &CellBrick) -> bool {
    let mut clusters = brick.clusters.iter().peekable();
    brick.cells.iter().any(|&cell| {
        let number = cell & 0x7fff;
        while clusters
            .next_if(|c| (**c & 0x7fff) + (1 << (3 * (**c >> 15 & 7))) <= number)
            .is_some()
        {}
        let covered = clusters.peek().is_some_and(|cluster| **cluster & 0x7fff <= number);
        !covered && components_of(cell).count > 1
    })
}

/// The cells of the cut of a record: low corner and side in cells, and their vertices.
#[cfg(test)]
pub fn cut_of(
    record: &crate::octree::ArchivedCellBrick,
) -> Vec<([usize; 3], i64, std::ops::Range<usize>)> {
    let mut cut = Vec::new();
    let (mut vertices, mut end) = (0, 0);
    let mut clusters = record.clusters.iter().map(|cluster| cluster.to_native()).peekable();
    for cell in record.cells.iter().map(|cell| cell.to_native()) {
        let number = cell::cell_number(cell);
        if number < end {
            continue;
        }
        let cluster = clusters.next_if(|cluster| (cluster & 0x7fff) as usize <= number);
        let (first, level, count) = match cluster {
            Some(packed) => ((packed & 0x7fff) as usize, packed >> 15 & 7, packed >> 18),
            None => (number, 0, u32::from(components_of(cell).count)),
        };
        end = first + (1 << (3 * level));
        if record.above.is_some() {
            // Its vertex lies anywhere in a larger cell, and in one brick only.
            return cut;
        }
        let next = vertices + count as usize;
        cut.push((cell::place_of(first), 1 << level, vertices..next));
        vertices = next;
    }
    assert_eq!(vertices, record.positions.len());
    cut
}
