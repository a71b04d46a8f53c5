//! First pass: the file becomes a spool of finite triangles.

use serde::{Deserialize, Serialize};

use crate::ingest::error::IngestError;
use crate::ingest::looks::{LOOK_MATERIALS, LOOKS, Looks, find_looks, no_looks};
use crate::ingest::names::{PART_NAMES, write_materials, write_names};
use crate::io::{IMAGES, IoError, MATERIALS, Palette};
use crate::mesh::{Attributes, Discarded, LengthUnit, Material, MeshSource, TriangleBatch};
use crate::monitor::Counter;
use crate::octree::{AttributeRecord, SnapBox, SoupSpool, SoupTriangle, SoupWriter, TRANSPARENT};
use crate::store::{FileState, Resources, Spool, SpoolWriter, StoreError};

/// Spool of the triangles.
pub const SOUP: &str = "soup.spool";
/// Side file of the attributes, one record per delivered triangle; empty where none are wanted.
pub const ATTRIBUTES: &str = "attributes.spool";

/// What was found out about the input while it was read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoupFacts {
    /// Box of the finite triangles; empty when there is none.
    pub bounds: SnapBox,
    /// What a model unit is, where the file says so.
    pub unit: Option<LengthUnit>,
    /// Parts that have triangles.
    pub parts: u64,
    /// Materials that have triangles.
    pub materials: u64,
    /// Whether there are several, or the file says anything of the one.
    pub has_materials: bool,
    /// Whether the file has texture coordinates.
    pub has_uvs: bool,
    /// Whether the file has colours of vertices.
    pub has_colours: bool,
    /// Whether the file has normals.
    pub has_normals: bool,
    /// Looks that triangles have; 0 where they have materials in their place.
    pub looks: u64,
    /// Counts.
    pub stats: SoupStats,
}

/// Counts of the input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoupStats {
    /// Triangles that the reader delivered.
    pub triangles: u64,
    /// Of these, dropped because a corner is NaN or infinite.
    pub nonfinite_triangles: u64,
    /// Triangles that light passes.
    pub transparent_triangles: u64,
    /// Faces that the reader left out.
    pub discarded: Discarded,
    /// Bytes of the input file that were read.
    pub input_bytes: u64,
}

impl SoupStats {
    /// Refuses broken faces where `strict` input was asked for.
    pub(crate) fn refuse_broken<E: std::error::Error>(
        &self,
        strict: bool,
    ) -> Result<(), IngestError<E>> {
        let faces = self.discarded.wild_index_faces + self.discarded.short_faces;
        let found = self.nonfinite_triangles + faces;
        if strict && found > 0 { Err(IngestError::Broken { found }) } else { Ok(()) }
    }
}

/// The triangles of the input.
pub struct Soup {
    /// Finite triangles in file order.
    pub spool: SoupSpool,
    /// Texture coordinates and colours, as far as the file has any that are wanted.
    pub attributes: Spool<AttributeRecord>,
    /// What parts them, or nothing.
    pub looks: Looks,
    /// The spools of the names of parts, see [`crate::ingest::PART_NAMES`], of the materials, see
    /// [`crate::io::MATERIALS`], and of the images, see [`crate::io::IMAGES`].
    pub names: [FileState; 3],
    /// What was found out.
    pub facts: SoupFacts,
}

impl Soup {
    /// Opens the triangles that an earlier run read.
    ///
    /// # Errors
    /// They are missing or damaged.
    pub fn open(
        resources: &Resources,
        files: &[FileState],
        facts: SoupFacts,
    ) -> Result<Self, StoreError> {
        Ok(Self {
            spool: SoupSpool::open(resources.scratch, FileState::find(files, SOUP)?)?,
            attributes: Spool::open(resources.scratch, FileState::find(files, ATTRIBUTES)?)?,
            looks: Looks {
                of_triangles: Spool::open(resources.scratch, FileState::find(files, LOOKS)?)?,
                materials: Spool::open(resources.scratch, FileState::find(files, LOOK_MATERIALS)?)?,
            },
            names: [
                FileState::find(files, PART_NAMES)?.clone(),
                FileState::find(files, MATERIALS)?.clone(),
                FileState::find(files, IMAGES)?.clone(),
            ],
            facts,
        })
    }

    /// Finds the looks of a soup that was read, where it has texture coordinates or colours.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn part_looks(&mut self, resources: &Resources) -> Result<(), IoError> {
        if !self.attributes.is_empty() {
            let palette = Palette::new(resources.scratch, &self.names[1]);
            self.looks = find_looks(&palette, (&self.spool, &self.attributes), resources)?;
            self.facts.looks = self.looks.materials.len();
        }
        Ok(())
    }

    /// The files, as they have to be found again.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        let Looks { of_triangles, materials } = &self.looks;
        let spools =
            [self.spool.state(), self.attributes.state(), of_triangles.state(), materials.state()];
        spools.into_iter().chain(&self.names).cloned().collect()
    }
}

