//! Refines a coarse fill on a smooth surface until its edges have about a given length.
//!
//! Long edges are split in the middle, longest first, the new corner placed on the surface; edges
//! are swapped until all triangles are as Delaunay's are; corners move to the middle of their
//! neighbours. The rim's edges stay as they are.
//!
//! Source: Liepa 2003, Filling holes in meshes, section 4; Botsch, Kobbelt 2004, A remeshing
//!         approach to multiresolution modeling, section 4.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::bridge::fill::surface::Surface;

/// Edges are split that are longer than this many times the wanted length.
const LONG: f64 = 4.0 / 3.0;
/// Rounds of splitting: each halves at least the longest of neighbouring edges.
/// A corner's edges may be this much shorter than those of the corners that it lies between: the
/// rim's edges stay as long as they are.
const GRADING: f64 = 0.5;
const MOST_ROUNDS: usize = 64;
const SWAP_SWEEPS: usize = 4;
const SMOOTH_ROUNDS: usize = 4;
/// Edges are not swapped if that bends the surface by more than 60 degrees.
const SWAP_COSINE: f64 = 0.5;
/// Share of the area that may face away from the surface before a fill counts as folded.
const FOLDED_SHARE: f64 = 0.01;
/// Area of an equilateral triangle over its squared side.
const EQUILATERAL: f64 = 0.433;

/// A refined fill.
pub struct Fine {
    /// Corners beyond those of the rim.
    pub added: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// How far a corner is at most from where the coarse fill would have it.
    pub farthest_stray: f64,
}

/// An edge between two triangles, each with the place of its side that it is.
#[derive(Clone, Copy)]
struct InnerEdge {
    ends: [u32; 2],
    sides: [(u32, u8); 2],
}

struct Net<'a> {
    rim: usize,
    places: Vec<DVec3>,
    /// Where the coarse fill has each corner.
    starts: Vec<DVec3>,
    /// How long the edges of each corner should be at least.
    lengths: Vec<f64>,
    triangles: Vec<[u32; 3]>,
    surface: &'a Surface,
}

/// Refines the triangles of a loop to edges of about the given length, or longer if more than
/// `most` triangles would be needed. `None` if the result is folded.
pub fn refine(
    points: &[DVec3],
    coarse: Vec<[u32; 3]>,
    surface: &Surface,
    edge: f64,
    most: usize,
) -> Option<Fine> {
    let mut net = Net {
        rim: points.len(),
        places: points.to_vec(),
        starts: points.to_vec(),
        lengths: rim_lengths(points),
        triangles: coarse,
        surface,
    };
    let mut farthest_area = net.area();
    let mut edge = edge;
    for _ in 0..MOST_ROUNDS {
        // The area is known better as the net takes the surface's shape.
        farthest_area = farthest_area.max(net.area());
        let least = (3.0 * farthest_area / (EQUILATERAL * most as f64)).sqrt();
        edge = edge.max(least);
        let split = net.split_long_edges(edge, most);
        net.swap_edges();
        if !split {
            break;
        }
    }
    let mut farthest_stray = net.farthest_stray();
    for _ in 0..SMOOTH_ROUNDS {
        net.smooth();
        net.swap_edges();
    }
    // Sideways moves are no straying.
    farthest_stray = farthest_stray.min(net.farthest_stray());
    let finite = net.places.iter().all(|place| place.is_finite());
    (finite && !net.is_folded()).then(|| Fine {
        added: net.places.split_off(net.rim),
        triangles: net.triangles,
        farthest_stray,
    })
}

/// For each corner of the rim the length of its longer edge.
fn rim_lengths(points: &[DVec3]) -> Vec<f64> {
    let count = points.len();
    let length = |i: usize| points[i % count].distance(points[(i + 1) % count]);
    (0..count).map(|i| length(i).max(length(i + count - 1))).collect()
}

/// The bits of a positive number that rounding leaves alone, so that equal lengths stay equal when
/// a loop is turned.
fn rounded(value: f64) -> u64 {
    value.to_bits() >> 24
}

