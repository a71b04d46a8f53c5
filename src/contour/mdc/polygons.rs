//! Joins vertices into polygons around crossed edges, brick by brick.
//!
//! A brick owns the edges that leave the min corners of its cells; the cells around such an edge
//! lie in the brick and its seven lower neighbours, all of which come earlier in Morton order.

use crate::contour::mdc::table::edge_at_corner;
use crate::contour::mdc::triangulate::{Cut, Quad};
use crate::contour::mdc::{cell_mask, cell_number, components_of};
use crate::contour::{ContourError, ContourStats};
use crate::octree::{ArchivedCellBrick, BrickKey, Domain, SIDE, decode_cells};
use crate::store::BrickFile;

/// The triangles of one brick.
#[derive(Default)]
pub struct BrickTriangles {
    /// Global vertex numbers; fan points are numbered from [`FAN_POINT`] up within the brick.
    pub indices: Vec<[u32; 3]>,
    /// Positions of the corners in model units; empty unless asked for.
    pub corners: Vec<[[f64; 3]; 3]>,
    /// Fan points in model units.
    pub fan_points: Vec<[f64; 3]>,
    /// Counts.
    pub stats: ContourStats,
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
    cells: &'p BrickFile,
    /// First vertex of every brick.
    bases: &'p [u32],
    domain: Domain,
    with_corners: bool,
    /// Rank of each cell of the brick in its list, while the brick is under way.
    ranks: Vec<u16>,
}

/// No cell of the brick has this rank: the list has at most 32768.
const NO_RANK: u16 = u16::MAX;

/// Cells from one to the next along the axes that are set.
const STEPS: [usize; 8] = {
    let mut steps = [0; 8];
    let mut axes = 0;
    while axes < 8 {
        steps[axes] = (axes & 1) + SIDE * (axes >> 1 & 1) + SIDE * SIDE * (axes >> 2);
        axes += 1;
    }
    steps
};

/// The four cells around the lower edge of a cell along each axis: the axes along which each lies
/// one step down, and the number of the edge there.
const AROUND: [[(u8, u8); 4]; 3] = {
    let mut around = [[(0, 0); 4]; 3];
    let mut axis = 0;
    while axis < 3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let downs = [u | v, v, 0, u];
        let mut slot = 0;
        while slot < 4 {
            around[axis][slot] = (downs[slot], edge_at_corner(downs[slot], axis as u8));
            slot += 1;
        }
        axis += 1;
    }
    around
};

/// What is needed of a brick to look up its vertices: all of the own one, of a neighbour the cells
/// on the sides where it touches.
struct Loaded {
    /// Packed cells, ascending.
    cells: Vec<u32>,
    /// First vertex of each cell in `positions`, and its global number.
    firsts: Vec<(u32, u32)>,
    /// Positions of their vertices, in units from the own brick's min corner.
    positions: Vec<[i32; 3]>,
}

/// A vertex: its global number and its place.
#[derive(Clone, Copy)]
struct Vertex {
    number: u32,
    position: [i32; 3],
}

impl<'p> Polygons<'p> {
    /// A maker of triangles over all bricks; `bases` are the numbers of their first vertices.
    #[must_use]
    pub fn new(
        cells: &'p BrickFile,
        bases: &'p [u32],
        domain: &Domain,
        with_corners: bool,
    ) -> Self {
        let ranks = vec![NO_RANK; SIDE * SIDE * SIDE];
        Self { cells, bases, domain: *domain, with_corners, ranks }
    }

    /// Loads brick `number`, which lies one step down along the axes set in `beyond`.
    fn load(&self, number: usize, beyond: u32) -> Result<Loaded, ContourError> {
        let view = self.cells.view(number)?;
        self.load_from(decode_cells(&view)?, number, beyond)
    }

