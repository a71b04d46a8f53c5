//! Materials of faces: the property `material_index` says which, comments of the header say what
//! each is called (`comment material 3 oak`), and the colour of its first face is its own, as is
//! the image that its `texnumber` says among the comments `TextureFile`.
//!
//! Where faces have texture coordinates and no `material_index`, each image is a material, which
//! has its name. A face whose property `patch` is not zero has the material `NAME.patch`. Memory:
//! the share, spilled beyond.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::names::Materials;
use crate::mesh::{Material, Surface, Texture};
use crate::store::{Dictionary, Scratch, Table};

/// How many materials are found without looking for their names.
const RECENT: usize = 32;

/// What a face says of its material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FaceSurface {
    pub(crate) index: u32,
    pub(crate) is_patch: bool,
    pub(crate) colour: Option<[u8; 4]>,
    /// The number of its image; the first where it says none.
    pub(crate) image: Option<i64>,
}

/// What tells materials apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Key {
    index: u32,
    is_patch: bool,
    image: i64,
}

/// The materials of a file.
pub(crate) struct FaceMaterials {
    /// Names by index, of which none is left out and no two are alike.
    declared: Dictionary,
    /// Images by number, equal ones once.
    images: Dictionary,
    image_numbers: Table<u32>,
    /// Whether images are the materials.
    is_by_image: bool,
    used: Materials,
    /// Materials that were asked for of late, and their numbers.
    recent: [Option<(Key, u32)>; RECENT],
}

impl FaceMaterials {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            declared: Dictionary::new(scratch, share_bytes / 4),
            images: Dictionary::new(scratch, share_bytes / 8),
            image_numbers: Table::new(scratch, share_bytes / 8),
            is_by_image: false,
            used: Materials::new(scratch, share_bytes / 2),
            recent: [None; RECENT],
        }
    }

    /// Takes in a comment of the header, if it declares the next material or image.
    pub(crate) fn declare(&mut self, comment: &str) -> Result<(), IoError> {
        let comment = comment.trim();
        if let Some(path) = comment.strip_prefix("TextureFile ") {
            let number = self.images.number(path.trim().as_bytes())?;
            return Ok(self.image_numbers.push(number)?);
        }
        let mut words = comment.splitn(3, ' ');
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

    /// Whether any image was declared.
    pub(crate) fn has_images(&self) -> bool {
        !self.image_numbers.is_empty()
    }

    /// From now on each image is a material.
    pub(crate) fn go_by_image(&mut self) {
        self.is_by_image = true;
    }

    /// The path of the image that a face shows.
    fn image(&mut self, face: &FaceSurface) -> Result<Option<String>, IoError> {
        let number = u64::try_from(face.image.unwrap_or(0)).ok();
        let Some(number) = number.filter(|&number| number < self.image_numbers.len()) else {
            return Ok(None);
        };
        let name = self.images.name(self.image_numbers.get(number)?)?;
        Ok(Some(String::from_utf8_lossy(&name).into_owned()))
    }

    /// The number of the material that a face uses.
    pub(crate) fn number(&mut self, path: &Path, face: FaceSurface) -> Result<u32, IoError> {
        let FaceSurface { index, is_patch, colour, .. } = face;
        let image = if self.is_by_image { face.image.unwrap_or(0) } else { 0 };
        let key = Key { index, is_patch, image };
        let slot = 2_u64.wrapping_mul(u64::from(index).wrapping_add(image as u64));
        let slot = ((slot + u64::from(is_patch)) % RECENT as u64) as usize;
        if let Some((_, number)) = self.recent[slot].filter(|(known, _)| *known == key) {
            return Ok(number);
        }
        let texture = self.image(&face)?;
        let mut name = if self.is_by_image {
            texture.clone().unwrap_or_default()
        } else if u64::from(index) < self.declared.len() {
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
            // Colours of faces that go by images are no one's.
            let colour = colour.filter(|_| !self.is_by_image);
            let opacity = colour.map(|[.., alpha]| share(alpha)).filter(|alpha| *alpha < 1.0);
            let material = Material {
                name,
                transparent: opacity.is_some(),
                diffuse: colour.map(|[r, g, b, _]| [r, g, b].map(share)),
                opacity,
                texture: texture.map(Texture::Beside),
                ..Material::default()
            };
            self.used.set(number, &material)?;
        }
        self.recent[slot] = Some((key, number));
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
