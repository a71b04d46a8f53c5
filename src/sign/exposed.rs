//! Finds the surface that the outside touches, and which corners are inside.
//!
//! In:      hits, flips, and what the outside reaches.
//! Out:     [`Exposed`], from each brick on its own.
//! Memory:  the share; a brick per worker.

use crate::geom::mix;
use crate::octree::{
    ArchivedHitBrick, BURIED, BrickKey, Domain, ExposedPlace, Flips, HitEdge, InsideCorners, LINES,
    LOST, Occupancy, Regions, SIDE, SourcePlane, Touched, decode_hits, edge_position, find_regions,
};
use crate::sign::SignError;
use crate::sign::flooded::{Flooded, OUTSIDE, PANE};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::store::{BrickFile, Resources, Sorter, StoreError, ordered_by_weight};

/// Places of one triangle in one brick that are told of.
const MOST_PLACES: usize = 2;

/// What the surface is to the outside.
pub struct Exposed {
    /// Places that the outside touches, up to two of each triangle and brick.
    pub places: Sorter<ExposedPlace>,
    /// What else there is of each thing.
    pub touched: Sorter<Touched>,
    /// Which corners are inside.
    pub occupancy: Occupancy,
}

/// What one brick says; things are triangles.
struct BrickSays {
    key: u64,
    corners: Box<InsideCorners>,
    places: Vec<ExposedPlace>,
    touched: Vec<Touched>,
}

/// Finds the exposed places of all bricks, of things as `thing_of` names them by triangle.
///
/// # Errors
/// [`SignError`].
pub fn find_exposed(
    hits: &BrickFile,
    flips: &Flips,
    flooded: &Flooded,
    domain: &Domain,
    mut thing_of: impl FnMut(u32) -> Result<u32, StoreError>,
    resources: &Resources,
) -> Result<Exposed, SignError> {
    let mut items = LoadItems::new(hits, flips, resources);
    let mut bricks = flooded.by_brick();
    let mut places = Sorter::new(resources.scratch, resources.share_bytes / 8);
    let mut touched = Sorter::new(resources.scratch, resources.share_bytes / 16);
    let (mut keys, mut corners) = (Vec::with_capacity(hits.len()), Occupancy::table(resources));
    ordered_by_weight(
        resources.pool,
        resources.scales(|(item, _): &(LoadItem, Vec<u8>)| item.weight_bytes(hits)),
        || {
            let Some(load) = items.next()? else { return Ok(None) };
            let (_, regions) = bricks.next_at(load.brick)?;
            Ok(Some((load, regions)))
        },
        Loaded::default,
        |loaded, (item, known)| {
            let view = loaded.load(hits, &item)?;
            let regions = find_regions(&loaded.barrier);
            let is_outside = |region: u16| known[usize::from(region)] & OUTSIDE != 0;
            let mut says = BrickSays {
                key: item.brick.0,
                // Rays pass panes.
                corners: inside_corners(&regions, |region| {
                    known[usize::from(region)] & (OUTSIDE | PANE) != 0
                }),
                places: Vec::new(),
                touched: Vec::new(),
            };
            if let Some(view) = &view {
                let ends = |edge: [[usize; 3]; 2]| edge.map(|at| is_outside(regions.at(at)));
                says.look_at(decode_hits(view)?, ends);
            }
            Ok(says)
        },
        |mut says: BrickSays| {
            keys.push(says.key);
            corners.push(*says.corners)?;
            says.touched.iter_mut().try_for_each(|touched| {
                touched.of = thing_of(touched.of)?;
                Ok::<(), StoreError>(())
            })?;
            says.touched.sort_unstable_by_key(|touched| (touched.of, touched.how));
            says.touched.dedup();
            touched.extend(&says.touched)?;
            for place in &mut says.places {
                place.of = thing_of(place.of)?;
            }
            Ok::<(), SignError>(places.extend(&says.places)?)
        },
    )?;
    Ok(Exposed { places, touched, occupancy: Occupancy::new(keys, corners, domain) })
}

/// The corners that the brick owns and rays do not pass.
fn inside_corners(regions: &Regions, is_passed: impl Fn(u16) -> bool) -> Box<InsideCorners> {
    let mut corners = Box::<InsideCorners>::default();
    for z in 0..SIDE {
        for y in 0..SIDE {
            let runs = regions.row(z * LINES + y).filter(|(_, region)| !is_passed(*region));
            corners.set_row([y, z], runs.fold(0, |row, (bits, _)| row | bits));
        }
    }
    for axis in 0..3 {
        let mut beyond = [0; 3];
        beyond[axis] = SIDE;
        if !is_passed(regions.at(beyond)) {
            corners.set_beyond(axis);
        }
    }
    corners
}

impl BrickSays {
    /// Looks at all edges that the brick owns; `ends` tells which of their ends are outside.
    fn look_at(&mut self, brick: &ArchivedHitBrick, ends: impl Fn([[usize; 3]; 2]) -> [bool; 2]) {
        let first_corner = BrickKey(self.key).position().map(|c| c * SIDE as u32);
        let mut first = 0;
        for edge in brick.edges.iter() {
            let edge = HitEdge::from(edge);
            let hits = &brick.hits[first..first + edge.kept()];
            first += edge.kept();
            let (axis, at) = edge_position(edge.edge());
            if at.contains(&SIDE) {
                continue;
            }
            let mut beyond = at;
            beyond[axis] += 1;
            let plane = |hit: &rkyv::rend::u32_le| {
                SourcePlane::from(&brick.planes[hit.to_native() as usize])
            };
            let (nearest, is_above) = match ends([at, beyond]) {
                [true, false] => (hits.first(), false),
                [false, true] => (hits.last(), true),
                [outside, _] => {
                    let how = if outside { LOST } else { BURIED };
                    let touched = hits.iter().map(|hit| Touched { of: plane(hit).source, how });
                    self.touched.extend(touched);
                    continue;
                }
            };
            let Some(plane) = nearest.map(plane) else { continue };
            let to_outside = if is_above { 1.0 } else { -1.0 };
            let turn = if plane.normal[axis] * to_outside < 0.0 { -1.0 } else { 1.0 };
            let end = if is_above { beyond } else { at };
            let corner = [0, 1, 2].map(|a| first_corner[a] + end[a] as u32);
            let hash = hash_of(axis, [0, 1, 2].map(|a| first_corner[a] + at[a] as u32));
            let normal = plane.normal.map(|n| n * turn);
            self.places.push(ExposedPlace { of: plane.source, hash, corner, normal });
        }
        self.touched.sort_unstable_by_key(|touched| (touched.of, touched.how));
        self.touched.dedup();
        self.keep_few();
    }

    /// Keeps [`MOST_PLACES`] of each triangle.
    fn keep_few(&mut self) {
        self.places.sort_unstable_by_key(|place| (place.of, place.hash, place.corner));
        let mut last = (u32::MAX, 0);
        self.places.retain(|place| {
            last = if place.of == last.0 { (place.of, last.1 + 1) } else { (place.of, 1) };
            last.1 <= MOST_PLACES
        });
    }
}

/// A hash of an edge of the grid.
fn hash_of(axis: usize, at: [u32; 3]) -> u32 {
    let [x, y, z] = at.map(u64::from);
    (mix(x | y << 16 | z << 32 | (axis as u64) << 48) >> 32) as u32
}
