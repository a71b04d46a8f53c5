//! Exact and small geometry: no files, no threads, no cells.

mod ear_clipping;

pub use ear_clipping::EarClipper;
