//! Sheets that hang from others by an edge.

use crate::defect::{Defect, DefectKind, Fin, Marks};
use crate::diagnose::Means;
use crate::diagnose::edges::Side;
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::model::Model;
use crate::diagnose::sums::Sets;
use crate::store::{Labels, Sequence, StoreError};

/// Finds all of them.
pub(crate) fn find(
    model: &Model,
    sheets: &mut Labels,
    sides: &Sequence<Side>,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let kind = DefectKind::Fin;
    if sides.is_empty() {
        return Ok(Finding::none(kind));
    }
    let mut sets = Sets::measure(model, sheets, sides, means)?;
    let mut largest = SizedPlaces::default();
    let (mut count, mut area) = (0, 0.0);
    for number in 0..sets.sums.len() {
        let sums = sets.sums.get(number)?;
        if sums.is_fin() {
            count += 1;
            area += sums.area;
            let fin = Fin {
                triangle: sums.first,
                triangles: sums.triangles,
                area: sums.area,
                hinge: sums.hinge_length,
                open: sums.open_length,
                position: sums.position,
            };
            largest.offer(sums.area, sums.first, Defect::Fin(fin));
        }
    }
    if let Some(marks) = marks.filter(|_| count > 0) {
        model.each(means, |triangle| {
            if !triangle.is_whole() {
                return Ok(());
            }
            let set = sets.set_of.get(triangle.number)?;
            match sets.sums.get(set.into())?.is_fin() {
                true => marks.triangles(kind, &[triangle.number as u32]),
                false => Ok(()),
            }
        })?;
    }
    Ok(Finding::sized(kind, count, (Measure::TotalArea, area), largest.into_places()))
}
