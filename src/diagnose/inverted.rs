//! Closed shells that are inside out: their volume is negative, and they are no cavity.
//!
//! Invariant:  a shell counts if all its edges are used alike both ways, its volume is negative beyond
//!             what rounding can do, and a ray from its first point crosses the other shells that enclose
//!             a volume an even number of times, exactly.
//! Memory:     a sixteenth of the share for the shells that are asked at one time.

use crate::defect::{Defect, DefectKind, InwardComponent};
use crate::diagnose::Means;
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::model::Model;
use crate::diagnose::shells::Shells;
use crate::geom::crossing::{Crossing, crossing};
use crate::store::StoreError;

/// A shell with a negative volume.
struct Asked {
    shell: u64,
    first: u64,
    area: f64,
    /// A point of it.
    position: [f64; 3],
    is_inside: bool,
}

/// Finds all of them.
pub(crate) fn find(
    model: &Model,
    shells: &mut Shells,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let most = (means.share_bytes / 16 / size_of::<Asked>() as u64).max(64) as usize;
    let mut tally = Tally::default();
    let mut asked = Vec::new();
    for shell in 0..shells.len() {
        let sums = shells.sums(shell)?;
        if sums.is_inverted() {
            let (first, area, position) = (sums.first, sums.area, sums.position);
            asked.push(Asked { shell, first, area, position, is_inside: false });
        }
        if asked.len() == most {
            tally.decide(&mut asked, model, shells, means)?;
        }
    }
    tally.decide(&mut asked, model, shells, means)?;
    let size = (Measure::TotalArea, tally.area);
    let places = tally.largest.into_places();
    Ok(Finding::sized(DefectKind::InwardComponent, tally.count, size, places))
}

#[derive(Default)]
struct Tally {
    count: u64,
    area: f64,
    largest: SizedPlaces,
}

impl Tally {
    /// Looks what of `asked` lies in others, and counts the rest.
    fn decide(
        &mut self,
        asked: &mut Vec<Asked>,
        model: &Model,
        shells: &mut Shells,
        means: &Means<'_>,
    ) -> Result<(), StoreError> {
        if asked.is_empty() {
            return Ok(());
        }
        asked.sort_by(|a, b| a.position[1].total_cmp(&b.position[1]).then(a.shell.cmp(&b.shell)));
        model.each(means, |triangle| {
            if !triangle.is_whole() {
                return Ok(());
            }
            let ys = triangle.corners.map(|corner| corner[1]);
            let (low, high) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
            let from = asked.partition_point(|asked| asked.position[1] < low);
            for own in asked[from..].iter_mut().take_while(|asked| asked.position[1] <= high) {
                if crossing(own.position, triangle.corners) == Crossing::Below {
                    let other = shells.of(triangle.number)?;
                    own.is_inside ^= other != own.shell && shells.sums(other)?.is_oriented();
                }
            }
            Ok(())
        })?;
        asked.sort_by_key(|asked| asked.shell);
        for own in asked.drain(..).filter(|own| !own.is_inside) {
            self.count += 1;
            shells.turn(own.shell)?;
            self.area += own.area;
            let (triangle, position) = (own.first, own.position);
            let defect = InwardComponent { triangle, position };
            self.largest.offer(own.area, triangle, Defect::InwardComponent(defect));
        }
        Ok(())
    }
}
