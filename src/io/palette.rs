//! The materials of a model, from its reader to the writer of its output.
//!
//! In:         the materials in the order of their numbers, and the images inside of the model.
//! Out:        the same, one after another; the material of any look.
//! Memory:     one material; the looks, spilled beyond a share.

use std::path::{Path, PathBuf};

use crate::io::error::IoError;
use crate::mesh::{Image, Material, Surface};
use crate::store::{FileState, Scratch, Spool, SpoolWriter, StoreError, Table, Texts, TextsWriter};

/// Spool of the materials, each as a JSON text.
pub const MATERIALS: &str = "materials.spool";
/// Spool of the bytes of all images inside of the model.
pub const IMAGES: &str = "images.spool";

/// Memory for the places of images, and for the materials of looks.
const SHARE_BYTES: u64 = 64 << 10;

/// Appends materials to their spool, and images to theirs.
pub struct PaletteWriter {
    texts: TextsWriter,
    images: SpoolWriter<u8>,
    /// By number of the image: where it begins and ends, once it is there.
    places: Table<[u64; 2]>,
}

/// No image is there.
const NOWHERE: [u64; 2] = [u64::MAX; 2];

impl PaletteWriter {
    /// Starts the spools.
    ///
    /// # Errors
    /// A file cannot be created.
    pub fn create(scratch: &Scratch) -> Result<Self, StoreError> {
        Ok(Self {
            texts: TextsWriter::create(scratch, MATERIALS)?,
            images: SpoolWriter::create(scratch, IMAGES)?,
            places: Table::new(scratch, SHARE_BYTES),
        })
    }

    /// Appends the next material.
    ///
    /// # Errors
    /// The disk is full.
    pub fn push(&mut self, material: &Material) -> Result<(), StoreError> {
        self.texts.push(&serde_json::to_string(material).expect("plain records serialise"))
    }

    /// Says where the bytes of an image are; `false` if they have to be appended first.
    ///
    /// # Errors
    /// The disk fails.
    pub fn place(&mut self, image: &mut Image) -> Result<bool, StoreError> {
        let number = u64::from(image.number);
        if number >= self.places.len() || self.places.get(number)? == NOWHERE {
            return Ok(false);
        }
        let [first, end] = self.places.get(number)?;
        (image.first_byte, image.bytes) = (first, end - first);
        Ok(true)
    }

    /// Appends bytes of an image, which come one after another.
    ///
    /// # Errors
    /// The disk is full.
    pub fn push_image(&mut self, number: u32, bytes: &[u8]) -> Result<(), StoreError> {
        while self.places.len() <= number.into() {
            self.places.push(NOWHERE)?;
        }
        let [mut first, _] = self.places.get(number.into())?;
        first = first.min(self.images.len());
        bytes.iter().try_for_each(|&byte| self.images.push(byte))?;
        self.places.set(number.into(), [first, self.images.len()])
    }

    /// Completes the spools: that of the materials, that of the images.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<[FileState; 2], StoreError> {
        Ok([self.texts.finish()?.state().clone(), self.images.finish()?.state().clone()])
    }
}

/// The materials that triangles of an output name by number.
#[derive(Clone, Debug)]
pub struct Palette {
    scratch: Scratch,
    state: FileState,
    images: Option<FileState>,
    looks: Option<FileState>,
    input: PathBuf,
}

impl Palette {
    /// The palette in the spool that `state` tells of.
    #[must_use]
    pub fn new(scratch: &Scratch, state: &FileState) -> Self {
        let (scratch, state) = (scratch.clone(), state.clone());
        Self { scratch, state, images: None, looks: None, input: PathBuf::new() }
    }

    /// With images: those of the spool [`IMAGES`], and those in the folder of the file at `input`.
    #[must_use]
    pub fn with_images(self, images: &FileState, input: &Path) -> Self {
        Self { images: Some(images.clone()), input: input.to_path_buf(), ..self }
    }

    /// Of triangles whose surfaces name looks: `looks` is a spool of `u32`, by look the number of
    /// its material.
    #[must_use]
    pub fn with_looks(self, looks: &FileState) -> Self {
        Self { looks: Some(looks.clone()), ..self }
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

    /// The way from looks to materials.
    ///
    /// # Errors
    /// The spool is missing or damaged.
    pub fn looks(&self) -> Result<LookMap, StoreError> {
        let Some(state) = &self.looks else { return Ok(LookMap::default()) };
        let spool = Spool::<u32>::open(&self.scratch, state)?;
        let mut materials = Table::new(&self.scratch, SHARE_BYTES);
        let mut reader = spool.reader(0, spool.len());
        while let Some(block) = reader.next_block()? {
            block.iter().try_for_each(|&material| materials.push(material))?;
        }
        Ok(LookMap { materials: Some(materials), mapped: Vec::new() })
    }

    /// The bytes of all images inside of the model, if they were kept.
    pub(crate) fn open_images(&self) -> Result<Option<Spool<u8>>, StoreError> {
        self.images.as_ref().map(|state| Spool::open(&self.scratch, state)).transpose()
    }

    /// The model that the materials are of.
    pub(crate) fn input(&self) -> &Path {
        &self.input
    }
}

/// The materials of looks; each is its own look where there are none.
#[derive(Default)]
pub struct LookMap {
    materials: Option<Table<u32>>,
    mapped: Vec<Surface>,
}

impl LookMap {
    /// The same surfaces by material.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn materials_of<'s>(
        &'s mut self,
        surfaces: &'s [Surface],
    ) -> Result<&'s [Surface], StoreError> {
        let Some(materials) = &mut self.materials else { return Ok(surfaces) };
        self.mapped.clear();
        for surface in surfaces {
            let material = materials.get(surface.material().into())?;
            self.mapped.push(Surface::new(material, surface.is_patch()));
        }
        Ok(&self.mapped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_lead_to_materials_and_stay_patches() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let state = PaletteWriter::create(&scratch).expect("spools").finish().expect("finished");
        let palette = Palette::new(&scratch, &state[0]);
        let surfaces = [Surface::new(2, true), Surface::new(0, false), Surface::new(1, false)];
        let own = palette.looks().expect("none").materials_of(&surfaces).expect("found").to_vec();
        assert_eq!(own, surfaces);
        let mut looks = SpoolWriter::create(&scratch, "looks").expect("a spool");
        [7_u32, 7, 3].iter().try_for_each(|&material| looks.push(material)).expect("pushed");
        let looks = looks.finish().expect("finished");
        let palette = palette.with_looks(looks.state());
        let mut looks = palette.looks().expect("a table");
        let expected = [Surface::new(3, true), Surface::new(7, false), Surface::new(7, false)];
        assert_eq!(looks.materials_of(&surfaces).expect("found"), expected);
    }

    #[test]
    fn images_are_kept_once_and_found_again() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut writer = PaletteWriter::create(&Scratch::new(folder.path())).expect("spools");
        let mut image = Image { number: 5, ..Image::default() };
        assert!(!writer.place(&mut image).expect("asked"));
        writer.push_image(3, b"abc").expect("pushed");
        writer.push_image(5, b"de").expect("pushed");
        writer.push_image(5, b"f").expect("pushed");
        writer.push_image(4, b"").expect("pushed");
        assert!(writer.place(&mut image).expect("asked"));
        assert_eq!((image.first_byte, image.bytes), (3, 3));
        image.number = 4;
        assert!(writer.place(&mut image).expect("asked"), "an image without bytes is known too");
        assert_eq!(image.bytes, 0);
    }
}
