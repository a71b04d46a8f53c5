//! Finds the surface that would be lost: triangles whose hits lie on edges with both ends outside.
//!
//! Such edges cross a wall thinner than a cell, or a sheet that no wall stands for and that a patch
//! went along.
//!
//! In:      hits, flips, and what the outside reaches.
//! Out:     [`LostHits`] by source number, from each brick on its own.
//! Memory:  the share; a brick per worker.

use glam::DVec3;

use crate::octree::{
    ArchivedHitBrick, EdgeBits, Flips, HitEdge, LINES, LostHits, ROWS, Regions, SIDE, SourcePlane,
    decode_hits, edge_index, edge_position, find_regions,
};
use crate::sign::SignError;
use crate::sign::flooded::{Flooded, OUTSIDE};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::store::{BrickFile, Resources, Sorter, ordered_by_weight};

/// Cosine of the angle between the sides of a wall: its edge is sharper than any ridge.
const PARALLEL: f64 = 0.8;

/// Corners of the largest speck.
const SPECK_CORNERS: u32 = 8;
/// Edges that leave a speck, at most.
pub const SPECK_EDGES: usize = 6 * SPECK_CORNERS as usize;

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
        resources.scales(|(item, ..): &(LoadItem, Vec<u8>, bool)| item.weight_bytes(hits)),
        || {
            let Some(load) = items.next()? else { return Ok(None) };
            let (brick, regions) = bricks.next_at(load.brick)?;
            Ok(Some((load, regions, brick.is_parted == 1)))
        },
        Loaded::default,
        |loaded, (item, known, is_parted)| {
            let outsides = known.iter().filter(|region| **region & OUTSIDE != 0).count();
            // Nothing is lost where the outside does not come, nor in most bricks where it does.
            if outsides == 0 || is_parted && outsides == 1 {
                return Ok(Vec::new());
            }
            let Some(view) = loaded.load(hits, &item)? else { return Ok(Vec::new()) };
            let regions = find_regions(&loaded.barrier);
            // A wall that is left as specks is lost as well.
            let specks = find_specks(&regions, &known);
            let is_outside = |at| {
                let region = usize::from(regions.at(at));
                known[region] & OUTSIDE != 0 || specks[region]
            };
            Ok(lost_of(decode_hits(&view)?, &loaded.barrier, is_outside))
        },
        |found: Vec<LostHits>| Ok::<(), SignError>(lost.extend(&found)?),
    )?;
    Ok(lost)
}

/// Which regions are specks: of few corners, all within the brick, with nothing inside beside them.
fn find_specks(regions: &Regions, known: &[u8]) -> Vec<bool> {
    let is_outside = |region: u16| known[usize::from(region)] & OUTSIDE != 0;
    let mut corners = vec![0; known.len()];
    for row in 0..ROWS {
        let is_border = [row % LINES, row / LINES].iter().any(|&c| c == 0 || c == SIDE);
        for (bits, region) in regions.row(row) {
            let at_border = is_border || bits & (1 | 1 << SIDE) != 0;
            let count = if at_border { SPECK_CORNERS + 1 } else { bits.count_ones() };
            corners[usize::from(region)] += count;
        }
    }
    let mut specks: Vec<bool> = corners.into_iter().map(|count| count <= SPECK_CORNERS).collect();
    for row in 0..ROWS {
        for (bits, region) in regions.row(row).filter(|(_, region)| !is_outside(*region)) {
            if !specks[usize::from(region)] {
                continue;
            }
            let is_bare = (0..=SIDE).filter(|x| bits >> x & 1 == 1).all(|x| {
                let at = [x, row % LINES, row / LINES];
                neighbours(at).all(|beside| {
                    let other = regions.at(beside);
                    other == region || is_outside(other)
                })
            });
            specks[usize::from(region)] = is_bare;
        }
    }
    specks
}

/// The six corners beside one within the brick.
fn neighbours(at: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..6).map(move |side| {
        let mut beside = at;
        if side % 2 == 0 {
            beside[side / 2] -= 1
        } else {
            beside[side / 2] += 1
        }
        beside
    })
}

/// Whether the first and the last hit of an edge lie on planes that could be the sides of a wall.
fn are_of_wall(brick: &ArchivedHitBrick, hits: &[rkyv::rend::u32_le], axis: usize) -> bool {
    let (Some(first), Some(last)) = (hits.first(), hits.last()) else { return false };
    let normal = |hit: &rkyv::rend::u32_le| {
        SourcePlane::from(&brick.planes[hit.to_native() as usize]).unit_normal()
    };
    are_sides([normal(first), normal(last)], axis)
}

/// Whether planes that an edge crosses could be the sides of a wall. Those of a ridge are no loss:
/// every ridge passes edges whose ends are both outside. Which way triangles face is not known; where
/// both are made to look the same way, an edge crosses the sides of a wall alike, and of those of a
/// blunt ridge one upward, one downward.
fn are_sides([one, other]: [DVec3; 2], axis: usize) -> bool {
    let cosine = one.dot(other);
    cosine.abs() >= PARALLEL && one[axis] * other[axis] * cosine >= 0.0
}

/// Whether the four edges beside one are hit as well. What lies beyond the brick is not asked.
fn is_inner(barrier: &EdgeBits, axis: usize, at: [usize; 3]) -> bool {
    (0..3).filter(|across| *across != axis).all(|across| {
        let (mut below, mut above) = (at, at);
        below[across] = below[across].saturating_sub(1);
        above[across] += 1;
        [below, above].iter().all(|beside| barrier.get(edge_index(axis, *beside)))
    })
}

fn lost_of(
    brick: &ArchivedHitBrick,
    barrier: &EdgeBits,
    is_outside: impl Fn([usize; 3]) -> bool,
) -> Vec<LostHits> {
    let mut counts = vec![[0_u32; 2]; brick.planes.len()];
    let mut first = 0;
    for edge in brick.edges.iter() {
        let edge = HitEdge::from(edge);
        let hits = first..first + edge.kept();
        first = hits.end;
        let (axis, at) = edge_position(edge.edge());
        let mut beyond = at;
        beyond[axis] += 1;
        let hits = &brick.hits[hits];
        let is_lost = at.iter().all(|&c| c < SIDE) && is_outside(at) && is_outside(beyond);
        if is_lost && are_of_wall(brick, hits, axis) {
            let inner = u32::from(is_inner(barrier, axis, at));
            for hit in hits {
                let [count, within] = &mut counts[hit.to_native() as usize];
                *count += 1;
                *within += inner;
            }
        }
    }
    let planes = counts.into_iter().zip(brick.planes.iter()).filter(|([count, _], _)| *count > 0);
    let lost = planes.map(|([count, inner], plane)| {
        let source = plane.source.to_native();
        LostHits { source, count, inner }
    });
    lost.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_of_walls_are_told_from_those_of_ridges_whichever_way_they_face() {
        let wall = DVec3::new(0.1, 0.2, 0.97).normalize();
        // Both sides of a roof, 12 degrees apart, along x.
        let [left, right] = [-0.1, 0.1].map(|x| DVec3::new(x, 0.0, 1.0).normalize());
        for turn in [1.0, -1.0] {
            for axis in 0..3 {
                assert!(are_sides([wall, turn * wall], axis));
                assert!(are_sides([wall, turn * (wall + 0.05 * DVec3::Y).normalize()], axis));
                assert_eq!(are_sides([left, turn * right], axis), axis != 0);
            }
            assert!(!are_sides([DVec3::X, turn * DVec3::new(0.7, 0.7, 0.0).normalize()], 0));
        }
    }
}
