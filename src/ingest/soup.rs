//! First pass: the file becomes a spool of finite triangles.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::ingest::error::IngestError;
use crate::mesh::{Discarded, Material, MeshSource, Part, TriangleBatch};
use crate::monitor::Counter;
use crate::octree::{SnapBox, SoupTriangle, TRANSPARENT};
use crate::store::{Resources, Spool, SpoolWriter, StoreError};

/// Spool of the triangles.
pub const SOUP: &str = "soup.spool";
/// Side file of the attributes, one record per delivered triangle.
pub const ATTRIBUTES: &str = "attributes.spool";

/// Texture coordinates, colours and polygon of one triangle, by source number. 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AttributeRecord {
    /// Texture coordinates of the corners; zero where the file has none.
    pub uvs: [[f32; 2]; 3],
    /// RGBA colours of the corners; zero where the file has none.
    pub colours: [[u8; 4]; 3],
    /// Number of the polygon in the file.
    pub polygon: u32,
}

/// Counts of the input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoupStats {
    /// Triangles that the reader delivered.
    pub triangles: u64,
    /// Of these, dropped because a corner is NaN or infinite.
    pub nonfinite_triangles: u64,
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
    pub spool: Spool<SoupTriangle>,
    /// Their box; empty when there is none.
    pub bounds: SnapBox,
    /// Part names.
    pub parts: Vec<Part>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Whether `attributes.spool` was written.
    pub has_attributes: bool,
    /// Counts.
    pub stats: SoupStats,
}

/// Reads `source` to its end.
///
/// # Errors
/// [`IngestError`]: the source fails, the disk is full, or `strict` met a broken face.
pub fn read_soup<S: MeshSource + ?Sized>(
    source: &mut S,
    strict: bool,
    resources: &Resources,
) -> Result<Soup, IngestError<S::Error>> {
    let mut writer = Writer::new(resources)?;
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
        writer.take(&batch, source.materials())?;
        if writer.delivered > u64::from(u32::MAX) {
            return Err(IngestError::TooManyTriangles { limit: u32::MAX.into() });
        }
    }
    resources.monitor.count(Counter::InputBytesRead, source.bytes_read() - read_bytes);
    let stats = SoupStats {
        triangles: writer.delivered,
        nonfinite_triangles: writer.delivered - writer.spool.len(),
        discarded: source.discarded(),
        input_bytes: source.bytes_read(),
    };
    stats.refuse_broken(strict)?;
    let has_attributes = writer.attributes.is_some();
    writer.attributes.map(SpoolWriter::finish).transpose()?;
    Ok(Soup {
        spool: writer.spool.finish()?,
        bounds: writer.bounds,
        parts: source.parts().to_vec(),
        materials: source.materials().to_vec(),
        has_attributes,
        stats,
    })
}

struct Writer<'r> {
    resources: Resources<'r>,
    spool: SpoolWriter<SoupTriangle>,
    attributes: Option<SpoolWriter<AttributeRecord>>,
    bounds: SnapBox,
    delivered: u64,
}

impl<'r> Writer<'r> {
    fn new(resources: &Resources<'r>) -> Result<Self, StoreError> {
        Ok(Self {
            resources: *resources,
            spool: SpoolWriter::create(resources.scratch, SOUP)?,
            attributes: None,
            bounds: SnapBox::EMPTY,
            delivered: 0,
        })
    }

    fn take(&mut self, batch: &TriangleBatch, materials: &[Material]) -> Result<(), StoreError> {
        let with_attributes = !batch.uvs.is_empty() || !batch.colours.is_empty();
        if with_attributes && self.attributes.is_none() {
            self.attributes = Some(SpoolWriter::create(self.resources.scratch, ATTRIBUTES)?);
        }
        for (i, corners) in batch.corners.iter().enumerate() {
            if let Some(attributes) = &mut self.attributes {
                attributes.push(AttributeRecord {
                    uvs: batch.uvs.get(i).copied().unwrap_or_default(),
                    colours: batch.colours.get(i).copied().unwrap_or_default(),
                    polygon: batch.polygons[i],
                })?;
            }
            let source = self.delivered as u32;
            self.delivered += 1;
            if !corners.iter().flatten().all(|c| c.is_finite()) {
                continue;
            }
            corners.iter().for_each(|&corner| self.bounds.add(corner));
            let material = batch.materials[i];
            let transparent = materials.get(material as usize).is_some_and(|m| m.transparent);
            let material = material | if transparent { TRANSPARENT } else { 0 };
            let part = batch.parts[i];
            self.spool.push(SoupTriangle { corners: *corners, source, part, material, tags: 0 })?;
        }
        Ok(())
    }
}
