//! All triangles, edges and vertices with a defect, for those who want more than the first places.
//!
//! In:         numbers of triangles, of their corners, and of vertices, from finders on any thread.
//! Out:        the same by kind, number and corner, each once.
//! Invariant:  the result depends on what was marked, not on order, threads or share.
//! Memory:     the share of the sort.
//! Fails:      only as [`StoreError`].

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

use crate::defect::DefectKind;
use crate::store::{Record, Scratch, Sorted, Sorter, StoreError};

/// The corner of a mark that stands for a whole triangle, or for a vertex.
const WHOLE: u32 = 3;

/// What is marked where a kind of defect is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marked {
    /// Whole triangles.
    Triangle,
    /// Edges of triangles.
    Edge,
    /// Corners of triangles.
    Corner,
    /// Vertices by their numbers.
    Vertex,
}

impl Marked {
    /// What is marked with a kind; `None` where there is nothing to show, or others show it.
    #[must_use]
    pub const fn with(kind: DefectKind) -> Option<Self> {
        match kind {
            // They have no place; and rims are made of boundary edges.
            DefectKind::NonfiniteTriangle
            | DefectKind::WildFace
            | DefectKind::ShortFace
            | DefectKind::OpenLoop => None,
            DefectKind::BoundaryEdge
            | DefectKind::NonmanifoldEdge
            | DefectKind::InconsistentEdge => Some(Self::Edge),
            DefectKind::TJunction => Some(Self::Corner),
            DefectKind::NonmanifoldVertex
            | DefectKind::CoincidentVertices
            | DefectKind::IsolatedVertex => Some(Self::Vertex),
            DefectKind::InwardComponent
            | DefectKind::IntersectingTriangles
            | DefectKind::OverlappingTriangles
            | DefectKind::DuplicateTriangle
            | DefectKind::DegenerateTriangle
            | DefectKind::Fin
            | DefectKind::OpenShell
            | DefectKind::ThinWall
            | DefectKind::HiddenShell
            | DefectKind::TinyShell
            | DefectKind::TouchingTriangles => Some(Self::Triangle),
        }
    }
}

/// A triangle, one of its edges or corners, or a vertex that has a defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Mark {
    kind: u32,
    /// Of the triangle, or of the vertex.
    number: u32,
    /// The corner, that an edge begins at as well, or [`WHOLE`].
    corner: u32,
}

impl Record for Mark {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.kind, self.number, self.corner)
    }
}

/// Takes marks while defects are found.
pub struct Marks {
    sorter: Mutex<Sorter<Mark>>,
}

impl Marks {
    /// No marks yet; the sort takes at most `share_bytes`.
    #[must_use]
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { sorter: Mutex::new(Sorter::new(scratch, share_bytes)) }
    }

    /// Marks whole triangles; numbers count the triangles of the file from 0.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn triangles(&self, kind: DefectKind, triangles: &[u32]) -> Result<(), StoreError> {
        triangles.iter().try_for_each(|&triangle| self.push(kind, triangle, WHOLE))
    }

    /// Marks a corner, 0 to 2, of a triangle, or the edge that begins there.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn corner(&self, kind: DefectKind, triangle: u32, corner: u32) -> Result<(), StoreError> {
        assert!(corner < WHOLE, "a triangle has three corners");
        self.push(kind, triangle, corner)
    }

    /// Marks a vertex by its number.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn vertex(&self, kind: DefectKind, vertex: u32) -> Result<(), StoreError> {
        self.push(kind, vertex, WHOLE)
    }

    fn push(&self, kind: DefectKind, number: u32, corner: u32) -> Result<(), StoreError> {
        let mut sorter = self.sorter.lock().unwrap_or_else(PoisonError::into_inner);
        sorter.push(Mark { kind: kind as u32, number, corner })
    }

    /// Sorts what was marked.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn finish(self) -> Result<SortedMarks, StoreError> {
        let sorter = self.sorter.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut sorted = sorter.finish()?;
        let next = sorted.next()?;
        Ok(SortedMarks { sorted, next })
    }
}

/// Marks by kind, number and corner.
pub struct SortedMarks {
    sorted: Sorted<Mark>,
    next: Option<Mark>,
}

impl SortedMarks {
    /// The kind that comes next; `None` behind the last one.
    #[must_use]
    pub fn kind(&self) -> Option<DefectKind> {
        let next = self.next?;
        DefectKind::ALL.into_iter().find(|&kind| kind as u32 == next.kind)
    }

    /// The next mark if it is one of this kind and triangle: the corner, or `None` for the whole
    /// triangle.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn take(
        &mut self,
        kind: DefectKind,
        triangle: u64,
    ) -> Result<Option<Option<u32>>, StoreError> {
        let own = |mark: &Mark| mark.kind == kind as u32 && u64::from(mark.number) == triangle;
        let Some(mark) = self.next.filter(own) else { return Ok(None) };
        self.pass(mark)?;
        Ok(Some(Some(mark.corner).filter(|&corner| corner != WHOLE)))
    }

    /// The number of the next mark if it is one of this kind.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn take_any(&mut self, kind: DefectKind) -> Result<Option<u32>, StoreError> {
        let Some(mark) = self.next.filter(|mark| mark.kind == kind as u32) else { return Ok(None) };
        self.pass(mark)?;
        Ok(Some(mark.number))
    }

    fn pass(&mut self, mark: Mark) -> Result<(), StoreError> {
        // A triangle may be in many pairs.
        while self.next == Some(mark) {
            self.next = self.sorted.next()?;
        }
        Ok(())
    }
}
