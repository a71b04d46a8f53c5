//! The MTL file beside an OBJ output.
//!
//! In:         the palette of the output. Out: one `newmtl` for every material, and one more where
//!             patches are told apart; the ways to images, where texture coordinates are written.
//! Memory:     one material, the names, and the numbers of images.

use std::fmt::Write;
use std::path::Path;

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::io::output_names::OutputNames;
use crate::io::textures::{Textures, as_held};
use crate::io::{Format, Palette, WriteOptions};
use crate::mesh::{Material, Surface};
use crate::store::Scratch;

/// First line of every library of ours.
pub const LIBRARY_MARK: &str = "# brickmend\n";

/// The file name of the library that belongs to an OBJ file.
#[must_use]
pub fn library_name(output: &Path) -> String {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}.mtl")
}

/// Writes the library of `options` to `path`, and hands it to the disk.
///
/// # Errors
/// The file cannot be written, or the palette cannot be read.
pub fn write_library(
    path: &Path,
    palette: &Palette,
    options: &WriteOptions,
    scratch: &Scratch,
) -> Result<(), IoError> {
    let mut names = OutputNames::new(palette, scratch)?;
    let mut output = Output::create(path, scratch)?;
    output.write(LIBRARY_MARK.as_bytes())?;
    let mut textures = match options.attributes.uvs {
        true => Textures::find(palette, Format::Obj, scratch, |_| Ok(true))?,
        false => Textures::none(scratch),
    };
    let kinds = if options.tag_patches { &[false, true][..] } else { &[false] };
    palette.for_each(|number, material| {
        let material = as_held(material, Format::Obj);
        let image = textures.of_material(number)?;
        let image = image.map(|image| textures.reference(image, options)).transpose()?.flatten();
        for &is_patch in kinds {
            let name = names.name(Surface::new(number, is_patch))?;
            output.write(statements(&name, &material, image.as_deref()).as_bytes())?;
        }
        Ok(())
    })?;
    output.finish()?;
    Ok(())
}

/// A material as statements. What the input does not state is left out.
fn statements(name: &str, material: &Material, image: Option<&str>) -> String {
    let mut text = format!("\nnewmtl {name}\n");
    let mut line = |word: &str, numbers: &[f32]| {
        text.push_str(word);
        numbers.iter().for_each(|number| write!(text, " {number}").expect("text grows"));
        text.push('\n');
    };
    if let Some(colour) = &material.diffuse {
        line("Kd", colour);
    }
    if let Some(colour) = &material.emissive {
        line("Ke", colour);
    }
    match material.opacity {
        Some(opacity) => line("d", &[opacity]),
        None if material.transparent => line("d", &[0.5]),
        None => {}
    }
    if let Some(metallic) = material.metallic {
        line("Pm", &[metallic]);
    }
    if let Some(roughness) = material.roughness {
        line("Pr", &[roughness]);
    }
    if let Some(image) = image {
        // Where no colour is stated, some readers take black for the factor.
        if material.diffuse.is_none() {
            line("Kd", &[1.0; 3]);
        }
        writeln!(text, "map_Kd {image}").expect("text grows");
    }
    text
}