    fn load_from(
        &self,
        record: &ArchivedCellBrick,
        number: usize,
        beyond: u32,
    ) -> Result<Loaded, ContourError> {
        let side = self.domain.brick_units() as i32;
        let shift: [i32; 3] = std::array::from_fn(|a| (beyond >> a & 1) as i32 * side);
        let mut loaded = Loaded { cells: Vec::new(), firsts: Vec::new(), positions: Vec::new() };
        let mut first = 0;
        for cell in record.cells.iter() {
            let cell = cell.to_native();
            let count = u32::from(components_of(cell).count);
            if touches(cell_number(cell), beyond) {
                loaded.cells.push(cell);
                loaded.firsts.push((loaded.positions.len() as u32, self.bases[number] + first));
                let range = first as usize..(first + count) as usize;
                let positions = record.positions.get(range).ok_or(ContourError::Contradiction {
                    brick: BrickKey(self.cells.directory()[number].key).position(),
                    expected: "a position for every vertex",
                })?;
                loaded.positions.extend(positions.iter().map(|position| {
                    std::array::from_fn::<_, 3, _>(|a| position[a].to_native() - shift[a])
                }));
            }
            first += count;
        }
        Ok(loaded)
    }

    /// The triangles around the edges that brick `number` owns.
    ///
    /// # Errors
    /// [`ContourError`]: a neighbour is missing, which sound bricks never miss.
    pub fn triangles(&mut self, number: usize) -> Result<BrickTriangles, ContourError> {
        let key = BrickKey(self.cells.directory()[number].key);
        let view = self.cells.view(number)?;
        let record = decode_cells(&view)?;
        let own = self.load_from(record, number, 0)?;
        self.ranks.fill(NO_RANK);
        for (rank, cell) in record.cells.iter().enumerate() {
            self.ranks[cell_number(cell.to_native())] = rank as u16;
        }
        let mut bricks: [Option<Loaded>; 8] = [const { None }; 8];
        bricks[0] = Some(own);
        let mut out = BrickTriangles::default();
        out.indices.reserve(2 * record.offsets.len());
        let mut offsets = record.offsets.iter();
        for cell in record.cells.iter() {
            let cell = cell.to_native();
            let mask = cell_mask(cell);
            let n = cell_number(cell);
            let at = [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE];
            for axis in 0..3 {
                if (mask ^ mask >> (1 << axis)) & 1 == 0 {
                    continue;
                }
                let offset = offsets.next().ok_or(ContourError::Contradiction {
                    brick: key.position(),
                    expected: "an offset for every own edge",
                })?;
                let ring = self.ring(&mut bricks, key, at, axis)?;
                let quad = self.quad(&ring, at, axis, offset.to_native());
                self.emit(&quad, &ring, mask & 1 == 1, key, &mut out);
            }
        }
        Ok(out)
    }

    /// The four vertices around the edge along `axis` from the min corner of cell `at`.
    #[inline]
    fn ring(
        &self,
        bricks: &mut [Option<Loaded>; 8],
        key: BrickKey,
        at: [usize; 3],
        axis: usize,
    ) -> Result<[Vertex; 4], ContourError> {
        let here = at[0] + SIDE * (at[1] + SIDE * at[2]);
        let low = (0..3).fold(0, |low, a| low | u8::from(at[a] == 0) << a);
        let mut ring = [Vertex { number: 0, position: [0; 3] }; 4];
        for (vertex, (down, edge)) in ring.iter_mut().zip(AROUND[axis]) {
            let beyond = down & low;
            let cell =
                here + (SIDE - 1) * STEPS[usize::from(beyond)] - STEPS[usize::from(down & !beyond)];
            *vertex = self.vertex(bricks, key, u32::from(beyond), cell, edge)?;
        }
        Ok(ring)
    }

