//! Decides whether a run begins anew one level deeper, since much of the model is thinner than a
//! cell.
//!
//! In:         what of the area had to be thickened at the depths tried so far.
//! Out:        a deeper grid, or none.
//! Invariant:  the choice depends on the model and the settings, not on memory or threads; of the
//!             limits only that of the disk has a say.
//! Memory:     none.
//! Source:     ours; each level costs four times as much as the one before.

use serde::{Deserialize, Serialize};

use crate::octree::Domain;
use crate::repair::settings::{Depth, ThinRule};
use crate::repair::stages::Findings;

/// Less of the area than this may be thickened without a level more.
const THIN_SHARE: f64 = 0.01;

/// A level that leaves more than this of what was thin before was of little use.
const USEFUL_SHARE: f64 = 0.75;

/// The grid gets no deeper by itself where more leaf cells are to be expected.
const MOST_LEAF_CELLS: u64 = 4_000_000;

/// Each level has so many times the cells of the surface.
const GROWTH: u64 = 4;

/// A depth that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthTrial {
    /// The depth.
    pub depth: u32,
    /// Share of the area that is thinner than a cell there.
    pub thin_share: f64,
}

/// Whether a level more is of use, and within the limits. `spent_bytes` is what the disk held so
/// far.
pub fn goes_deeper(
    findings: &Findings,
    (depth, thin): (Depth, ThinRule),
    (spent_bytes, most_bytes): (u64, Option<u64>),
) -> bool {
    let Depth::Auto { max_depth } = depth else { return false };
    let Some(last) = findings.trials.last() else { return false };
    let before = findings.trials.iter().rev().nth(1);
    let is_useful = before.is_none_or(|b| last.thin_share <= USEFUL_SHARE * b.thin_share);
    thin == ThinRule::Deeper
        && last.depth < max_depth
        && last.thin_share > THIN_SHARE
        && is_useful
        && GROWTH * findings.scan.leaf_cells <= MOST_LEAF_CELLS
        && most_bytes.is_none_or(|most| GROWTH * spent_bytes <= most)
}

/// Why a grid is as deep as it is.
pub fn depth_reason(depth: Depth, domain: &Domain, trials: &[DepthTrial]) -> String {
    let percent = |share: f64| 100.0 * share;
    match depth {
        Depth::Levels(_) => "asked for".to_owned(),
        Depth::Tolerance { length, .. } => format!("cells of at most twice {length}"),
        Depth::Auto { .. } => {
            let first = trials.first().map_or(domain.depth, |trial| trial.depth);
            let mut reason = format!("depth {first} for cells of 0.4% of the diagonal");
            for pair in trials.windows(2) {
                let (share, next) = (percent(pair[0].thin_share), pair[1].depth);
                reason += &format!("; depth {next} since {share:.1}% of the area was thinner");
            }
            if let Some(last) = trials.last().filter(|last| last.thin_share > THIN_SHARE) {
                let share = percent(last.thin_share);
                reason += &format!("; {share:.1}% of the area is thinner still, and thickened");
            }
            reason
        }
    }
}
