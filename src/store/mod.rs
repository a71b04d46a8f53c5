//! Bytes on disk and in memory: brick files, sorts, tables, unions, and the one accountant.
//!
//! Nothing here knows what a cell or a triangle is. Everything that can outgrow its share of the
//! memory budget has a form on disk that gives the same answer.

mod accountant;
mod brick;
mod brick_pass;
mod checkpoint;
mod dictionary;
mod digest;
mod error;
mod manifest;
mod mapped;
mod outbox;
mod parts;
mod pipeline;
mod resources;
mod scratch;
mod scratch_file;
mod sequence;
mod sort;
mod spool;
mod table;
mod texts;
mod unite;

pub use accountant::{Accountant, Lease};
pub use brick::{Backing, BrickFile, BrickWriter, DirectoryEntry, View, directory_name};
pub use brick_pass::BrickPass;
pub use checkpoint::{Checkpoints, FileState, NoCheckpoints, Progress};
pub use dictionary::{Dictionary, MOST_NAMES};
pub use digest::{DIGEST_BYTES, Digest, Digester, digest_file};
pub(crate) use digest::{digest, part_digest};
pub use error::StoreError;
pub use manifest::{Manifest, load_manifest, save_manifest};
pub use outbox::Outbox;
pub use parts::Parts;
pub use pipeline::{Scales, ordered, ordered_by_weight};
pub use resources::Resources;
pub use scratch::{Scratch, sync_folder};
pub use scratch_file::ScratchFile;
pub use sequence::{Sequence, SequencePeek};
pub use sort::{Record, Sorted, Sorter};
pub use spool::{Spool, SpoolPeek, SpoolReader, SpoolWriter};
pub use table::Table;
pub use texts::{NumberedTexts, Texts, TextsWriter};
pub use unite::{Labels, Unite};

/// Version of every file in a work folder; another version is discarded, never guessed at.
pub const FORMAT_VERSION: u32 = 11;
