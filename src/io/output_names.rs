//! Names of materials and parts as a writer gives them: none empty, no two alike, one line each.
//!
//! In:         a palette, or one name after another. Out: a name for every number.
//! Memory:     the share of a dictionary, spilled beyond.

use crate::io::error::IoError;
use crate::io::palette::Palette;
use crate::mesh::Surface;
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
            enter(&mut names, ("material", number), &material.name)?;
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

/// The names of parts, as they come.
pub(crate) struct PartNames {
    names: Dictionary,
}

impl PartNames {
    pub(crate) fn new(scratch: &Scratch) -> Self {
        Self { names: Dictionary::new(scratch, SHARE_BYTES) }
    }

    /// A name for the part with this number.
    pub(crate) fn name(&mut self, number: u32, name: &str) -> Result<String, StoreError> {
        enter(&mut self.names, ("part", number), name)
    }
}

/// Enters the name that a file gives, in one line, and as no other is.
fn enter(
    names: &mut Dictionary,
    (kind, number): (&str, u32),
    name: &str,
) -> Result<String, StoreError> {
    let name: String = name.chars().map(|c| if c.is_control() { '_' } else { c }).collect();
    let mut name = match name.trim() {
        "" => format!("{kind}_{number}"),
        name => name.to_owned(),
    };
    while names.find(name.as_bytes())?.is_some() {
        name = format!("{name}_{number}");
    }
    names.number(name.as_bytes())?;
    Ok(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_names_of_their_own_in_one_line() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut names = PartNames::new(&Scratch::new(folder.path()));
        let mut name = |number, name| names.name(number, name).expect("named");
        assert_eq!(name(0, "leg"), "leg");
        assert_eq!(name(1, " leg "), "leg_1");
        assert_eq!(name(2, "a\nb"), "a_b");
        assert_eq!(name(3, ""), "part_3");
        assert_eq!(name(4, "leg_1"), "leg_1_4");
    }
}
