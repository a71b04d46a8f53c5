//! What the patches of the grid are: they have the surface of the nearest crossing that has one.
//!
//! In:         the crossings of a brick. Out: the same, those of patches with a surface.
//! Invariant:  depends on the brick alone. Memory: 290 KiB.
//! Source:     a flood from all known crossings at once, along the edges of the grid.

use crate::contour::mdc::vertices::{EdgeCrossing, NO_SURFACE};
use crate::mesh::Surface;
use crate::octree::{LINES, edge_position};

/// Room for the flood over the corners of a brick.
#[derive(Default)]
pub struct PatchSurfaces {
    at_corner: Vec<u32>,
    queue: Vec<u32>,
}

impl PatchSurfaces {
    /// Gives the crossings without a surface that of the nearest; the first material where the
    /// brick has none.
    pub fn find(
        &mut self,
        edges: impl Iterator<Item = u32> + Clone,
        crossings: &mut [EdgeCrossing],
    ) {
        self.at_corner.clear();
        self.at_corner.resize(LINES * LINES * LINES, NO_SURFACE);
        self.queue.clear();
        for (edge, crossing) in edges.clone().zip(crossings.iter()) {
            if crossing.surface != NO_SURFACE {
                ends_of(edge).into_iter().for_each(|corner| self.reach(corner, crossing.surface));
            }
        }
        self.flood();
        for (edge, crossing) in edges.zip(crossings) {
            if crossing.surface == NO_SURFACE {
                let known = ends_of(edge).map(|corner| self.at_corner[corner]);
                let of = known.into_iter().find(|surface| *surface != NO_SURFACE).unwrap_or(0);
                crossing.surface = Surface::new(Surface::from_bits(of).material(), true).bits();
            }
        }
    }

    fn reach(&mut self, corner: usize, surface: u32) {
        if self.at_corner[corner] == NO_SURFACE {
            self.at_corner[corner] = surface;
            self.queue.push(corner as u32);
        }
    }

    fn flood(&mut self) {
        let mut next = 0;
        while next < self.queue.len() {
            let corner = self.queue[next] as usize;
            next += 1;
            let surface = self.at_corner[corner];
            let at = [corner % LINES, corner / LINES % LINES, corner / (LINES * LINES)];
            for (axis, step) in [1, LINES, LINES * LINES].into_iter().enumerate() {
                if at[axis] > 0 {
                    self.reach(corner - step, surface);
                }
                if at[axis] + 1 < LINES {
                    self.reach(corner + step, surface);
                }
            }
        }
    }
}

/// The corners at both ends of an edge.
fn ends_of(edge: u32) -> [usize; 2] {
    let (axis, at) = edge_position(edge);
    let lower = (at[2] * LINES + at[1]) * LINES + at[0];
    [lower, lower + [1, LINES, LINES * LINES][axis]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_has_the_surface_of_the_nearest_crossing() {
        let edge = |x: u32| x;
        let (one, other) = (Surface::new(1, false).bits(), Surface::new(7, false).bits());
        let crossing = |surface| EdgeCrossing { offset: 0.5, normal: 0, surface };
        let edges = [edge(0), edge(3), edge(20), edge(30)];
        let mut crossings = [one, NO_SURFACE, NO_SURFACE, other].map(crossing);
        PatchSurfaces::default().find(edges.into_iter(), &mut crossings);
        let found = crossings.map(|crossing| Surface::from_bits(crossing.surface));
        assert_eq!(found.map(Surface::material), [1, 1, 7, 7]);
        assert_eq!(found.map(Surface::is_patch), [false, true, true, false]);
    }
}
