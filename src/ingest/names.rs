//! Names of parts and materials, kept for what is told and written of them in the end.
//!
//! In:         a source that was read to its end.
//! Out:        of every part its name, of every material what the file says of it, and the images
//!             inside of the file.
//! Memory:     one of them, a block of an image.

use std::collections::{BTreeMap, BTreeSet};

use crate::ingest::error::IngestError;
use crate::io::PaletteWriter;
use crate::mesh::{MeshSource, Texture};
use crate::store::{FileState, Resources, Spool, StoreError, Texts, TextsWriter};

/// Spool of the names of parts.
pub const PART_NAMES: &str = "parts.spool";

/// Writes the names of all parts of a source.
pub(super) fn write_names<S: MeshSource + ?Sized>(
    source: &mut S,
    resources: &Resources,
) -> Result<FileState, IngestError<S::Error>> {
    let mut texts = TextsWriter::create(resources.scratch, PART_NAMES)?;
    for number in 0..source.part_count() as u32 {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        texts.push(&source.part(number).map_err(IngestError::Source)?.name)?;
    }
    Ok(texts.finish()?.state().clone())
}

/// Writes all materials of a source, and the images that are inside of it.
pub(super) fn write_materials<S: MeshSource + ?Sized>(
    source: &mut S,
    resources: &Resources,
) -> Result<[FileState; 2], IngestError<S::Error>> {
    let mut palette = PaletteWriter::create(resources.scratch)?;
    for number in 0..source.material_count() as u32 {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        let mut material = source.material(number).map_err(IngestError::Source)?;
        for texture in material.texture.iter_mut().chain(material.maps.images_mut()) {
            if let Texture::Inside(image) = texture
                && !palette.place(image)?
            {
                keep_image(source, image.number, &mut palette, resources)?;
                palette.place(image)?;
            }
        }
        palette.push(&material)?;
    }
    Ok(palette.finish()?)
}

/// Appends an image of a source, block by block.
fn keep_image<S: MeshSource + ?Sized>(
    source: &mut S,
    number: u32,
    palette: &mut PaletteWriter,
    resources: &Resources,
) -> Result<(), IngestError<S::Error>> {
    let (mut offset, mut block) = (0, Vec::new());
    loop {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        source.image_block(number, offset, &mut block).map_err(IngestError::Source)?;
        palette.push_image(number, &block)?;
        if block.is_empty() {
            return Ok(());
        }
        offset += block.len() as u64;
    }
}

/// The names of the parts with these numbers, as an earlier step wrote them.
///
/// # Errors
/// The spool is missing or damaged.
pub fn names_of_parts(
    numbers: &BTreeSet<u32>,
    files: &[FileState],
    resources: &Resources,
) -> Result<BTreeMap<u32, String>, StoreError> {
    let spool = Spool::<u8>::open(resources.scratch, FileState::find(files, PART_NAMES)?)?;
    let mut texts = Texts::new(&spool);
    let mut names = BTreeMap::new();
    let Some(&last) = numbers.last() else { return Ok(names) };
    for number in 0..=last {
        let Some(name) = texts.next()? else { break };
        if numbers.contains(&number) {
            names.insert(number, name);
        }
    }
    Ok(names)
}
