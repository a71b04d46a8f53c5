//! Clusters above the brick: what a brick says of itself, and how eight cells become one.
//!
//! In:         bricks, or cells of bricks, each a disk with one arc per face.
//! Out:        the cell that they make, if that is one too, with its vertex.
//! Invariant:  no plane of a crossing lies farther from the vertex than told: a facet knows a normal,
//!             how far others are from it, and the range of offsets, which bounds all distances in
//!             its cell. No edge of a cell above the brick is crossed twice, so every minimal edge
//!             among such cells is crossed once and no two polygons have the same vertices.
//! Units:      cells, from the min corner of the cell.
//! Memory:     80 bytes a facet, [`MAX_FACETS`] a cell.
//! Fails:      never; refuses what does not fit.
//! Source:     as clusters within the brick; facets are ours.

use glam::DVec3;

use crate::contour::mdc::cluster::node::{EdgeCounts, Node};
use crate::contour::mdc::cluster::planes::JUDGES_ONLY;
use crate::contour::mdc::cluster::{CellPlane, ClusterOptions, Clustering, Leaves};
use crate::geom::qef::{Hit, solve_inside};
use crate::octree::{CellBrick, Facet, MAX_LEVEL, Summary};

/// Most facets that one vertex can stand for.
const MAX_FACETS: usize = 8;

/// Normals that differ by less belong to one face whose corners were rounded.
const SAME_NORMAL: f64 = 1e-4;

/// A child of a cell.
pub struct Part<'s> {
    /// Its octant.
    pub octant: usize,
    /// What it says of itself.
    pub summary: &'s Summary,
}

/// A cell that children make.
pub struct Whole {
    /// What it says of itself.
    pub summary: Summary,
    /// Its vertex, lattice units from its min corner.
    pub vertex: [i64; 3],
    /// The vertex' largest distance to a plane, cells.
    pub error: f64,
}

impl Clustering {
    /// What the brick that was cut last says of itself; `None` if it is not one vertex that
    /// larger cells can do with.
    pub fn summary(&self, brick: &CellBrick, leaves: &Leaves) -> Option<Summary> {
        if brick.clusters != [MAX_LEVEL << 15 | 1 << 18] {
            return None;
        }
        let node = self.nodes.first()?;
        let mut facets = Vec::new();
        let mut last = (u32::MAX, 0);
        for hit in &leaves.hits {
            if hit.plane & JUDGES_ONLY != 0 {
                return None;
            }
            let points = DVec3::from(hit.point.map(f64::from));
            if hit.plane == last.0 {
                let facet: &mut Facet = &mut facets[last.1];
                facet.points = (DVec3::from(facet.points) + points).to_array();
                facet.count += 1.0;
                continue;
            }
            let CellPlane { normal, offset } = leaves.planes[hit.plane as usize];
            let facet = Facet {
                normal: normal.to_array(),
                offsets: [offset; 2],
                spread: 0.0,
                points: points.to_array(),
                count: 1.0,
            };
            last = (hit.plane, add_facet(&mut facets, &facet)?);
        }
        Some(Summary { edges: node.edges.words(), facets })
    }
}

/// The cell at `level` that `parts` make, if it may be a cluster.
pub fn join(parts: &[Part], level: u32, options: &ClusterOptions) -> Option<Whole> {
    let mut node = Node::EMPTY;
    let mut facets = Vec::new();
    let half = f64::from(1_u32 << (level - 1));
    for Part { octant, summary } in parts {
        let edges = EdgeCounts::from_words(summary.edges);
        node.add(&Node { edges, euler: 1, ..Node::EMPTY }, *octant);
        let low = DVec3::from([0, 1, 2].map(|a| f64::from((octant >> a & 1) as u8))) * half;
        for facet in &summary.facets {
            add_facet(&mut facets, &moved(facet, low))?;
        }
    }
    node.close();
    if !are_connected(parts) || !node.is_simple() || !node.edges.are_single() {
        return None;
    }
    let (vertex, error) = place(&facets, 2.0 * half, options)?;
    Some(Whole { summary: Summary { edges: node.edges.words(), facets }, vertex, error })
}

