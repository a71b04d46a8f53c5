//! Joins vertices into polygons around crossed edges, brick by brick.
//!
//! A brick owns the edges that leave the min corners of its cells; the cells around such an edge
//! lie in the brick and its seven lower neighbours, all of which come earlier in Morton order.

use crate::contour::mdc::angles::Angles;
use crate::contour::mdc::arcs::Edge;
use crate::contour::mdc::around_edge::Polygon;
use crate::contour::mdc::cell::{cell_mask, cell_number, place_of};
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::neighbourhood::{Neighbourhood, OWN, Patch};
use crate::contour::mdc::shape::{Loop, LoopPoint, Shape};
use crate::contour::mdc::triangulate::{Cut, Quad};
use crate::contour::{ContourError, ContourStats};
use crate::mesh::{InnerCrossing, Surface};
use crate::octree::Domain;

/// The triangles of one brick.
#[derive(Default)]
pub struct BrickTriangles {
    /// Global vertex numbers; fan points are numbered from [`FAN_POINT`] up within the brick.
    pub indices: Vec<[u32; 3]>,
    /// Positions of the corners in model units; empty unless asked for.
    pub corners: Vec<[[f64; 3]; 3]>,
    /// What they are; empty where nothing is told.
    pub surfaces: Vec<Surface>,
    /// The source triangles that they come from; likewise.
    pub sources: Vec<u32>,
    /// Crossings without a triangle; likewise.
    pub inner: Vec<InnerCrossing>,
    /// Fan points in model units.
    pub fan_points: Vec<[f64; 3]>,
    /// Counts.
    pub stats: ContourStats,
    /// The smallest angle so far.
    angles: Angles,
}

/// A vertex number with this bit is the brick's own fan point.
pub const FAN_POINT: u32 = 1 << 31;

impl BrickTriangles {
    /// Gives the fan points their global numbers, from `first` on.
    pub fn number_fan_points(&mut self, first: u32) {
        if self.fan_points.is_empty() {
            return;
        }
        for index in self.indices.iter_mut().flatten().filter(|index| **index & FAN_POINT != 0) {
            *index = first + (*index & !FAN_POINT);
        }
    }
}

/// Makes the triangles of one brick after another.
pub struct Polygons<'p> {
    nb: Neighbourhood<'p>,
    /// First vertex of every brick.
    bases: &'p [u32],
    /// Whether polygons keep to their envelopes; else all are cut alike.
    is_careful: bool,
    with_corners: bool,
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    number: u32,
    position: [i32; 3],
}

impl<'p> Polygons<'p> {
    /// A maker of triangles over all bricks; `bases` are the numbers of their first vertices.
    #[must_use]
    pub fn new(
        layers: Layers<'p>,
        bases: &'p [u32],
        domain: &Domain,
        is_careful: bool,
        with_corners: bool,
    ) -> Self {
        Self { nb: Neighbourhood::new(layers, domain), bases, is_careful, with_corners }
    }

    /// The triangles around the edges that brick `number` owns.
    ///
    /// # Errors
    /// [`ContourError`]: a neighbour is missing, which sound bricks never miss.
    pub fn triangles(&mut self, number: usize) -> Result<BrickTriangles, ContourError> {
        self.nb.move_to(number)?;
        let mut out = BrickTriangles::default();
        let own = self.nb.own();
        let (cells, edges) = (own.cells.len(), own.offsets.len());
        out.indices.reserve(2 * edges);
        let mut next_offset = 0;
        for rank in 0..cells {
            let own = self.nb.own();
            let cell = own.cells[rank];
            let mask = cell_mask(cell);
            let mark = |axis: u8| ((mask ^ mask >> (1 << axis)) & 1) << axis;
            let marks = mark(0) | mark(1) | mark(2);
            if marks == 0 {
                continue;
            }
            let at = place_of(cell_number(cell));
            let cut = own.first_vertex(rank).cut;
            // In the same cluster all around, which has one vertex: no polygon.
            let inner = if cut.level() > 0 && !cut.is_multi() {
                let low = (1 << cut.level()) - 1;
                let brick = cut.brick_in_it();
                let is_inner = |a: usize| at[a] & low != 0 || brick[a] != 0;
                (0..3).fold(0_u8, |inner, a| inner | u8::from(is_inner(a)) << a)
            } else {
                0
            };
            for axis in 0..3 {
                if marks >> axis & 1 == 0 {
                    continue;
                }
                let own = self.nb.own();
                let (offset, surface) = (own.offsets[next_offset], own.surface(next_offset));
                let source = own.source(next_offset);
                next_offset += 1;
                if (inner | 1 << axis) == 7 {
                    let vertex = *own.first_vertex(rank);
                    self.add_inner(&[Patch { slot: OWN, vertex }], surface.zip(source), &mut out);
                    continue;
                }
                let edge = Edge { axis, lower: at.map(|c| c as i32) };
                if surface.is_none() && edge.is_between_two(&self.nb) {
                    continue;
                }
                if let Some(ring) = self.draw(edge, offset, mask & 1 == 1, &mut out)? {
                    self.add_inner(&ring, surface.zip(source), &mut out);
                }
                if let Some(surface) = surface {
                    out.surfaces.resize(out.indices.len(), surface);
                }
                if let Some(source) = source {
                    out.sources.resize(out.indices.len(), source);
                }
            }
        }
        out.stats.least_angle_deg = out.angles.least_deg();
        Ok(out)
    }

