//! What the patches of the grid are: they have the surface of the nearest crossing that has one.
//!
//! In:         the crossings of a brick. Out: the same, those of patches with a surface.
//! Invariant:  depends on the brick alone. Memory: 290 KiB.
//! Source:     a flood from all known crossings at once, along the edges of the grid.

use crate::contour::mdc::workspace::{EdgeCrossing, NO_SURFACE};
use crate::mesh::Surface;
use crate::octree::{LINES, NO_SOURCE, edge_position};

/// No crossing yet.
const NONE: u32 = u32::MAX;

/// Room for the flood over the corners of a brick.
#[derive(Default)]
pub struct PatchSurfaces {
    /// The number of the nearest crossing that has a surface.
    at_corner: Vec<u32>,
    queue: Vec<u32>,
}

impl PatchSurfaces {
    /// Gives the crossings without a surface that of the nearest, and its source; the first material where the
    /// brick has none.
    pub fn find(
        &mut self,
        edges: impl Iterator<Item = u32> + Clone,
        crossings: &mut [EdgeCrossing],
    ) {
        self.at_corner.clear();
        self.at_corner.resize(LINES * LINES * LINES, NONE);
        self.queue.clear();
        for ((edge, crossing), number) in edges.clone().zip(crossings.iter()).zip(0..) {
            if crossing.surface != NO_SURFACE {
                ends_of(edge).into_iter().for_each(|corner| self.reach(corner, number));
            }
        }
        self.flood();
        for (edge, number) in edges.zip(0..) {
            if crossings[number].surface != NO_SURFACE {
                continue;
            }
            let known = ends_of(edge).map(|corner| self.at_corner[corner]);
            let of = known.into_iter().find(|nearest| *nearest != NONE);
            let (of, source) = match of.map(|nearest| crossings[nearest as usize]) {
                Some(nearest) => (Surface::from_bits(nearest.surface), nearest.source),
                None => (Surface::default(), NO_SOURCE),
            };
            crossings[number].surface = Surface::new(of.material(), true).bits();
            crossings[number].source = source;
        }
    }

    fn reach(&mut self, corner: usize, crossing: u32) {
        if self.at_corner[corner] == NONE {
            self.at_corner[corner] = crossing;
            self.queue.push(corner as u32);
        }
    }

    fn flood(&mut self) {
        let mut next = 0;
        while next < self.queue.len() {
            let corner = self.queue[next] as usize;
            next += 1;
            let crossing = self.at_corner[corner];
            let at = [corner % LINES, corner / LINES % LINES, corner / (LINES * LINES)];
            for (axis, step) in [1, LINES, LINES * LINES].into_iter().enumerate() {
                if at[axis] > 0 {
                    self.reach(corner - step, crossing);
                }
                if at[axis] + 1 < LINES {
                    self.reach(corner + step, crossing);
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
        let crossing = |surface| EdgeCrossing { offset: 0.5, normal: 0, surface, source: surface };
        let edges = [edge(0), edge(3), edge(20), edge(30)];
        let mut crossings = [one, NO_SURFACE, NO_SURFACE, other].map(crossing);
        PatchSurfaces::default().find(edges.into_iter(), &mut crossings);
        let found = crossings.map(|crossing| Surface::from_bits(crossing.surface));
        assert_eq!(found.map(Surface::material), [1, 1, 7, 7]);
        assert_eq!(found.map(Surface::is_patch), [false, true, true, false]);
        assert_eq!(crossings.map(|crossing| crossing.source), [one, one, other, other]);
    }
}
