//! Cuts a loop in space into triangles without new corners: first as little bent as can be, then
//! as small as can be.
//!
//! Of every stretch of the rim the best way is found from the best ways of shorter ones. That takes
//! the cube of the number of corners; so a rim of more than [`MOST_CORNERS`] is thinned out first,
//! and the strips that this leaves beside it are cut on their own.
//!
//! Source: Barequet, Sharir 1995, Filling gaps in the boundary of a polyhedron (the programme);
//!         Liepa 2003, Filling holes in meshes, section 3 (the weights); Visvalingam, Whyatt 1993
//!         (thinning).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::bridge::fill::flat::cut_flat;

/// Corners of a loop that is cut as a whole.
const MOST_CORNERS: usize = 128;
/// The same for an area alone.
const MOST_CORNERS_FOR_AREA: usize = 48;
/// Bends are compared in steps, so that area decides between those that are about the same.
const BEND_STEPS: f64 = 7.3;
/// Right angles and flat ones do not lie where two steps meet.
const FIRST_STEP: f64 = 0.37;
const WORST_BEND: u32 = 15;
/// A triangle is a line if its height is this part of its longest side.
const LINE: f64 = 1e-7;

/// Cuts a loop; `normals` are those of the triangles behind its edges.
pub fn cut_coarse(points: &[DVec3], normals: &[Option<DVec3>]) -> Vec<[u32; 3]> {
    let kept = thin_out(points, MOST_CORNERS);
    if kept.len() == points.len() {
        return Programme::run(points, normals, true).triangles();
    }
    let inner: Vec<DVec3> = kept.iter().map(|&corner| points[corner as usize]).collect();
    let mut triangles = Vec::new();
    let mut behind = Vec::new();
    for (i, &from) in kept.iter().enumerate() {
        let to = kept[(i + 1) % kept.len()];
        let chain = chain_between(from, to, points.len());
        let sum: DVec3 =
            chain[..chain.len() - 1].iter().filter_map(|&edge| normals[edge as usize]).sum();
        behind.push(sum.try_normalize());
        let strip: Vec<DVec3> = chain.iter().map(|&corner| points[corner as usize]).collect();
        let cut = match strip.len() {
            2 => Vec::new(),
            3..=MOST_CORNERS => Programme::run(&strip, &vec![None; strip.len()], false).triangles(),
            _ => cut_flat(&strip),
        };
        triangles.extend(cut.into_iter().map(|t| t.map(|corner| chain[corner as usize])));
    }
    let cut = Programme::run(&inner, &behind, true).triangles();
    triangles.extend(cut.into_iter().map(|t| t.map(|corner| kept[corner as usize])));
    triangles
}

/// The least area of a cut of a loop, thinned out if it is long.
pub fn least_area(points: &[DVec3]) -> f64 {
    let kept = thin_out(points, MOST_CORNERS_FOR_AREA);
    let corners: Vec<DVec3> = kept.iter().map(|&corner| points[corner as usize]).collect();
    let none = vec![None; corners.len()];
    Programme::run(&corners, &none, false).area()
}

/// Numbers of the corners from one to another, along the loop.
fn chain_between(from: u32, to: u32, count: usize) -> Vec<u32> {
    let count = count as u32;
    let steps = (to + count - from) % count;
    (0..=steps).map(|step| (from + step) % count).collect()
}

