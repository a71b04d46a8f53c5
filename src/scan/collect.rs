//! Gathers the hits of a brick into one record per edge.
//!
//! Memory: at most [`CHUNK_HITS`] hits before they are reduced to three per edge, and the planes
//! that these refer to.

use crate::octree::{
    AXIS_EDGES, HitBrick, HitEdge, LINES, MAX_HITS, NO_PLANE, SIDE, SourcePlane, edge_position,
};

/// Hits that are held before they are reduced. Large enough for every brick of a sane model.
pub const CHUNK_HITS: usize = 1 << 16;

/// One hit of a triangle on an edge, by edge and then by plane. A single word is sorted fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Hit(u64);

impl Hit {
    /// A hit on an edge by the plane with this number in the brick; whether the triangle faces up the edge's
    /// axis.
    #[inline]
    pub fn new(edge: u32, plane: u32, is_up: bool) -> Self {
        Self(u64::from(edge) << 33 | u64::from(plane) << 1 | u64::from(is_up))
    }

    #[inline]
    fn edge(self) -> u32 {
        (self.0 >> 33) as u32
    }

    #[inline]
    fn plane(self) -> u32 {
        (self.0 >> 1) as u32
    }

    /// +1 where the triangle faces up the axis, -1 where down.
    #[inline]
    fn sign(self) -> i16 {
        if self.0 & 1 == 1 { 1 } else { -1 }
    }
}

/// A plane with its place on the edge under way.
#[derive(Clone, Copy, Debug)]
struct Placed {
    plane: u32,
    offset: f64,
}

