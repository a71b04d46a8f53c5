//! The parts and materials of a file, numbered in the order in which faces first use them.
//!
//! Memory: the share that each is given; what exceeds it goes to the scratch folder.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::mesh::{Material, Part};
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// Numbered parts.
pub(crate) struct Parts {
    names: Dictionary,
}

impl Parts {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { names: Dictionary::new(scratch, share_bytes) }
    }

    pub(crate) fn count(&self) -> u64 {
        self.names.len()
    }

    /// The number of a part that a face of the file at `path` uses.
    pub(crate) fn number(&mut self, path: &Path, name: &str) -> Result<u32, IoError> {
        self.names.number(name.as_bytes()).map_err(|e| of_file(e, path, "parts"))
    }

    pub(crate) fn get(&mut self, number: u32) -> Result<Part, IoError> {
        Ok(Part { name: text(self.names.name(number)?) })
    }
}

/// What is known of a material besides its name.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Properties {
    diffuse: [f32; 3],
    flags: u32,
}

const TRANSPARENT: u32 = 1;
const HAS_DIFFUSE: u32 = 2;

/// Numbered materials.
pub(crate) struct Materials {
    names: Dictionary,
    properties: Table<Properties>,
}

impl Materials {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            names: Dictionary::new(scratch, share_bytes / 4 * 3),
            properties: Table::new(scratch, share_bytes / 4),
        }
    }

    pub(crate) fn count(&self) -> u64 {
        self.names.len()
    }

    /// The number of `name`, of which nothing else is known where it is new.
    pub(crate) fn number(&mut self, path: &Path, name: &str) -> Result<u32, IoError> {
        let number = self.names.number(name.as_bytes());
        let number = number.map_err(|e| of_file(e, path, "materials"))?;
        if u64::from(number) == self.properties.len() {
            self.properties.push(Properties::zeroed())?;
        }
        Ok(number)
    }

    /// The number of `name`, if it is known.
    pub(crate) fn find(&mut self, name: &str) -> Result<Option<u32>, IoError> {
        Ok(self.names.find(name.as_bytes())?)
    }

    pub(crate) fn get(&mut self, number: u32) -> Result<Material, IoError> {
        let Properties { diffuse, flags } = self.properties.get(number.into())?;
        Ok(Material {
            name: text(self.names.name(number)?),
            transparent: flags & TRANSPARENT != 0,
            diffuse: (flags & HAS_DIFFUSE != 0).then_some(diffuse),
        })
    }

    /// Replaces what is known of a material besides its name.
    pub(crate) fn set(&mut self, number: u32, material: &Material) -> Result<(), IoError> {
        let transparent = if material.transparent { TRANSPARENT } else { 0 };
        let coloured = if material.diffuse.is_some() { HAS_DIFFUSE } else { 0 };
        let diffuse = material.diffuse.unwrap_or_default();
        let properties = Properties { diffuse, flags: transparent | coloured };
        Ok(self.properties.set(number.into(), properties)?)
    }
}

/// Too many names are the file's fault, a full disk is not.
fn of_file(error: StoreError, path: &Path, what: &'static str) -> IoError {
    match error {
        StoreError::TooMany { limit, .. } => IoError::too_many(path, what, limit),
        error => error.into(),
    }
}

fn text(name: Vec<u8>) -> String {
    String::from_utf8(name).expect("names are numbered as text")
}
