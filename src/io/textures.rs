//! The images of an output's materials: found, told apart by content, numbered, copied.
//!
//! In:         a palette. Out: of every material in use the number of its image; the bytes of each.
//! Invariant:  files are read in the input's folder only, also where links lead elsewhere; an
//!             image that is missing, or that the format cannot hold, is left out and told.
//! Memory:     a block of an image; the numbers, spilled beyond a share.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use bytemuck::{Pod, Zeroable};

use crate::io::beside::{file_inside, folder_of};
use crate::io::error::{IoError, Place};
use crate::io::image_kind::ImageKind;
use crate::io::input::Input;
use crate::io::palette::Palette;
use crate::io::{Format, WriteOptions};
use crate::mesh::{Attributes, Material, OtherMaps, Texture};
use crate::store::{Dictionary, Scratch, Spool, Table};

const SHARE_BYTES: u64 = 48 << 10;
/// As many bytes tell what kind an image is.
const HEAD_BYTES: usize = 12;
/// The number of what is not there.
const NONE: u32 = u32::MAX;
/// The most images that are named one by one where they are lost.
const MOST_NAMED: usize = 16;

/// An image that a material of the output shows.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    pub(crate) texture: Texture,
    pub(crate) kind: ImageKind,
    pub(crate) bytes: u64,
}

/// What is kept of an image.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Record {
    bytes: u64,
    /// Its number among all that materials name.
    name: u32,
    kind: u32,
}

/// The images of a palette.
pub(crate) struct Textures {
    /// Where the input's folder really is.
    folder: Option<PathBuf>,
    inside: Option<Spool<u8>>,
    /// Textures as texts, and by their numbers those among the images.
    names: Dictionary,
    numbers: Table<u32>,
    images: Table<Record>,
    /// Of the base colour, and of the further maps.
    of_material: Table<[u32; 5]>,
}

impl Textures {
    /// None at all.
    pub(crate) fn none(scratch: &Scratch) -> Self {
        Self {
            folder: None,
            inside: None,
            names: Dictionary::new(scratch, SHARE_BYTES),
            numbers: Table::new(scratch, SHARE_BYTES),
            images: Table::new(scratch, SHARE_BYTES),
            of_material: Table::new(scratch, SHARE_BYTES),
        }
    }

    /// Finds the images of all materials that are used, as far as the format can show them.
    pub(crate) fn find(
        palette: &Palette,
        format: Format,
        scratch: &Scratch,
        mut is_used: impl FnMut(u32) -> Result<bool, IoError>,
    ) -> Result<Self, IoError> {
        let mut textures = Self::none(scratch);
        textures.folder = folder_of(palette.input());
        textures.inside = palette.open_images()?;
        palette.for_each(|material, properties| {
            let mut numbers = [NONE; 5];
            if is_used(material)? {
                let properties = as_held(properties, format);
                let maps = properties.maps.images().map(|(_, image)| image);
                for (image, number) in
                    [properties.texture.as_ref()].into_iter().chain(maps).zip(&mut numbers)
                {
                    if let Some(image) = image {
                        *number = textures.number(image, format)?;
                    }
                }
            }
            Ok(textures.of_material.push(numbers)?)
        })?;
        Ok(textures)
    }

    fn number(&mut self, texture: &Texture, format: Format) -> Result<u32, IoError> {
        let text = serde_json::to_string(texture).expect("plain records serialise");
        let name = self.names.number(text.as_bytes())?;
        if u64::from(name) < self.numbers.len() {
            return Ok(self.numbers.get(name.into())?);
        }
        let number = match self.look_at(texture)? {
            Some((kind, bytes)) if kind.is_held_by(format) => {
                self.images.push(Record { bytes, name, kind: kind as u32 })?;
                self.images.len() as u32 - 1
            }
            _ => NONE,
        };
        self.numbers.push(number)?;
        Ok(number)
    }

