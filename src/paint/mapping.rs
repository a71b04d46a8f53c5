//! What a source triangle has at a place near it.
//!
//! Texture coordinates go on beyond the triangle as they run within, by a cell at most: the places
//! lie beside triangles that are smaller than cells. Colours end where the triangle ends.
//!
//! Units: model units.

use glam::DVec3;

use crate::geom::closest_on_triangle;
use crate::octree::AttributeRecord;

/// Weights of corners stay above its negative: so far a sliver tells what is beside it.
const LEAST_WEIGHT: f64 = -16.0;

/// What a triangle has at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapped {
    /// From the place to the triangle, squared.
    pub distance_squared: f64,
    /// The texture coordinate.
    pub uv: [f32; 2],
    /// RGBA.
    pub colour: [u8; 4],
}

/// What `record` has at `place`; texture coordinates go on by `reach`.
pub fn map_at(place: DVec3, record: &AttributeRecord, reach: f64) -> Mapped {
    let corners = record.corners.map(DVec3::from);
    let closest = closest_on_triangle(place, corners);
    let within = weights(closest, corners);
    let beyond = weights_beyond(place, closest, corners, within, reach);
    let uv = [0, 1].map(|axis| {
        let sum: f64 = (0..3).map(|i| beyond[i] * f64::from(record.uvs[i][axis])).sum();
        sum as f32
    });
    let colour = [0, 1, 2, 3].map(|channel| {
        let sum: f64 = (0..3).map(|i| within[i] * f64::from(record.colours[i][channel])).sum();
        sum.round().clamp(0.0, 255.0) as u8
    });
    Mapped { distance_squared: place.distance_squared(closest), uv, colour }
}

/// The weights of the corners at a point of the triangle's plane.
fn weights(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    if square > 0.0 && square.is_finite() {
        let one = normal.dot((b - point).cross(c - point)) / square;
        let other = normal.dot((c - point).cross(a - point)) / square;
        return [one, other, 1.0 - one - other];
    }
    // Without area: along its longest side.
    let sides = [(0, 1, b - a), (1, 2, c - b), (2, 0, a - c)];
    let longest = sides.into_iter().reduce(|one, other| {
        if other.2.length_squared() > one.2.length_squared() { other } else { one }
    });
    let mut weights = [1.0, 0.0, 0.0];
    if let Some((from, to, along)) = longest
        && along.length_squared() > 0.0
    {
        let share = (point - [a, b, c][from]).dot(along) / along.length_squared();
        let share = share.clamp(0.0, 1.0);
        weights = [0.0; 3];
        (weights[from], weights[to]) = (1.0 - share, share);
    }
    weights
}

/// The weights where the place lies over the triangle's plane, or as far toward it as they go.
fn weights_beyond(
    place: DVec3,
    closest: DVec3,
    corners: [DVec3; 3],
    within: [f64; 3],
    reach: f64,
) -> [f64; 3] {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    if !(square > 0.0 && square.is_finite()) {
        return within;
    }
    let over = place - normal * (normal.dot(place - a) / square);
    let way = over - closest;
    let share = (reach / way.length().max(f64::MIN_POSITIVE)).min(1.0);
    let beyond = weights(closest + way * share, corners);
    let mut share = 1.0_f64;
    for (from, to) in within.into_iter().zip(beyond) {
        if to < LEAST_WEIGHT {
            share = share.min((from - LEAST_WEIGHT) / (from - to));
        }
    }
    std::array::from_fn(|i| within[i] + (beyond[i] - within[i]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(corners: [[f64; 3]; 3]) -> AttributeRecord {
        let uvs = corners.map(|[x, y, _]| [2.0 * x as f32 + 0.5, y as f32 - 1.0]);
        let colours = corners.map(|[x, _, _]| [(x * 255.0) as u8, 0, 0, 255]);
        AttributeRecord { corners, uvs, colours, unused: 0 }
    }

    #[test]
    fn coordinates_go_on_by_the_reach_and_colours_do_not() {
        let record = record([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        for (place, at) in [
            ([0.25, 0.25, 3.0], [0.25, 0.25]),
            ([-0.5, 0.25, 0.0], [-0.5, 0.25]),
            ([-7.0, 0.25, 0.0], [-1.0, 0.25]),
            ([0.25, -0.75, 9.0], [0.25, -0.75]),
        ] {
            let mapped = map_at(DVec3::from(place), &record, 1.0);
            let expected = [2.0 * at[0] + 0.5, at[1] - 1.0];
            let off = [0, 1].map(|i| (f64::from(mapped.uv[i]) - expected[i]).abs());
            assert!(off.iter().all(|off| *off < 1e-6), "{place:?}: {:?}", mapped.uv);
            let red = (at[0].clamp(0.0, 1.0) * 255.0_f64).round() as u8;
            assert!(mapped.colour[0].abs_diff(red) <= 1 && mapped.colour[3] == 255);
        }
    }

    #[test]
    fn triangles_without_area_and_slivers_do_not_run_away() {
        let line = record([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]);
        let mapped = map_at(DVec3::new(0.25, 4.0, 0.0), &line, 1.0);
        assert_eq!(mapped.uv, [1.0, -1.0]);
        let point = record([[0.5, 0.0, 0.0]; 3]);
        assert_eq!(map_at(DVec3::ONE, &point, 1.0).uv, [1.5, -1.0]);
        let mut sliver = record([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1e-9, 0.0]]);
        sliver.uvs[2] = [0.0, 1.0];
        let uv = map_at(DVec3::new(0.5, 1.0, 0.0), &sliver, 1.0).uv;
        assert!(uv.iter().all(|x| x.abs() < 100.0), "{uv:?}");
    }
}
