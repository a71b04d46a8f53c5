//! What triangles of a written model are painted with: one group of properties each.
//!
//! A triangle whose material shows an image, and that has texture coordinates, is painted with
//! these (`texture2dgroup`); of others, one with a corner that is not opaque white with the
//! colours of its vertices (`colorgroup`); all others with a base material. So names of materials
//! that show images are not held. Ids: 1 are the base materials, 2 is the object where there
//! is one only, 3 the colours, and from 4 on two for each image. Memory: [`SORT_BYTES`] twice, and shares for tables.

use bytemuck::{Pod, Zeroable};

use crate::io::Format;
use crate::io::error::IoError;
use crate::io::image_kind::ImageKind;
use crate::io::numbers::push_single;
use crate::io::output::Aside;
use crate::io::palette::Palette;
use crate::io::polygon::WHITE;
use crate::io::textures::Textures;
use crate::io::threemf::bases::Bases;
use crate::io::threemf::package::relationships;
use crate::io::threemf::properties::colour_name;
use crate::io::threemf::records::{Record, for_each_record};
use crate::io::threemf::vocabulary::TEXTURE_RELATIONSHIP;
use crate::io::threemf::zip_file::ZipFile;
use crate::mesh::{Attributes, Surface};
use crate::store::{Record as SortRecord, Scratch, Sorted, Sorter, Table};

/// The largest number of a property that 3MF allows, and one.
pub(super) const MOST_INDICES: u64 = 1 << 31;
/// The most images: what archives of ours may hold besides the model.
const MOST_IMAGES: u64 = 4096;
/// For the order of corners.
const SORT_BYTES: u64 = 2 << 20;
/// For colours and texture coordinates by number.
const SHARE_BYTES: u64 = 1 << 20;
const COLOURS_ID: u32 = 3;
/// No line of a colour takes more bytes, nor of a texture coordinate.
const COLOUR_BYTES: u64 = 40;
const COORDINATE_BYTES: u64 = 64;

/// A corner that names a texture coordinate of an image.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Named {
    image: u32,
    uv: u32,
    /// Textured corners are numbered in the order of the file.
    corner: u64,
}

impl SortRecord for Named {
    type Key = (u32, u32, u64);

    fn key(&self) -> Self::Key {
        (self.image, self.uv, self.corner)
    }
}

/// The number of a corner's texture coordinate in the group of its image.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    corner: u64,
    index: u64,
}

impl SortRecord for Placed {
    type Key = u64;

    fn key(&self) -> u64 {
        self.corner
    }
}

/// All groups of properties.
pub(super) struct Paint {
    scratch: Scratch,
    palette: Option<Palette>,
    has_patches: bool,
    bases: Bases,
    textures: Textures,
    /// By vertex.
    colours: Option<Table<[u8; 4]>>,
    corners: Option<Sorted<Placed>>,
}

impl Paint {
    /// Looks at what is in use.
    pub(super) fn new(
        scratch: &Scratch,
        palette: Option<&Palette>,
        attributes: Attributes,
        records: &mut Aside,
    ) -> Result<Self, IoError> {
        let mut used = Table::<u8>::new(scratch, SHARE_BYTES);
        let mut has_patches = false;
        let mut note = |record| {
            let (Record::Triangle(_, Some(surface)) | Record::Textured(_, surface, _)) = record
            else {
                return Ok(());
            };
            has_patches |= surface.is_patch();
            while used.len() <= surface.material().into() {
                used.push(0)?;
            }
            Ok(used.set(surface.material().into(), 1)?)
        };
        // Without materials no record tells anything.
        if palette.is_some() {
            for_each_record(records, &mut note)?;
        }
        let textures = match palette.filter(|_| attributes.uvs) {
            Some(palette) => Textures::find(palette, Format::ThreeMf, scratch, |material| {
                let is_known = u64::from(material) < used.len();
                Ok(is_known && used.get(material.into())? > 0)
            })?,
            None => Textures::none(scratch),
        };
        Ok(Self {
            scratch: scratch.clone(),
            palette: palette.cloned(),
            has_patches,
            bases: Bases::default(),
            textures,
            colours: attributes.colours.then(|| Table::new(scratch, SHARE_BYTES)),
            corners: None,
        })
    }

    pub(super) fn has_textures(&self) -> bool {
        self.textures.count() > 0
    }

    /// The first id that no resource here has.
    pub(super) fn next_id(&self) -> u32 {
        image_id(self.textures.count() as u32)
    }

    pub(super) fn has_bases(&self) -> bool {
        self.bases.count > 0
    }

    /// What the groups take in the model, at most.
    pub(super) fn longest_bytes(&self, vertices: u64, triangles: u64) -> u64 {
        let colours = if self.colours.is_some() { COLOUR_BYTES * vertices } else { 0 };
        let uvs = if self.has_textures() { 3 * COORDINATE_BYTES * triangles } else { 0 };
        colours + uvs
    }

    /// Writes all groups.
    pub(super) fn write(&mut self, zip: &mut ZipFile, records: &mut Aside) -> Result<(), IoError> {
        if let Some(palette) = &self.palette {
            self.bases = Bases::write(zip, palette, self.has_patches)?;
        }
        let counts = [
            (self.bases.count, MOST_INDICES, "materials"),
            (self.textures.count(), MOST_IMAGES, "images"),
        ];
        for (count, limit, what) in counts {
            if count > limit {
                return Err(IoError::TooLarge { path: zip.path().to_path_buf(), what, limit });
            }
        }
        self.write_colours(zip, records)?;
        self.write_coordinates(zip, records)
    }

