//! A brick of cells, or its side that touches another brick, ready to be looked up in.
//!
//! Memory:     some 16 bytes a cell and 24 a vertex.

use crate::contour::ContourError;
use crate::contour::mdc::cell::{OWN_EDGES, cell_mask, cell_number, components_of, number_at};
use crate::contour::mdc::cut_cell::CutCell;
use crate::contour::mdc::table::NO_COMPONENT;
use crate::mesh::Surface;
use crate::octree::{ArchivedCellBrick, BrickKey, SIDE};

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

/// Walks the cells of the cut along the leaf cells.
struct CutWalk<'r> {
    record: &'r ArchivedCellBrick,
    cluster: usize,
    member: usize,
    flagged: usize,
    reach: usize,
    /// First vertex of the cell of the cut under way.
    vertex: u32,
    /// End of the cluster under way, in leaf numbers, and how many vertices it has.
    end: usize,
    count: u32,
    cut: CutCell,
}

impl<'r> CutWalk<'r> {
    fn new(record: &'r ArchivedCellBrick) -> Self {
        let cut = CutCell::new(0, 0, false, false);
        Self {
            record,
            cluster: 0,
            member: 0,
            flagged: 0,
            reach: 0,
            vertex: 0,
            end: 0,
            count: 0,
            cut,
        }
    }

    fn is_flagged(&mut self, first: usize) -> bool {
        let flagged = &self.record.flagged;
        while flagged.get(self.flagged).is_some_and(|f| usize::from(f.to_native()) < first) {
            self.flagged += 1;
        }
        flagged.get(self.flagged).is_some_and(|f| usize::from(f.to_native()) == first)
    }

    /// The face that the vertex of a leaf cell reaches through.
    #[inline]
    fn reaches(&mut self, number: usize) -> Option<u8> {
        let reaches = &self.record.reaches;
        while reaches.get(self.reach).is_some_and(|r| usize::from(r.cell.to_native()) < number) {
            self.reach += 1;
        }
        let reach = reaches.get(self.reach)?;
        (reach.is_granted && usize::from(reach.cell.to_native()) == number).then_some(reach.face)
    }

    /// The cell of the cut that the leaf cell lies in, with its first vertex; the leaf's components
    /// have the vertices that `member` tells.
    #[inline]
    fn step(&mut self, number: usize, components: u32) -> (CutCell, u32, bool) {
        if number < self.end {
            return (self.cut, self.vertex - self.count, true);
        }
        if let Some(cluster) = self.record.clusters.get(self.cluster) {
            let cluster = cluster.to_native();
            let (first, level) = ((cluster & 0x7fff) as usize, cluster >> 15 & 7);
            if first <= number {
                self.cluster += 1;
                self.end = first + (1 << (3 * level));
                self.count = cluster >> 18;
                self.vertex += self.count;
                let flagged = self.is_flagged(first);
                self.cut = CutCell::new(first, level, flagged, self.count > 1);
                return (self.cut, self.vertex - self.count, true);
            }
        }
        let flagged = !self.record.flagged.is_empty() && self.is_flagged(number);
        let mut cut = CutCell::new(number, 0, flagged, components > 1);
        if let Some(face) = self.reaches(number) {
            cut = cut.reaching(face);
        }
        self.vertex += components;
        (cut, self.vertex - components, false)
    }

    /// Whether a leaf cell lies in the cluster under way, which has one vertex: then there is nothing to
    /// step over.
    #[inline]
    fn is_in_one_vertex(&self, number: usize) -> bool {
        number < self.end && self.count == 1
    }

    /// Which vertex of its cluster, which has several, the next component has.
    fn member(&mut self) -> Option<u32> {
        self.member += 1;
        self.record.members.get(self.member - 1).map(|member| u32::from(*member))
    }
}

