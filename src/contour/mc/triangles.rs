//! Makes the triangles of one brick after another.
//!
//! A brick draws the triangles of its cells. Edges on its max sides belong to its seven upper
//! neighbours; of those the cells at the sides where they touch are loaded, one brick at a time.

use crate::contour::ContourError;
use crate::contour::mc::cycles::CYCLES;
use crate::contour::mc::hull::cut;
use crate::contour::mc::{cell_mask, cell_number, checked};
use crate::contour::mdc::BrickTriangles;
use crate::contour::mdc::table::{axis_of_edge, corner_of_edge, is_marked};
use crate::octree::{BrickKey, Domain, EdgeBrick, SIDE, decode_edges};
use crate::store::BrickFile;

/// Makes the triangles of one brick after another.
pub struct Triangles<'t> {
    cells: &'t BrickFile,
    /// First vertex of every brick.
    bases: &'t [u32],
    domain: Domain,
    with_corners: bool,
    /// Rank of each cell of the brick in its list, while the brick is under way.
    ranks: Vec<u16>,
}

/// No cell of the brick has this rank: the list has at most 32768.
const NO_RANK: u16 = u16::MAX;

/// A cell and the crossings on the edges that leave its min corner.
#[derive(Clone, Copy)]
struct Owner {
    /// Number and mask.
    cell: u32,
    /// Global number of the first of its vertices.
    first: u32,
    /// Where each axis is crossed.
    places: [u32; 3],
}

/// A vertex: its global number, and its place from the cell's min corner.
#[derive(Clone, Copy, Default)]
struct Vertex {
    number: u32,
    position: [i64; 3],
}

impl<'t> Triangles<'t> {
    /// A maker of triangles over all bricks; `bases` are the numbers of their first vertices.
    #[must_use]
    pub fn new(
        cells: &'t BrickFile,
        bases: &'t [u32],
        domain: &Domain,
        with_corners: bool,
    ) -> Self {
        let ranks = vec![NO_RANK; SIDE * SIDE * SIDE];
        Self { cells, bases, domain: *domain, with_corners, ranks }
    }

    /// The cells of brick `number` that lie on the min side of every axis set in `beyond`.
    fn load(&self, number: usize, beyond: u8) -> Result<Vec<Owner>, ContourError> {
        let view = self.cells.view(number)?;
        let record = decode_edges(&view)?;
        let key = BrickKey(self.cells.directory()[number].key);
        let mut owners = Vec::with_capacity(if beyond == 0 { record.cells.len() } else { 0 });
        let mut first = self.bases[number];
        let mut places = record.places.iter();
        for cell in record.cells.iter().map(|cell| cell.to_native()) {
            let axes = EdgeBrick::own_axes(cell_mask(cell));
            let mut owner = Owner { cell, first, places: [0; 3] };
            for (axis, place) in (0..3).filter(|axis| axes >> axis & 1 == 1).zip(places.by_ref()) {
                owner.places[axis] = checked(place.to_native(), self.domain.cell_units, key)?;
                first += 1;
            }
            if touches(cell_number(cell), beyond) {
                owners.push(owner);
            }
        }
        Ok(owners)
    }

    /// The triangles in the cells of brick `number`.
    ///
    /// # Errors
    /// [`ContourError`]: a neighbour is missing, which sound bricks never miss.
    pub fn triangles(&mut self, number: usize) -> Result<BrickTriangles, ContourError> {
        let key = BrickKey(self.cells.directory()[number].key);
        let own = self.load(number, 0)?;
        self.ranks.fill(NO_RANK);
        for (rank, owner) in own.iter().enumerate() {
            self.ranks[cell_number(owner.cell)] = rank as u16;
        }
        let cells: Vec<u32> = own.iter().map(|owner| owner.cell).collect();
        let mut bricks = [const { None }; 8];
        bricks[0] = Some(own);
        let mut out = BrickTriangles::default();
        let mut points = Vec::with_capacity(12);
        for cell in cells {
            let n = cell_number(cell);
            let at = [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE];
            let mask = cell_mask(cell);
            let vertices = self.vertices(&mut bricks, key, at, mask)?;
            for cycle in CYCLES[usize::from(mask)].iter() {
                let corners = |i: usize| &vertices[usize::from(cycle[i])];
                points.clear();
                points.extend((0..cycle.len()).map(|i| corners(i).position));
                cut(&points, &mut |triangle| {
                    self.emit(triangle.map(corners), at, key, &mut out);
                });
                out.stats.polygons += 1;
            }
        }
        Ok(out)
    }

