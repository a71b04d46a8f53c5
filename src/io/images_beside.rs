//! Images that lie beside an output, since it does not hold them and the input has them inside, or
//! since copies are wanted.
//!
//! In:         a palette. Out: each of them with its path; its bytes, to be compared or written.
//! Memory:     a block of an image.

use std::path::{Path, PathBuf};

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::output::Output;
use crate::io::textures::{Shown, Textures, name_beside, refers};
use crate::io::{Format, WriteOptions};
use crate::mesh::Texture;
use crate::store::Scratch;

/// An image that an output names and does not hold.
pub struct ImageBeside<'t> {
    textures: &'t Textures,
    image: Shown,
    /// Its file, beside the output.
    pub path: PathBuf,
}

impl ImageBeside<'_> {
    /// Whether the file at its path, if there is one, has the very bytes of it.
    ///
    /// # Errors
    /// The scratch folder fails.
    pub fn is_there(&self) -> Result<bool, IoError> {
        let Ok(mut input) = Input::open(&self.path, 0) else { return Ok(false) };
        let mut is_same = input.size_bytes() == self.image.bytes;
        self.textures.copy(&self.image, |block| {
            let mut rest = block;
            while is_same && !rest.is_empty() {
                if input.available().is_empty() && !input.fill().unwrap_or(false) {
                    is_same = false;
                    break;
                }
                let count = rest.len().min(input.available().len());
                is_same = input.take(count) == &rest[..count];
                rest = &rest[count..];
            }
            Ok(())
        })?;
        Ok(is_same)
    }

    /// Writes it to `path`, and hands it to the disk.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path, scratch: &Scratch) -> Result<(), IoError> {
        let mut output = Output::create(path, scratch)?;
        self.textures.copy(&self.image, |block| output.write(block))?;
        output.finish().map(drop)
    }
}

/// Shows every image that has to lie beside an output of this format, since it does not hold them
/// and the input has them inside, or copies are wanted.
///
/// # Errors
/// The palette cannot be read, as `of_io` says it, or what `visit` says.
pub fn images_beside<E>(
    format: Format,
    options: &WriteOptions,
    scratch: &Scratch,
    of_io: impl Fn(IoError) -> E,
    mut visit: impl FnMut(&ImageBeside) -> Result<(), E>,
) -> Result<(), E> {
    let (true, Some(palette)) = (refers(format, options.attributes), &options.palette) else {
        return Ok(());
    };
    let found = Textures::find(palette, format, scratch, |_| Ok(true));
    let mut textures = found.map_err(&of_io)?;
    for number in 0..textures.count() as u32 {
        let image = textures.image(number).map_err(&of_io)?;
        if options.copies_images || matches!(image.texture, Texture::Inside(_)) {
            let name = name_beside(&options.output, number, image.kind);
            let path = options.output.with_file_name(name.trim_start_matches("./"));
            visit(&ImageBeside { textures: &textures, image, path })?;
        }
    }
    Ok(())
}