/// All hits of one edge so far. 20 bytes: a brick of noise has a hundred thousand.
#[derive(Clone, Copy, Debug)]
struct EdgeHits {
    edge: u32,
    /// Planes of the kept hits, from the lower end of the edge up.
    planes: [u32; MAX_HITS],
    signed_sum: i16,
    class: u8,
    kept: u8,
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
            let edge = self.sorted[start].edge();
            let count = self.sorted[start..].iter().take_while(|hit| hit.edge() == edge).count();
            if let [hit] = self.sorted[start..start + count] {
                brick.edges.push(HitEdge::new(edge, 1, 1, hit.sign()));
                brick.hits.push(hit.plane());
            } else {
                self.merge(None, start, count).push_to(&mut brick);
            }
            start += count;
        }
        self.chunk.clear();
        if brick.hits.len() == self.sorted.len() {
            // Planes are added with a hit, and all hits are kept.
            brick.planes = std::mem::take(&mut self.planes);
        } else {
            self.hand_over_planes(&mut brick);
        }
        brick
    }

    fn brick_of_edges(&mut self) -> HitBrick {
        let edges = std::mem::take(&mut self.edges);
        let mut brick = HitBrick::default();
        brick.edges.reserve_exact(edges.len());
        brick.hits.reserve_exact(edges.iter().map(|edge| usize::from(edge.kept)).sum());
        edges.iter().for_each(|edge| edge.push_to(&mut brick));
        drop(edges);
        self.hand_over_planes(&mut brick);
        brick
    }

    /// Moves the planes that the brick's hits use into the brick.
    fn hand_over_planes(&mut self, brick: &mut HitBrick) {
        prune_planes(&mut self.planes, |see| brick.hits.iter_mut().for_each(see));
        brick.planes = std::mem::take(&mut self.planes);
    }

    /// Merges a full chunk into the edges and forgets planes that nobody keeps.
    fn reduce(&mut self) {
        self.sort_chunk();
        let old = std::mem::take(&mut self.edges);
        let new = self.sorted.chunk_by(|a, b| a.edge() == b.edge()).count();
        let mut merged = Vec::with_capacity(old.len() + new);
        let mut before = old.into_iter().peekable();
        let mut start = 0;
        while start < self.sorted.len() {
            let edge = self.sorted[start].edge();
            let count = self.sorted[start..].iter().take_while(|hit| hit.edge() == edge).count();
            while let Some(earlier) = before.next_if(|earlier| earlier.edge < edge) {
                merged.push(earlier);
            }
            let earlier = before.next_if(|earlier| earlier.edge == edge);
            merged.push(self.merge(earlier, start, count));
            start += count;
        }
        merged.extend(before);
        self.edges = merged;
        let edges = &mut self.edges;
        prune_planes(&mut self.planes, |see| {
            for edge in edges.iter_mut() {
                edge.planes[..usize::from(edge.kept)].iter_mut().for_each(&mut *see);
            }
        });
        self.chunk.clear();
    }

    /// Counting sort by row, then by edge and plane within a row. Counts the hits on own edges.
    fn sort_chunk(&mut self) {
        self.rows.fill(0);
        for hit in &self.chunk {
            self.rows[hit.edge() as usize / LINES + 1] += 1;
        }
        for row in 0..ALL_ROWS {
            self.rows[row + 1] += self.rows[row];
        }
        self.sorted.clear();
        self.sorted.resize(self.chunk.len(), Hit::default());
        for &hit in &self.chunk {
            let slot = &mut self.rows[hit.edge() as usize / LINES];
            self.sorted[*slot as usize] = hit;
            *slot += 1;
        }
        let mut start = 0;
        for (number, &end) in self.rows[..ALL_ROWS].iter().enumerate() {
            // Most rows have none.
            if start == end {
                continue;
            }
            let row = &mut self.sorted[start as usize..end as usize];
            if row.len() > 1 {
                row.sort_unstable();
            }
            if number % LINES < SIDE && number / LINES % LINES < SIDE {
                let last = (number * LINES + SIDE) as u32;
                let beyond = row.iter().rev().take_while(|hit| hit.edge() == last).count();
                self.owned_hits += (row.len() - beyond) as u64;
            }
            start = end;
        }
    }

    /// A plane with its place on an edge.
    fn placed(&self, edge: u32, plane: u32) -> Placed {
        let (axis, at) = edge_position(edge);
        let offset = self.planes[plane as usize].offset_on_edge(axis, at, self.cell_units);
        Placed { plane, offset }
    }

    /// Adds the sorted hits `start..start + count`, all on one edge, to what was there.
    fn merge(&self, earlier: Option<EdgeHits>, start: usize, count: usize) -> EdgeHits {
        let hits = &self.sorted[start..start + count];
        let edge = hits[0].edge();
        let none =
            EdgeHits { edge, planes: [NO_PLANE; MAX_HITS], signed_sum: 0, class: 0, kept: 0 };
        let mut all = earlier.unwrap_or(none);
        for hit in hits {
            all.class = HitEdge::next_class(all.class.into()) as u8;
            all.signed_sum = all.signed_sum.saturating_add(hit.sign());
        }
        let mut group: Vec<Placed> =
            hits.iter().map(|hit| self.placed(edge, hit.plane())).collect();
        group.sort_by(|a, b| a.offset.total_cmp(&b.offset));
        let mut candidates = [group[0]; 2 * MAX_HITS];
        let mut count = usize::from(all.kept);
        for (candidate, &plane) in candidates.iter_mut().zip(&all.planes[..count]) {
            *candidate = self.placed(edge, plane);
        }
        // First, middle and last of the group stand for it.
        let picks = [0, group.len() / 2, group.len() - 1];
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
        all.kept = count.min(MAX_HITS) as u8;
        match count {
            0..=MAX_HITS => {
                for (plane, candidate) in all.planes.iter_mut().zip(candidates) {
                    *plane = candidate.plane;
                }
            }
            _ => {
                let three = [candidates[0], candidates[count / 2], candidates[count - 1]];
                all.planes = three.map(|candidate| candidate.plane);
            }
        }
        all
    }
}

/// Forgets the planes that nobody uses; `each_use` shows the numbers in use, which become new ones.
fn prune_planes(planes: &mut Vec<SourcePlane>, mut each_use: impl FnMut(&mut dyn FnMut(&mut u32))) {
    let mut number = vec![NO_PLANE; planes.len()];
    each_use(&mut |plane| number[*plane as usize] = 0);
    let mut kept = 0;
    for (old, number) in number.iter_mut().enumerate().filter(|(_, n)| **n != NO_PLANE) {
        *number = kept as u32;
        planes[kept] = planes[old];
        kept += 1;
    }
    planes.truncate(kept);
    each_use(&mut |plane| *plane = number[*plane as usize]);
}

impl EdgeHits {
    fn push_to(&self, brick: &mut HitBrick) {
        let (kept, class) = (usize::from(self.kept), u32::from(self.class));
        brick.edges.push(HitEdge::new(self.edge, class, kept, self.signed_sum));
        brick.hits.extend_from_slice(&self.planes[..kept]);
    }
}
