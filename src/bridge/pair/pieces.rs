//! Rims as chains of pieces: which corners they have, how long the way is along them.

use glam::DVec3;

use crate::bridge::pair::{MOST_PIECES, RimEdge};

/// What is behind an edge.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Away from its triangle, across the edge; of length one.
    pub outward: DVec3,
    pub sheet: u32,
}

/// A part of an edge of a rim.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    pub ends: [u32; 2],
    pub side: Side,
    chain: u32,
    /// How far along its chain its ends are.
    along: [f64; 2],
}

/// A row of edges between corners that have not just two of them, or around.
struct Chain {
    /// Corners at its ends; the same if it is closed.
    ends: [u32; 2],
    length: f64,
}

/// Where a corner is, for each chain that it is on.
type Stations = Vec<(u32, f64)>;

/// All rims, cut into pieces.
pub struct Pieces {
    /// Corners of the rims in the order of their coordinates, then those between.
    pub points: Vec<DVec3>,
    /// For each corner what is behind its edges.
    pub sides: Vec<Vec<Side>>,
    pub pieces: Vec<Piece>,
    chains: Vec<Chain>,
    stations: Vec<Stations>,
    /// First piece of each edge, and the end of the last.
    firsts: Vec<usize>,
}

/// An edge between numbered corners, the lower one first.
struct Edge {
    ends: [u32; 2],
    side: Side,
}

impl Pieces {
    /// Cuts edges into equal pieces no longer than `longest`, or into [`MOST_PIECES`].
    pub fn cut(rim: &[RimEdge], longest: f64) -> Self {
        let (points, edges) = numbered(rim);
        let corners = points.len();
        let mut pieces = Self {
            points,
            sides: vec![Vec::new(); corners],
            pieces: Vec::new(),
            chains: Vec::new(),
            stations: vec![Vec::new(); corners],
            firsts: vec![0],
        };
        let along = pieces.chain(&edges);
        for (edge, (chain, along)) in edges.iter().zip(along) {
            pieces.cut_edge(edge, chain, along, longest);
        }
        pieces
    }

    pub fn at(&self, corner: u32) -> DVec3 {
        self.points[corner as usize]
    }

    /// The way along the rim from a place of a piece to a corner; infinite if there is none.
    pub fn way(&self, piece: &Piece, share: f64, corner: u32) -> f64 {
        let [from, to] = piece.along;
        let here = from + share.clamp(0.0, 1.0) * (to - from);
        let own = &self.chains[piece.chain as usize];
        let mut shortest = f64::INFINITY;
        for &(chain, there) in &self.stations[corner as usize] {
            let other = &self.chains[chain as usize];
            if chain == piece.chain {
                shortest = shortest.min((here - there).abs());
            }
            // Over a corner at which the chains meet, or around a closed one.
            for (own_end, own_way) in own.ends.into_iter().zip([here, own.length - here]) {
                for (end, way) in other.ends.into_iter().zip([there, other.length - there]) {
                    if own_end == end {
                        shortest = shortest.min(own_way + way);
                    }
                }
            }
        }
        shortest
    }

    /// Triangles without area that cut edges at the corners that are used.
    pub fn cuts(&self, is_used: &[bool]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for range in self.firsts.windows(2) {
            let pieces = &self.pieces[range[0]..range[1]];
            let Some((first, rest)) = pieces.split_first() else { continue };
            let mut last = None;
            let ends = rest.iter().map(|piece| piece.ends[0]).filter(|&c| is_used[c as usize]);
            for corner in ends.chain(pieces.last().map(|piece| piece.ends[1])) {
                triangles.extend(last.map(|last| [first.ends[0], last, corner]));
                last = Some(corner);
            }
        }
        triangles
    }

