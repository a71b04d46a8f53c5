//! Marching cubes: a vertex on every crossed edge, triangles within every cell.
//!
//! `vertices` places the crossings, `cycles` joins them around each cell, `hull` cuts the cycles
//! into triangles, `triangles` does both brick by brick.
//!
//! The surface is closed, manifold and free of intersections and of degenerate triangles, whatever
//! the signs and the places of the crossings: cells meet in the sides of their cycles, on which
//! both agree, and `hull` tells why triangles of one cell do not meet. What it cannot do is follow
//! a crease or a corner within a cell: normals have no part in it.
//!
//! Source: Lorensen and Cline 1987 (Marching Cubes); Nielson and Hamann 1991 (ambiguous faces).

mod cycles;
mod hull;
mod triangles;
mod vertices;

#[cfg(test)]
mod tests;

pub use triangles::Triangles;
pub use vertices::{place_vertices, read_positions};

use crate::contour::ContourError;
use crate::octree::BrickKey;

/// The number of a packed cell in its brick.
const fn cell_number(cell: u32) -> usize {
    (cell & 0x7fff) as usize
}

/// The corner mask of a packed cell.
const fn cell_mask(cell: u32) -> u8 {
    (cell >> 15) as u8
}

/// A place on an edge, which lies strictly inside of it.
fn checked(place: u32, cell_units: u32, key: BrickKey) -> Result<u32, ContourError> {
    if (1..cell_units).contains(&place) {
        return Ok(place);
    }
    let expected = "crossings strictly inside of their edges";
    Err(ContourError::Contradiction { brick: key.position(), expected })
}
