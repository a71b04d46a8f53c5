//! Exact and small geometry: no files, no threads, no cells.

mod ear_clipping;
pub mod morton;
pub mod qef;

pub use ear_clipping::EarClipper;
