//! Which boundary edges follow each other at a vertex: those of one fan of triangles.
//!
//! In:         the wedges of one vertex at a time: the triangles around it.
//! Invariant:  fans are joined over edges with any number of triangles. At a vertex with more than
//!             [`MOST_WEDGES`] triangles all boundary edges follow each other.

use crate::store::Parts;

/// The number of a side that is no boundary edge.
pub(crate) const NO_RIM: u32 = u32::MAX;
/// Wedges of one vertex that are told apart by fans.
pub(crate) const MOST_WEDGES: usize = 1 << 16;

/// A triangle at the vertex: the next and the previous vertex in it, and the rims towards them.
#[derive(Clone, Copy)]
pub(crate) struct Wedge {
    pub(crate) neighbours: [u32; 2],
    /// Numbers of boundary edges, or [`NO_RIM`].
    pub(crate) rims: [u32; 2],
}

/// Pairs of rims that belong to one fan, such that all of a fan hang together.
pub(crate) fn pairs(wedges: &[Wedge]) -> Vec<[u32; 2]> {
    let mut neighbours: Vec<u32> = wedges.iter().flat_map(|wedge| wedge.neighbours).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    let place = |id: u32| neighbours.binary_search(&id).expect("all neighbours are listed");
    let mut parts = Parts::new(neighbours.len());
    for wedge in wedges {
        let [a, b] = wedge.neighbours.map(place);
        parts.unite(a, b);
    }
    let mut first = vec![NO_RIM; neighbours.len()];
    let mut found = Vec::new();
    for wedge in wedges {
        for (&rim, id) in wedge.rims.iter().zip(wedge.neighbours) {
            if rim == NO_RIM {
                continue;
            }
            let fan = parts.first(place(id));
            match first[fan] {
                NO_RIM => first[fan] = rim,
                other => found.push([other, rim]),
            }
        }
    }
    found
}