    /// Writes a colour for every vertex.
    fn write_colours(&mut self, zip: &mut ZipFile, records: &mut Aside) -> Result<(), IoError> {
        let Some(colours) = &mut self.colours else { return Ok(()) };
        let mut is_open = false;
        for_each_record(records, |record| {
            let Record::Colour(colour) = record else { return Ok(()) };
            if !is_open {
                zip.write(format!("<m:colorgroup id=\"{COLOURS_ID}\">\n").as_bytes())?;
                is_open = true;
            }
            colours.push(colour)?;
            let line = format!("<m:color color=\"{}\"/>\n", colour_name(colour));
            zip.write(line.as_bytes())
        })?;
        if is_open {
            zip.write(b"</m:colorgroup>\n")?;
        }
        Ok(())
    }

    /// Writes images, and of each the texture coordinates that triangles with it name.
    fn write_coordinates(&mut self, zip: &mut ZipFile, records: &mut Aside) -> Result<(), IoError> {
        if !self.has_textures() {
            return Ok(());
        }
        for number in 0..self.textures.count() as u32 {
            let kind = self.textures.image(number)?.kind;
            let (id, path, media) = (image_id(number), path_of(number, kind), kind.media_type());
            let image = format!("path=\"{path}\" contenttype=\"{media}\"");
            zip.write(format!("<m:texture2d id=\"{id}\" {image}/>\n").as_bytes())?;
        }
        let (mut named, mut uvs) = self.named_corners(records)?;
        let mut placed = Sorter::<Placed>::new(&self.scratch, SORT_BYTES);
        let (mut open, mut last, mut count) = (None, None, 0_u64);
        let mut text = Vec::new();
        while let Some(Named { image, uv, corner }) = named.next()? {
            if open != Some(image) {
                let end = if open.is_some() { "</m:texture2dgroup>\n" } else { "" };
                let (id, texture) = (image_id(image) + 1, image_id(image));
                let start = format!("<m:texture2dgroup id=\"{id}\" texid=\"{texture}\">\n");
                zip.write(format!("{end}{start}").as_bytes())?;
                (open, last, count) = (Some(image), None, 0);
            }
            if last != Some(uv) {
                (last, count) = (Some(uv), count + 1);
                text.clear();
                let [u, v] = if u64::from(uv) < uvs.len() { uvs.get(uv.into())? } else { [0.0; 2] };
                for (name, number) in [(&b"<m:tex2coord u=\""[..], u), (b"\" v=\"", v)] {
                    text.extend_from_slice(name);
                    push_single(&mut text, number);
                }
                text.extend_from_slice(b"\"/>\n");
                zip.write(&text)?;
            }
            placed.push(Placed { corner, index: count - 1 })?;
        }
        if open.is_some() {
            zip.write(b"</m:texture2dgroup>\n")?;
        }
        self.corners = Some(placed.finish()?);
        Ok(())
    }

    /// The corners of triangles with images in the order of these and of their coordinates; and
    /// all coordinates.
    fn named_corners(
        &mut self,
        records: &mut Aside,
    ) -> Result<(Sorted<Named>, Table<[f32; 2]>), IoError> {
        let mut named = Sorter::<Named>::new(&self.scratch, SORT_BYTES);
        let mut uvs = Table::new(&self.scratch, SHARE_BYTES);
        let mut corner = 0;
        for_each_record(records, |record| {
            match record {
                Record::Uv(uv) => uvs.push(uv)?,
                Record::Textured(_, surface, numbers) => {
                    let Some(image) = self.textures.of_material(surface.material())? else {
                        return Ok(());
                    };
                    for uv in numbers {
                        named.push(Named { image, uv, corner })?;
                        corner += 1;
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        Ok((named.finish()?, uvs))
    }

    /// The group and the properties of the next triangle's corners.
    pub(super) fn property(
        &mut self,
        (indices, surface, has_uvs): ([u32; 3], Option<Surface>, bool),
    ) -> Result<Option<(u32, [u32; 3])>, IoError> {
        let image = match surface.filter(|_| has_uvs) {
            Some(surface) => self.textures.of_material(surface.material())?,
            None => None,
        };
        if let (Some(image), Some(corners)) = (image, &mut self.corners) {
            let mut properties = [0; 3];
            for property in &mut properties {
                let placed = corners.next()?.expect("every textured corner was placed");
                *property = placed.index as u32;
            }
            return Ok(Some((image_id(image) + 1, properties)));
        }
        if let Some(colours) = &mut self.colours {
            for index in indices {
                let index = u64::from(index);
                if index < colours.len() && colours.get(index)? != WHITE {
                    return Ok(Some((COLOURS_ID, indices)));
                }
            }
        }
        let base = surface.and_then(|surface| self.bases.index(surface));
        Ok(base.map(|index| (1, [index as u32; 3])))
    }

    /// Adds the images to the archive, and the way to them.
    pub(super) fn write_images(&mut self, zip: &mut ZipFile) -> Result<(), IoError> {
        let mut targets = Vec::new();
        for number in 0..self.textures.count() as u32 {
            let image = self.textures.image(number)?;
            let path = path_of(number, image.kind);
            zip.store(&path[1..], |visit| self.textures.copy(&image, visit))?;
            targets.push(path);
        }
        if targets.is_empty() {
            return Ok(());
        }
        let text = relationships(TEXTURE_RELATIONSHIP, &targets);
        zip.store("3D/_rels/3dmodel.model.rels", |visit| visit(text.as_bytes()))
    }
}

fn image_id(number: u32) -> u32 {
    4 + 2 * number
}

fn path_of(number: u32, kind: ImageKind) -> String {
    format!("/3D/Textures/texture-{number}.{}", kind.ending())
}
