//! Marked triangles and edges by their places.
//!
//! In:         a model, and marks of one kind after the other.
//! Out:        corners, in file order.
//! Memory:     a block of triangles.

use crate::defect::{DefectKind, SortedMarks};
use crate::diagnose::Means;
use crate::diagnose::model::Model;
use crate::store::StoreError;

impl Model {
    /// Shows what is marked with `kind`, which must be the next of `marks`: the triangle's number
    /// and its corners; of an edge its ends come first.
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
}
