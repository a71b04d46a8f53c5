//! What surrounds a cell of the cut that has several vertices: its arcs and its polygons.
//!
//! Units:  lattice units from the own brick's min corner.
//! Source: ours; see `separate`.

use crate::contour::ContourError;
use crate::contour::mdc::arcs::{Arc, Edge, edges_of};
use crate::contour::mdc::around_edge::Polygon;
use crate::contour::mdc::cell::{cell_number, place_of, segments_on};
use crate::contour::mdc::cut_cell::{CutBox, CutCell};
use crate::contour::mdc::neighbourhood::{Neighbourhood, OWN, Patch};
use crate::contour::mdc::shape::{Loop, LoopPoint, Shape};
use crate::contour::mdc::triangulate::Quad;
use crate::geom::triangle_triangle::Triangle;
use crate::octree::SIDE;

/// Names of crossings and of face points, beside those of vertices.
const CROSSING: u64 = 1 << 40;
const FACE_POINT: u64 = 1 << 41;

/// An arc of the cell, seen from inside.
#[derive(Clone, Copy, Debug)]
pub struct CellArc {
    /// The vertex within.
    pub mine: u64,
    /// The vertex beyond.
    pub other: u64,
    /// The face that it lies on: twice its axis, and one more on the max side.
    pub face: usize,
    /// The face point.
    pub point: [i32; 3],
    /// Whether the segment between the two vertices misses the face.
    pub is_missed: bool,
    /// Whether the face point may be a vertex: if it is missed, or the cell beyond may be flagged.
    may_be_explicit: bool,
}

/// One polygon at one vertex of the cell.
pub struct Corner {
    /// The vertex.
    pub vertex: u64,
    /// The crossing, and its name.
    pub crossing: ([i32; 3], u64),
    /// Arcs to the vertex before and the one after, as numbers in [`AroundCell::arcs`], and where
    /// those vertices are.
    before: (usize, Patch),
    after: (usize, Patch),
}

/// See the module.
pub struct AroundCell {
    /// The cell's vertices: names and places.
    pub vertices: Vec<(u64, [i32; 3])>,
    /// Its arcs.
    pub arcs: Vec<CellArc>,
    /// Its polygons, once for every vertex of the cell that they have.
    pub corners: Vec<Corner>,
    /// Triangles of polygons that are not fans: the vertex of the cell, and the triangle.
    plain: Vec<(u64, Triangle)>,
    /// Whether a cell around, or the cell itself, is flagged.
    pub is_near_flagged: bool,
    /// Whether two cells share more than one arc.
    pub is_torn: bool,
}

