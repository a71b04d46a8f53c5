//! What surfaces of a package are made of: groups of properties, and the materials in use.
//!
//! A base material keeps its name and colour; a colour is a material that is named by itself; a
//! composite is its largest part; a multiproperty is the first of its layers that has a material,
//! with the first that has an image; a texture coordinate is a material of its image. Materials are
//! numbered in the order of their first use, equal ones once. Memory: the share, spilled beyond.

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::mesh::{Image, Material, Texture};
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// The number of the definition that says nothing.
pub(super) const NOTHING: u32 = 0;

/// Consecutive properties of one resource.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Group {
    first: u64,
    pub(super) count: u64,
    /// 1 if all are colours.
    is_colours: u64,
}

impl Group {
    pub(super) fn is_colours(&self) -> bool {
        self.is_colours != 0
    }
}

/// What is known of a property.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Entry {
    definition: u32,
    uv: [f32; 2],
}

/// Definitions, groups of them, and numbers for those that are used.
pub(super) struct Properties {
    /// Flag, red, green, blue, alpha, image (one more than its number; 4 bytes) and name of every
    /// definition.
    definitions: Dictionary,
    groups: Table<Group>,
    entries: Table<Entry>,
    /// Whether any has a texture coordinate.
    pub(super) has_uvs: bool,
    /// By definition: one more than the number of its material, or 0.
    numbers: Table<u32>,
    /// By material: its definition.
    used: Table<u32>,
}

const HAS_COLOUR: u8 = 1;
const COLOUR_BYTES: usize = 5;
const KEY_BYTES: usize = 9;

impl Properties {
    pub(super) fn new(scratch: &Scratch, share_bytes: u64) -> Result<Self, StoreError> {
        let mut properties = Self {
            definitions: Dictionary::new(scratch, share_bytes / 2),
            groups: Table::new(scratch, share_bytes / 8),
            entries: Table::new(scratch, share_bytes / 8),
            has_uvs: false,
            numbers: Table::new(scratch, share_bytes / 8),
            used: Table::new(scratch, share_bytes / 8),
        };
        let nothing = properties.define("", None, None)?;
        debug_assert_eq!(nothing, NOTHING);
        Ok(properties)
    }

    /// The number of a definition.
    pub(super) fn define(
        &mut self,
        name: &str,
        colour: Option<[u8; 4]>,
        image: Option<u32>,
    ) -> Result<u32, StoreError> {
        let mut key = vec![if colour.is_some() { HAS_COLOUR } else { 0 }];
        key.extend(colour.unwrap_or_default());
        key.extend(image.map_or(0, |image| image + 1).to_le_bytes());
        key.extend_from_slice(name.as_bytes());
        self.define_key(&key)
    }

    /// A definition with the image of another one, if that has any.
    pub(super) fn with_image(&mut self, definition: u32, other: u32) -> Result<u32, StoreError> {
        let image = self.definitions.name(other)?;
        let mut key = self.definitions.name(definition)?;
        let range = COLOUR_BYTES..KEY_BYTES;
        if image[range.clone()] != [0; 4] {
            key[range.clone()].copy_from_slice(&image[range]);
        }
        self.define_key(&key)
    }

    fn define_key(&mut self, key: &[u8]) -> Result<u32, StoreError> {
        let number = self.definitions.number(key)?;
        while self.numbers.len() < self.definitions.len() {
            self.numbers.push(0)?;
        }
        Ok(number)
    }

    /// Starts a group; its number.
    pub(super) fn start_group(&mut self, is_colours: bool) -> Result<u32, StoreError> {
        let first = self.entries.len();
        self.groups.push(Group { first, count: 0, is_colours: is_colours.into() })?;
        Ok((self.groups.len() - 1) as u32)
    }

    /// Adds a property to the group that was started last, with its texture coordinate.
    pub(super) fn push(&mut self, definition: u32, uv: Option<[f32; 2]>) -> Result<(), StoreError> {
        self.has_uvs |= uv.is_some();
        self.entries.push(Entry { definition, uv: uv.unwrap_or_default() })?;
        let last = self.groups.len() - 1;
        let group = self.groups.get(last)?;
        self.groups.set(last, Group { count: group.count + 1, ..group })
    }

    /// The texture coordinate of a property; 0 where there is none.
    pub(super) fn uv(&mut self, group: Group, index: u64) -> Result<[f32; 2], StoreError> {
        if index < group.count {
            return Ok(self.entries.get(group.first + index)?.uv);
        }
        Ok([0.0; 2])
    }

