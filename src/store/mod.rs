//! Bytes on disk and in memory: brick files, sorts, tables, unions, and the one accountant.
//!
//! Nothing here knows what a cell or a triangle is. Everything that can outgrow its share of the
//! memory budget has a form on disk that gives the same answer.

mod accountant;
mod brick_file;
mod dictionary;
mod error;
mod manifest;
mod mapped;
mod pipeline;
mod resources;
mod scratch;
mod sort;
mod spool;
mod table;
mod unite;

pub use accountant::{Accountant, Lease};
pub use brick_file::{Backing, BrickFile, BrickWriter, DirectoryEntry, View};
pub use dictionary::{Dictionary, MOST_NAMES};
pub use error::StoreError;
pub use manifest::{Manifest, ManifestFile, load_manifest, save_manifest};
pub use pipeline::ordered;
pub use resources::Resources;
pub use scratch::{Scratch, sync_folder};
pub use sort::{Record, Sorted, Sorter};
pub use spool::{Spool, SpoolPeek, SpoolReader, SpoolWriter};
pub use table::Table;
pub use unite::{Labels, Unite};

/// Version of every file in a work folder; another version is discarded, never guessed at.
pub const FORMAT_VERSION: u32 = 1;
