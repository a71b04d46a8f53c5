//! From signs and Hermite data to a surface: vertices in cells, polygons around crossed edges.
//!
//! [`mdc`] is manifold dual contouring, the method that the guarantees rest on.

pub mod mdc;