impl Loaded {
    /// Loads a brick that lies `steps` bricks away along each axis, -1, 0 or 1: of its cells those
    /// that touch the brick it is seen from, and all of them when it is that brick.
    ///
    /// # Errors
    /// [`ContourError::Contradiction`].
    pub fn new(
        record: &ArchivedCellBrick,
        key: BrickKey,
        steps: [i32; 3],
        brick_units: i64,
    ) -> Result<Self, ContourError> {
        let shift = steps.map(|step| step * brick_units as i32);
        let moved =
            |position: [i32; 3]| -> [i32; 3] { std::array::from_fn(|a| position[a] + shift[a]) };
        let wrong = |expected| ContourError::Contradiction { brick: key.position(), expected };
        let is_whole = steps == [0; 3];
        let above = record.above.as_ref().map(|above| Vertex {
            number: above.owner.to_native(),
            position: moved(above.position.map(|c| c.to_native())),
            cut: CutCell::above(above.level.to_native(), key.position()),
        });
        let mut loaded = Self::with_room(if is_whole { record.cells.len() } else { 0 });
        loaded.vertices.extend(above);
        let mut walk = CutWalk::new(record);
        let mut offset = 0;
        let (side_bits, side) = side_of(steps);
        // The vertex of the cluster under way, if it has one, and where the cluster ends.
        let mut shared = (0, 0);
        for cell in record.cells.iter() {
            let cell = cell.to_native();
            let first_offset = offset;
            offset += usize::from(OWN_EDGES[usize::from(cell_mask(cell))]);
            let number = cell_number(cell);
            let is_wanted = number & side_bits == side;
            let goes_on = walk.is_in_one_vertex(number);
            if !is_wanted && goes_on {
                continue;
            }
            if is_wanted {
                loaded.cells.push(cell);
                loaded.offset_firsts.push(loaded.offsets.len() as u32);
                let own = record.offsets.get(first_offset..offset);
                let own = own.ok_or_else(|| wrong("an offset for every own edge"))?;
                loaded.offsets.extend(own.iter().map(|offset| offset.to_native()));
            }
            if goes_on && number < shared.1 {
                loaded.firsts.push(shared.0 | SHARED);
                continue;
            }
            let count = u32::from(components_of(cell).count);
            let (cut, first, is_cluster) = walk.step(number, count);
            if above.is_some() {
                if is_wanted {
                    loaded.firsts.push(SHARED);
                }
                continue;
            }
            let vertex_of = |number: u32| {
                let position = record.positions.get(number as usize);
                let position = position.ok_or_else(|| wrong("a position for every vertex"))?;
                let position = moved(position.map(|c| c.to_native()));
                Ok::<_, ContourError>(Vertex { number, position, cut })
            };
            let next = loaded.vertices.len() as u32;
            if walk.is_in_one_vertex(number) {
                if is_wanted {
                    shared = (next, walk.end);
                    loaded.firsts.push(next | SHARED);
                    loaded.vertices.push(vertex_of(first)?);
                }
                continue;
            }
            if is_wanted {
                loaded.firsts.push(next);
            }
            for component in 0..count {
                let number = if is_cluster {
                    first + walk.member().ok_or_else(|| wrong("a member for every component"))?
                } else {
                    first + component
                };
                if is_wanted {
                    loaded.vertices.push(vertex_of(number)?);
                }
            }
        }
        if is_whole {
            if record.surfaces.len() > 1 && record.surfaces.len() != record.offsets.len() {
                return Err(wrong("a surface for every own edge"));
            }
            if record.sources.len() > 1 && record.sources.len() != record.offsets.len() {
                return Err(wrong("a source for every own edge"));
            }
            loaded.surfaces.extend(record.surfaces.iter().map(|surface| surface.to_native()));
            loaded.sources.extend(record.sources.iter().map(|source| source.to_native()));
        }
        let first = record.positions.len() as u32;
        for (number, point) in (first..).zip(record.points.iter()) {
            loaded.points.push((point.key.to_native(), number));
            loaded.point_positions.push(moved(point.position.map(|c| c.to_native())));
        }
        Ok(loaded)
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

    fn with_room(cells: usize) -> Self {
        Self {
            cells: Vec::with_capacity(cells),
            firsts: Vec::with_capacity(cells),
            vertices: Vec::with_capacity(cells / 2),
            offset_firsts: Vec::with_capacity(cells),
            offsets: Vec::with_capacity(cells + cells / 2),
            surfaces: Vec::new(),
            sources: Vec::new(),
            points: Vec::new(),
            point_positions: Vec::new(),
        }
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
