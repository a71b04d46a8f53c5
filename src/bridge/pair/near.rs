//! Finds the points near a place: a grid of cubes, sorted.

use glam::DVec3;

type Cube = [i64; 3];

/// Points by the cube that they are in.
pub struct Near {
    side: f64,
    sorted: Vec<(Cube, u32)>,
}

impl Near {
    /// Cubes of the given side.
    pub fn new(points: &[DVec3], side: f64) -> Self {
        let cube = |point: &DVec3| point.to_array().map(|x| (x / side).floor() as i64);
        let mut sorted: Vec<_> =
            points.iter().zip(0..).map(|(point, number)| (cube(point), number)).collect();
        sorted.sort_unstable();
        Self { side, sorted }
    }

    /// Visits all points within a cube's side, and some others, in one order.
    pub fn visit(&self, place: DVec3, mut visit: impl FnMut(u32)) {
        let [x, y, z] = place.to_array().map(|x| (x / self.side).floor() as i64);
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            // Three cubes in a row follow each other.
            let row = [x.saturating_add(i), y.saturating_add(j)];
            let [from, to] = [z.saturating_sub(1), z.saturating_add(1)];
            let first = self.sorted.partition_point(|(cube, _)| *cube < [row[0], row[1], from]);
            for (cube, number) in &self.sorted[first..] {
                if *cube > [row[0], row[1], to] {
                    break;
                }
                visit(*number);
            }
        }
    }
}
