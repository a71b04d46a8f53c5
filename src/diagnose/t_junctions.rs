//! Vertices of rims that lie on the inside of a boundary edge.
//!
//! In:         the boundary edges.
//! Invariant:  a vertex counts once, with the edge that is nearest. Distances are rounded: that one
//!             is within the tolerance, which is far above rounding.
//! Units:      model units.
//! Memory:     three quarters of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::defect::{Defect, DefectKind, Marks, Smallest, TJunction};
use crate::diagnose::Means;
use crate::diagnose::finding::Finding;
use crate::diagnose::loops::Rim;
use crate::diagnose::model::{BLOCK, Model, position_key};
use crate::diagnose::near::Near;
use crate::store::{Record, Sequence, Sorter, StoreError};

/// A vertex on an edge.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct OnEdge {
    vertex: [u64; 3],
    /// Bits of the distance, which are in its order.
    distance: u64,
    side: u32,
    /// Three times a triangle that has the vertex, and the corner that it is there.
    corner: u32,
    ends: [[f64; 3]; 2],
}

impl Record for OnEdge {
    type Key = ([u64; 3], u64, u32, u32);
    fn key(&self) -> Self::Key {
        (self.vertex, self.distance, self.side, self.corner)
    }
}

/// How far a point lies from the inside of an edge: at least `margin` from both ends.
fn distance_from_inside(point: [f64; 3], ends: [[f64; 3]; 2], margin: f64) -> Option<f64> {
    let [a, b] = ends.map(DVec3::from_array);
    let (along, towards) = (b - a, DVec3::from(point) - a);
    let length = along.length();
    let at = towards.dot(along) / length;
    if !(at > margin && at < length - margin) {
        return None;
    }
    Some(towards.cross(along).length() / length)
}

/// Finds all of them.
pub(crate) fn find(
    rims: &Sequence<Rim>,
    tolerance: f64,
    model: &Model,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let kind = DefectKind::TJunction;
    let Some(bounds) = model.facts().bounds.filter(|_| !rims.is_empty()) else {
        return Ok(Finding::none(kind));
    };
    let mut near = Near::new(bounds, (2.0 * tolerance, tolerance), means);
    rims.each_block(BLOCK, |block| {
        let mut rims = block.iter();
        rims.try_for_each(|rim| near.add(rim.side, [0; 3], [rim.ends[0], rim.ends[1], rim.ends[1]]))
    })?;
    rims.each_block(BLOCK, |block| {
        let mut ends = block.iter().flat_map(|rim| rim.ends.into_iter().zip(rim.corners()));
        ends.try_for_each(|(end, corner)| near.probe(corner, [0; 3], [end; 3]))
    })?;
    let mut found = Sorter::new(means.scratch, means.share_bytes / 4);
    near.join(|probe, edge| {
        let (point, ends) = (probe.points[0], [edge.points[0], edge.points[1]]);
        match distance_from_inside(point, ends, tolerance) {
            Some(distance) if distance <= tolerance => {
                let (distance, side, corner) = (distance.to_bits(), edge.number, probe.number);
                found.push(OnEdge { vertex: position_key(point), distance, side, corner, ends })
            }
            _ => Ok(()),
        }
    })?;
    let mut count = 0;
    let mut places = Smallest::new();
    let mut last = None;
    let mut sorted = found.finish()?;
    while let Some(next) = sorted.next()? {
        if last != Some(next.vertex) {
            last = Some(next.vertex);
            count += 1;
            if let Some(marks) = marks {
                marks.corner(kind, next.corner / 3, next.corner % 3)?;
            }
            let junction = TJunction {
                position: next.vertex.map(f64::from_bits),
                ends: next.ends,
                distance: f64::from_bits(next.distance),
                triangle: u64::from(next.side) / 3,
            };
            places.offer((next.side, next.vertex), Defect::TJunction(junction));
        }
    }
    Ok(Finding::counted(kind, count, places.iter().map(|&(_, place)| place).collect()))
}
