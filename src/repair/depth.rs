//! Chooses how fine the grid is, once the box of the model is known.

use std::path::Path;

use crate::io::{CoordinateType, Format};
use crate::octree::{Domain, SnapBox};
use crate::repair::RepairError;
use crate::repair::settings::Depth;

/// The domain around `bounds` at the depth that `depth` means for it and for the output's format.
///
/// # Errors
/// [`RepairError::NoUnit`] for metres, since `input` states no unit; or
/// [`RepairError::OutputTooCoarse`].
pub fn choose_domain(
    input: &Path,
    bounds: &SnapBox,
    depth: Depth,
    format: Format,
) -> Result<Domain, RepairError> {
    let single = format.coordinates() == CoordinateType::F32;
    let around = |depth| {
        Domain::around(bounds, depth, single)
            .map_err(|possible_depth| RepairError::OutputTooCoarse { depth, possible_depth })
    };
    match depth {
        Depth::Levels(depth) => around(depth),
        Depth::Tolerance { length, max_depth } => {
            let tolerance = length
                .in_model_units(bounds)
                .ok_or_else(|| RepairError::NoUnit { path: input.to_path_buf() })?;
            let mut domain = around(*Depth::RANGE.start())?;
            for depth in *Depth::RANGE.start() + 1..=max_depth {
                if domain.cell_size() <= 2.0 * tolerance {
                    break;
                }
                domain = around(depth)?;
            }
            Ok(domain)
        }
    }
}
