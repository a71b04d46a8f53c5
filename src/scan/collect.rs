//! Gathers the hits of a brick into one record per edge.
//!
//! Memory: at most [`CHUNK_HITS`] hits before they are reduced to three per edge, and the planes
//! that these refer to.

use crate::octree::{
    AXIS_EDGES, HitBrick, HitEdge, LINES, MAX_HITS, NO_PLANE, SIDE, SourcePlane, edge_position,
};

/// Hits that are held before they are reduced. Large enough for every brick of a sane model.
pub const CHUNK_HITS: usize = 1 << 17;

/// One hit of a triangle on an edge.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Edge number in the brick.
    pub edge: u32,
    /// Plane number in the brick.
    pub plane: u32,
    /// Whether the triangle faces up the edge's axis.
    pub up: bool,
}

/// A hit with its place on the edge.
#[derive(Clone, Copy, Debug)]
struct Placed {
    hit: Hit,
    offset: f64,
}

/// All hits of one edge so far.
#[derive(Clone, Copy, Debug)]
struct EdgeHits {
    edge: u32,
    class: u32,
    signed_sum: i16,
    kept: usize,
    hits: [Placed; MAX_HITS],
}

/// Gathers the hits of one brick after another.
pub struct Collector {
    cell_units: f64,
    planes: Vec<SourcePlane>,
    chunk: Vec<Hit>,
    rows: Vec<u32>,
    sorted: Vec<Placed>,
    edges: Vec<EdgeHits>,
    owned_hits: u64,
}

/// Rows of all three axes.
const ALL_ROWS: usize = 3 * AXIS_EDGES as usize / LINES;

impl Collector {
    pub fn new(cell_units: f64) -> Self {
        Self {
            cell_units,
            planes: Vec::new(),
            chunk: Vec::new(),
            rows: vec![0; ALL_ROWS + 1],
            sorted: Vec::new(),
            edges: Vec::new(),
            owned_hits: 0,
        }
    }

    /// Starts a brick.
    pub fn clear(&mut self) {
        self.planes.clear();
        self.chunk.clear();
        self.edges.clear();
        self.owned_hits = 0;
    }

    /// Adds a plane, in ascending order of source numbers; its number in the brick.
    pub fn add_plane(&mut self, plane: SourcePlane) -> u32 {
        if self.chunk.len() >= CHUNK_HITS {
            self.reduce();
        }
        self.planes.push(plane);
        self.planes.len() as u32 - 1
    }

    /// Adds a hit on a plane that was added last.
    pub fn add(&mut self, hit: Hit) {
        self.chunk.push(hit);
    }

    /// Hits so far on edges that leave a cell's min corner.
    pub fn owned_hits(&self) -> u64 {
        self.owned_hits
    }

    /// Ends the brick.
    pub fn finish(&mut self) -> HitBrick {
        self.reduce();
        let mut brick = HitBrick::default();
        brick.edges.reserve_exact(self.edges.len());
        for edge in &self.edges {
            brick.edges.push(HitEdge::new(edge.edge, edge.class, edge.kept, edge.signed_sum));
            brick.hits.extend(edge.hits[..edge.kept].iter().map(|placed| placed.hit.plane));
        }
        brick.planes.extend_from_slice(&self.planes);
        brick
    }

    /// Sorts the chunk, merges it into the edges and forgets planes that nobody keeps.
    fn reduce(&mut self) {
        self.sort_chunk();
        let old = std::mem::take(&mut self.edges);
        let mut merged = Vec::with_capacity(old.len() + self.sorted.len());
        let mut before = old.into_iter().peekable();
        for group in self.sorted.chunk_by(|a, b| a.hit.edge == b.hit.edge) {
            let edge = group[0].hit.edge;
            while let Some(earlier) = before.next_if(|earlier| earlier.edge < edge) {
                merged.push(earlier);
            }
            let earlier = before.next_if(|earlier| earlier.edge == edge);
            merged.push(EdgeHits::merge(earlier, group));
            let (_, at) = edge_position(edge);
            if at.iter().all(|&c| c < SIDE) {
                self.owned_hits += group.len() as u64;
            }
        }
        merged.extend(before);
        self.edges = merged;
        self.chunk.clear();
        self.sorted.clear();
        self.prune_planes();
    }

