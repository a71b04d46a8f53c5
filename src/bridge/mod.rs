//! Closes openings before the scan: rims that face each other are joined, loops are filled.
//!
//! In:         rim edges of the snapped soup with the corner across each, in memory.
//! Out:        triangles that go into the bins like any others.
//! Invariant:  mod 2, what a fill is bounded by is exactly the loop that it was made for.
//! Units:      model units; a cell's side is an argument.
//! Memory:     O(edges of the longest loop), and at most `MOST_TRIANGLES` triangles for its fill.
//! Fails:      never; what cannot be filled here is left to the patch.
//! Source:     Barequet, Sharir 1995, Filling gaps in the boundary of a polyhedron; Liepa 2003,
//!             Filling holes in meshes.

pub mod fill;
pub mod pair;
