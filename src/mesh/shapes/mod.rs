//! Parametric shapes, closed and outward, for tests, benches and examples.
//!
//! Out:        triangles in model units; equal corners are equal to the last bit.
//! Invariant:  the same arguments give the same triangles.
//! Memory:     all triangles of the shape.

mod change;
mod listed;
mod random;
mod solids;

pub use change::{bounds, crumple, rotation, shuffle, transform};
pub use listed::ListedTriangles;
pub use random::Random;
pub use solids::{cuboid, gear, sphere, tetrahedron, torus};

/// The three corners of a triangle, model units.
pub type Corners = [[f64; 3]; 3];

/// The signed volume that closed triangles enclose, model units cubed.
#[must_use]
pub fn volume(triangles: &[Corners]) -> f64 {
    let origin = triangles.first().map_or(glam::DVec3::ZERO, |corners| corners[0].into());
    let six: f64 = triangles
        .iter()
        .map(|corners| {
            let [p, q, r] = corners.map(|corner| glam::DVec3::from(corner) - origin);
            p.dot(q.cross(r))
        })
        .sum();
    six / 6.0
}

/// The area of triangles, model units squared.
#[must_use]
pub fn area(triangles: &[Corners]) -> f64 {
    let twice: f64 = triangles
        .iter()
        .map(|corners| {
            let [p, q, r] = corners.map(glam::DVec3::from);
            (q - p).cross(r - p).length()
        })
        .sum();
    twice / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn is_closed(triangles: &[Corners]) -> bool {
        let mut edges: HashMap<[[u64; 3]; 2], i32> = HashMap::new();
        for corners in triangles {
            let keys = corners.map(|c| c.map(f64::to_bits));
            for i in 0..3 {
                let (a, b) = (keys[i], keys[(i + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        edges.values().all(|&balance| balance == 0)
    }

    #[test]
    fn solids_are_closed_and_have_their_volume() {
        let pi = std::f64::consts::PI;
        let shapes = [
            (sphere([1.0, 2.0, 3.0], 2.0, 40), 4.0 / 3.0 * pi * 8.0),
            (torus(2.0, 0.5, 96, 48), 2.0 * pi * pi * 2.0 * 0.25),
            (cuboid([-1.0, 0.0, 2.0], [1.0, 3.0, 2.5]), 3.0),
            (tetrahedron([0.0; 3], 1.0), 1.0 / 6.0),
        ];
        for (shape, expected) in shapes {
            assert!(is_closed(&shape));
            let found = volume(&shape);
            assert!((found / expected - 1.0).abs() < 0.01, "{found} for {expected}");
        }
        let gear = gear(9, 0.7, 1.0, 0.4);
        assert!(is_closed(&gear) && volume(&gear) > 0.4);
    }

    #[test]
    fn crumpled_and_shuffled_shapes_stay_closed() {
        let mut random = Random::new(5);
        let mut shape = crumple(&sphere([0.0; 3], 1.0, 12), 0.3, &mut random);
        assert!(is_closed(&shape));
        let before = volume(&shape);
        shuffle(&mut shape, &mut random);
        assert!(is_closed(&shape));
        assert!((volume(&shape) - before).abs() < 1e-9);
        let turned = transform(&shape, rotation(&mut random), glam::DVec3::splat(7.0));
        assert!(is_closed(&turned));
        assert!((volume(&turned) - before).abs() < 1e-9);
    }
}