    /// Counting sort by row, then by edge, place and plane within a row.
    fn sort_chunk(&mut self) {
        self.rows.fill(0);
        for hit in &self.chunk {
            self.rows[hit.edge as usize / LINES + 1] += 1;
        }
        for row in 0..ALL_ROWS {
            self.rows[row + 1] += self.rows[row];
        }
        let nothing = Placed { hit: Hit { edge: 0, plane: 0, up: false }, offset: 0.0 };
        self.sorted.clear();
        self.sorted.resize(self.chunk.len(), nothing);
        for &hit in &self.chunk {
            let (axis, at) = edge_position(hit.edge);
            let plane = &self.planes[hit.plane as usize];
            let offset = plane.offset_on_edge(axis, at, self.cell_units);
            let slot = &mut self.rows[hit.edge as usize / LINES];
            self.sorted[*slot as usize] = Placed { hit, offset };
            *slot += 1;
        }
        let mut start = 0;
        for &end in &self.rows[..ALL_ROWS] {
            let row = &mut self.sorted[start as usize..end as usize];
            if row.len() > 1 {
                row.sort_unstable_by(|a, b| {
                    (a.hit.edge.cmp(&b.hit.edge))
                        .then(a.offset.total_cmp(&b.offset))
                        .then(a.hit.plane.cmp(&b.hit.plane))
                });
            }
            start = end;
        }
    }

    fn prune_planes(&mut self) {
        let mut number = vec![NO_PLANE; self.planes.len()];
        for edge in &self.edges {
            for placed in &edge.hits[..edge.kept] {
                number[placed.hit.plane as usize] = 0;
            }
        }
        let mut next = 0;
        for (old, new) in number.iter_mut().enumerate() {
            if *new != NO_PLANE {
                *new = next;
                self.planes[next as usize] = self.planes[old];
                next += 1;
            }
        }
        self.planes.truncate(next as usize);
        for edge in &mut self.edges {
            for placed in &mut edge.hits[..edge.kept] {
                placed.hit.plane = number[placed.hit.plane as usize];
            }
        }
    }
}

impl EdgeHits {
    /// Adds a group of hits on one edge, by ascending place, to what was there.
    fn merge(earlier: Option<Self>, group: &[Placed]) -> Self {
        let mut all = earlier.unwrap_or(Self {
            edge: group[0].hit.edge,
            class: 0,
            signed_sum: 0,
            kept: 0,
            hits: [group[0]; MAX_HITS],
        });
        for placed in group {
            all.class = HitEdge::next_class(all.class);
            all.signed_sum = all.signed_sum.saturating_add(if placed.hit.up { 1 } else { -1 });
        }
        let mut candidates = [group[0]; 2 * MAX_HITS];
        let mut count = all.kept;
        candidates[..count].copy_from_slice(&all.hits[..count]);
        // First, middle and last of the group stand for it.
        let last = group.len() - 1;
        let picks = [0, group.len() / 2, last];
        let picks = match group.len() {
            1 => &picks[..1],
            2 => &picks[..2],
            _ => &picks[..],
        };
        for &pick in picks {
            candidates[count] = group[pick];
            count += 1;
        }
        let candidates = &mut candidates[..count];
        candidates.sort_by(|a, b| a.offset.total_cmp(&b.offset));
        all.kept = count.min(MAX_HITS);
        match count {
            0..=MAX_HITS => all.hits[..count].copy_from_slice(candidates),
            _ => all.hits = [candidates[0], candidates[count / 2], candidates[count - 1]],
        }
        all
    }
}