    fn cut_edge(&mut self, edge: &Edge, chain: u32, along: [f64; 2], longest: f64) {
        let [start, end] = edge.ends.map(|end| self.at(end));
        let count = (start.distance(end) / longest).ceil().clamp(1.0, MOST_PIECES as f64) as u32;
        let mut from = (edge.ends[0], along[0]);
        for k in 1..=count {
            let share = f64::from(k) / f64::from(count);
            let to = if k == count {
                (edge.ends[1], along[1])
            } else {
                let station = along[0] + share * (along[1] - along[0]);
                self.points.push(start + share * (end - start));
                self.sides.push(vec![edge.side]);
                self.stations.push(vec![(chain, station)]);
                (self.points.len() as u32 - 1, station)
            };
            let (ends, along) = ([from.0, to.0], [from.1, to.1]);
            self.pieces.push(Piece { ends, side: edge.side, chain, along });
            from = to;
        }
        self.firsts.push(self.pieces.len());
    }

    /// Walks along the edges; tells for each its chain and where on it its ends are.
    fn chain(&mut self, edges: &[Edge]) -> Vec<(u32, [f64; 2])> {
        let mut at_corner = vec![Vec::new(); self.points.len()];
        for (number, edge) in edges.iter().enumerate() {
            for end in edge.ends {
                at_corner[end as usize].push(number);
                self.sides[end as usize].push(edge.side);
            }
        }
        let mut places = vec![(u32::MAX, [0.0; 2]); edges.len()];
        // Corners at which chains end come first, then any corner of those that go around.
        let ending = (0..self.points.len()).filter(|&c| at_corner[c].len() != 2);
        let starts: Vec<usize> = ending.chain(0..self.points.len()).collect();
        for start in starts {
            for first in at_corner[start].clone() {
                if places[first].0 == u32::MAX {
                    self.walk(start as u32, first, edges, &at_corner, &mut places);
                }
            }
        }
        places
    }

    fn walk(
        &mut self,
        start: u32,
        first: usize,
        edges: &[Edge],
        at_corner: &[Vec<usize>],
        places: &mut [(u32, [f64; 2])],
    ) {
        let chain = self.chains.len() as u32;
        let (mut corner, mut number, mut length) = (start, first, 0.0);
        self.stations[start as usize].push((chain, 0.0));
        loop {
            let [low, high] = edges[number].ends;
            let after = length + self.at(low).distance(self.at(high));
            let along = if corner == low { [length, after] } else { [after, length] };
            places[number] = (chain, along);
            corner = if corner == low { high } else { low };
            length = after;
            self.stations[corner as usize].push((chain, length));
            let next = at_corner[corner as usize].iter().find(|&&n| places[n].0 == u32::MAX);
            match next {
                Some(&next) if at_corner[corner as usize].len() == 2 && corner != start => {
                    number = next;
                }
                _ => break,
            }
        }
        self.chains.push(Chain { ends: [start, corner], length });
    }
}

/// Corners in the order of their coordinates, and edges in the order of their corners.
fn numbered(rim: &[RimEdge]) -> (Vec<DVec3>, Vec<Edge>) {
    // Negative zero is zero.
    let key = |point: DVec3| (point + 0.0).to_array();
    let order = |a: &[f64; 3], b: &[f64; 3]| {
        let both = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
        both.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    };
    let mut places: Vec<[f64; 3]> = rim.iter().flat_map(|edge| edge.ends.map(key)).collect();
    places.sort_unstable_by(order);
    places.dedup();
    let number = |point: DVec3| {
        let found = places.binary_search_by(|other| order(other, &key(point)));
        found.expect("the ends of all edges were collected") as u32
    };
    let edge = |edge: &RimEdge| {
        let [a, b] = edge.ends;
        let along = (b - a).normalize_or_zero();
        let outward = (a - edge.opposite).reject_from_normalized(along).normalize_or_zero();
        let (a, b) = (number(a), number(b));
        Edge { ends: [a.min(b), a.max(b)], side: Side { outward, sheet: edge.sheet } }
    };
    let mut edges: Vec<Edge> = rim.iter().map(edge).collect();
    edges.retain(|edge| edge.ends[0] != edge.ends[1]);
    edges.sort_unstable_by_key(|edge| edge.ends);
    (places.into_iter().map(DVec3::from_array).collect(), edges)
}