/// Takes corners out, those first that span the smallest triangle with their neighbours.
fn thin_out(points: &[DVec3], most: usize) -> Vec<u32> {
    let count = points.len();
    if count <= most {
        return (0..count as u32).collect();
    }
    let mut next: Vec<usize> = (0..count).map(|i| (i + 1) % count).collect();
    let mut previous: Vec<usize> = (0..count).map(|i| (i + count - 1) % count).collect();
    // Four times an even share, so that no strip becomes long.
    let longest = 4 * count.div_ceil(most);
    let cost = |i: usize, before: usize, after: usize| {
        let area = (points[before] - points[i]).cross(points[after] - points[i]).length();
        // Of positive numbers the bits are ordered as they are.
        (area.to_bits(), before, i, after)
    };
    let mut heap: BinaryHeap<_> =
        (0..count).map(|i| Reverse(cost(i, previous[i], next[i]))).collect();
    let mut is_kept = vec![true; count];
    let mut left = count;
    while left > most {
        let Some(Reverse((_, before, i, after))) = heap.pop() else { break };
        let is_old = !is_kept[i] || previous[i] != before || next[i] != after;
        if is_old || (after + count - before) % count > longest {
            continue;
        }
        is_kept[i] = false;
        left -= 1;
        next[before] = after;
        previous[after] = before;
        heap.push(Reverse(cost(before, previous[before], after)));
        heap.push(Reverse(cost(after, before, next[after])));
    }
    (0..count as u32).filter(|&i| is_kept[i as usize]).collect()
}

/// The best cut of a stretch of the rim, closed by a straight line.
#[derive(Clone, Copy)]
struct Stretch {
    bend: u32,
    area: f64,
    /// The third corner of the triangle at that line, and the triangle's normal.
    third: u32,
    normal: Option<DVec3>,
}

struct Programme {
    count: usize,
    best: Vec<Stretch>,
}

impl Programme {
    fn run(points: &[DVec3], normals: &[Option<DVec3>], bend_counts: bool) -> Self {
        let count = points.len();
        let empty = Stretch { bend: 0, area: 0.0, third: 0, normal: None };
        let mut programme = Self { count, best: vec![empty; count * count] };
        for (from, &normal) in normals.iter().enumerate().take(count - 1) {
            programme.best[from * count + from + 1].normal = normal;
        }
        for span in 2..count {
            // The last stretch closes the loop.
            let closing = if span == count - 1 { normals[count - 1] } else { None };
            for from in 0..count - span {
                let to = from + span;
                let mut best = Stretch { bend: u32::MAX, ..empty };
                for third in from + 1..to {
                    let (one, two) = (programme.at(from, third), programme.at(third, to));
                    let corners = [points[from], points[third], points[to]];
                    let (area, normal) = area_and_normal(corners);
                    let area = area + one.area + two.area;
                    let bend = if bend_counts {
                        let behind = [one.normal, two.normal, closing];
                        let own = worst_bend(normal, behind);
                        own.max(one.bend).max(two.bend)
                    } else {
                        0
                    };
                    if (bend, area) < (best.bend, best.area) || best.third == 0 {
                        best = Stretch { bend, area, third: third as u32, normal };
                    }
                }
                programme.best[from * count + to] = best;
            }
        }
        programme
    }

    fn at(&self, from: usize, to: usize) -> &Stretch {
        &self.best[from * self.count + to]
    }

    fn area(&self) -> f64 {
        self.at(0, self.count - 1).area
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.count - 2);
        let mut open = vec![(0, self.count - 1)];
        while let Some((from, to)) = open.pop() {
            if to - from >= 2 {
                let third = self.at(from, to).third as usize;
                triangles.push([from as u32, third as u32, to as u32]);
                open.extend([(from, third), (third, to)]);
            }
        }
        triangles
    }
}

fn area_and_normal([a, b, c]: [DVec3; 3]) -> (f64, Option<DVec3>) {
    let (ab, ac) = (b - a, c - a);
    let cross = ab.cross(ac);
    let twice = cross.length();
    let longest = ab.length_squared().max(ac.length_squared()).max(b.distance_squared(c));
    (twice / 2.0, (twice > LINE * longest).then(|| cross / twice))
}

fn worst_bend(normal: Option<DVec3>, behind: [Option<DVec3>; 3]) -> u32 {
    let Some(normal) = normal else { return WORST_BEND };
    let step = |other: DVec3| ((1.0 - normal.dot(other)) * BEND_STEPS + FIRST_STEP) as u32;
    behind.into_iter().flatten().map(step).max().unwrap_or(0)
}
