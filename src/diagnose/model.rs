//! The model as all looks see it: corners in file order, and vertices by position.
//!
//! In:         a [`MeshSource`], read to its end.
//! Out:        [`Model`]: per triangle its corners, its vertices, and whether it is transparent.
//! Invariant:  two corners are one vertex if and only if their positions are equal, exactly. A vertex
//!             has the smallest number that the file gives to that position; in formats without
//!             numbers, its place in the order of all positions.
//! Memory:     a quarter of the share for what stays, half of it for the sorts.
//! Fails:      [`DiagnoseError`]; more than 2^32 - 1 corners are refused.

use bytemuck::{Pod, Zeroable};

use crate::defect::{CoincidentVertices, Defect, DefectKind, Smallest};
use crate::diagnose::ownership::{Census, Owners};
use crate::diagnose::{DiagnoseError, Finding, Means};
use crate::mesh::{Discarded, LengthUnit, MeshSource, TriangleBatch};
use crate::store::{Record, Sequence, Sorter, StoreError};

/// The most triangles at one time on their way through a look.
pub(crate) const BLOCK: usize = 1024;
/// The three corners of a triangle, model units.
pub(crate) type Corners = [[f64; 3]; 3];

/// What was found out while reading.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFacts {
    /// Triangles that the reader delivered.
    pub triangles: u64,
    /// Triangles with a corner that is no place.
    pub nonfinite_triangles: u64,
    /// Faces that the reader left out.
    pub discarded: Discarded,
    /// Vertices that the file lists; `None` in formats without vertex numbers.
    pub listed_vertices: Option<u64>,
    /// Vertices that triangles without infinite corners name; in formats without numbers, corners.
    pub used_vertices: u64,
    /// Different positions among them.
    pub positions: u64,
    /// Lowest and highest corner of finite triangles.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// What a model unit is, where the file says so.
    pub unit: Option<LengthUnit>,
    /// Parts, by their triangles.
    pub parts: Owners,
    /// Materials, by their triangles.
    pub materials: Owners,
}

/// A model that has been read.
pub struct Model {
    /// Corners of all triangles, in file order.
    pub(crate) corners: Sequence<Corners>,
    /// Their vertices; three times 0 where a corner is no place.
    pub(crate) vertices: Sequence<[u32; 3]>,
    /// Their vertices by the numbers of the file, in formats that have them.
    pub(crate) named: Option<Sequence<[u32; 3]>>,
    /// Whether light passes, 1 or 0.
    pub(crate) transparent: Sequence<u8>,
    /// All vertex numbers are below.
    pub(crate) space: u64,
    facts: ModelFacts,
    coincident: Smallest<u32, CoincidentVertices>,
}

/// A triangle as the looks see it.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<'t> {
    /// Its number in the file.
    pub(crate) number: u64,
    pub(crate) vertices: [u32; 3],
    pub(crate) corners: &'t Corners,
}

impl Triangle<'_> {
    /// Whether it has three vertices: only such triangles make up the surface.
    pub(crate) fn is_whole(&self) -> bool {
        is_whole(self.vertices)
    }
}

/// Whether these are three vertices.
pub(crate) fn is_whole([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Whether all three corners are places.
pub(crate) fn is_finite(corners: &Corners) -> bool {
    corners.iter().flatten().all(|x| x.is_finite())
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

/// Bits of a finite position, with one zero.
pub(crate) fn position_key(position: [f64; 3]) -> [u64; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

impl Model {
    /// Reads `source` to its end.
    ///
    /// # Errors
    /// [`DiagnoseError`]: the source fails, the scratch disk fails, or the caller cancels.
    pub fn read<S: MeshSource + ?Sized>(
        source: &mut S,
        means: &Means<'_>,
    ) -> Result<Self, DiagnoseError<S::Error>> {
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

    /// What was found out while reading.
    #[must_use]
    pub fn facts(&self) -> &ModelFacts {
        &self.facts
    }

    /// Whether vertex numbers are those of the file.
    #[must_use]
    pub fn has_names(&self) -> bool {
        self.named.is_some()
    }

    /// The model as a mesh whose vertices are positions.
    #[must_use]
    pub fn source(&self) -> ModelSource<'_> {
        ModelSource { model: self, next: 0, corners: Vec::new(), vertices: Vec::new() }
    }

    /// Vertices in the places of others.
    pub(crate) fn coincident(&self) -> Finding {
        let count = match self.has_names() {
            true => self.facts.used_vertices - self.facts.positions,
            false => 0,
        };
        let places = self.coincident.iter().map(|&(_, pair)| Defect::CoincidentVertices(pair));
        Finding::counted(DefectKind::CoincidentVertices, count, places.collect())
    }

    /// Shows every triangle in file order.
    pub(crate) fn each(
        &self,
        means: &Means<'_>,
        mut visit: impl FnMut(Triangle<'_>) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let (mut corner_buffer, mut vertex_buffer) = (Vec::new(), Vec::new());
        let mut number = 0;
        while number < self.corners.len() {
            means.stop_if_asked()?;
            let corners = self.corners.block(number, BLOCK, &mut corner_buffer)?;
            let vertices = self.vertices.block(number, corners.len(), &mut vertex_buffer)?;
            for (corners, &vertices) in corners.iter().zip(vertices) {
                visit(Triangle { number, vertices, corners })?;
                number += 1;
            }
        }
        Ok(())
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

/// Reads a model again, as a mesh whose vertices are positions.
pub struct ModelSource<'m> {
    model: &'m Model,
    next: u64,
    corners: Vec<Corners>,
    vertices: Vec<[u32; 3]>,
}

impl MeshSource for ModelSource<'_> {
    type Error = StoreError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, StoreError> {
        batch.clear();
        let Self { model, next, corners, vertices } = self;
        let corners = model.corners.block(*next, BLOCK, corners)?;
        let mut names = model.vertices.block(*next, corners.len(), vertices)?.to_vec();
        // The two may leave memory at different places.
        while names.len() < corners.len() {
            let from = *next + names.len() as u64;
            let more = model.vertices.block(from, corners.len() - names.len(), vertices)?;
            names.extend_from_slice(more);
        }
        for (&corners, names) in corners.iter().zip(names) {
            batch.push(corners, 0, 0, 0);
            batch.indices.push(names);
        }
        *next += batch.len() as u64;
        Ok(!batch.is_empty())
    }

    fn discarded(&self) -> Discarded {
        Discarded::default()
    }

    fn bytes_read(&self) -> u64 {
        0
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.model.space)
    }
}
