//! Brick files: variable records under ascending keys, read through windows of the file.
//!
//! In:         one byte record per brick, keys ascending.
//! Out:        the same records by number or by key; each is checked against its hash once.
//! Invariant:  a record never crosses a window unless it is larger than one, and starts at a
//!             multiple of 16 bytes, as rkyv archives need it.
//! Memory:     the directory (40 bytes a record), and at most `cached_windows` windows besides
//!             those that a [`View`] holds.
//! Fails:      [`crate::store::StoreError::Damaged`] when the bytes are not those that were written.

mod file;
mod layout;
#[cfg(test)]
mod tests;
mod writer;

pub use file::{BrickFile, View};
pub use layout::{DirectoryEntry, directory_name};
pub use writer::BrickWriter;

/// Where the bytes of a brick file lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backing {
    /// In a memory-mapped scratch file.
    Mapped,
    /// In memory; for tests and for comparing.
    Memory,
}
