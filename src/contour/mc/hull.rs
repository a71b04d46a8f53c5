//! Cuts a boundary cycle into triangles: the side of its convex hull that faces the inside.
//!
//! Every crossing lies strictly inside of an edge of the cell, so it is a corner of the hull, and
//! no three lie on a line: no triangle is degenerate. The sides of a cycle lie on the hull, so they
//! part its surface into two disks, each free of intersections. The one that faces the inside has
//! no triangle and no diagonal in a face of the cell: where one cycle crosses an ambiguous face
//! twice, what lies between is outside. So cells meet in the sides of their cycles and nowhere
//! else. Within a cell the sides of a cycle leave a convex part of every face outside, so this disk
//! is also the wall of the hull of all that lies outside of the cycle, and a cycle that lies there
//! cannot reach it. Two cycles that do not lie outside of each other cut off two opposite corners,
//! each alone outside, in two triangles far apart.
//!
//! Units: lattice units from the cell's min corner, at most 2^24; all of it exact.

/// Calls `emit` with the numbers of three points for each triangle, in the direction of the cycle.
pub fn cut(points: &[[i64; 3]], emit: &mut impl FnMut([usize; 3])) {
    span(points, 0, points.len() - 1, emit);
}

/// Covers the part of the cycle from `first` to `last` up to the diagonal between them.
fn span(points: &[[i64; 3]], first: usize, last: usize, emit: &mut impl FnMut([usize; 3])) {
    if last - first < 2 {
        return;
    }
    // Where several lie in one plane: the one that makes the shortest sides.
    let apex = (first + 1..last)
        .filter(|&apex| is_facet(points, [first, apex, last]))
        .min_by_key(|&apex| {
            let sides = [first, last].map(|end| square_length(points[apex], points[end]));
            sides[0].max(sides[1])
        })
        .expect("crossings strictly inside of their edges are corners of their hull");
    emit([first, apex, last]);
    span(points, first, apex, emit);
    span(points, apex, last, emit);
}

/// Whether all points lie on the outer side of the triangle, or in its plane.
fn is_facet(points: &[[i64; 3]], triangle: [usize; 3]) -> bool {
    if points.len() == 3 {
        return true;
    }
    let [p, q, r] = triangle.map(|i| points[i]);
    let (a, b) = (difference(q, p), difference(r, p));
    let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    points.iter().all(|&point| {
        let to = difference(point, p);
        (0..3).map(|i| i128::from(normal[i]) * i128::from(to[i])).sum::<i128>() >= 0
    })
}

fn difference(p: [i64; 3], q: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|a| p[a] - q[a])
}

fn square_length(p: [i64; 3], q: [i64; 3]) -> i64 {
    difference(p, q).iter().map(|d| d * d).sum()
}

#[cfg(test)]
mod tests;
