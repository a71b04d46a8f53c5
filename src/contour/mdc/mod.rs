//! Manifold dual contouring: one vertex per boundary cycle of a cell, not one per cell.
//!
//! [`table`] answers, for each of the 256 sign patterns of a cell, which crossed edges share a
//! vertex; `vertices` places them, `polygons` joins them around crossed edges, `triangulate` cuts
//! the quads.
//!
//! Source: Schaefer, Ju, Warren 2007 (Manifold Dual Contouring); Ju et al. 2002 (quadrics).

pub mod table;

mod polygons;
mod triangulate;
mod vertices;

pub use polygons::{BrickTriangles, FAN_POINT, Polygons};
pub use vertices::place_vertices;

use crate::contour::mdc::table::{Components, FLIPPED, TABLE};

/// Flag of a cell whose two-sided face is flipped, beside its number and mask.
const FLIPPED_BIT: u32 = 1 << 23;

/// The components of a packed cell.
fn components_of(cell: u32) -> &'static Components {
    let mask = (cell >> 15 & 0xff) as usize;
    if cell & FLIPPED_BIT == 0 { &TABLE[mask] } else { &FLIPPED[mask] }
}

/// The number of a packed cell in its brick.
const fn cell_number(cell: u32) -> usize {
    (cell & 0x7fff) as usize
}

/// The corner mask of a packed cell.
const fn cell_mask(cell: u32) -> u8 {
    (cell >> 15 & 0xff) as u8
}