    /// What an image is and how long, if it is there.
    fn look_at(&mut self, texture: &Texture) -> Result<Option<(ImageKind, u64)>, IoError> {
        let mut head = Vec::new();
        let bytes = match texture {
            Texture::Beside(_) => {
                let opened = self.path_of(texture).and_then(|path| Input::open(&path, 0).ok());
                let Some(mut input) = opened else { return Ok(None) };
                // A file that cannot be read is as good as none.
                let Ok(bytes) = input.look_ahead(HEAD_BYTES) else { return Ok(None) };
                head.extend_from_slice(&bytes[..bytes.len().min(HEAD_BYTES)]);
                input.size_bytes()
            }
            Texture::Inside(image) => {
                let Some(spool) = &self.inside else { return Ok(None) };
                spool.read(
                    image.first_byte,
                    image.bytes.min(HEAD_BYTES as u64) as usize,
                    &mut head,
                )?;
                image.bytes
            }
        };
        Ok((bytes > 0).then(|| (ImageKind::of(&head), bytes)))
    }

    /// The file of an image that lies beside the input.
    pub(crate) fn path_of(&self, texture: &Texture) -> Option<PathBuf> {
        let Texture::Beside(name) = texture else { return None };
        file_inside(self.folder.as_ref()?, name.as_bytes())
    }

    /// How many images there are.
    pub(crate) fn count(&self) -> u64 {
        self.images.len()
    }

    /// The image of a material's base colour, if it has one.
    pub(crate) fn of_material(&mut self, material: u32) -> Result<Option<u32>, IoError> {
        Ok(self.all_of_material(material)?[0])
    }

    /// The images of a material: of its base colour, and of its further maps in their order.
    pub(crate) fn all_of_material(&mut self, material: u32) -> Result<[Option<u32>; 5], IoError> {
        if u64::from(material) >= self.of_material.len() {
            return Ok([None; 5]);
        }
        let numbers = self.of_material.get(material.into())?;
        Ok(numbers.map(|number| (number != NONE).then_some(number)))
    }

    /// An image by its number, which is below the count.
    pub(crate) fn image(&mut self, number: u32) -> Result<Shown, IoError> {
        let Record { bytes, name, kind } = self.images.get(number.into())?;
        let text = self.names.name(name)?;
        let texture = serde_json::from_slice(&text).expect("numbered as we wrote them");
        Ok(Shown { texture, kind: ImageKind::ALL[kind as usize], bytes })
    }

    /// Shows the bytes of an image, block by block: as many as it said.
    pub(crate) fn copy(
        &self,
        image: &Shown,
        mut visit: impl FnMut(&[u8]) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        match &image.texture {
            Texture::Inside(place) => {
                let Some(spool) = &self.inside else { return Ok(()) };
                let mut reader = spool.reader(place.first_byte, place.bytes);
                while let Some(block) = reader.next_block()? {
                    visit(block)?;
                }
                Ok(())
            }
            texture @ Texture::Beside(name) => {
                let changed = |path: &Path, at: u64| {
                    let expected = format!("an image of {} bytes", image.bytes);
                    IoError::unreadable(path, Place::Byte(at), expected, "another size")
                };
                let Some(path) = self.path_of(texture) else {
                    return Err(changed(name.as_ref(), 0));
                };
                let mut input = Input::open(&path, 0)?;
                let mut left = image.bytes;
                while left > 0 {
                    if input.available().is_empty() && !input.fill()? {
                        return Err(changed(&path, image.bytes - left));
                    }
                    let count = left.min(input.available().len() as u64);
                    visit(input.take(count as usize))?;
                    left -= count;
                }
                Ok(())
            }
        }
    }

    /// How an output that holds no images names one: the way there from its folder, if that can
    /// be said in one line.
    pub(crate) fn reference(
        &mut self,
        number: u32,
        options: &WriteOptions,
    ) -> Result<Option<String>, IoError> {
        let image = self.image(number)?;
        let path = self.path_of(&image.texture).filter(|_| !options.copies_images);
        let Some(path) = path else {
            return Ok(Some(name_beside(&options.output, number, image.kind)));
        };
        let Some(folder) = folder_of(&options.output) else { return Ok(None) };
        Ok(way(&folder, &path).filter(|way| !way.contains(char::is_control)))
    }
}