impl AroundCell {
    /// Gathers what surrounds the cell `cut` of the own brick, whose leaf cells have these ranks.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn gather(
        nb: &mut Neighbourhood,
        cut: CutCell,
        ranks: std::ops::Range<usize>,
    ) -> Result<Self, ContourError> {
        let cut_box = CutBox::new(OWN, cut);
        let mut around = Self {
            vertices: Vec::new(),
            arcs: Vec::new(),
            corners: Vec::new(),
            plain: Vec::new(),
            is_near_flagged: false,
            is_torn: false,
        };
        let mut edges = Vec::new();
        for rank in ranks {
            around.add_leaf(nb, cut_box, rank, &mut edges)?;
        }
        edges.sort_unstable();
        edges.dedup();
        for edge in edges {
            if let Some(polygon) = Polygon::around(nb, edge)? {
                around.add_polygon(nb, cut, &polygon)?;
            }
        }
        Ok(around)
    }

    /// Adds the arcs of a leaf cell that begin on the cell's boundary; `edges` are where they end.
    fn add_leaf(
        &mut self,
        nb: &mut Neighbourhood,
        cut: CutBox,
        rank: usize,
        edges: &mut Vec<Edge>,
    ) -> Result<(), ContourError> {
        let packed = nb.own().cells[rank];
        let at = place_of(cell_number(packed)).map(|c| c as i32);
        for face in 0..6 {
            let axis = face / 2;
            let mut beyond = at;
            beyond[axis] += if face % 2 == 1 { 1 } else { -1 };
            if cut.holds(beyond) {
                continue;
            }
            for &pair in segments_on(packed, face).pairs() {
                let ends = edges_of(pair, at);
                let found = nb.cell(at)?;
                let mine = nb.vertex(found, pair[0]);
                let other = nb.vertex_at(beyond, ends[0].axis, ends[0].lower)?;
                self.note_vertex(&mine);
                let is_min = face % 2 == 0;
                let (lower, upper) = if is_min { (other, mine) } else { (mine, other) };
                let arc = Arc { axis, lower, upper };
                let above = if is_min { at } else { beyond };
                let is_end = |edge: &Edge| arc.ends_at(edge, above);
                edges.extend(ends.iter().copied().filter(is_end));
                if let Some(end) = ends.into_iter().find(is_end) {
                    self.note_arc(nb, &arc, (mine.id(), other.id()), face, (end, above))?;
                }
            }
        }
        Ok(())
    }

    fn note_vertex(&mut self, patch: &Patch) {
        let id = patch.id();
        if self.vertices.iter().all(|(known, _)| *known != id) {
            self.vertices.push((id, patch.vertex.position));
        }
    }

    fn note_arc(
        &mut self,
        nb: &mut Neighbourhood,
        arc: &Arc,
        (mine, other): (u64, u64),
        face: usize,
        (end, above): (Edge, [i32; 3]),
    ) -> Result<(), ContourError> {
        let point = arc.point(arc.ends(nb, end, above)?, nb.cell_units());
        match self.arcs.iter().find(|known| known.mine == mine && known.other == other) {
            Some(known) => self.is_torn |= known.point != point,
            None => {
                let is_missed = !arc.passes(nb.cell_units());
                let beyond = if face % 2 == 1 { arc.upper } else { arc.lower }.vertex.cut;
                let may_be_explicit = is_missed || (beyond.level() == 0 && beyond.is_multi());
                self.arcs.push(CellArc { mine, other, face, point, is_missed, may_be_explicit });
            }
        }
        Ok(())
    }

    fn arc(&self, mine: &Patch, other: &Patch) -> Option<usize> {
        let (mine, other) = (mine.id(), other.id());
        self.arcs.iter().position(|arc| arc.mine == mine && arc.other == other)
    }

    fn add_polygon(
        &mut self,
        nb: &mut Neighbourhood,
        cut: CutCell,
        polygon: &Polygon,
    ) -> Result<(), ContourError> {
        let Edge { axis, lower } = polygon.edge;
        let (crossing, inside_below) = nb.crossing(axis, lower)?;
        let id = lower
            .iter()
            .fold(axis as u64, |id, c| id * (2 * SIDE as u64) + (c + SIDE as i32 / 2) as u64)
            | CROSSING;
        let patches = polygon.patches();
        self.is_near_flagged |= patches.iter().any(|patch| patch.vertex.cut.is_flagged());
        for (i, patch) in patches.iter().enumerate() {
            if patch.slot != OWN || patch.vertex.cut != cut {
                continue;
            }
            let before = patches[(i + patches.len() - 1) % patches.len()];
            let after = patches[(i + 1) % patches.len()];
            let arcs = (self.arc(patch, &before), self.arc(patch, &after));
            let (Some(to_before), Some(to_after)) = arcs else {
                return Err(nb.contradiction("an arc between neighbours around an edge"));
            };
            self.corners.push(Corner {
                vertex: patch.id(),
                crossing: (crossing, id),
                before: (to_before, before),
                after: (to_after, after),
            });
            let triangles = self.draw(nb, polygon, i, (crossing, inside_below))?;
            self.plain.extend(triangles.into_iter().map(|triangle| (patch.id(), triangle)));
        }
        Ok(())
    }

    /// The face point of an arc, with its name.
    fn face_point(&self, arc: usize) -> ([i32; 3], u64) {
        (self.arcs[arc].point, FACE_POINT | arc as u64)
    }

    /// All triangles that a polygon at `vertex` may have if its own cell is not flagged.
    pub fn variants(&self, vertex: (u64, [i32; 3])) -> Vec<Triangle> {
        let plain = self.plain.iter().filter(|(of, _)| *of == vertex.0);
        let mut triangles: Vec<Triangle> = plain.map(|(_, triangle)| *triangle).collect();
        let apex = (vertex.1, vertex.0);
        for corner in self.corners.iter().filter(|corner| corner.vertex == vertex.0) {
            for (arc, beyond) in [corner.before, corner.after] {
                if !self.arcs[arc].is_missed {
                    let other = (beyond.vertex.position, beyond.id());
                    triangles.push(triangle(corner.crossing, other, apex));
                }
                if self.arcs[arc].may_be_explicit {
                    triangles.push(triangle(corner.crossing, self.face_point(arc), apex));
                }
            }
        }
        triangles
    }

    /// The triangles at `vertex` if all face points around are vertices.
    pub fn cone(&self, vertex: (u64, [i32; 3])) -> Vec<Triangle> {
        let corners = self.corners.iter().filter(|corner| corner.vertex == vertex.0);
        corners
            .flat_map(|corner| [corner.before.0, corner.after.0].map(|arc| (corner, arc)))
            .map(|(corner, arc)| {
                triangle(corner.crossing, self.face_point(arc), (vertex.1, vertex.0))
            })
            .collect()
    }

    /// The triangles of a polygon at vertex `own` of the cell if no cell around is flagged; none if
    /// it is a fan.
    fn draw(
        &self,
        nb: &mut Neighbourhood,
        polygon: &Polygon,
        own: usize,
        (crossing, inside_below): ([i32; 3], bool),
    ) -> Result<Vec<Triangle>, ContourError> {
        let patches = polygon.patches();
        if polygon.has_missed_arc_off(own, nb.cell_units()) {
            return Ok(Vec::new());
        }
        let mut ring = Loop::new(polygon.edge.axis, crossing, inside_below);
        for (i, patch) in patches.iter().enumerate() {
            ring.push(LoopPoint::of_vertex(patch));
            let next = (i + 1) % patches.len();
            if !polygon.arc(i).passes(nb.cell_units()) {
                let other = if i == own { next } else { i };
                let arc = self.arc(&patches[own], &patches[other]);
                let arc = arc.ok_or_else(|| nb.contradiction("an arc to every neighbour"))?;
                let (position, id) = self.face_point(arc);
                ring.push(LoopPoint { position, id, is_leaf: false, is_face_point: true });
            }
        }
        let is_plain = |patch: &Patch| patch.vertex.cut.is_unit();
        let shape = if patches.len() == 4 && patches.iter().all(is_plain) {
            let corners = [0, 1, 2, 3].map(|i| patches[i].vertex.position.map(i64::from));
            let crossing = crossing.map(i64::from);
            let quad = Quad { corners, axis: polygon.edge.axis, crossing };
            Shape::from(quad.cut(i64::from(nb.cell_units())))
        } else {
            ring.shape(polygon.minimal_edge(nb)?)
        };
        let points = ring.points();
        let take = |numbers: [usize; 3]| {
            let [p, q, r] = numbers.map(|i| (points[i].position, points[i].id));
            triangle(p, q, r)
        };
        Ok(shape.triangles().iter().map(|numbers| take(*numbers)).collect())
    }
}

type Named = ([i32; 3], u64);

/// A triangle of three named points.
fn triangle(p: Named, q: Named, r: Named) -> Triangle {
    Triangle { corners: [p.0, q.0, r.0].map(|c| c.map(i64::from)), ids: [p.1, q.1, r.1] }
}
