//! Face points between two clusters above the brick, whose arcs pass many bricks.
//!
//! In:         bricks of cells whose flags and vertices are final.
//! Out:        [`FarPoints`]: those that are vertices, each for the brick that has the vertex of
//!             the smaller cluster.
//! Invariant:  an arc ends twice, wherever; its face point is that of any other arc.
//! Units:      places in cells, positions in lattice units, from the grid's min corner.
//! Memory:     per worker what [`Neighbourhood`] holds; 100 bytes a point, at most six for a
//!             cluster above the brick.
//! Fails:      [`ContourError`].
//! Source:     as all face points; see `face_points`.

use crate::contour::ContourError;
use crate::contour::mdc::IS_IN_ABOVE;
use crate::contour::mdc::arcs::{Arc, MinimalFace, edges_of};
use crate::contour::mdc::cell::{cell_number, edge_in_cell, place_of, segments_on};
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::neighbourhood::Neighbourhood;
use crate::octree::{Domain, FacePoint, SIDE};
use crate::store::Resources;

/// What a byte of a record takes while its face points are sought.
const RECORD_FACTOR: u64 = 12;

/// See the module.
pub struct FarPoints(Vec<(usize, FacePoint)>);

/// An end of an arc.
struct End {
    /// The brick that owns the face point, and its key there.
    owner: usize,
    key: u64,
    crossing: [i32; 3],
    face: MinimalFace,
}

impl FarPoints {
    /// Finds them.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn find(
        layers: &Layers,
        domain: &Domain,
        resources: &Resources,
    ) -> Result<Self, ContourError> {
        let mut ends = Vec::new();
        layers.each(
            RECORD_FACTOR,
            |number| layers.flags(number) & IS_IN_ABOVE != 0,
            || Neighbourhood::new(*layers, domain),
            |nb, number| ends_in(nb, layers, number),
            |more: Vec<End>| {
                ends.extend(more);
                Ok(())
            },
            resources,
        )?;
        ends.sort_unstable_by_key(|end| (end.owner, end.key, end.crossing));
        let mut points = Vec::with_capacity(ends.len() / 2);
        for of_arc in ends.chunk_by(|a, b| (a.owner, a.key) == (b.owner, b.key)) {
            let place = layers.key(of_arc[0].owner).position();
            let [one, other] = of_arc else {
                let expected = "one arc between two clusters";
                return Err(ContourError::Contradiction { brick: place, expected });
            };
            let at = one.face.point([one.crossing, other.crossing], domain.cell_units as i32);
            let low = place.map(|c| (i64::from(c) * domain.brick_units()) as i32);
            let position = [0, 1, 2].map(|a| at[a] - low[a]);
            points.push((one.owner, FacePoint { key: one.key, position }));
        }
        Ok(Self(points))
    }

    /// Those of brick `number`, from its min corner.
    pub fn of_brick(&self, number: usize) -> impl Iterator<Item = FacePoint> {
        let first = self.0.partition_point(|(owner, _)| *owner < number);
        self.0[first..]
            .iter()
            .take_while(move |(owner, _)| *owner == number)
            .map(|(_, point)| *point)
    }
}

/// Where arcs to larger or smaller clusters end on the lower faces of a brick that is in one.
fn ends_in(
    nb: &mut Neighbourhood,
    layers: &Layers,
    number: usize,
) -> Result<Vec<End>, ContourError> {
    let mut ends = Vec::new();
    let key = layers.key(number);
    let is_faced: [bool; 3] = std::array::from_fn(|axis| {
        let below = key.lower(1 << axis).and_then(|below| layers.find(below));
        below.is_some_and(|below| layers.flags(below) & IS_IN_ABOVE != 0)
    });
    if is_faced == [false; 3] {
        return Ok(ends);
    }
    nb.move_to(number)?;
    let low = key.position().map(|c| c as i32 * SIDE as i32);
    for rank in 0..nb.own().cells.len() {
        let packed = nb.own().cells[rank];
        let at = place_of(cell_number(packed)).map(|c| c as i32);
        for axis in (0..3).filter(|axis| is_faced[*axis] && at[*axis] == 0) {
            let mut below = at;
            below[axis] -= 1;
            for &pair in segments_on(packed, 2 * axis).pairs() {
                let edges = edges_of(pair, at);
                let (here, there) = (nb.cell(at)?, nb.cell(below)?);
                let edge = edge_in_cell(edges[0].axis, edges[0].lower, below);
                let arc =
                    Arc { axis, lower: nb.vertex(there, edge), upper: nb.vertex(here, pair[0]) };
                if arc.is_inner() || arc.passes(nb.cell_units()) {
                    continue;
                }
                let (owner, key) = arc.far_key();
                for end in edges.iter().filter(|edge| arc.ends_at(edge, at)) {
                    let units = nb.cell_units();
                    let crossing = nb.crossing(end.axis, end.lower)?.0;
                    let crossing = [0, 1, 2].map(|a| crossing[a] + low[a] * units);
                    let mut face = arc.minimal_face();
                    face.face = face.face.moved(low);
                    ends.push(End { owner, key, crossing, face });
                }
            }
        }
    }
    Ok(ends)
}
