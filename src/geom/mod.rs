//! Exact and small geometry: no files, no threads, no cells.

mod clearance;
mod closest;
pub mod crossing;
mod ear_clipping;
mod halving;
mod mix;
pub mod morton;
pub mod orientation;
pub mod qef;
pub mod signs;
pub mod triangle_triangle;
#[cfg(test)]
mod triangle_triangle_tests;
mod wide;

pub use clearance::are_within;
pub use closest::closest_on_triangle;
pub use ear_clipping::EarClipper;
pub use halving::{ball_around, halve, longest_edge, rejoin};
pub use mix::{mix, mix_words};
