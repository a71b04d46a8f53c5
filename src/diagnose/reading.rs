//! Reads a model and makes one vertex of all corners in one place.
//!
//! Memory:     half of the share for the sorts, and a quarter for what stays.

use bytemuck::{Pod, Zeroable};

use crate::defect::{CoincidentVertices, Smallest};
use crate::diagnose::model::{Corners, Model, ModelFacts, is_finite, position_key};
use crate::diagnose::ownership::Census;
use crate::diagnose::{DiagnoseError, Means};
use crate::mesh::{MeshSource, TriangleBatch};
use crate::store::{Record, Sequence, Sorter, StoreError};

/// Reads `source` to its end.
pub(crate) fn read<S: MeshSource + ?Sized>(
    source: &mut S,
    means: &Means<'_>,
) -> Result<Model, DiagnoseError<S::Error>> {
    let mut reading = Reading::new(means);
    let mut batch = TriangleBatch::default();
    let mut read_bytes = 0;
    let failed = |source| DiagnoseError::Source { source };
    while source.next_batch(&mut batch).map_err(failed)? {
        means.stop_if_asked()?;
        let now = source.bytes_read();
        means.monitor.advance(now - read_bytes);
        read_bytes = now;
        reading.take(&batch, source)?;
    }
    let facts = ModelFacts {
        triangles: reading.corners.len(),
        nonfinite_triangles: reading.nonfinite,
        discarded: source.discarded(),
        listed_vertices: reading.named.is_some().then(|| source.vertex_count()).flatten(),
        used_vertices: 0,
        positions: 0,
        bounds: reading.bounds,
        unit: source.unit(),
        parts: reading.parts.list(|number| source.part(number).map(|part| part.name))?,
        materials: reading
            .materials
            .list(|number| source.material(number).map(|material| material.name))?,
    };
    Ok(reading.weld(facts)?)
}

/// A corner on its way to its vertex.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    key: [u64; 3],
    /// The number that the file gives to it, or 0.
    name: u32,
    corner: u32,
}

impl Record for Placed {
    type Key = ([u64; 3], u32, u32);
    fn key(&self) -> Self::Key {
        (self.key, self.name, self.corner)
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct CornerVertex {
    corner: u32,
    vertex: u32,
}

impl Record for CornerVertex {
    type Key = u32;
    fn key(&self) -> u32 {
        self.corner
    }
}

/// A model while it is read.
struct Reading<'m> {
    means: &'m Means<'m>,
    corners: Sequence<Corners>,
    named: Option<Sequence<[u32; 3]>>,
    transparent: Sequence<u8>,
    placed: Sorter<Placed>,
    nonfinite: u64,
    bounds: Option<[[f64; 3]; 2]>,
    parts: Census,
    materials: Census,
    /// The material that was asked for last, and whether it is transparent.
    last_material: Option<(u32, bool)>,
}

impl<'m> Reading<'m> {
    fn new(means: &'m Means<'m>) -> Self {
        let share = means.share_bytes;
        Self {
            means,
            corners: Sequence::new(means.scratch, share / 8),
            named: None,
            transparent: Sequence::new(means.scratch, share / 64),
            placed: Sorter::new(means.scratch, share / 4),
            nonfinite: 0,
            bounds: None,
            parts: Census::new(means, share / 64),
            materials: Census::new(means, share / 64),
            last_material: None,
        }
    }

    fn take<S: MeshSource + ?Sized>(
        &mut self,
        batch: &TriangleBatch,
        source: &mut S,
    ) -> Result<(), DiagnoseError<S::Error>> {
        if !batch.indices.is_empty() && self.named.is_none() {
            let share = self.means.share_bytes / 32;
            self.named = Some(Sequence::new(self.means.scratch, share));
        }
        for (at, corners) in batch.corners.iter().enumerate() {
            self.take_corners(corners, batch.indices.get(at).copied())?;
            self.parts.count(batch.parts[at])?;
            self.materials.count(batch.materials[at])?;
            let material = batch.materials[at];
            let transparent = match self.last_material {
                Some((last, transparent)) if last == material => transparent,
                _ => {
                    let asked = source.material(material);
                    asked.map_err(|source| DiagnoseError::Source { source })?.transparent
                }
            };
            self.last_material = Some((material, transparent));
            self.transparent.push(u8::from(transparent))?;
        }
        Ok(())
    }

    fn take_corners(
        &mut self,
        corners: &Corners,
        names: Option<[u32; 3]>,
    ) -> Result<(), StoreError> {
        let first = self.corners.len() * 3;
        let limit = u64::from(u32::MAX);
        if first + 3 > limit {
            return Err(StoreError::TooMany { what: "Corners of a model to inspect", limit });
        }
        self.corners.push(*corners)?;
        if let Some(named) = &mut self.named {
            named.push(names.unwrap_or_default())?;
        }
        if !is_finite(corners) {
            self.nonfinite += 1;
            return Ok(());
        }
        let [low, high] = self.bounds.get_or_insert([corners[0]; 2]);
        for (at, &corner) in corners.iter().enumerate() {
            for axis in 0..3 {
                // Adding zero turns -0 into 0.
                low[axis] = low[axis].min(corner[axis]) + 0.0;
                high[axis] = high[axis].max(corner[axis]) + 0.0;
            }
            let name = names.map_or(0, |names| names[at]);
            let corner_number = first as u32 + at as u32;
            self.placed.push(Placed { key: position_key(corner), name, corner: corner_number })?;
        }
        Ok(())
    }

    /// Makes corners in one place one vertex.
    fn weld(self, mut facts: ModelFacts) -> Result<Model, StoreError> {
        let Means { scratch, share_bytes, .. } = *self.means;
        let mut by_corner = Sorter::new(scratch, share_bytes / 4);
        let mut coincident = Smallest::new();
        let mut space = 0;
        let mut last: Option<(Placed, u32)> = None;
        let mut sorted = self.placed.finish()?;
        while let Some(placed) = sorted.next()? {
            let is_new = last.is_none_or(|(before, _)| before.key != placed.key);
            let is_named = self.named.is_some();
            let vertex = match last {
                Some((_, vertex)) if !is_new => vertex,
                _ if is_named => placed.name,
                _ => facts.positions as u32,
            };
            facts.positions += u64::from(is_new);
            let is_other = is_new || last.is_none_or(|(before, _)| before.name != placed.name);
            facts.used_vertices += u64::from(is_other || !is_named);
            if is_other && !is_new {
                let position = placed.key.map(f64::from_bits);
                let vertices = [vertex, placed.name];
                coincident.offer(placed.name, CoincidentVertices { vertices, position });
            }
            space = space.max(u64::from(vertex) + 1);
            last = Some((placed, vertex));
            by_corner.push(CornerVertex { corner: placed.corner, vertex })?;
        }
        drop(sorted);
        let mut vertices = Sequence::new(scratch, share_bytes / 32);
        let mut sorted = by_corner.finish()?;
        let mut next = sorted.next()?;
        for triangle in 0..self.corners.len() {
            let first = (triangle * 3) as u32;
            let mut own = [0; 3];
            while let Some(CornerVertex { corner, vertex }) = next
                && corner < first + 3
            {
                own[(corner - first) as usize] = vertex;
                next = sorted.next()?;
            }
            vertices.push(own)?;
        }
        let Self { corners, named, transparent, .. } = self;
        Ok(Model { corners, vertices, named, transparent, space, facts, coincident })
    }
}
