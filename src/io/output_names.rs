//! Names of materials as a writer gives them: none empty, no two alike, one line each.
//!
//! In:         a palette. Out: a name for every number.
//! Memory:     the share of a dictionary, spilled beyond.

use crate::io::error::IoError;
use crate::io::palette::Palette;
use crate::mesh::{Material, Surface};
use crate::store::{Dictionary, Scratch, StoreError};

/// Memory for names; the least that a dictionary asks for.
const SHARE_BYTES: u64 = 48 << 10;

/// The names of a palette, by material number.
pub(crate) struct OutputNames {
    names: Dictionary,
}

impl OutputNames {
    pub(crate) fn new(palette: &Palette, scratch: &Scratch) -> Result<Self, IoError> {
        let mut names = Dictionary::new(scratch, SHARE_BYTES);
        palette.for_each(|number, material| {
            let mut name = plain_name(&material, number);
            while names.find(name.as_bytes())?.is_some() {
                name = format!("{name}_{number}");
            }
            names.number(name.as_bytes())?;
            Ok(())
        })?;
        Ok(Self { names })
    }

    /// The name of a surface.
    pub(crate) fn name(&mut self, surface: Surface) -> Result<String, StoreError> {
        let name = self.names.name(surface.material())?;
        let name = String::from_utf8(name).expect("names are numbered as text");
        Ok(if surface.is_patch() { name + Surface::PATCH_ENDING } else { name })
    }
}

/// The name that the file gives, in one line.
fn plain_name(material: &Material, number: u32) -> String {
    let name: String =
        material.name.chars().map(|c| if c.is_control() { '_' } else { c }).collect();
    let name = name.trim();
    if name.is_empty() { format!("material_{number}") } else { name.to_owned() }
}
