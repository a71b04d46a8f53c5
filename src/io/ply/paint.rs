//! What a face says of its material in PLY: a colour, and the number of an image.
//!
//! Memory: a share each for colours, names and images, spilled beyond.

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::io::output_names::OutputNames;
use crate::io::textures::Textures;
use crate::io::{Format, Palette, WriteOptions};
use crate::mesh::Surface;
use crate::store::{Scratch, Table};

/// Memory for paints.
const SHARE_BYTES: u64 = 64 << 10;

/// What faces of a material are painted with.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Paint {
    pub(crate) colour: [u8; 4],
    /// The number of the comment that names its image, or -1.
    pub(crate) texture: i32,
}

/// Paints by material.
pub(crate) struct Paints {
    paints: Table<Paint>,
    /// Whether any has an image.
    pub(crate) has_textures: bool,
}

impl Paints {
    /// Those of a palette.
    pub(crate) fn of(
        palette: &Palette,
        options: &WriteOptions,
        scratch: &Scratch,
    ) -> Result<Self, IoError> {
        let mut textures = find(palette, options, scratch)?;
        let numbers = name_all(&mut textures, options, scratch, |_, _| Ok(()))?;
        let Numbers { mut by_image, count } = numbers;
        let mut paints = Table::new(scratch, SHARE_BYTES);
        palette.for_each(|number, material| {
            let texture = match textures.of_material(number)? {
                Some(image) => by_image.get(image.into())?,
                None => -1,
            };
            Ok(paints.push(Paint { colour: material.rgba(), texture })?)
        })?;
        Ok(Self { paints, has_textures: count > 0 })
    }

    pub(crate) fn get(&mut self, material: u32) -> Result<Paint, IoError> {
        Ok(self.paints.get(material.into())?)
    }

    /// Writes the comments that say what numbers of materials and images stand for.
    pub(crate) fn declare(
        palette: &Palette,
        options: &WriteOptions,
        scratch: &Scratch,
        output: &mut Output,
    ) -> Result<(), IoError> {
        let mut names = OutputNames::new(palette, scratch)?;
        palette.for_each(|number, _| {
            let name = names.name(Surface::new(number, false))?;
            output.write(format!("comment material {number} {name}\n").as_bytes())
        })?;
        let mut textures = find(palette, options, scratch)?;
        name_all(&mut textures, options, scratch, |_, way| {
            output.write(format!("comment TextureFile {way}\n").as_bytes())
        })?;
        Ok(())
    }
}

fn find(palette: &Palette, options: &WriteOptions, scratch: &Scratch) -> Result<Textures, IoError> {
    match options.attributes.uvs {
        true => Textures::find(palette, Format::Ply, scratch, |_| Ok(true)),
        false => Ok(Textures::none(scratch)),
    }
}

/// The numbers of images among the comments.
struct Numbers {
    by_image: Table<i32>,
    count: i32,
}

/// Numbers the images that can be named, and shows each with its name.
fn name_all(
    textures: &mut Textures,
    options: &WriteOptions,
    scratch: &Scratch,
    mut visit: impl FnMut(i32, &str) -> Result<(), IoError>,
) -> Result<Numbers, IoError> {
    let mut numbers = Numbers { by_image: Table::new(scratch, SHARE_BYTES), count: 0 };
    for image in 0..textures.count() as u32 {
        let number = match textures.reference(image, options)? {
            Some(way) => {
                visit(numbers.count, &way)?;
                numbers.count += 1;
                numbers.count - 1
            }
            None => -1,
        };
        numbers.by_image.push(number)?;
    }
    Ok(numbers)
}
