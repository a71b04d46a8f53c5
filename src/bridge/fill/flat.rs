//! Triangles between the points of a loop in a plane, or of one that is all but a line.

use glam::DVec3;

use crate::geom::EarClipper;

/// Cuts a loop that lies in a plane.
pub fn cut_flat(points: &[DVec3]) -> Vec<[u32; 3]> {
    let corners: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
    let mut triangles = Vec::new();
    EarClipper::default().cut(&corners, &mut triangles);
    triangles
}

/// Cuts a loop that is long and narrow: goes along both of its sides from one end to the other.
pub fn zip(points: &[DVec3], ends: [usize; 2]) -> Vec<[u32; 3]> {
    let count = points.len();
    let axis = points[ends[1]] - points[ends[0]];
    let along = |corner: usize| (points[corner] - points[ends[0]]).dot(axis);
    let (mut left, mut right) = (ends[0], ends[0]);
    let mut triangles = Vec::with_capacity(count - 2);
    while left != ends[1] || right != ends[1] {
        let (after, before) = ((left + 1) % count, (right + count - 1) % count);
        let go_left = right == ends[1] || left != ends[1] && along(after) <= along(before);
        let ([from, to], other) =
            if go_left { ([left, after], right) } else { ([before, right], left) };
        if from != other && to != other {
            triangles.push([from, to, other].map(|corner| corner as u32));
        }
        if go_left {
            left = after;
        } else {
            right = before;
        }
    }
    triangles
}
