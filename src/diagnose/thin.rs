//! Walls that are thin: from the middle of every triangle a look behind it, for one that faces the
//! other way.
//!
//! In:         the triangles with an area.
//! Invariant:  a triangle counts if, straight behind its middle, closer than the tolerance, lies a
//!             triangle that shares no corner with it and faces away from it by 120 degrees at
//!             least. So the slim end of a wedge is no wall, nor is a gap between two parts.
//! Limits:     it trusts that triangles face outward; it looks from one point of each triangle; two
//!             sides in one place are no wall but an overlap.
//! Units:      model units.
//! Memory:     three quarters of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::defect::{Defect, DefectKind, Marks, Smallest, ThinWall};
use crate::diagnose::Means;
use crate::diagnose::finding::{Finding, Measure};
use crate::diagnose::model::{Corners, Model};
use crate::diagnose::near::Near;
use crate::store::{Record, Sorter, StoreError};

/// The cosine between the normals of the two sides of a wall, at most.
const OPPOSITE: f64 = -0.5;

/// Something close behind a triangle.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Behind {
    triangle: u64,
    /// Bits of the distance, which are in its order.
    distance: u64,
    middle: [f64; 3],
}

impl Record for Behind {
    type Key = (u64, u64);
    fn key(&self) -> Self::Key {
        (self.triangle, self.distance)
    }
}

/// Middle and unit normal; `None` without an area.
fn middle_and_normal(corners: &Corners) -> Option<(DVec3, DVec3)> {
    let [a, b, c] = corners.map(DVec3::from_array);
    let normal = (b - a).cross(c - a).try_normalize()?;
    // Thirds first, so that nothing overflows.
    let middle = a / 3.0 + b / 3.0 + c / 3.0;
    middle.is_finite().then_some((middle, normal))
}

/// How far straight on a ray meets a triangle that faces along it.
fn distance_to(from: DVec3, way: DVec3, corners: &Corners) -> Option<f64> {
    let [a, b, c] = corners.map(DVec3::from_array);
    let normal = (b - a).cross(c - a).try_normalize()?;
    let slope = normal.dot(way);
    if slope < -OPPOSITE {
        return None;
    }
    let distance = normal.dot(a - from) / slope;
    let point = from + way * distance;
    let inside = [(a, b), (b, c), (c, a)];
    let is_inside = inside.iter().all(|&(p, q)| (q - p).cross(point - p).dot(normal) >= 0.0);
    is_inside.then_some(distance)
}

/// Finds all of them.
pub(crate) fn find(
    model: &Model,
    thin: f64,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let kind = DefectKind::ThinWall;
    let Some(bounds) = model.facts().bounds else { return Ok(Finding::none(kind)) };
    let mut near = Near::new(bounds, (thin, 0.0), means);
    model.each(means, |triangle| match triangle.is_whole() {
        true => near.add(triangle.number as u32, triangle.vertices, *triangle.corners),
        false => Ok(()),
    })?;
    model.each(means, |triangle| {
        let frame = middle_and_normal(triangle.corners).filter(|_| triangle.is_whole());
        let Some((middle, normal)) = frame else { return Ok(()) };
        let end = middle - normal * thin;
        let points = [middle, end, end].map(|p| p.to_array());
        near.probe(triangle.number as u32, triangle.vertices, points)
    })?;
    let mut found = Sorter::new(means.scratch, means.share_bytes / 4);
    near.join(|probe, thing| {
        let [from, to, _] = probe.points.map(DVec3::from_array);
        if probe.vertices.iter().any(|vertex| thing.vertices.contains(vertex)) {
            return Ok(());
        }
        let way = (to - from) / thin;
        match distance_to(from, way, &thing.points) {
            Some(distance) if distance > 0.0 && distance < thin => found.push(Behind {
                triangle: probe.number.into(),
                distance: distance.to_bits(),
                middle: from.to_array(),
            }),
            _ => Ok(()),
        }
    })?;
    conclude(found, marks)
}

/// Counts the triangles with something behind them, and lists the thinnest places.
fn conclude(found: Sorter<Behind>, marks: Option<&Marks>) -> Result<Finding, StoreError> {
    let mut sorted = found.finish()?;
    let (mut count, mut least) = (0, f64::INFINITY);
    let mut places = Smallest::new();
    let mut last = None;
    while let Some(Behind { triangle, distance, middle }) = sorted.next()? {
        if last != Some(triangle) {
            last = Some(triangle);
            count += 1;
            if let Some(marks) = marks {
                marks.triangles(DefectKind::ThinWall, &[triangle as u32])?;
            }
            let thickness = f64::from_bits(distance);
            least = least.min(thickness);
            let wall = ThinWall { triangle, thickness, position: middle };
            places.offer((distance, triangle), Defect::ThinWall(wall));
        }
    }
    let size = if count > 0 { (Measure::LeastLength, least) } else { (Measure::None, 0.0) };
    let places = places.iter().map(|&(_, place)| place).collect();
    Ok(Finding::sized(DefectKind::ThinWall, count, size, places))
}