    /// The vertex of the component that `edge` belongs to in cell `number` of the brick `beyond`.
    #[inline]
    fn vertex(
        &self,
        bricks: &mut [Option<Loaded>; 8],
        key: BrickKey,
        beyond: u32,
        number: usize,
        edge: u8,
    ) -> Result<Vertex, ContourError> {
        let missing = || ContourError::Contradiction {
            brick: key.position(),
            expected: "a cell with a vertex on every side of a crossed edge",
        };
        let slot = &mut bricks[beyond as usize];
        if slot.is_none() {
            let neighbour = key.lower(beyond).ok_or_else(missing)?;
            *slot = Some(self.load(self.cells.find(neighbour.0).ok_or_else(missing)?, beyond)?);
        }
        let brick = slot.as_ref().ok_or_else(missing)?;
        let rank = if beyond == 0 {
            Some(usize::from(self.ranks[number])).filter(|&rank| rank != usize::from(NO_RANK))
        } else {
            brick.cells.binary_search_by_key(&number, |&cell| cell_number(cell)).ok()
        };
        let rank = rank.ok_or_else(missing)?;
        let component = components_of(brick.cells[rank]).component_of_edge[usize::from(edge)];
        let (at, global) = brick.firsts[rank];
        let position = brick.positions.get((at + u32::from(component)) as usize);
        let position = *position.ok_or_else(missing)?;
        Ok(Vertex { number: global + u32::from(component), position })
    }

    fn quad(&self, ring: &[Vertex; 4], at: [usize; 3], axis: usize, offset: u16) -> Quad {
        let cell = i64::from(self.domain.cell_units);
        let mut crossing = at.map(|c| c as i64 * cell);
        let units = (i64::from(offset) * cell + (1 << 15)) >> 16;
        crossing[axis] += units.clamp(1, cell - 1);
        Quad { corners: ring.map(|vertex| vertex.position.map(i64::from)), axis, crossing }
    }

    /// Cuts the quad and adds its triangles, seen from outside.
    fn emit(
        &self,
        quad: &Quad,
        ring: &[Vertex; 4],
        inside_below: bool,
        key: BrickKey,
        out: &mut BrickTriangles,
    ) {
        let [p, q, r, s] = *ring;
        out.stats.polygons += 1;
        let mut add = |mut triangle: [Vertex; 3]| {
            if !inside_below {
                triangle.swap(1, 2);
            }
            out.indices.push(triangle.map(|vertex| vertex.number));
            if self.with_corners {
                out.corners.push(
                    triangle.map(|vertex| self.to_model(key, vertex.position.map(i64::from))),
                );
            }
        };
        match quad.cut(i64::from(self.domain.cell_units)) {
            Cut::FirstThird => [[p, q, r], [p, r, s]].into_iter().for_each(add),
            Cut::SecondFourth => [[q, r, s], [q, s, p]].into_iter().for_each(add),
            Cut::Fan => {
                let number = FAN_POINT | out.fan_points.len() as u32;
                let centre = Vertex { number, position: quad.crossing.map(|c| c as i32) };
                [[p, q], [q, r], [r, s], [s, p]].into_iter().for_each(|[a, b]| add([centre, a, b]));
                out.fan_points.push(self.to_model(key, quad.crossing));
                out.stats.fans += 1;
            }
        }
    }

    fn to_model(&self, key: BrickKey, position: [i64; 3]) -> [f64; 3] {
        let (brick, side) = (key.position(), self.domain.brick_units());
        let lattice = std::array::from_fn(|a| i64::from(brick[a]) * side + position[a]);
        self.domain.to_model(lattice)
    }
}

/// Whether a cell lies on the max side of every axis set in `beyond`.
const fn touches(number: usize, beyond: u32) -> bool {
    let at = [number % SIDE, number / SIDE % SIDE, number / SIDE / SIDE];
    (beyond & 1 == 0 || at[0] == SIDE - 1)
        && (beyond & 2 == 0 || at[1] == SIDE - 1)
        && (beyond & 4 == 0 || at[2] == SIDE - 1)
}
