//! A brick of cells, or its side that touches another brick, ready to be looked up in.
//!
//! Memory:     some 16 bytes a cell and 24 a vertex.

use crate::contour::ContourError;
use crate::contour::mdc::cell::{OWN_EDGES, cell_mask, cell_number, components_of, number_at};
use crate::contour::mdc::cut_cell::CutCell;
use crate::contour::mdc::cut_walk::CutWalk;
use crate::contour::mdc::table::NO_COMPONENT;
use crate::mesh::Surface;
use crate::octree::{ArchivedCellBrick, ArchivedFacePoint, BrickKey, SIDE};

/// A vertex of a brick.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Its number in the brick; of a cell above the brick, the number of the brick that owns it.
    pub number: u32,
    /// Units from the min corner of the brick that looks.
    pub position: [i32; 3],
    /// Its cell, in its own brick.
    pub cut: CutCell,
}

/// In the number of the first vertex of a cell: all its components have it.
const SHARED: u32 = 1 << 31;

/// A brick as seen from another, or from itself.
#[derive(Default)]
pub struct Loaded {
    /// Packed cells, ascending.
    pub cells: Vec<u32>,
    /// The first vertex of each cell; with [`SHARED`] that of all its components.
    firsts: Vec<u32>,
    /// The vertices of the cells: one for every component, and one of a cluster that has no other.
    vertices: Vec<Vertex>,
    /// First offset of each cell.
    pub offset_firsts: Vec<u32>,
    /// Offsets of the crossings on own edges.
    pub offsets: Vec<u16>,
    /// What those crossings are, as in the record.
    pub surfaces: Vec<u32>,
    /// Their source triangles, likewise.
    pub sources: Vec<u32>,
    /// Keys and numbers of the vertices on faces.
    pub points: Vec<(u64, u32)>,
    /// Their positions, as those of vertices.
    pub point_positions: Vec<[i32; 3]>,
}

impl Loaded {
    /// Loads a brick that lies `steps` bricks away along each axis, -1, 0 or 1: of its cells those
    /// that touch the brick it is seen from, and all of them when it is that brick. It takes the room of
    /// `spare`, one that is not needed any more.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn new(
        spare: Self,
        (record, points): (&ArchivedCellBrick, &[ArchivedFacePoint]),
        key: BrickKey,
        steps: [i32; 3],
        brick_units: i64,
    ) -> Result<Self, ContourError> {
        let is_whole = steps == [0; 3];
        let shift = steps.map(|step| step * brick_units as i32);
        let mut filling = Filling::new(spare, record, key, shift);
        let (side_bits, side) = side_of(steps);
        for cell in record.cells.iter() {
            let cell = cell.to_native();
            let number = cell_number(cell);
            let is_wanted = number & side_bits == side;
            if !is_wanted && filling.walk.is_in_one_vertex(number) {
                filling.pass_over(cell);
            } else {
                filling.pass(cell, is_wanted)?;
            }
        }
        if is_whole {
            filling.add_surfaces()?;
        }
        filling.add_points(points);
        Ok(filling.loaded)
    }

    /// The place in the list of vertices of that of the component that crosses `edge`, of the cell with this
    /// rank.
    #[inline]
    pub fn place_of_vertex(&self, rank: usize, edge: u8) -> usize {
        let first = self.firsts[rank];
        if first & SHARED != 0 {
            return (first & !SHARED) as usize;
        }
        let component = components_of(self.cells[rank]).component_of_edge[usize::from(edge)];
        debug_assert!(component != NO_COMPONENT);
        first as usize + usize::from(component)
    }

    /// A vertex by its place in the list.
    #[inline]
    pub fn vertex(&self, place: usize) -> Vertex {
        self.vertices[place]
    }

    /// The first vertex of the cell with this rank.
    #[inline]
    pub fn first_vertex(&self, rank: usize) -> &Vertex {
        &self.vertices[(self.firsts[rank] & !SHARED) as usize]
    }

    /// Nothing, with the same room.
    fn clear(&mut self) {
        let Self {
            cells,
            firsts,
            vertices,
            offset_firsts,
            offsets,
            surfaces,
            sources,
            points,
            point_positions,
        } = self;
        cells.clear();
        firsts.clear();
        vertices.clear();
        offset_firsts.clear();
        offsets.clear();
        surfaces.clear();
        sources.clear();
        points.clear();
        point_positions.clear();
    }

    /// What a crossing is, by its place among the offsets; `None` where nothing is told.
    #[inline]
    pub fn surface(&self, offset: usize) -> Option<Surface> {
        let known = if self.surfaces.len() > 1 { offset } else { 0 };
        self.surfaces.get(known).map(|bits| Surface::from_bits(*bits))
    }

    /// The source triangle of a crossing, likewise.
    #[inline]
    pub fn source(&self, offset: usize) -> Option<u32> {
        let known = if self.sources.len() > 1 { offset } else { 0 };
        self.sources.get(known).copied()
    }

    /// The vertex on a face, if there is one.
    pub fn point(&self, key: u64) -> Option<(u32, [i32; 3])> {
        let at = self.points.binary_search_by_key(&key, |point| point.0).ok()?;
        Some((self.points[at].1, self.point_positions[at]))
    }
}

/// A brick on the way into memory.
struct Filling<'r> {
    record: &'r ArchivedCellBrick,
    key: BrickKey,
    /// From its min corner to that of the brick that looks, lattice units.
    shift: [i32; 3],
    walk: CutWalk<'r>,
    /// First own edge of the cell to come.
    offset: usize,
    /// The vertex of the cluster under way, if it has but one, and where the cluster ends.
    shared: (u32, usize),
    loaded: Loaded,
}

