//! All triangles and edges with a defect, for those who want more than the first places.
//!
//! In:         numbers of triangles, and of their corners, from finders on any thread.
//! Out:        the same by kind, triangle and corner, each once.
//! Invariant:  the result depends on what was marked, not on order, threads or share.
//! Memory:     the share of the sort.
//! Fails:      only as [`StoreError`].

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

use crate::defect::DefectKind;
use crate::store::{Record, Scratch, Sorted, Sorter, StoreError};

/// The corner of a mark that stands for a whole triangle.
const WHOLE: u32 = 3;

/// A triangle or one of its edges that has a defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Mark {
    kind: u32,
    triangle: u32,
    /// The corner that an edge begins at, or [`WHOLE`].
    corner: u32,
}

impl Record for Mark {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.kind, self.triangle, self.corner)
    }
}

/// Takes marks while defects are found.
pub struct Marks {
    sorter: Mutex<Sorter<Mark>>,
}

impl Marks {
    /// Kinds whose triangles are marked.
    pub const OF_TRIANGLES: [DefectKind; 6] = [
        DefectKind::IntersectingTriangles,
        DefectKind::OverlappingTriangles,
        DefectKind::TouchingTriangles,
        DefectKind::DuplicateTriangle,
        DefectKind::Fin,
        DefectKind::HiddenShell,
    ];
    /// Kinds whose edges are marked.
    pub const OF_EDGES: [DefectKind; 3] =
        [DefectKind::BoundaryEdge, DefectKind::NonmanifoldEdge, DefectKind::InconsistentEdge];

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

    /// Marks the edge that begins at a corner, 0 to 2, of a triangle.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn edge(&self, kind: DefectKind, triangle: u32, corner: u32) -> Result<(), StoreError> {
        assert!(corner < WHOLE, "a triangle has three edges");
        self.push(kind, triangle, corner)
    }

    fn push(&self, kind: DefectKind, triangle: u32, corner: u32) -> Result<(), StoreError> {
        let mut sorter = self.sorter.lock().unwrap_or_else(PoisonError::into_inner);
        sorter.push(Mark { kind: kind as u32, triangle, corner })
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

/// Marks by kind, triangle and corner.
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

    /// The next mark if it is one of this kind and triangle: the corner that its edge begins at, or
    /// `None` for the whole triangle.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn take(
        &mut self,
        kind: DefectKind,
        triangle: u64,
    ) -> Result<Option<Option<u32>>, StoreError> {
        let own = |mark: &Mark| mark.kind == kind as u32 && u64::from(mark.triangle) == triangle;
        let Some(mark) = self.next.filter(own) else { return Ok(None) };
        // A triangle may be in many pairs.
        while self.next == Some(mark) {
            self.next = self.sorted.next()?;
        }
        Ok(Some(Some(mark.corner).filter(|&corner| corner != WHOLE)))
    }
}
