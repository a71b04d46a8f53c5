//! Chooses how fine the grid is, once the box of the model is known.

use std::path::Path;

use crate::io::{CoordinateType, Format};
use crate::octree::{Domain, SnapBox};
use crate::repair::RepairError;
use crate::repair::length::{Reach, Ruler};
use crate::repair::settings::Depth;

/// Walls up to this thickness have room beside every model.
const FREE_CELLS: f64 = 2.0;

/// The box with room for walls that are thicker than those of the default.
fn roomy(ruler: &Ruler, sheet_thickness: Reach) -> SnapBox {
    let bounds = &ruler.bounds;
    let half = match sheet_thickness {
        Reach::Cells(cells) if cells <= FREE_CELLS => return *bounds,
        // Cells are no wider than the longest side over as many as fit in depth 4.
        Reach::Cells(cells) => (cells - FREE_CELLS) * 0.5 * bounds.longest() / 8.0,
        Reach::Length(length) => 0.5 * length.in_model_units(ruler).unwrap_or(0.0),
    };
    bounds.grown(half)
}

/// The domain around the box of `ruler`, with room for walls, at the depth that `depth` means for
/// it and for the output's format; its cells are no smaller than `finest`, as far as there is a
/// grid so coarse.
///
/// # Errors
/// [`RepairError::NoUnit`] for metres where nobody states the unit of `input`; or
/// [`RepairError::OutputTooCoarse`].
pub fn choose_domain(
    input: &Path,
    ruler: &Ruler,
    depth: Depth,
    sheet_thickness: Reach,
    format: Format,
    finest: f64,
) -> Result<Domain, RepairError> {
    let bounds = &roomy(ruler, sheet_thickness);
    let single = format.coordinates() == CoordinateType::F32;
    let around = |depth| {
        Domain::around(bounds, depth, single)
            .map_err(|possible_depth| RepairError::OutputTooCoarse { depth, possible_depth })
    };
    let (length, max_depth) = match depth {
        Depth::Levels(depth) => return no_finer(around(depth)?, finest, around),
        Depth::Auto { max_depth } => (Depth::DEFAULT_TOLERANCE, max_depth),
        Depth::Tolerance { length, max_depth } => (length, max_depth),
    };
    let tolerance = length
        .in_model_units(ruler)
        .ok_or_else(|| RepairError::NoUnit { path: input.to_path_buf() })?;
    let mut domain = around(*Depth::RANGE.start())?;
    for depth in *Depth::RANGE.start() + 1..=max_depth {
        if domain.cell_size() <= 2.0 * tolerance {
            break;
        }
        domain = around(depth)?;
    }
    no_finer(domain, finest, around)
}

/// The domain, or the deepest one whose cells are no smaller than `finest`.
fn no_finer(
    domain: Domain,
    finest: f64,
    around: impl Fn(u32) -> Result<Domain, RepairError>,
) -> Result<Domain, RepairError> {
    let mut domain = domain;
    while domain.cell_size() < finest && domain.depth > *Depth::RANGE.start() {
        domain = around(domain.depth - 1)?;
    }
    Ok(domain)
}