    /// Adds a crossing that has no polygon to the vertices around it, if it is told what it is.
    fn add_inner(&self, around: &[Patch], told: Option<(Surface, u32)>, out: &mut BrickTriangles) {
        let Some((surface, source)) = told else { return };
        for patch in around {
            let Corner { number: vertex, position } = self.corner(patch);
            let is_known = out.inner.last().is_some_and(|last| {
                (last.vertex, last.surface, last.source) == (vertex, surface, source)
            });
            if !is_known {
                let position = self.nb.to_model(position);
                out.inner.push(InnerCrossing { vertex, position, surface, source });
            }
        }
    }

    /// Draws the polygon around an edge; what is around it where there is none.
    #[inline]
    fn draw(
        &mut self,
        edge: Edge,
        offset: u16,
        inside_below: bool,
        out: &mut BrickTriangles,
    ) -> Result<Option<[Patch; 4]>, ContourError> {
        let ring = edge.ring(&mut self.nb)?;
        if Polygon::turns(&ring) < 3 {
            return Ok(Some(ring));
        }
        let crossing = self.nb.crossing_at(edge.axis, edge.lower, offset);
        if ring.iter().all(|patch| patch.vertex.cut.is_plain()) {
            out.stats.polygons += 1;
            let corners = ring.map(|patch| patch.vertex.position.map(i64::from));
            let quad = Quad { corners, axis: edge.axis, crossing: crossing.map(i64::from) };
            let cell_units = i64::from(self.nb.cell_units());
            let cut = if self.is_careful { quad.cut(cell_units) } else { quad.shorter_diagonal() };
            let [p, q, r, s] = ring.map(|patch| self.corner(&patch));
            match cut {
                Cut::FirstThird => self.add(&[[p, q, r], [p, r, s]], inside_below, out),
                Cut::SecondFourth => self.add(&[[q, r, s], [q, s, p]], inside_below, out),
                Cut::Fan => self.add_fan(&[p, q, r, s], crossing, inside_below, out),
            }
            return Ok(None);
        }
        let Some(polygon) = Polygon::of_ring(edge, ring) else { return Ok(Some(ring)) };
        out.stats.polygons += 1;
        self.draw_among_cells(&polygon, crossing, inside_below, out)?;
        Ok(None)
    }

    /// Draws a polygon between cells of any size.
    fn draw_among_cells(
        &mut self,
        polygon: &Polygon,
        crossing: [i32; 3],
        inside_below: bool,
        out: &mut BrickTriangles,
    ) -> Result<(), ContourError> {
        let mut ring = Loop::new(polygon.edge.axis, crossing, inside_below);
        let mut corners = [Corner { number: 0, position: [0; 3] }; 8];
        let mut is_flagged = false;
        for (i, patch) in polygon.patches().iter().enumerate() {
            corners[ring.points().len()] = self.corner(patch);
            ring.push(LoopPoint::of_vertex(patch));
            is_flagged |= patch.vertex.cut.is_flagged();
            let arc = polygon.arc(i);
            if arc.is_explicit(self.nb.cell_units()) {
                let (brick, point) = if arc.is_far() {
                    let (owner, key) = arc.far_key();
                    (owner, self.nb.far_point(owner, key)?)
                } else {
                    let slot = arc.upper.slot;
                    let point = self.nb.sound_brick(slot)?.point(arc.key());
                    (self.nb.number_of(slot), point)
                };
                let Some((number, position)) = point else {
                    return Err(self.nb.contradiction("a vertex on a face that a segment misses"));
                };
                let number = self.bases[brick] + number;
                corners[ring.points().len()] = Corner { number, position };
                ring.push(LoopPoint { position, id: 0, is_leaf: false, is_face_point: true });
            }
        }
        let cell_units = self.nb.cell_units();
        let is_fan = is_flagged
            || polygon.patches().iter().enumerate().any(|(i, patch)| {
                patch.vertex.cut.is_multi() && polygon.has_missed_arc_off(i, cell_units)
            });
        let ends = if is_fan { None } else { polygon.minimal_edge(&mut self.nb)? };
        let shape = ring.shape(ends);
        if shape == Shape::Fan {
            self.add_fan(&corners[..ring.points().len()], crossing, inside_below, out);
        }
        for numbers in shape.triangles() {
            self.add(&[numbers.map(|i| corners[i])], inside_below, out);
        }
        Ok(())
    }

    #[inline]
    fn corner(&self, patch: &Patch) -> Corner {
        let number = if patch.vertex.cut.is_above() {
            self.bases[patch.vertex.number as usize]
        } else {
            self.bases[self.nb.number_of(patch.slot)] + patch.vertex.number
        };
        Corner { number, position: patch.vertex.position }
    }

    /// Adds triangles, seen from outside.
    #[inline]
    fn add(&self, triangles: &[[Corner; 3]], inside_below: bool, out: &mut BrickTriangles) {
        for &(mut triangle) in triangles {
            if !inside_below {
                triangle.swap(1, 2);
            }
            let positions = triangle.map(|corner| corner.position);
            out.stats.sum_of_least_angles_deg += out.angles.note(positions);
            out.indices.push(triangle.map(|corner| corner.number));
            if self.with_corners {
                out.corners.push(triangle.map(|corner| self.nb.to_model(corner.position)));
            }
        }
    }

    fn add_fan(
        &self,
        ring: &[Corner],
        crossing: [i32; 3],
        inside_below: bool,
        out: &mut BrickTriangles,
    ) {
        let number = FAN_POINT | out.fan_points.len() as u32;
        let centre = Corner { number, position: crossing };
        for (i, &corner) in ring.iter().enumerate() {
            self.add(&[[centre, corner, ring[(i + 1) % ring.len()]]], inside_below, out);
        }
        out.fan_points.push(self.nb.to_model(crossing));
        out.stats.fans += 1;
    }
}
