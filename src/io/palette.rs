//! The materials of a model, from its reader to the writer of its output.
//!
//! In:         the materials in the order of their numbers. Out: the same, one after another.
//! Memory:     one material.

use crate::io::error::IoError;
use crate::mesh::Material;
use crate::store::{FileState, Scratch, Spool, StoreError, Texts, TextsWriter};

/// Spool of the materials, each as a JSON text.
pub const MATERIALS: &str = "materials.spool";

/// Appends materials to their spool.
pub struct PaletteWriter {
    texts: TextsWriter,
}

impl PaletteWriter {
    /// Starts the spool.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch) -> Result<Self, StoreError> {
        Ok(Self { texts: TextsWriter::create(scratch, MATERIALS)? })
    }

    /// Appends the next material.
    ///
    /// # Errors
    /// The disk is full.
    pub fn push(&mut self, material: &Material) -> Result<(), StoreError> {
        self.texts.push(&serde_json::to_string(material).expect("plain records serialise"))
    }

    /// Completes the spool.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<FileState, StoreError> {
        Ok(self.texts.finish()?.state().clone())
    }
}

/// The materials that triangles of an output name by number.
#[derive(Clone, Debug)]
pub struct Palette {
    scratch: Scratch,
    state: FileState,
}

impl Palette {
    /// The palette in the spool that `state` tells of.
    #[must_use]
    pub fn new(scratch: &Scratch, state: &FileState) -> Self {
        Self { scratch: scratch.clone(), state: state.clone() }
    }

    /// Shows every material with its number, in order.
    ///
    /// # Errors
    /// The spool is missing or damaged, or what `visit` says.
    pub fn for_each(
        &self,
        mut visit: impl FnMut(u32, Material) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let spool = Spool::open(&self.scratch, &self.state)?;
        let mut texts = Texts::new(&spool);
        let mut number = 0;
        while let Some(text) = texts.next()? {
            let material = serde_json::from_str(&text).map_err(|error| {
                let (path, found) = (MATERIALS.as_ref(), format!("{text}: {error}"));
                StoreError::damaged(path, 0, "a material", found)
            })?;
            visit(number, material)?;
            number += 1;
        }
        Ok(())
    }
}
