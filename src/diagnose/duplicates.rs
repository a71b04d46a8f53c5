//! Triangles that are there already: the same three corners, in any order.

use bytemuck::{Pod, Zeroable};

use crate::defect::{Defect, DefectKind, DuplicateTriangle, Marks, Smallest};
use crate::diagnose::Means;
use crate::diagnose::finding::{Finding, Measure};
use crate::diagnose::model::Model;
use crate::diagnose::sums::area_of;
use crate::store::{Record, Sorter, StoreError};

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Named {
    vertices: [u32; 3],
    triangle: u32,
    /// Whether its corners go round the other way than `vertices`.
    is_odd: u32,
    unused: u32,
    area: f64,
    position: [f64; 3],
}

impl Record for Named {
    type Key = ([u32; 3], u32);
    fn key(&self) -> Self::Key {
        (self.vertices, self.triangle)
    }
}

/// Finds all of them; each but the first of its kind is one.
pub(crate) fn find(
    model: &Model,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let mut sorter = Sorter::new(means.scratch, means.share_bytes / 2);
    model.each(means, |triangle| {
        if triangle.is_whole() {
            let [a, b, c] = triangle.vertices;
            let mut vertices = triangle.vertices;
            vertices.sort_unstable();
            let is_even = [[a, b, c], [b, c, a], [c, a, b]].contains(&vertices);
            sorter.push(Named {
                vertices,
                triangle: triangle.number as u32,
                is_odd: u32::from(!is_even),
                unused: 0,
                area: area_of(triangle.corners),
                position: triangle.corners[0],
            })?;
        }
        Ok(())
    })?;
    let mut sorted = sorter.finish()?;
    let (mut count, mut area) = (0, 0.0);
    let mut places = Smallest::new();
    let mut first: Option<Named> = None;
    while let Some(next) = sorted.next()? {
        match first.filter(|first| first.vertices == next.vertices) {
            None => first = Some(next),
            Some(first) => {
                count += 1;
                area += next.area;
                if let Some(marks) = marks {
                    marks.triangles(DefectKind::DuplicateTriangle, &[next.triangle])?;
                }
                let copy = DuplicateTriangle {
                    triangles: [first.triangle.into(), next.triangle.into()],
                    is_reversed: first.is_odd != next.is_odd,
                    position: next.position,
                };
                places.offer(copy.triangles[1], Defect::DuplicateTriangle(copy));
            }
        }
    }
    let places = places.iter().map(|&(_, place)| place).collect();
    let size = (Measure::TotalArea, area);
    Ok(Finding::sized(DefectKind::DuplicateTriangle, count, size, places))
}