    /// The vertices on the marked edges of cell `at`.
    fn vertices(
        &self,
        bricks: &mut [Option<Vec<Owner>>; 8],
        key: BrickKey,
        at: [usize; 3],
        mask: u8,
    ) -> Result<[Vertex; 12], ContourError> {
        let mut vertices = [Vertex::default(); 12];
        for edge in (0..12).filter(|&edge| is_marked(mask, edge)) {
            let (axis, corner) = (usize::from(axis_of_edge(edge)), corner_of_edge(edge, 0));
            let steps = [0, 1, 2].map(|a| usize::from(corner >> a & 1));
            let mut beyond = 0;
            let mut cell = [0; 3];
            for a in 0..3 {
                let moved = at[a] + steps[a];
                beyond |= u8::from(moved == SIDE) << a;
                cell[a] = moved % SIDE;
            }
            let number = cell[0] + SIDE * (cell[1] + SIDE * cell[2]);
            let owner = self.owner(bricks, key, beyond, number)?;
            let axes = EdgeBrick::own_axes(cell_mask(owner.cell));
            if axes >> axis & 1 == 0 {
                return Err(missing(key));
            }
            let rank = (axes & ((1 << axis) - 1)).count_ones();
            let mut position = steps.map(|step| step as i64 * i64::from(self.domain.cell_units));
            position[axis] += i64::from(owner.places[axis]);
            vertices[usize::from(edge)] = Vertex { number: owner.first + rank, position };
        }
        Ok(vertices)
    }

    /// Cell `number` of the brick one step up along the axes set in `beyond`.
    #[inline]
    fn owner(
        &self,
        bricks: &mut [Option<Vec<Owner>>; 8],
        key: BrickKey,
        beyond: u8,
        number: usize,
    ) -> Result<Owner, ContourError> {
        let slot = &mut bricks[usize::from(beyond)];
        if slot.is_none() {
            let mut position = key.position();
            for (axis, coordinate) in position.iter_mut().enumerate() {
                *coordinate += u32::from(beyond >> axis & 1);
            }
            let found = self.cells.find(BrickKey::new(position).0).ok_or_else(|| missing(key))?;
            *slot = Some(self.load(found, beyond)?);
        }
        let owners = slot.as_ref().ok_or_else(|| missing(key))?;
        let rank = if beyond == 0 {
            Some(usize::from(self.ranks[number])).filter(|&rank| rank != usize::from(NO_RANK))
        } else {
            owners.binary_search_by_key(&number, |owner| cell_number(owner.cell)).ok()
        };
        rank.map(|rank| owners[rank]).ok_or_else(|| missing(key))
    }

    fn emit(&self, corners: [&Vertex; 3], at: [usize; 3], key: BrickKey, out: &mut BrickTriangles) {
        out.indices.push(corners.map(|vertex| vertex.number));
        if self.with_corners {
            out.corners.push(corners.map(|vertex| self.to_model(key, at, vertex.position)));
        }
    }

    fn to_model(&self, key: BrickKey, at: [usize; 3], position: [i64; 3]) -> [f64; 3] {
        let (brick, cell) = (key.position(), i64::from(self.domain.cell_units));
        let lattice = std::array::from_fn(|a| {
            i64::from(brick[a]) * self.domain.brick_units() + at[a] as i64 * cell + position[a]
        });
        self.domain.to_model(lattice)
    }
}

fn missing(key: BrickKey) -> ContourError {
    let expected = "a vertex on every crossed edge of a cell";
    ContourError::Contradiction { brick: key.position(), expected }
}

/// Whether a cell lies on the min side of every axis set in `beyond`.
const fn touches(number: usize, beyond: u8) -> bool {
    let at = [number % SIDE, number / SIDE % SIDE, number / SIDE / SIDE];
    (beyond & 1 == 0 || at[0] == 0)
        && (beyond & 2 == 0 || at[1] == 0)
        && (beyond & 4 == 0 || at[2] == 0)
}