impl Net<'_> {
    fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| self.cross(t).length()).sum::<f64>() / 2.0
    }

    fn farthest_stray(&self) -> f64 {
        let pairs = self.places.iter().zip(&self.starts);
        pairs.map(|(place, start)| place.distance(*start)).fold(0.0, f64::max)
    }

    fn at(&self, corner: u32) -> DVec3 {
        self.places[corner as usize]
    }

    fn cross(&self, [a, b, c]: [u32; 3]) -> DVec3 {
        (self.at(b) - self.at(a)).cross(self.at(c) - self.at(a))
    }

    fn square(&self, [a, b]: [u32; 2]) -> f64 {
        self.at(a).distance_squared(self.at(b))
    }

    /// All edges in order, and those of two triangles.
    fn edges(&self) -> (Vec<[u32; 2]>, Vec<InnerEdge>) {
        let mut sides = Vec::with_capacity(3 * self.triangles.len());
        for (t, triangle) in self.triangles.iter().enumerate() {
            for side in 0..3_u8 {
                let (a, b) = (triangle[side as usize], triangle[(side as usize + 1) % 3]);
                sides.push(([a.min(b), a.max(b)], t as u32, side));
            }
        }
        sides.sort_unstable();
        let mut all: Vec<[u32; 2]> = sides.iter().map(|side| side.0).collect();
        all.dedup();
        let pairs = sides.windows(2).filter(|pair| pair[0].0 == pair[1].0);
        let inner = pairs.map(|pair| InnerEdge {
            ends: pair[0].0,
            sides: [(pair[0].1, pair[0].2), (pair[1].1, pair[1].2)],
        });
        (all, inner.collect())
    }

    /// The triangle turned so that the side comes first.
    fn turned_to(&self, (triangle, side): (u32, u8)) -> [u32; 3] {
        let corners = self.triangles[triangle as usize];
        [0, 1, 2].map(|k| corners[(side as usize + k) % 3])
    }

    /// Splits edges that share no triangle, longest first; whether there were any.
    fn split_long_edges(&mut self, length: f64, most: usize) -> bool {
        let (_, mut inner) = self.edges();
        inner.retain(|edge| {
            let longest = LONG * self.mean_length(edge.ends).max(length);
            self.square(edge.ends) > longest * longest
        });
        inner.sort_by(|a, b| {
            let order = rounded(self.square(b.ends)).cmp(&rounded(self.square(a.ends)));
            order.then_with(|| a.ends.cmp(&b.ends))
        });
        let mut is_used = vec![false; self.triangles.len()];
        let mut any = false;
        for edge in inner {
            let [(one, _), (two, _)] = edge.sides;
            if is_used[one as usize] || is_used[two as usize] {
                continue;
            }
            if self.triangles.len() + 2 > most {
                return false;
            }
            is_used[one as usize] = true;
            is_used[two as usize] = true;
            self.split(edge);
            any = true;
        }
        any
    }

    fn mean_length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.lengths[a as usize] + self.lengths[b as usize]) / 2.0
    }

    fn split(&mut self, edge: InnerEdge) {
        let [(one, _), (two, _)] = edge.sides;
        let ([a, b, c], [_, _, d]) = (self.turned_to(edge.sides[0]), self.turned_to(edge.sides[1]));
        let middle = self.places.len() as u32;
        let start = (self.starts[a as usize] + self.starts[b as usize]) / 2.0;
        let place = self.surface.nearest((self.at(a) + self.at(b)) / 2.0);
        self.lengths.push(GRADING * self.mean_length([a, b]));
        self.starts.push(start);
        self.places.push(place);
        self.triangles[one as usize] = [a, middle, c];
        self.triangles[two as usize] = [b, middle, d];
        self.triangles.push([middle, b, c]);
        self.triangles.push([middle, a, d]);
    }

    fn swap_edges(&mut self) {
        for _ in 0..SWAP_SWEEPS {
            let (all, inner) = self.edges();
            let mut is_used = vec![false; self.triangles.len()];
            let mut new_edges = BTreeSet::new();
            for edge in inner {
                let [(one, _), (two, _)] = edge.sides;
                if is_used[one as usize] || is_used[two as usize] {
                    continue;
                }
                let Some((pair, new_edge)) = self.swapped(edge) else { continue };
                if all.binary_search(&new_edge).is_err() && new_edges.insert(new_edge) {
                    is_used[one as usize] = true;
                    is_used[two as usize] = true;
                    [self.triangles[one as usize], self.triangles[two as usize]] = pair;
                }
            }
            if new_edges.is_empty() {
                break;
            }
        }
    }

    /// The two triangles with the other diagonal, if they are better.
    fn swapped(&self, edge: InnerEdge) -> Option<([[u32; 3]; 2], [u32; 2])> {
        let ([a, b, c], [_, _, d]) = (self.turned_to(edge.sides[0]), self.turned_to(edge.sides[1]));
        let cotangent = |from: u32| {
            let (one, two) = (self.at(a) - self.at(from), self.at(b) - self.at(from));
            one.dot(two) / one.cross(two).length()
        };
        // The two angles are more than 180 degrees; far enough that no sweep undoes the last.
        let is_worse = cotangent(c) + cotangent(d) < -1e-6;
        let pair = [[a, d, c], [d, b, c]];
        let [one, two] = pair.map(|triangle| self.cross(triangle).normalize_or_zero());
        let old = self.cross([a, b, c]).normalize_or_zero();
        let old = old.dot(self.cross([b, a, d]).normalize_or_zero());
        (c != d && is_worse && one.dot(two) > old.min(SWAP_COSINE))
            .then_some((pair, [c.min(d), c.max(d)]))
    }

    /// Moves every corner to the middle of its neighbours, on the surface.
    fn smooth(&mut self) {
        let mut sums = vec![(DVec3::ZERO, 0_u32); self.places.len()];
        for &[a, b] in &self.edges().0 {
            for (to, from) in [(a, b), (b, a)] {
                let sum = &mut sums[to as usize];
                *sum = (sum.0 + self.at(from), sum.1 + 1);
            }
        }
        for (corner, (sum, count)) in sums.into_iter().enumerate().skip(self.rim) {
            self.places[corner] = self.surface.nearest(sum / f64::from(count));
        }
    }

    fn is_folded(&self) -> bool {
        let (mut away, mut total) = (0.0, 0.0);
        for &triangle in &self.triangles {
            let cross = self.cross(triangle);
            let middle = triangle.map(|corner| self.at(corner)).into_iter().sum::<DVec3>() / 3.0;
            let area = cross.length();
            total += area;
            away += if cross.dot(self.surface.normal(middle)) < 0.0 { area } else { 0.0 };
        }
        away > FOLDED_SHARE * total
    }
}
