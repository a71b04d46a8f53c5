//! Finds the surface that would be lost: triangles whose hits lie on edges with both ends outside.
//!
//! Such edges cross a wall thinner than a cell, or a sheet that no wall stands for and that a patch
//! went along.
//!
//! In:      hits, flips, and what the outside reaches.
//! Out:     [`LostHits`] by source number, from each brick on its own.
//! Memory:  the share; a brick per worker.

use crate::octree::{
    ArchivedHitBrick, Flips, HitEdge, LINES, LostHits, ROWS, Regions, SIDE, decode_hits,
    edge_position, find_regions,
};
use crate::sign::SignError;
use crate::sign::flooded::{Flooded, OUTSIDE};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::store::{BrickFile, Resources, Sorter, ordered_by_weight};

/// Corners of the largest speck.
const SPECK_CORNERS: u32 = 8;

/// Finds the lost hits of all bricks.
///
/// # Errors
/// [`SignError`].
pub fn find_lost(
    hits: &BrickFile,
    flips: &Flips,
    flooded: &Flooded,
    resources: &Resources,
) -> Result<Sorter<LostHits>, SignError> {
    let mut items = LoadItems::new(hits, flips, resources);
    let mut bricks = flooded.by_brick();
    let mut lost = Sorter::new(resources.scratch, resources.share_bytes / 4);
    ordered_by_weight(
        resources.pool,
        resources.scales(|(item, _): &(LoadItem, Vec<u8>)| item.weight_bytes(hits)),
        || {
            let Some(load) = items.next()? else { return Ok(None) };
            let brick = bricks.next()?.filter(|brick| brick.key == load.brick.0);
            let (position, expected) = (load.brick.position(), "the bricks of the flood");
            let brick = brick.ok_or(SignError::Contradiction { brick: position, expected })?;
            let regions = bricks.regions_of(&brick)?;
            Ok(Some((load, regions)))
        },
        Loaded::default,
        |loaded, (item, known)| {
            // Nothing is lost where the outside does not come.
            if known.iter().all(|region| region & OUTSIDE == 0) {
                return Ok(Vec::new());
            }
            let Some(view) = loaded.load(hits, &item)? else { return Ok(Vec::new()) };
            let regions = find_regions(&loaded.barrier);
            // A wall that is left as specks is lost as well.
            let specks = find_specks(&regions);
            let is_outside = |at| {
                let region = usize::from(regions.at(at));
                known[region] & OUTSIDE != 0 || specks[region]
            };
            Ok(lost_of(decode_hits(&view)?, is_outside))
        },
        |found: Vec<LostHits>| Ok::<(), SignError>(lost.extend(&found)?),
    )?;
    Ok(lost)
}

/// Which regions are specks: of few corners, all within the brick.
fn find_specks(regions: &Regions) -> Vec<bool> {
    let mut corners = vec![0; usize::from(regions.count)];
    for row in 0..ROWS {
        let is_border = [row % LINES, row / LINES].iter().any(|&c| c == 0 || c == SIDE);
        for (bits, region) in regions.row(row) {
            let at_border = is_border || bits & (1 | 1 << SIDE) != 0;
            let count = if at_border { SPECK_CORNERS + 1 } else { bits.count_ones() };
            corners[usize::from(region)] += count;
        }
    }
    corners.into_iter().map(|count| count <= SPECK_CORNERS).collect()
}

fn lost_of(brick: &ArchivedHitBrick, is_outside: impl Fn([usize; 3]) -> bool) -> Vec<LostHits> {
    let mut counts = vec![0_u32; brick.planes.len()];
    let mut first = 0;
    for edge in brick.edges.iter() {
        let edge = HitEdge { bits: edge.bits.to_native(), signed_sum: 0 };
        let hits = first..first + edge.kept();
        first = hits.end;
        let (axis, at) = edge_position(edge.edge());
        let mut beyond = at;
        beyond[axis] += 1;
        if at.iter().all(|&c| c < SIDE) && is_outside(at) && is_outside(beyond) {
            for hit in &brick.hits[hits] {
                counts[hit.to_native() as usize] += 1;
            }
        }
    }
    let planes = counts.into_iter().zip(brick.planes.iter()).filter(|(count, _)| *count > 0);
    planes.map(|(count, plane)| LostHits { source: plane.source.to_native(), count }).collect()
}