/// Reads `source` to its end, and keeps of its texture coordinates and colours what is `wanted`.
///
/// # Errors
/// [`IngestError`]: the source fails, the disk is full, or `strict` met a broken face.
pub fn read_soup<S: MeshSource + ?Sized>(
    source: &mut S,
    strict: bool,
    wanted: Attributes,
    resources: &Resources,
) -> Result<Soup, IngestError<S::Error>> {
    let mut writer = Writer::new(wanted, resources)?;
    let mut batch = TriangleBatch::default();
    let mut read_bytes = 0;
    while source.next_batch(&mut batch).map_err(IngestError::Source)? {
        let now = source.bytes_read();
        resources.monitor.count(Counter::InputBytesRead, now - read_bytes);
        resources.monitor.advance(now - read_bytes);
        read_bytes = now;
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        writer.take(&batch, source)?;
        if writer.delivered > u64::from(u32::MAX) {
            return Err(IngestError::TooManyTriangles { limit: u32::MAX.into() });
        }
    }
    resources.monitor.count(Counter::InputBytesRead, source.bytes_read() - read_bytes);
    let stats = SoupStats {
        triangles: writer.delivered,
        nonfinite_triangles: writer.delivered - writer.spool.len(),
        transparent_triangles: writer.transparent,
        discarded: source.discarded(),
        input_bytes: source.bytes_read(),
    };
    stats.refuse_broken(strict)?;
    let (parts, materials) = (source.part_count(), source.material_count());
    let has_materials = has_materials(source)?;
    let part_names = write_names(source, resources)?;
    let [materials_state, images] = write_materials(source, resources)?;
    let names = [part_names, materials_state, images];
    let (spool, attributes) = (writer.spool.finish()?, writer.attributes.finish()?);
    Ok(Soup {
        spool,
        names,
        attributes,
        facts: SoupFacts {
            bounds: writer.bounds,
            unit: source.unit(),
            parts,
            materials,
            has_materials,
            has_uvs: writer.has_uvs,
            has_colours: writer.has_colours,
            has_normals: source.has_normals(),
            looks: 0,
            stats,
        },
        looks: no_looks(resources)?,
    })
}

/// Texture coordinates without NaN and infinities, which are zero.
fn finite(uvs: &[[f32; 2]; 3]) -> [[f32; 2]; 3] {
    // Adding zero turns -0 into 0: both are one place.
    uvs.map(|uv| uv.map(|x| if x.is_finite() { x + 0.0 } else { 0.0 }))
}

/// Whether a source that was read to its end says anything of materials.
pub(super) fn has_materials<S: MeshSource + ?Sized>(
    source: &mut S,
) -> Result<bool, IngestError<S::Error>> {
    Ok(match source.material_count() {
        0 => false,
        1 => source.material(0).map_err(IngestError::Source)? != Material::default(),
        _ => true,
    })
}

struct Writer {
    spool: SoupWriter,
    attributes: SpoolWriter<AttributeRecord>,
    wanted: Attributes,
    bounds: SnapBox,
    delivered: u64,
    transparent: u64,
    has_uvs: bool,
    has_colours: bool,
    /// The last material that was asked for, and its number as triangles have it.
    last_material: Option<(u32, u32)>,
}

impl Writer {
    fn new(wanted: Attributes, resources: &Resources) -> Result<Self, StoreError> {
        Ok(Self {
            spool: SoupWriter::create(resources.scratch, SOUP)?,
            attributes: SpoolWriter::create(resources.scratch, ATTRIBUTES)?,
            wanted,
            bounds: SnapBox::EMPTY,
            delivered: 0,
            transparent: 0,
            has_uvs: false,
            has_colours: false,
            last_material: None,
        })
    }

    fn take<S: MeshSource + ?Sized>(
        &mut self,
        batch: &TriangleBatch,
        source: &mut S,
    ) -> Result<(), IngestError<S::Error>> {
        self.has_uvs |= !batch.uvs.is_empty();
        self.has_colours |= !batch.colours.is_empty();
        let uvs = if self.wanted.uvs { batch.uvs.as_slice() } else { &[] };
        let colours = if self.wanted.colours { batch.colours.as_slice() } else { &[] };
        for (i, corners) in batch.corners.iter().enumerate() {
            if !uvs.is_empty() || !colours.is_empty() {
                self.attributes.push(AttributeRecord {
                    corners: *corners,
                    uvs: uvs.get(i).map(finite).unwrap_or_default(),
                    colours: colours.get(i).copied().unwrap_or_default(),
                    unused: 0,
                })?;
            }
            let number = self.delivered as u32;
            self.delivered += 1;
            if !corners.iter().flatten().all(|c| c.is_finite()) {
                continue;
            }
            corners.iter().for_each(|&corner| self.bounds.add(corner));
            let material = self.marked_material(batch.materials[i], source)?;
            let part = batch.parts[i];
            let triangle =
                SoupTriangle { corners: *corners, source: number, part, material, stands_for: 0 };
            self.transparent += u64::from(triangle.is_pane());
            self.spool.push(triangle)?;
        }
        Ok(())
    }

    /// A material's number, with a bit that says whether it is transparent.
    fn marked_material<S: MeshSource + ?Sized>(
        &mut self,
        number: u32,
        source: &mut S,
    ) -> Result<u32, IngestError<S::Error>> {
        match self.last_material {
            Some((last, marked)) if last == number => Ok(marked),
            _ => {
                let material = source.material(number).map_err(IngestError::Source)?;
                let marked = number | if material.transparent { TRANSPARENT } else { 0 };
                self.last_material = Some((number, marked));
                Ok(marked)
            }
        }
    }
}
