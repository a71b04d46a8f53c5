//! Brings the triangles of a file into the order of their parts, each of which is read for itself
//! then.
//!
//! In:         a source, read to its end.
//! Out:        [`Scattered`]: triangles part by part, each part's in file order; materials with
//!             images; the box and the name of each part; the nodes of the scene.
//! Invariant:  a part read from here is what a file with nothing else in it would give, but for the
//!             numbers of materials, which are those of the whole.
//! Units:      model units; of each part its own.
//! Memory:     the share; tables over parts spill.
//! Fails:      [`IngestError`].
//! Source:     ours.

use bytemuck::Zeroable;

use crate::ingest::error::IngestError;
use crate::ingest::names::{write_materials, write_names};
use crate::ingest::scattered::{Has, Materials, PartRecord, PartTriangle, Scattered};
use crate::ingest::soup::{SoupStats, has_materials};
use crate::io::{NODES, SceneTree, SceneWriter};
use crate::mesh::{IDENTITY, MeshSource, Part, SceneNode, TriangleBatch};
use crate::monitor::Counter;
use crate::octree::SnapBox;
use crate::store::{NumberedTexts, Resources, Sorter, Spool, SpoolWriter, StoreError, Table};

/// Spool of the triangles of all parts.
pub const SCATTERED: &str = "scattered.spool";

/// Reads `source` to its end.
///
/// # Errors
/// [`IngestError`]: the source fails, the disk is full, or `strict` met a face that leads nowhere.
pub fn scatter<S: MeshSource + ?Sized>(
    source: &mut S,
    strict: bool,
    resources: &Resources,
) -> Result<Scattered, IngestError<S::Error>> {
    let share_bytes = resources.share_bytes / 2;
    let mut sorter = Sorter::<PartTriangle>::new(resources.scratch, share_bytes);
    let mut batch = TriangleBatch::default();
    let (mut stats, mut has_uvs, mut has_colours) = (SoupStats::default(), false, false);
    while source.next_batch(&mut batch).map_err(IngestError::Source)? {
        let read_bytes = source.bytes_read() - stats.input_bytes;
        resources.monitor.count(Counter::InputBytesRead, read_bytes);
        resources.monitor.advance(read_bytes);
        stats.input_bytes += read_bytes;
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        has_uvs |= !batch.uvs.is_empty();
        has_colours |= !batch.colours.is_empty();
        if stats.triangles + batch.len() as u64 > u64::from(u32::MAX) {
            return Err(IngestError::TooManyTriangles { limit: u32::MAX.into() });
        }
        for at in 0..batch.len() {
            let number = stats.triangles as u32;
            stats.triangles += 1;
            sorter.push(record_of(&batch, at, number))?;
        }
    }
    stats.input_bytes = source.bytes_read();
    stats.discarded = source.discarded();
    stats.refuse_broken(strict)?;
    let names = write_names(source, resources)?;
    let palette = write_materials(source, resources)?;
    let (triangles, mut parts) = write_parts(sorter, resources)?;
    // Parts are numbered by their triangles, so none is without.
    while parts.len() < source.part_count() {
        parts.push(PartRecord { first: triangles.len(), ..PartRecord::zeroed() })?;
    }
    let scene = write_scene(source, resources)?;
    let open = |state| NumberedTexts::open(resources.scratch, state, resources.share_bytes / 32);
    Ok(Scattered {
        triangles,
        parts,
        names: open(&names)?,
        scene,
        unit: source.unit(),
        stats,
        materials: Materials::new(open(&palette[0])?),
        palette,
        has: Has {
            uvs: has_uvs,
            colours: has_colours,
            normals: source.has_normals(),
            materials: has_materials(source)?,
        },
    })
}

fn record_of(batch: &TriangleBatch, at: usize, number: u32) -> PartTriangle {
    PartTriangle {
        corners: batch.corners[at],
        part: batch.parts[at],
        number,
        material: batch.materials[at],
        polygon: batch.polygons[at],
        uvs: batch.uvs.get(at).copied().unwrap_or_default(),
        colours: batch.colours.get(at).copied().unwrap_or_default(),
        unused: 0,
    }
}

/// Writes the triangles in the order of their parts, and where each part begins.
fn write_parts(
    sorter: Sorter<PartTriangle>,
    resources: &Resources,
) -> Result<(Spool<PartTriangle>, Table<PartRecord>), StoreError> {
    let mut sorted = sorter.finish()?;
    let mut spool = SpoolWriter::create(resources.scratch, SCATTERED)?;
    let mut parts = Table::<PartRecord>::new(resources.scratch, resources.share_bytes / 32);
    let mut bounds = SnapBox::EMPTY;
    while let Some(triangle) = sorted.next()? {
        while parts.len() <= u64::from(triangle.part) {
            let SnapBox { lo, hi } = std::mem::replace(&mut bounds, SnapBox::EMPTY);
            if let Some(last) = parts.len().checked_sub(1) {
                let record = parts.get(last)?;
                parts.set(last, PartRecord { lo, hi, ..record })?;
            }
            parts.push(PartRecord { first: spool.len(), ..PartRecord::zeroed() })?;
        }
        let part = u64::from(triangle.part);
        let record = parts.get(part)?;
        parts.set(part, PartRecord { triangles: record.triangles + 1, ..record })?;
        if triangle.corners.iter().flatten().all(|x| x.is_finite()) {
            triangle.corners.iter().for_each(|&corner| bounds.add(corner));
        }
        spool.push(triangle)?;
    }
    if let Some(last) = parts.len().checked_sub(1) {
        let record = parts.get(last)?;
        parts.set(last, PartRecord { lo: bounds.lo, hi: bounds.hi, ..record })?;
    }
    Ok((spool.finish()?, parts))
}

/// Writes the nodes; one for each part where the file has none.
fn write_scene<S: MeshSource + ?Sized>(
    source: &mut S,
    resources: &Resources,
) -> Result<SceneTree, IngestError<S::Error>> {
    let mut writer = SceneWriter::create(resources.scratch, NODES)?;
    for number in 0..source.node_count() as u32 {
        if let Some(node) = source.node(number).map_err(IngestError::Source)? {
            writer.push(&node)?;
        }
    }
    if source.node_count() == 0 {
        for number in 0..source.part_count() as u32 {
            let Part { name } = source.part(number).map_err(IngestError::Source)?;
            writer.push(&SceneNode { name, parent: None, map: IDENTITY, part: Some(number) })?;
        }
    }
    Ok(writer.finish()?)
}
