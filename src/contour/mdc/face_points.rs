//! Face points that are vertices, brick by brick: the last thing before the surface is written.
//!
//! In:         bricks of cells whose flags and vertices are final.
//! Out:        those bricks that changed since they were placed, with the vertices on the faces
//!             that they own, which are those below their cells; of the others these vertices only.
//! Invariant:  a face point stands where its arc leaves its face, halfway between the two crossings
//!             there; it depends on the arc alone, so both polygons that have it see the same.
//! Units:      lattice units from the brick's min corner.
//! Memory:     per worker what [`Neighbourhood`] holds, and 64 bytes a face point.
//! Fails:      [`ContourError`].
//! Source:     Ju and Udeshi 2006 (face vertices).

use crate::contour::mdc::arcs::{Arc, Edge, edges_of};
use crate::contour::mdc::cell::{cell_number, edge_below, place_of, segments_on};
use crate::contour::mdc::far_points::FarPoints;
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::neighbourhood::Neighbourhood;
use crate::contour::mdc::{HAS_CLUSTERS, HAS_FLAGGED, HAS_GRANTED, HAS_POINTS_ONLY, flags_of};
use crate::contour::{ContourError, ContourStats, SURFACE};
use crate::octree::{CellBrick, Domain, FacePoint, encode};
use crate::store::{BrickFile, BrickWriter, Resources};

/// What a byte of a record takes while its face points are sought.
const RECORD_FACTOR: u64 = 12;

/// Adds the face points to the bricks of `layers`.
///
/// # Errors
/// [`ContourError`].
pub fn add(
    layers: &Layers,
    domain: &Domain,
    stats: &mut ContourStats,
    resources: &Resources,
) -> Result<BrickFile, ContourError> {
    let far = FarPoints::find(layers, domain, resources)?;
    let mut writer = BrickWriter::create(resources.scratch, SURFACE, resources.backing)?;
    layers.each(
        RECORD_FACTOR,
        |number| layers.is_anew(number) || may_have_points(layers, number),
        || Neighbourhood::new(*layers, domain),
        |nb, number| {
            let mut points = face_points(nb, number)?;
            points.extend(far.of_brick(number));
            points.sort_unstable_by_key(|point| point.key);
            if points.is_empty() && !layers.is_anew(number) {
                return Ok(None);
            }
            let count = points.len() as u32;
            let is_anew = layers.is_anew(number);
            let mut brick = CellBrick::default();
            if is_anew {
                brick = layers.read(number, |record| Ok(record.to_brick()))?;
            }
            brick.points = points;
            let flags = if is_anew {
                flags_of(&brick)
            } else {
                (layers.flags(number) + count) | HAS_POINTS_ONLY
            };
            let counts = [brick.flagged.len() as u64, count.into()];
            Ok(Some((layers.key(number), flags, encode(&brick), counts)))
        },
        |made| {
            let Some((key, flags, bytes, [flagged, points])) = made else { return Ok(()) };
            stats.flagged_cells += flagged;
            stats.face_points += points;
            Ok(writer.append(key.0, flags, &bytes)?)
        },
        resources,
    )?;
    Ok(writer.finish(resources.cached_windows)?)
}

/// Whether the brick, or one below a side of it, has cells that make face points.
fn may_have_points(layers: &Layers, number: usize) -> bool {
    let key = layers.key(number);
    let below = (0..3).filter_map(|axis| layers.find(key.lower(1 << axis)?));
    std::iter::once(number)
        .chain(below)
        .any(|number| layers.flags(number) & (HAS_CLUSTERS | HAS_FLAGGED | HAS_GRANTED) != 0)
}

/// The face points that the brick owns, by ascending key.
fn face_points(nb: &mut Neighbourhood, number: usize) -> Result<Vec<FacePoint>, ContourError> {
    nb.move_to(number)?;
    let mut ends = Vec::new();
    for rank in 0..nb.own().cells.len() {
        add_ends(nb, rank, &mut ends)?;
    }
    ends.sort_unstable_by_key(|(key, _, edge)| (*key, *edge));
    let mut points = Vec::new();
    for of_arc in ends.chunk_by(|a, b| a.0 == b.0) {
        let [(key, arc, one), (_, _, other)] = of_arc else {
            return Err(nb.contradiction("one arc between two cells"));
        };
        let crossings =
            [nb.crossing(one.axis, one.lower)?.0, nb.crossing(other.axis, other.lower)?.0];
        let position = arc.point(crossings, nb.cell_units());
        points.push(FacePoint { key: *key, position });
    }
    Ok(points)
}

/// Adds where the arcs on the lower faces of a leaf cell end whose face points are vertices.
fn add_ends(
    nb: &mut Neighbourhood,
    rank: usize,
    ends: &mut Vec<(u64, Arc, Edge)>,
) -> Result<(), ContourError> {
    let own = nb.own();
    let packed = own.cells[rank];
    let number = cell_number(packed);
    let cut = own.first_vertex(rank).cut;
    let at = place_of(number).map(|c| c as i32);
    let low = (1 << cut.level()) - 1;
    for axis in 0..3 {
        // Within its own cluster there is no face.
        if at[axis] & low != 0 {
            continue;
        }
        let pairs = segments_on(packed, 2 * axis).pairs();
        if pairs.is_empty() {
            continue;
        }
        let mut below = at;
        below[axis] -= 1;
        let (here, there) = (nb.own_cell(rank), nb.cell(below)?);
        if Arc::never_misses(cut, nb.cut(there)) {
            continue;
        }
        for &pair in pairs {
            let (lower, upper) =
                (nb.vertex(there, edge_below(pair[0], axis)), nb.vertex(here, pair[0]));
            let arc = Arc { axis, lower, upper };
            if !arc.is_inner() && !arc.is_far() && arc.is_explicit(nb.cell_units()) {
                let edges = edges_of(pair, at);
                let is_end = |edge: &Edge| arc.ends_at(edge, at);
                ends.extend(edges.into_iter().filter(is_end).map(|edge| (arc.key(), arc, edge)));
            }
        }
    }
    Ok(())
}
