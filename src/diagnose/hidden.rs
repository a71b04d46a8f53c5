//! Shells of which nothing can be seen from outside.

use crate::defect::{Defect, DefectKind, HiddenShell};
use crate::diagnose::Means;
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::model::Model;
use crate::diagnose::shells::Shells;
use crate::diagnose::sight::Sight;
use crate::store::{SequencePeek, StoreError};

/// Finds all of them, and notes which are seen. Transparent triangles stop no view.
pub(crate) fn find(
    model: &Model,
    shells: &mut Shells,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let sight = model.facts().bounds.and_then(Sight::new);
    let Some(mut sight) = sight.filter(|_| shells.len() > 1) else {
        // A shell that is alone is seen.
        (0..shells.len()).try_for_each(|shell| shells.see(shell))?;
        return Ok(Finding::none(DefectKind::HiddenShell));
    };
    let mut panes = SequencePeek::new(&model.transparent);
    model.each(means, |triangle| {
        let is_pane = panes.peek()?.is_some_and(|(_, pane)| pane == 1);
        panes.pass();
        if triangle.is_whole() && !is_pane {
            sight.fill(triangle.corners);
        }
        Ok(())
    })?;
    sight.look();
    // The shell of the triangle before, if it is known to be seen.
    let mut last_seen = u64::MAX;
    model.each(means, |triangle| {
        if triangle.is_whole() {
            let shell = shells.of(triangle.number)?;
            if shell != last_seen && shells.sums(shell)?.is_seen == 1 {
                last_seen = shell;
            } else if shell != last_seen && sight.sees(triangle.corners) {
                shells.see(shell)?;
                last_seen = shell;
            }
        }
        Ok(())
    })?;
    let mut largest = SizedPlaces::default();
    let (mut count, mut area) = (0, 0.0);
    for shell in 0..shells.len() {
        let sums = shells.sums(shell)?;
        if sums.is_seen == 0 {
            count += 1;
            area += sums.area;
            let hidden = HiddenShell {
                triangle: sums.first,
                triangles: sums.triangles,
                area: sums.area,
                position: sums.position,
            };
            largest.offer(sums.area, sums.first, Defect::HiddenShell(hidden));
        }
    }
    let size = (Measure::TotalArea, area);
    Ok(Finding::sized(DefectKind::HiddenShell, count, size, largest.into_places()))
}