impl<'r> Filling<'r> {
    fn new(
        mut loaded: Loaded,
        record: &'r ArchivedCellBrick,
        key: BrickKey,
        shift: [i32; 3],
    ) -> Self {
        loaded.clear();
        let walk = CutWalk::new(record);
        let mut filling = Self { record, key, shift, walk, offset: 0, shared: (0, 0), loaded };
        let above = record.above.as_ref().map(|above| Vertex {
            number: above.owner.to_native(),
            position: filling.moved(above.position.map(|c| c.to_native())),
            cut: CutCell::above(above.level.to_native(), key.position()),
        });
        filling.loaded.vertices.extend(above);
        filling
    }

    fn moved(&self, position: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|a| position[a] + self.shift[a])
    }

    fn wrong(&self, expected: &'static str) -> ContourError {
        ContourError::Contradiction { brick: self.key.position(), expected }
    }

    fn vertex(&self, number: u32, cut: CutCell) -> Result<Vertex, ContourError> {
        let position = self.record.positions.get(number as usize);
        let position = position.ok_or_else(|| self.wrong("a position for every vertex"))?;
        Ok(Vertex { number, position: self.moved(position.map(|c| c.to_native())), cut })
    }

    /// Passes the next cell, which needs nothing but to be passed.
    #[inline]
    fn pass_over(&mut self, cell: u32) {
        self.offset += usize::from(OWN_EDGES[usize::from(cell_mask(cell))]);
    }

    /// Passes the next cell, and adds it if it is wanted.
    #[inline]
    fn pass(&mut self, cell: u32, is_wanted: bool) -> Result<(), ContourError> {
        let first_offset = self.offset;
        self.pass_over(cell);
        if is_wanted {
            let number = cell_number(cell);
            let goes_on = self.walk.is_in_one_vertex(number);
            self.loaded.cells.push(cell);
            self.loaded.offset_firsts.push(self.loaded.offsets.len() as u32);
            let own = self.record.offsets.get(first_offset..self.offset);
            let own = own.ok_or_else(|| self.wrong("an offset for every own edge"))?;
            self.loaded.offsets.extend(own.iter().map(|offset| offset.to_native()));
            if goes_on && number < self.shared.1 {
                self.loaded.firsts.push(self.shared.0 | SHARED);
                return Ok(());
            }
        }
        self.pass_vertices(cell, is_wanted)
    }

    /// The same of the vertices of its components.
    fn pass_vertices(&mut self, cell: u32, is_wanted: bool) -> Result<(), ContourError> {
        let number = cell_number(cell);
        let count = u32::from(components_of(cell).count);
        let (cut, first, is_cluster) = self.walk.step(number, count);
        let next = self.loaded.vertices.len() as u32;
        if self.record.above.is_some() {
            self.loaded.firsts.extend(is_wanted.then_some(SHARED));
            return Ok(());
        }
        if self.walk.is_in_one_vertex(number) {
            if is_wanted {
                self.shared = (next, self.walk.end());
                self.loaded.firsts.push(next | SHARED);
                self.loaded.vertices.push(self.vertex(first, cut)?);
            }
            return Ok(());
        }
        self.loaded.firsts.extend(is_wanted.then_some(next));
        for component in 0..count {
            let vertex = if is_cluster {
                let member = self.walk.member();
                first + member.ok_or_else(|| self.wrong("a member for every component"))?
            } else {
                first + component
            };
            if is_wanted {
                self.loaded.vertices.push(self.vertex(vertex, cut)?);
            }
        }
        Ok(())
    }

    /// What the crossings are, and where they come from.
    fn add_surfaces(&mut self) -> Result<(), ContourError> {
        let record = self.record;
        if record.surfaces.len() > 1 && record.surfaces.len() != record.offsets.len() {
            return Err(self.wrong("a surface for every own edge"));
        }
        if record.sources.len() > 1 && record.sources.len() != record.offsets.len() {
            return Err(self.wrong("a source for every own edge"));
        }
        self.loaded.surfaces.extend(record.surfaces.iter().map(|surface| surface.to_native()));
        self.loaded.sources.extend(record.sources.iter().map(|source| source.to_native()));
        Ok(())
    }

    /// The vertices on its faces.
    fn add_points(&mut self, points: &[ArchivedFacePoint]) {
        let first = self.record.positions.len() as u32;
        for (number, point) in (first..).zip(points) {
            self.loaded.points.push((point.key.to_native(), number));
            let position = self.moved(point.position.map(|c| c.to_native()));
            self.loaded.point_positions.push(position);
        }
    }
}

/// The key of a vertex on the face across `axis` between the vertices `upper` of the brick that
/// owns the face and `lower`, which may lie in the brick below.
pub fn face_point_key(axis: usize, is_beyond: bool, upper: u32, lower: u32) -> u64 {
    (axis as u64) << 62 | u64::from(is_beyond) << 61 | u64::from(upper) << 24 | u64::from(lower)
}

/// The key of a vertex on the face across `axis` between two cells above the brick, in the brick
/// that owns the vertex of the smaller one, which is the upper one or the lower one.
pub fn far_point_key(axis: usize, is_upper: bool) -> u64 {
    (axis as u64) << 62 | 1 << 60 | u64::from(is_upper) << 59
}

/// Bits of the number of a cell of a brick so many steps away, and what they are where the cell touches the
/// brick at no steps.
fn side_of(steps: [i32; 3]) -> (usize, usize) {
    let along = |wanted: fn(i32) -> bool| {
        number_at(steps.map(|step| if wanted(step) { SIDE - 1 } else { 0 }))
    };
    (along(|step| step != 0), along(|step| step < 0))
}
