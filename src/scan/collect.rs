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
    sorted: Vec<Hit>,
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
        if !self.edges.is_empty() {
            self.reduce();
            return self.brick_of_edges();
        }
        self.sort_chunk();
        let mut brick = HitBrick::default();
        brick.edges.reserve_exact(self.sorted.len());
        brick.hits.reserve_exact(self.sorted.len());
        let mut start = 0;
        while start < self.sorted.len() {
            let edge = self.sorted[start].edge;
            let count = self.sorted[start..].iter().take_while(|hit| hit.edge == edge).count();
            if let [hit] = self.sorted[start..start + count] {
                brick.edges.push(HitEdge::new(edge, 1, 1, if hit.up { 1 } else { -1 }));
                brick.hits.push(hit.plane);
            } else {
                let group = self.place(start, count);
                EdgeHits::merge(None, &group).push_to(&mut brick);
            }
            self.count_owned(edge, count);
            start += count;
        }
        self.chunk.clear();
        brick.planes = prune_planes(&self.planes, &mut brick.hits);
        brick
    }

    fn brick_of_edges(&mut self) -> HitBrick {
        let mut brick = HitBrick::default();
        self.edges.iter().for_each(|edge| edge.push_to(&mut brick));
        brick.planes = prune_planes(&self.planes, &mut brick.hits);
        brick
    }

    /// Merges a full chunk into the edges and forgets planes that nobody keeps.
    fn reduce(&mut self) {
        self.sort_chunk();
        let old = std::mem::take(&mut self.edges);
        let mut merged = Vec::with_capacity(old.len() + self.sorted.len());
        let mut before = old.into_iter().peekable();
        let mut start = 0;
        while start < self.sorted.len() {
            let edge = self.sorted[start].edge;
            let count = self.sorted[start..].iter().take_while(|hit| hit.edge == edge).count();
            while let Some(earlier) = before.next_if(|earlier| earlier.edge < edge) {
                merged.push(earlier);
            }
            let earlier = before.next_if(|earlier| earlier.edge == edge);
            let group = self.place(start, count);
            merged.push(EdgeHits::merge(earlier, &group));
            self.count_owned(edge, count);
            start += count;
        }
        merged.extend(before);
        let mut hits: Vec<u32> =
            merged.iter().flat_map(|e| &e.hits[..e.kept]).map(|placed| placed.hit.plane).collect();
        self.planes = prune_planes(&self.planes, &mut hits);
        let mut renumbered = hits.into_iter();
        for placed in merged.iter_mut().flat_map(|edge| &mut edge.hits[..edge.kept]) {
            placed.hit.plane = renumbered.next().unwrap_or(NO_PLANE);
        }
        self.edges = merged;
        self.chunk.clear();
    }

    fn count_owned(&mut self, edge: u32, hits: usize) {
        let (_, at) = edge_position(edge);
        if at.iter().all(|&c| c < SIDE) {
            self.owned_hits += hits as u64;
        }
    }

    /// Counting sort by row, then by edge and plane within a row.
    fn sort_chunk(&mut self) {
        self.rows.fill(0);
        for hit in &self.chunk {
            self.rows[hit.edge as usize / LINES + 1] += 1;
        }
        for row in 0..ALL_ROWS {
            self.rows[row + 1] += self.rows[row];
        }
        self.sorted.clear();
        self.sorted.resize(self.chunk.len(), Hit { edge: 0, plane: 0, up: false });
        for &hit in &self.chunk {
            let slot = &mut self.rows[hit.edge as usize / LINES];
            self.sorted[*slot as usize] = hit;
            *slot += 1;
        }
        let mut start = 0;
        for &end in &self.rows[..ALL_ROWS] {
            let row = &mut self.sorted[start as usize..end as usize];
            if row.len() > 1 {
                row.sort_unstable_by_key(|hit| (hit.edge, hit.plane));
            }
            start = end;
        }
    }

    /// The hits of one edge with their places on it, from its lower end up.
    fn place(&self, start: usize, count: usize) -> Vec<Placed> {
        let hits = &self.sorted[start..start + count];
        let mut placed: Vec<Placed> = hits
            .iter()
            .map(|&hit| {
                let (axis, at) = edge_position(hit.edge);
                let plane = &self.planes[hit.plane as usize];
                Placed { hit, offset: plane.offset_on_edge(axis, at, self.cell_units) }
            })
            .collect();
        placed.sort_by(|a, b| a.offset.total_cmp(&b.offset));
        placed
    }
}

/// The planes that `hits` use, in their old order; `hits` are renumbered.
fn prune_planes(planes: &[SourcePlane], hits: &mut [u32]) -> Vec<SourcePlane> {
    let mut number = vec![NO_PLANE; planes.len()];
    hits.iter().for_each(|&plane| number[plane as usize] = 0);
    let mut kept = Vec::with_capacity(planes.len());
    for (plane, number) in planes.iter().zip(&mut number).filter(|(_, n)| **n != NO_PLANE) {
        *number = kept.len() as u32;
        kept.push(*plane);
    }
    hits.iter_mut().for_each(|plane| *plane = number[*plane as usize]);
    kept
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

    fn push_to(&self, brick: &mut HitBrick) {
        brick.edges.push(HitEdge::new(self.edge, self.class, self.kept, self.signed_sum));
        brick.hits.extend(self.hits[..self.kept].iter().map(|placed| placed.hit.plane));
    }
}
