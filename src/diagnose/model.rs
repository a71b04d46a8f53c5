//! The model as all looks see it: corners in file order, and vertices by position.
//!
//! In:         a [`MeshSource`], read to its end.
//! Out:        [`Model`]: per triangle its corners, its vertices, and whether it is transparent.
//! Invariant:  two corners are one vertex if and only if their positions are equal, exactly. A vertex
//!             has the smallest number that the file gives to that position; in formats without
//!             numbers, its place in the order of all positions.
//! Memory:     a quarter of the share.
//! Fails:      [`DiagnoseError`]; more than 2^32 - 1 corners are refused.

use crate::defect::{CoincidentVertices, Defect, DefectKind, Smallest};
use crate::diagnose::ownership::Owners;
use crate::diagnose::reading::read;
use crate::diagnose::{DiagnoseError, Finding, Means};
use crate::mesh::{Discarded, LengthUnit, MeshSource, TriangleBatch};
use crate::store::{Sequence, StoreError};

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
    pub(crate) facts: ModelFacts,
    pub(crate) coincident: Smallest<u32, CoincidentVertices>,
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
        read(source, means)
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
