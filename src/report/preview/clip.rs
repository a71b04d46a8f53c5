//! Cuts triangles that reach far outside of the view down to its surroundings.
//!
//! In:         projected corners of any finite size.
//! Out:        up to seven triangles inside the guard box, and which edges are edges of the mesh.
//! Invariant:  triangles inside the guard box pass unchanged, bit by bit.
//! Memory:     one polygon of at most nine corners.
//! Source:     I. Sutherland and G. Hodgman, Reentrant Polygon Clipping, 1974.

use crate::report::preview::camera::Projected;

/// Edge functions of coordinates below this are good to 1e-9 samples; above, they are cut first.
const GUARD: f64 = 1e6;

/// A triangle ready to be drawn; `mesh_edges[i]` tells of the edge from corner `i` to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// The corners, in the order of the mesh.
    pub(crate) corners: [Projected; 3],
    /// Whether an edge belongs to the mesh and was not made by cutting.
    pub(crate) mesh_edges: [bool; 3],
}

/// Hands the triangle, or its pieces inside the guard box, to `draw`.
pub(crate) fn clip(corners: [Projected; 3], mut draw: impl FnMut(&Piece)) {
    let inside = |corner: &Projected| (0..6).all(|plane| distance(corner, plane) >= 0.0);
    if corners.iter().all(inside) {
        draw(&Piece { corners, mesh_edges: [true; 3] });
        return;
    }
    let mut polygon: Vec<(Projected, bool)> = corners.iter().map(|&at| (at, true)).collect();
    for plane in 0..6 {
        polygon = cut(&polygon, plane);
    }
    let last = polygon.len().saturating_sub(1);
    for i in 1..last {
        let corners = [polygon[0].0, polygon[i].0, polygon[i + 1].0];
        let mesh_edges = [i == 1 && polygon[0].1, polygon[i].1, i + 1 == last && polygon[last].1];
        draw(&Piece { corners, mesh_edges });
    }
}

/// The signed distance to one of the six planes of the guard box, positive inside.
fn distance(at: &Projected, plane: usize) -> f64 {
    let coordinate = [at.x, at.y, at.depth][plane / 2];
    if plane.is_multiple_of(2) { GUARD - coordinate } else { GUARD + coordinate }
}

fn cut(polygon: &[(Projected, bool)], plane: usize) -> Vec<(Projected, bool)> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &(from, mesh_edge)) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()].0;
        let (d_from, d_to) = (distance(&from, plane), distance(&to, plane));
        if d_from >= 0.0 {
            kept.push((from, mesh_edge));
        }
        if (d_from >= 0.0) != (d_to >= 0.0) {
            // Halves, because the distances of two opposite outliers may overflow when added.
            let t = (0.5 * d_from) / (0.5 * d_from - 0.5 * d_to);
            let entering = d_from < 0.0;
            kept.push((between(&from, &to, t), entering && mesh_edge));
        }
    }
    kept
}

fn between(from: &Projected, to: &Projected, t: f64) -> Projected {
    let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
    Projected { x: mix(from.x, to.x), y: mix(from.y, to.y), depth: mix(from.depth, to.depth) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(corners: [[f64; 2]; 3]) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let corners = corners.map(|[x, y]| Projected { x, y, depth: 0.5 });
        clip(corners, |piece| pieces.push(*piece));
        pieces
    }

    fn area(piece: &Piece) -> f64 {
        let [a, b, c] = piece.corners;
        0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x))
    }

    #[test]
    fn a_triangle_inside_passes_unchanged() {
        let inside = pieces([[0.1, 0.2], [30.0, 7.0], [5.0, 900.0]]);
        assert_eq!(inside.len(), 1);
        assert_eq!(inside[0].corners[1], Projected { x: 30.0, y: 7.0, depth: 0.5 });
        assert_eq!(inside[0].mesh_edges, [true; 3]);
    }

    #[test]
    fn a_triangle_around_the_guard_box_becomes_the_box() {
        let all = pieces([[-1e9, -1e9], [1e9, -1e9], [0.0, 1e9]]);
        let sum: f64 = all.iter().map(area).sum();
        assert!((sum - 4.0 * GUARD * GUARD).abs() < 1e-3 * sum, "{sum}");
        assert!(all.iter().all(|piece| piece.mesh_edges == [false; 3]));
    }

    #[test]
    fn a_triangle_beside_the_guard_box_vanishes() {
        assert!(pieces([[2e6, 0.0], [3e6, 0.0], [2e6, 5.0]]).is_empty());
    }

    #[test]
    fn the_edge_that_stays_is_still_an_edge_of_the_mesh() {
        let all = pieces([[0.0, 0.0], [1e9, 0.0], [1e9, 1.0]]);
        assert!(all.iter().any(|piece| piece.mesh_edges.contains(&true)));
        assert!(all.iter().any(|piece| piece.mesh_edges.contains(&false)));
    }
}
