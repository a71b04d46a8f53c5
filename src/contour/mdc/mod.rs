//! Manifold dual contouring: one vertex per boundary cycle of a cell, not one per cell.
//!
//! [`table`] answers, for each of the 256 sign patterns of a cell, which crossed edges share a
//! vertex.
//!
//! Source: Schaefer, Ju, Warren 2007 (Manifold Dual Contouring).

pub mod table;
