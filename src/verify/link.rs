//! Judges one vertex by its records: the next and the previous vertex of each of its triangles.
//!
//! Invariant:  a vertex is good iff its records form exactly one cycle in which no neighbour occurs
//!             twice. An edge is counted at its lower end, so once.

use crate::defect::{DefectKind, Marks, Smallest};
use crate::store::{Parts, Sequence, StoreError};

/// Next and previous vertex of a triangle, seen from its corner at the judged vertex.
pub(crate) type Wedge = [u32; 2];

/// Above this number of wedges, sorting is faster than comparing all pairs.
pub(crate) const FEW_WEDGES: usize = 24;

/// Edge counts and vertex counts.
pub(crate) struct Judgement<'m> {
    /// Vertices with several fans are marked.
    marks: Option<&'m Marks>,
    pub(crate) used_vertices: u64,
    pub(crate) edges: u64,
    pub(crate) boundary_edges: u64,
    pub(crate) nonmanifold_edges: u64,
    pub(crate) inconsistent_edges: u64,
    pub(crate) nonmanifold_vertices: u64,
    pub(crate) boundary_places: Smallest<[u32; 2], ()>,
    pub(crate) nonmanifold_places: Smallest<[u32; 2], u64>,
    pub(crate) inconsistent_places: Smallest<[u32; 2], ()>,
    pub(crate) vertex_places: Smallest<u32, u64>,
    /// Vertices with an edge that is not used equally often in both directions.
    pub(crate) unbalanced: Sequence<u32>,
}

/// One end of a wedge: the neighbour times two, plus one if the edge runs towards the vertex.
pub(crate) type Spoke = u64;

/// The two spokes of a wedge.
#[inline]
pub(crate) fn spokes([next, previous]: Wedge) -> [Spoke; 2] {
    [u64::from(next) * 2, u64::from(previous) * 2 + 1]
}

impl<'m> Judgement<'m> {
    pub(crate) fn new(unbalanced: Sequence<u32>, marks: Option<&'m Marks>) -> Self {
        Self {
            marks,
            used_vertices: 0,
            edges: 0,
            boundary_edges: 0,
            nonmanifold_edges: 0,
            inconsistent_edges: 0,
            nonmanifold_vertices: 0,
            boundary_places: Smallest::new(),
            nonmanifold_places: Smallest::new(),
            inconsistent_places: Smallest::new(),
            vertex_places: Smallest::new(),
            unbalanced,
        }
    }

    /// Judges a vertex with all its wedges, in any order.
    #[inline]
    pub(crate) fn judge(&mut self, vertex: u32, wedges: &mut [Wedge]) -> Result<(), StoreError> {
        if wedges.is_empty() {
            return Ok(());
        }
        if wedges.len() <= FEW_WEDGES && is_one_cycle(wedges) {
            self.used_vertices += 1;
            self.edges += wedges.iter().filter(|wedge| wedge[0] > vertex).count() as u64;
            return Ok(());
        }
        self.classify(vertex, wedges)
    }

    /// Judges a vertex edge by edge, then fan by fan.
    fn classify(&mut self, vertex: u32, wedges: &[Wedge]) -> Result<(), StoreError> {
        let mut ends: Vec<Spoke> = wedges.iter().flat_map(|&wedge| spokes(wedge)).collect();
        ends.sort_unstable();
        let mut neighbours: Vec<u32> = Vec::new();
        let mut balanced = true;
        for edge in ends.chunk_by(|a, b| a / 2 == b / 2) {
            let neighbour = (edge[0] / 2) as u32;
            let inward = edge.iter().filter(|&&spoke| spoke % 2 == 1).count() as u64;
            balanced &= self.edge([vertex, neighbour], edge.len() as u64 - inward, inward);
            neighbours.push(neighbour);
        }
        let fans = count_fans(wedges, &neighbours);
        self.vertex(vertex, fans, balanced)
    }

    /// Enters an edge seen from its first end; answers whether it is used alike both ways.
    pub(crate) fn edge(&mut self, edge: [u32; 2], outward: u64, inward: u64) -> bool {
        if edge[0] < edge[1] {
            self.edges += 1;
            match outward + inward {
                1 => {
                    self.boundary_edges += 1;
                    self.boundary_places.offer(edge, ());
                }
                2 if outward != 1 => {
                    self.inconsistent_edges += 1;
                    self.inconsistent_places.offer(edge, ());
                }
                2 => {}
                triangles => {
                    self.nonmanifold_edges += 1;
                    self.nonmanifold_places.offer(edge, triangles);
                }
            }
        }
        outward == inward
    }

    /// Enters a vertex whose edges were entered.
    pub(crate) fn vertex(
        &mut self,
        vertex: u32,
        fans: u64,
        balanced: bool,
    ) -> Result<(), StoreError> {
        self.used_vertices += 1;
        if fans > 1 {
            self.nonmanifold_vertices += 1;
            self.vertex_places.offer(vertex, fans);
            if let Some(marks) = self.marks {
                marks.vertex(DefectKind::NonmanifoldVertex, vertex)?;
            }
        }
        if balanced { Ok(()) } else { self.unbalanced.push(vertex) }
    }
}

/// Whether the wedges close one round with every neighbour once.
#[inline]
pub(crate) fn is_one_cycle(wedges: &mut [Wedge]) -> bool {
    let count = wedges.len();
    for at in 0..count - 1 {
        let wanted = wedges[at][1];
        let Some(step) = wedges[at + 1..].iter().position(|wedge| wedge[0] == wanted) else {
            return false;
        };
        wedges.swap(at + 1, at + 1 + step);
    }
    // With all next vertices different, a closed chain of all wedges cannot be two.
    let distinct = (1..count).all(|at| wedges[..at].iter().all(|w| w[0] != wedges[at][0]));
    distinct && wedges[count - 1][1] == wedges[0][0]
}

/// The same for many wedges.
pub(crate) fn is_one_long_cycle(wedges: &mut [Wedge]) -> bool {
    wedges.sort_unstable();
    if wedges.windows(2).any(|pair| pair[0][0] == pair[1][0]) {
        return false;
    }
    let first = wedges[0][0];
    let mut at = wedges[0];
    for _ in 1..wedges.len() {
        let Ok(next) = wedges.binary_search_by_key(&at[1], |wedge| wedge[0]) else { return false };
        at = wedges[next];
        if at[0] == first {
            return false;
        }
    }
    at[1] == first
}

/// Counts the fans of wedges that hang together over neighbours (ascending).
fn count_fans(wedges: &[Wedge], neighbours: &[u32]) -> u64 {
    let place = |id: u32| neighbours.binary_search(&id).expect("both ends of a wedge are listed");
    let mut parts = Parts::new(neighbours.len());
    let joined = wedges.iter().filter(|[a, b]| parts.unite(place(*a), place(*b))).count();
    (neighbours.len() - joined) as u64
}
