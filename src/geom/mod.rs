//! Exact and small geometry: no files, no threads, no cells.

pub mod qef;
