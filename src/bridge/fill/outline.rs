//! Measures of a loop: its plane, how far it leaves it, how long and how wide it is.

use glam::DVec3;

/// The sides of a rim whose triangles turn away from the loop's plane.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tilt {
    /// Mean cosine of the angle to the loop's plane, by length of edge; 1 if nothing is known.
    pub mean: f64,
    /// Share of the rim whose triangles lean to one side, by about the same angle.
    pub even: f64,
}

/// What a loop looks like from far away.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    pub centre: DVec3,
    /// Of length one, or zero for a loop without area.
    pub normal: DVec3,
    /// From the point that is farthest from the centre to the one that is farthest from it.
    pub ends: [usize; 2],
    pub diameter: f64,
    /// Largest distance from the line between the ends.
    pub width: f64,
    /// Largest distance from the plane.
    pub deviation: f64,
    /// Cosine of the sharpest turn of the loop.
    pub sharpest_turn: f64,
    pub mean_edge: f64,
}

impl Outline {
    /// Measures a loop of three points or more.
    pub fn new(points: &[DVec3]) -> Self {
        let count = points.len();
        let centre = points.iter().sum::<DVec3>() / count as f64;
        let next = |i: usize| points[(i + 1) % count];
        let twice_area: DVec3 =
            (0..count).map(|i| (points[i] - centre).cross(next(i) - centre)).sum();
        let normal = twice_area.normalize_or_zero();
        let first = farthest(points, centre);
        let second = farthest(points, points[first]);
        let along = points[second] - points[first];
        let diameter = along.length();
        let axis = along.normalize_or_zero();
        let off_axis = |p: &DVec3| (*p - points[first]).reject_from_normalized(axis).length();
        let turn = |i: usize| {
            let before = points[i] - points[(i + count - 1) % count];
            before.normalize_or_zero().dot((next(i) - points[i]).normalize_or_zero())
        };
        Self {
            centre,
            normal,
            ends: [first, second],
            diameter,
            width: points.iter().map(off_axis).fold(0.0, f64::max),
            deviation: points.iter().map(|p| (*p - centre).dot(normal).abs()).fold(0.0, f64::max),
            sharpest_turn: (0..count).map(turn).fold(1.0, f64::min),
            mean_edge: (0..count).map(|i| points[i].distance(next(i))).sum::<f64>() / count as f64,
        }
    }

    /// How the triangles behind the rim lean; `normals` as of [`rim_normals`].
    pub fn tilt(&self, points: &[DVec3], normals: &[Option<DVec3>]) -> Tilt {
        let count = points.len();
        let mut sides = Vec::new();
        for i in 0..count {
            let edge = points[(i + 1) % count] - points[i];
            if let Some(normal) = normals[i] {
                // Away from the loop, along its triangle.
                let away = edge.cross(normal).dot(self.normal);
                sides.push((edge.length(), normal.dot(self.normal), away));
            }
        }
        let length: f64 = sides.iter().map(|side| side.0).sum();
        if length == 0.0 {
            return Tilt { mean: 1.0, even: 0.0 };
        }
        let mean = sides.iter().map(|side| side.0 * side.1).sum::<f64>() / length;
        let down: f64 = sides.iter().filter(|side| side.2 < 0.0).map(|side| side.0).sum();
        let leans_down = 2.0 * down > length;
        // At least half of the mean angle: 1 - cos grows with its square.
        let even = |side: &&(f64, f64, f64)| {
            (side.2 < 0.0) == leans_down && 4.0 * (1.0 - side.1) >= 1.0 - mean
        };
        Tilt { mean, even: sides.iter().filter(even).map(|side| side.0).sum::<f64>() / length }
    }
}

/// Normals of the rim's triangles: on the side from which the loop turns left in a flat surface.
pub fn rim_normals(points: &[DVec3], opposite: &[Option<DVec3>]) -> Vec<Option<DVec3>> {
    let count = points.len();
    let normal = |i: usize| {
        let edge = points[(i + 1) % count] - points[i];
        (opposite[i]? - points[i]).cross(edge).try_normalize()
    };
    (0..count).map(normal).collect()
}

fn farthest(points: &[DVec3], from: DVec3) -> usize {
    let mut best = (0, -1.0);
    for (i, point) in points.iter().enumerate() {
        let square = point.distance_squared(from);
        if square > best.1 {
            best = (i, square);
        }
    }
    best.0
}
