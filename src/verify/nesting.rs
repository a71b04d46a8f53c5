//! Which components lie inside an odd number of others: one sweep over the triangles per chunk.
//!
//! In:         components with an anchor point each; the tape; the labels.
//! Out:        per component whether a ray from its anchor towards -x crosses the others an odd
//!             number of times.
//! Invariant:  every decision is exact, see [`crossing`]. An anchor on another component is not decided.
//! Memory:     the chunk of components.

use crate::geom::crossing::{Crossing, crossing};
use crate::monitor::Monitor;
use crate::store::{Labels, StoreError};
use crate::verify::components::Component;
use crate::verify::tape::Tape;

/// Where an anchor lies with respect to all other components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Nesting {
    /// Inside an odd number of them.
    pub(crate) odd: bool,
    /// On the surface of one of them.
    pub(crate) touches: bool,
}

/// Finds the nesting of each of `components`.
pub(crate) fn nest(
    components: &[Component],
    tape: &Tape,
    labels: &mut Labels,
    monitor: &dyn Monitor,
) -> Result<Vec<Nesting>, StoreError> {
    let mut by_y: Vec<usize> = (0..components.len()).collect();
    by_y.sort_unstable_by(|&a, &b| components[a].anchor[1].total_cmp(&components[b].anchor[1]));
    let mut nestings = vec![Nesting::default(); components.len()];
    tape.each(monitor, |triangle| {
        if triangle.is_whole() {
            let ys = triangle.corners.map(|corner| corner[1]);
            let (low, high) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
            let from = by_y.partition_point(|&at| components[at].anchor[1] < low);
            for &at in &by_y[from..] {
                let Component { anchor, label, .. } = components[at];
                if anchor[1] > high {
                    break;
                }
                if labels.label(triangle.ids[0])? != label {
                    match crossing(anchor, triangle.corners) {
                        Crossing::None => {}
                        Crossing::Below => nestings[at].odd ^= true,
                        Crossing::Touching => nestings[at].touches = true,
                    }
                }
            }
        }
        Ok(true)
    })?;
    Ok(nestings)
}