/// A material, without those maps that a format cannot hold.
pub(crate) fn as_held(material: Material, format: Format) -> Material {
    if format == Format::Glb {
        return material;
    }
    let kinds = material.maps.kinds();
    material.losing(kinds)
}

/// The way from a folder to a file, both canonical; with slashes, and no option to any reader.
fn way(folder: &Path, file: &Path) -> Option<String> {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Some(".."));
    let down = file.components().skip(shared).map(|part| match part {
        Component::Normal(name) => OsStr::to_str(name),
        _ => None,
    });
    let parts = up.chain(down).collect::<Option<Vec<&str>>>()?;
    let way = parts.join("/");
    let is_plain = way.trim() == way && !way.starts_with(['-', '#']);
    Some(if is_plain { way } else { format!("./{way}") }).filter(|way| way.trim() == way)
}

/// The name of an image that is put beside an output.
pub(crate) fn name_beside(output: &Path, number: u32, kind: ImageKind) -> String {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let stem: String = stem.chars().map(|c| if c.is_control() { '_' } else { c }).collect();
    let dot = if stem.starts_with(['-', '#']) { "./" } else { "" };
    format!("{dot}{stem}.texture-{number}.{}", kind.ending())
}

/// Whether a file beside an output has the name of one of its images.
#[must_use]
pub fn is_image_of(output: &Path, file: &Path) -> bool {
    let name = name_beside(output, 0, ImageKind::ALL[0]);
    let front = name.trim_start_matches("./").rsplit_once('-').map_or("", |(front, _)| front);
    let number = file.file_name().and_then(|name| name.to_str()?.strip_prefix(front));
    output.parent() == file.parent() && number.is_some_and(|rest| rest.starts_with('-'))
}

/// Whether an output names images that lie elsewhere.
pub(crate) fn refers(format: Format, attributes: Attributes) -> bool {
    attributes.uvs && matches!(format, Format::Obj | Format::Ply)
}

/// What materials have and an output of this format does not show: images that are missing or of
/// a kind that it cannot hold, and further maps.
///
/// # Errors
/// The palette cannot be read.
pub fn lost_of_materials(
    palette: &Palette,
    format: Format,
    options: &WriteOptions,
    scratch: &Scratch,
) -> Result<Vec<String>, IoError> {
    let mut maps = OtherMaps::default();
    let (mut missing, mut more) = (BTreeSet::new(), 0_u64);
    let mut textures = Textures::find(palette, format, scratch, |_| Ok(true))?;
    let attributes = options.attributes.and(format.attributes());
    palette.for_each(|number, material| {
        let material = as_held(material, format);
        maps = maps.with(material.other_maps);
        let [_, of_maps @ ..] = textures.all_of_material(number)?;
        for ((kind, image), shown) in material.maps.images().into_iter().zip(of_maps) {
            if image.is_some() && (shown.is_none() || !attributes.uvs) {
                maps = maps.with(kind);
            }
        }
        let Some(texture) = &material.texture else { return Ok(()) };
        let is_held = match textures.of_material(number)?.filter(|_| attributes.uvs) {
            Some(image) if refers(format, attributes) => {
                textures.reference(image, options)?.is_some()
            }
            image => image.is_some(),
        };
        if !is_held {
            let name = texture.name().escape_debug().to_string();
            if missing.len() < MOST_NAMED {
                missing.insert(name);
            } else {
                more += u64::from(!missing.contains(&name));
            }
        }
        Ok(())
    })?;
    let named = missing.into_iter().map(|name| format!("the texture {name}"));
    let more = (more > 0).then(|| format!("textures of {more} more materials"));
    let maps = maps.names().map(str::to_owned);
    Ok(named.chain(more).chain(maps).collect())
}
