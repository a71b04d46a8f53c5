//! Materials of faces: the property `material_index` says which, comments of the header say what
//! each is called (`comment material 3 oak`), and the colour of its first face is its own.
//!
//! A face whose property `patch` is not zero has the material `NAME.patch`. Memory: the share,
//! spilled beyond.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::names::Materials;
use crate::mesh::{Material, Surface};
use crate::store::{Dictionary, Scratch};

/// How many materials are found without looking for their names.
const RECENT: usize = 32;

/// What a face says of its material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FaceSurface {
    pub(crate) index: u32,
    pub(crate) is_patch: bool,
    pub(crate) colour: Option<[u8; 4]>,
}

/// The materials of a file.
pub(crate) struct FaceMaterials {
    /// Names by index, of which none is left out and no two are alike.
    declared: Dictionary,
    used: Materials,
    /// Materials that were asked for of late, and their numbers.
    recent: [Option<(u32, bool, u32)>; RECENT],
}

impl FaceMaterials {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            declared: Dictionary::new(scratch, share_bytes / 2),
            used: Materials::new(scratch, share_bytes / 2),
            recent: [None; RECENT],
        }
    }

    /// Takes in a comment of the header, if it declares the next material.
    pub(crate) fn declare(&mut self, comment: &str) -> Result<(), IoError> {
        let mut words = comment.trim().splitn(3, ' ');
        let (Some("material"), Some(index), Some(name)) =
            (words.next(), words.next(), words.next())
        else {
            return Ok(());
        };
        let is_next = index.parse() == Ok(self.declared.len());
        if is_next && self.declared.find(name.as_bytes())?.is_none() {
            self.declared.number(name.as_bytes())?;
        }
        Ok(())
    }

    /// The number of the material that a face uses.
    pub(crate) fn number(&mut self, path: &Path, face: FaceSurface) -> Result<u32, IoError> {
        let FaceSurface { index, is_patch, colour } = face;
        let slot = (2 * index as usize + usize::from(is_patch)) % RECENT;
        let known = self.recent[slot].filter(|known| (known.0, known.1) == (index, is_patch));
        if let Some((.., number)) = known {
            return Ok(number);
        }
        let mut name = if u64::from(index) < self.declared.len() {
            String::from_utf8_lossy(&self.declared.name(index)?).into_owned()
        } else {
            format!("material_{index}")
        };
        if is_patch {
            name.push_str(Surface::PATCH_ENDING);
        }
        let before = self.used.count();
        let number = self.used.number(path, &name)?;
        if self.used.count() > before {
            let share = |channel: u8| f32::from(channel) / 255.0;
            let opacity = colour.map(|[.., alpha]| share(alpha)).filter(|alpha| *alpha < 1.0);
            let diffuse = colour.map(|[r, g, b, _]| [r, g, b].map(share));
            let transparent = opacity.is_some();
            let material = Material { name, transparent, diffuse, opacity, ..Material::default() };
            self.used.set(number, &material)?;
        }
        self.recent[slot] = Some((index, is_patch, number));
        Ok(number)
    }

    /// How many were used so far.
    pub(crate) fn count(&self) -> u64 {
        self.used.count()
    }

    /// A material that was used.
    pub(crate) fn get(&mut self, number: u32) -> Result<Material, IoError> {
        self.used.get(number)
    }
}
