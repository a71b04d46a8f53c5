//! What is marked, by its place.
//!
//! In:         a model, and marks of one kind after the other.
//! Out:        corners, in file order.
//! Memory:     a block of triangles; of vertices a bit each, in an eighth of the share.

use crate::defect::{DefectKind, Marks, SortedMarks};
use crate::diagnose::Means;
use crate::diagnose::model::{Model, is_finite};
use crate::store::{SequencePeek, StoreError, Table};

impl Model {
    /// Shows the triangles, edges or corners that are marked with `kind`, which must be the next of
    /// `marks`: the triangle's number and its corners, first the one that is marked or that the edge
    /// begins at.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn each_marked(
        &self,
        kind: DefectKind,
        marks: &mut SortedMarks,
        means: &Means<'_>,
        mut visit: impl FnMut(u64, [[f64; 3]; 3]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        self.each(means, |triangle| {
            while let Some(corner) = marks.take(kind, triangle.number)? {
                let mut points = *triangle.corners;
                points.rotate_left(corner.unwrap_or_default() as usize);
                visit(triangle.number, points)?;
            }
            Ok(())
        })
    }

    /// Shows the vertices that are marked with `kind`, likewise: each with the first triangle that has
    /// it. Those that no triangle has are passed over.
    ///
    /// # Errors
    /// As for [`Self::each_marked`].
    pub fn each_marked_vertex(
        &self,
        kind: DefectKind,
        marks: &mut SortedMarks,
        means: &Means<'_>,
        mut visit: impl FnMut(u64, [f64; 3]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut wanted = Table::<u64>::scattered(means.scratch, means.share_bytes / 8);
        while let Some(vertex) = marks.take_any(kind)? {
            let (word, bit) = (u64::from(vertex) / 64, vertex % 64);
            while wanted.len() <= word {
                wanted.push(0)?;
            }
            let bits = wanted.get(word)?;
            wanted.set(word, bits | 1 << bit)?;
        }
        // Copies are told by the file's own numbers, all others by those of places.
        let by_name = kind == DefectKind::CoincidentVertices;
        let mut names = self.named.as_ref().filter(|_| by_name).map(SequencePeek::new);
        self.each(means, |triangle| {
            let vertices = match &mut names {
                Some(names) => {
                    let own = names.peek()?.map_or(triangle.vertices, |(_, own)| own);
                    names.pass();
                    own
                }
                None => triangle.vertices,
            };
            if !is_finite(triangle.corners) {
                return Ok(());
            }
            for (vertex, &position) in vertices.into_iter().zip(triangle.corners) {
                let (word, bit) = (u64::from(vertex) / 64, vertex % 64);
                let bits = if word < wanted.len() { wanted.get(word)? } else { 0 };
                if bits >> bit & 1 == 1 {
                    wanted.set(word, bits & !(1 << bit))?;
                    visit(triangle.number, position)?;
                }
            }
            Ok(())
        })
    }

    /// Marks the vertices of the file that lie in the place of one with a smaller number.
    pub(crate) fn mark_coincident(
        &self,
        marks: &Marks,
        means: &Means<'_>,
    ) -> Result<(), StoreError> {
        let Some(named) = &self.named else { return Ok(()) };
        let mut names = SequencePeek::new(named);
        self.each(means, |triangle| {
            let own = names.peek()?.map_or(triangle.vertices, |(_, own)| own);
            names.pass();
            if !is_finite(triangle.corners) {
                return Ok(());
            }
            let copies = own.into_iter().zip(triangle.vertices).filter(|(own, first)| own != first);
            let mut copies = copies.map(|(own, _)| own);
            copies.try_for_each(|own| marks.vertex(DefectKind::CoincidentVertices, own))
        })
    }
}
