//! Counts the triangles of a surface that is placed, without writing them.
//!
//! In:         cells of all bricks.
//! Out:        as many as [`crate::contour::write_surface`] would write.
//! Memory:     4 bytes a brick, and what the [`Maker`] holds.

use crate::contour::maker::Maker;
use crate::contour::mdc::Layers;
use crate::contour::write::number_vertices;
use crate::contour::{ContourError, ContourOptions};
use crate::octree::Domain;
use crate::store::{BrickFile, Resources};

/// How many triangles the vertices in `cells`, and in the bricks of `surface` that stand for them,
/// span.
///
/// # Errors
/// [`ContourError`].
pub fn count_triangles(
    (cells, surface): (&BrickFile, &BrickFile),
    domain: &Domain,
    options: &ContourOptions,
    resources: &Resources,
) -> Result<u64, ContourError> {
    let cells = Layers::new(cells, Some(surface));
    let bases = number_vertices(&cells)?;
    let (method, factor) = (options.method, options.method.factors().plain);
    let mut triangles = 0;
    cells.each(
        factor,
        |_| true,
        || Maker::new(method, cells, &bases, domain, false),
        |maker, number| Ok(maker.triangles(number)?.indices.len() as u64),
        |more| {
            triangles += more;
            Ok(())
        },
        resources,
    )?;
    Ok(triangles)
}
