//! Exact and small geometry: no files, no threads, no cells.

pub mod morton;
pub mod qef;

pub use ear_clipping::EarClipper;