/// Whether arcs on the planes between the octants join all parts. A part that crosses no edge of a
/// face has no arc there, as its rim is one curve that crosses edges elsewhere.
fn are_connected(parts: &[Part]) -> bool {
    let all = (1_u32 << parts.len()) - 1;
    let mut reached = 1_u32;
    for _ in 1..parts.len() {
        for (i, one) in parts.iter().enumerate() {
            if reached >> i & 1 == 1 {
                reached |= neighbours(one, parts);
            }
        }
    }
    reached == all
}

/// The parts that an arc joins to `one`, as bits.
fn neighbours(one: &Part, parts: &[Part]) -> u32 {
    let edges = EdgeCounts::from_words(one.summary.edges);
    let is_joined = |other: &Part| {
        let across = one.octant ^ other.octant;
        let face = 2 * across.trailing_zeros() as usize + usize::from(one.octant & across == 0);
        across.count_ones() == 1 && edges.is_on_face(face)
    };
    parts.iter().enumerate().fold(0, |bits, (j, other)| bits | u32::from(is_joined(other)) << j)
}

/// A facet from the min corner of a cell whose child it is of, at `low` there.
fn moved(facet: &Facet, low: DVec3) -> Facet {
    let shift = DVec3::from(facet.normal).dot(low);
    // Other normals shift by that much more or less.
    let more = facet.spread * low.length();
    Facet {
        offsets: [facet.offsets[0] + shift - more, facet.offsets[1] + shift + more],
        points: (DVec3::from(facet.points) + low * facet.count).to_array(),
        ..*facet
    }
}

/// Adds a facet to a list; where it went, `None` if there is no room.
fn add_facet(facets: &mut Vec<Facet>, facet: &Facet) -> Option<usize> {
    let normal = DVec3::from(facet.normal);
    for (number, known) in facets.iter_mut().enumerate() {
        let mean = DVec3::from(known.normal);
        let is_turned = mean.dot(normal) < 0.0;
        let apart = (if is_turned { -normal } else { normal }).distance(mean);
        if apart > SAME_NORMAL {
            continue;
        }
        let [low, high] = facet.offsets;
        let [low, high] = if is_turned { [-high, -low] } else { [low, high] };
        known.offsets = [known.offsets[0].min(low), known.offsets[1].max(high)];
        known.spread = known.spread.max(facet.spread + apart);
        known.points = (DVec3::from(known.points) + DVec3::from(facet.points)).to_array();
        known.count += facet.count;
        return Some(number);
    }
    if facets.len() == MAX_FACETS {
        return None;
    }
    facets.push(*facet);
    Some(facets.len() - 1)
}

/// The vertex of these facets in a cell of `size`, and its largest distance to their planes; `None`
/// if it is beyond the threshold, or the cell.
fn place(facets: &[Facet], size: f64, options: &ClusterOptions) -> Option<([i64; 3], f64)> {
    let ClusterOptions { cell_units, inset_units, .. } = *options;
    let half = size * 0.5;
    let reach = half - inset_units as f64 / cell_units as f64;
    let mut qef = options.qef;
    (qef.lo, qef.hi) = (DVec3::splat(-reach), DVec3::splat(reach));
    let hits: Vec<Hit> = facets.iter().map(|facet| mean(facet, half)).collect();
    if hits.is_empty() {
        return None;
    }
    let at = solve_inside(&hits, &qef)? + half;
    let last = size as i64 * cell_units - inset_units;
    let vertex =
        [0, 1, 2].map(|a| ((at[a] * cell_units as f64).round() as i64).clamp(inset_units, last));
    let at = DVec3::from(vertex.map(|c| c as f64)) / cell_units as f64;
    let distance = |facet: &Facet| {
        let along = DVec3::from(facet.normal).dot(at);
        let [low, high] = facet.offsets;
        (along - low).abs().max((along - high).abs()) + facet.spread * at.length()
    };
    let error = facets.iter().map(distance).fold(0.0, f64::max);
    (error <= options.threshold_cells).then_some((vertex, error))
}

/// The facet as one crossing of its mean plane, about the middle of a cell.
fn mean(facet: &Facet, half: f64) -> Hit {
    let normal = DVec3::from(facet.normal);
    let offset = (facet.offsets[0] + facet.offsets[1]) * 0.5;
    let mut point = DVec3::from(facet.points) / facet.count;
    point -= normal * (normal.dot(point) - offset);
    for axis in 0..3 {
        if normal[axis].abs() == 1.0 {
            point[axis] = offset * normal[axis];
        }
    }
    Hit { point: point - half, normal }
}
