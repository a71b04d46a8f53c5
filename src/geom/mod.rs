//! Exact and small geometry: no files, no threads, no cells.

mod ear_clipping;
pub mod morton;
pub mod orientation;
pub mod qef;
pub mod triangle_triangle;
#[cfg(test)]
mod triangle_triangle_tests;

pub use ear_clipping::EarClipper;