    /// The colour of a property, if it has one.
    pub(super) fn colour(
        &mut self,
        group: Group,
        index: u64,
    ) -> Result<Option<[u8; 4]>, StoreError> {
        let Some(definition) = self.definition(group, index)? else { return Ok(None) };
        let key = self.definitions.name(definition)?;
        Ok(match key[..COLOUR_BYTES] {
            [HAS_COLOUR, r, g, b, alpha] => Some([r, g, b, alpha]),
            _ => None,
        })
    }

    pub(super) fn group(&mut self, number: u32) -> Result<Group, StoreError> {
        self.groups.get(number.into())
    }

    /// The definition of a property, if the group has so many.
    pub(super) fn definition(
        &mut self,
        group: Group,
        index: u64,
    ) -> Result<Option<u32>, StoreError> {
        if index >= group.count {
            return Ok(None);
        }
        Ok(Some(self.entries.get(group.first + index)?.definition))
    }

    /// The number of the material that a triangle uses.
    pub(super) fn material(&mut self, definition: u32) -> Result<u32, StoreError> {
        if let Some(number) = self.numbers.get(definition.into())?.checked_sub(1) {
            return Ok(number);
        }
        self.used.push(definition)?;
        let count = self.used.len() as u32;
        self.numbers.set(definition.into(), count)?;
        Ok(count - 1)
    }

    pub(super) fn material_count(&self) -> u64 {
        self.used.len()
    }

    /// The material of a number below the count.
    pub(super) fn describe(&mut self, number: u32) -> Result<Material, IoError> {
        let definition = self.used.get(number.into())?;
        let key = self.definitions.name(definition)?;
        let (head, name) = key.split_at(KEY_BYTES);
        let (colour, image) = head.split_at(COLOUR_BYTES);
        let name = String::from_utf8_lossy(name).into_owned();
        let image = u32::from_le_bytes(image.try_into().expect("four bytes of nine"));
        let texture = image
            .checked_sub(1)
            .map(|number| Texture::Inside(Image { number, ..Image::default() }));
        let &[HAS_COLOUR, r, g, b, alpha] = colour else {
            return Ok(Material { name, texture, ..Material::default() });
        };
        // What cannot be seen at all would be no surface: programs that write so mean no alpha.
        let is_transparent = (1..255).contains(&alpha);
        Ok(Material {
            name,
            transparent: is_transparent,
            diffuse: Some([r, g, b].map(|channel| f32::from(channel) / 255.0)),
            opacity: is_transparent.then(|| f32::from(alpha) / 255.0),
            texture,
            ..Material::default()
        })
    }
}

/// A colour as 3MF writes it: `#RRGGBB` or `#RRGGBBAA`.
pub(super) fn parse_colour(text: &str) -> Option<[u8; 4]> {
    let digits = text.trim().strip_prefix('#')?;
    if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let number = u32::from_str_radix(digits, 16).ok()?;
    match digits.len() {
        6 => Some((number << 8 | 0xff).to_be_bytes()),
        8 => Some(number.to_be_bytes()),
        _ => None,
    }
}

/// The name of a colour that has none.
pub(super) fn colour_name([r, g, b, alpha]: [u8; 4]) -> String {
    match alpha {
        255 => format!("#{r:02X}{g:02X}{b:02X}"),
        _ => format!("#{r:02X}{g:02X}{b:02X}{alpha:02X}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read_in_both_lengths() {
        assert_eq!(parse_colour("#0a0B0c"), Some([10, 11, 12, 255]));
        assert_eq!(parse_colour(" #0A0B0C80 "), Some([10, 11, 12, 128]));
        for text in ["", "#", "0A0B0C", "#0A0B0", "#+A0B0C", "#0A0B0C8", "#0A0B0C800", "#\u{e4}"] {
            assert_eq!(parse_colour(text), None, "{text}");
        }
        assert_eq!(colour_name([10, 11, 12, 255]), "#0A0B0C");
        assert_eq!(colour_name([10, 11, 12, 1]), "#0A0B0C01");
    }

    #[test]
    fn materials_are_numbered_by_use_and_equal_ones_once() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut properties =
            Properties::new(&Scratch::new(folder.path()), 0).expect("a properties store");
        let red = properties.define("red", Some([255, 0, 0, 51]), None).expect("defined");
        let bare = properties.define("bare", None, None).expect("defined");
        assert_eq!(properties.define("red", Some([255, 0, 0, 51]), None).expect("defined"), red);
        for (definition, number) in [(bare, 0), (red, 1), (bare, 0), (NOTHING, 2)] {
            assert_eq!(properties.material(definition).expect("numbered"), number);
        }
        let material = properties.describe(1).expect("described");
        assert_eq!((material.opacity, material.transparent), (Some(0.2), true));
        assert_eq!(material.diffuse, Some([1.0, 0.0, 0.0]));
        assert_eq!(properties.describe(2).expect("described"), Material::default());
    }
}
