//! A brick and the bricks around it: the vertex of any component, the crossing of any edge.
//!
//! Units:      places in cells, positions in lattice units, both from the own brick's min corner;
//!             a place may lie one cell outside.
//! Memory:     [`Loaded`] for the own brick and for the sides of those around that were asked for, at most 27,
//!             whose room the next ones take.
//! Fails:      [`ContourError::Contradiction`] where sound bricks have a cell and these do not.

use crate::contour::ContourError;
use crate::contour::mdc::cell::{cell_mask, cell_number, edge_in_cell, number_at};
use crate::contour::mdc::cut_cell::{CutBox, CutCell, steps_of};
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::loaded::{Loaded, Vertex};
use crate::contour::mdc::table::is_marked;
use crate::octree::{BrickKey, Domain, SIDE};

/// The own brick among the 27.
pub const OWN: usize = 13;
/// No cell of the brick has this rank: the list has at most 32768.
const NO_RANK: u16 = u16::MAX;
/// Crossings lie at multiples of this many units, and as far from the ends of their edges: so the
/// middles of middles of two of them are on the lattice.
pub const CROSSING_UNITS: i32 = 4;

/// Names of vertices of cells above the brick, beside those of others.
const ABOVE: u64 = 1 << 42;

/// A leaf cell that was found: the brick among the 27, and its rank there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    slot: usize,
    rank: usize,
}

impl Found {
    /// Its rank in its brick.
    #[inline]
    pub fn rank(self) -> usize {
        self.rank
    }
}

/// A vertex with the brick that it was found in.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The vertex.
    pub vertex: Vertex,
    /// The brick among the 27.
    pub slot: usize,
}

impl Patch {
    /// A name for the vertex, distinct in this neighbourhood.
    #[inline]
    pub fn id(&self) -> u64 {
        if self.vertex.cut.is_above() {
            return ABOVE | u64::from(self.vertex.number);
        }
        (self.slot as u64) << 24 | u64::from(self.vertex.number)
    }

    /// Its number among the vertices of the brick in its slot.
    #[inline]
    pub fn number_in_brick(&self) -> u32 {
        if self.vertex.cut.is_above() { 0 } else { self.vertex.number }
    }

    /// The box of its cell of the cut, with the empty cell that it reaches into.
    #[inline]
    pub fn cut_box(&self) -> CutBox {
        CutBox::new(self.slot, self.vertex.cut)
    }
}

/// The brick in slot `slot` around `key`; `None` below the grid.
pub fn brick_around(key: BrickKey, slot: usize) -> Option<BrickKey> {
    let (mut position, steps) = (key.position(), steps_of(slot));
    for (coordinate, step) in position.iter_mut().zip(steps) {
        *coordinate = coordinate.checked_add_signed(step)?;
    }
    Some(BrickKey::new(position))
}

/// See the module.
pub struct Neighbourhood<'f> {
    layers: Layers<'f>,
    domain: Domain,
    key: BrickKey,
    /// Rank of each cell of the own brick.
    ranks: Vec<u16>,
    bricks: [Option<Loaded>; 27],
    /// The numbers of those bricks.
    numbers: [usize; 27],
    /// Bricks that were moved away from: their room is taken again.
    spare: Vec<Loaded>,
}

impl<'f> Neighbourhood<'f> {
    /// A neighbourhood that has not moved in yet.
    pub fn new(layers: Layers<'f>, domain: &Domain) -> Self {
        Self {
            layers,
            domain: *domain,
            key: BrickKey(0),
            ranks: vec![NO_RANK; SIDE * SIDE * SIDE],
            bricks: [const { None }; 27],
            numbers: [usize::MAX; 27],
            spare: Vec::new(),
        }
    }

    /// Moves to brick `number`.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn move_to(&mut self, number: usize) -> Result<(), ContourError> {
        self.key = self.layers.key(number);
        // The own brick comes last, and so takes the room of the one before.
        let own = self.bricks[OWN].take();
        self.spare.extend(self.bricks.iter_mut().filter_map(Option::take));
        self.spare.extend(own);
        self.numbers = [usize::MAX; 27];
        let (key, units) = (self.key, self.domain.brick_units());
        let spare = self.spare.pop().unwrap_or_default();
        let own = self.layers.read_with_points(number, |record, points| {
            Loaded::new(spare, (record, points), key, [0; 3], units)
        })?;
        self.ranks.fill(NO_RANK);
        for (rank, &cell) in own.cells.iter().enumerate() {
            self.ranks[cell_number(cell)] = rank as u16;
        }
        self.bricks[OWN] = Some(own);
        self.numbers[OWN] = number;
        Ok(())
    }

    /// All bricks.
    pub fn layers(&self) -> &Layers<'f> {
        &self.layers
    }

    /// Lattice units of a cell.
    #[inline]
    pub fn cell_units(&self) -> i32 {
        self.domain.cell_units as i32
    }

    /// The own brick.
    #[inline]
    pub fn own(&self) -> &Loaded {
        self.bricks[OWN].as_ref().expect("moved in")
    }

    /// The number of the brick in a slot that was looked into.
    pub fn number_of(&self, slot: usize) -> usize {
        self.numbers[slot]
    }

    /// What to say when bricks are not sound.
    pub fn contradiction(&self, expected: &'static str) -> ContourError {
        ContourError::Contradiction { brick: self.key.position(), expected }
    }

    /// The brick in a slot; `None` where no surface is.
    fn brick(&mut self, slot: usize) -> Result<Option<&Loaded>, ContourError> {
        if self.bricks[slot].is_none() {
            let steps = steps_of(slot);
            let Some(key) = brick_around(self.key, slot) else { return Ok(None) };
            let Some(number) = self.layers.find(key) else { return Ok(None) };
            let units = self.domain.brick_units();
            let spare = self.spare.pop().unwrap_or_default();
            let loaded = self.layers.read_with_points(number, |record, points| {
                Loaded::new(spare, (record, points), key, steps, units)
            })?;
            self.bricks[slot] = Some(loaded);
            self.numbers[slot] = number;
        }
        Ok(self.bricks[slot].as_ref())
    }

    /// The brick in a slot that sound bricks have.
    #[inline]
    pub fn sound_brick(&mut self, slot: usize) -> Result<&Loaded, ContourError> {
        if self.bricks[slot].is_none() && self.brick(slot)?.is_none() {
            return Err(self.contradiction("a brick beyond a crossed side"));
        }
        Ok(self.bricks[slot].as_ref().expect("just loaded"))
    }

    /// Looks for a leaf cell.
    #[inline]
    pub fn find(&mut self, at: [i32; 3]) -> Result<Option<Found>, ContourError> {
        let side = SIDE as i32;
        let steps = at.map(|c| 1 + i32::from(c >= side) - i32::from(c < 0));
        let slot = (steps[0] + 3 * steps[1] + 9 * steps[2]) as usize;
        if slot == OWN {
            return Ok(self.find_within(at.map(|c| c as usize)));
        }
        let Some(brick) = self.brick(slot)? else { return Ok(None) };
        let number = number_at(at.map(|c| (c & (side - 1)) as usize));
        let rank = brick.cells.binary_search_by_key(&number, |&cell| cell_number(cell));
        Ok(rank.ok().map(|rank| Found { slot, rank }))
    }

    /// Looks for a leaf cell of the own brick.
    #[inline]
    pub fn find_within(&self, at: [usize; 3]) -> Option<Found> {
        let rank = self.ranks[number_at(at)];
        (rank != NO_RANK).then_some(Found { slot: OWN, rank: usize::from(rank) })
    }

    /// The leaf cell of the own brick with this rank.
    #[inline]
    pub fn own_cell(&self, rank: usize) -> Found {
        Found { slot: OWN, rank }
    }

    /// The cell of the cut that a leaf cell lies in.
    #[inline]
    pub fn cut(&self, found: Found) -> CutCell {
        self.loaded(found).first_vertex(found.rank).cut
    }

    /// A leaf cell that sound bricks have.
    #[inline]
    pub fn cell(&mut self, at: [i32; 3]) -> Result<Found, ContourError> {
        let found = self.find(at)?;
        found.ok_or_else(|| self.contradiction("a cell with a vertex around every crossed edge"))
    }

    #[inline]
    fn loaded(&self, found: Found) -> &Loaded {
        self.bricks[found.slot].as_ref().expect("found in it")
    }

    /// The packed cell.
    #[inline]
    pub fn packed(&self, found: Found) -> u32 {
        self.loaded(found).cells[found.rank]
    }

    /// The vertex of the component that crosses `edge`, a number in the cell.
    #[inline]
    pub fn vertex(&self, found: Found, edge: u8) -> Patch {
        let brick = self.loaded(found);
        let vertex = brick.vertex(brick.place_of_vertex(found.rank, edge));
        Patch { vertex, slot: found.slot }
    }

    /// The vertex of the component of the cell at `at` that crosses the edge along `axis` from
    /// `lower`.
    #[inline]
    pub fn vertex_at(
        &mut self,
        at: [i32; 3],
        axis: usize,
        lower: [i32; 3],
    ) -> Result<Patch, ContourError> {
        let found = self.cell(at)?;
        Ok(self.vertex(found, edge_in_cell(axis, lower, at)))
    }

    /// Whether the edge along `axis` from `lower` is crossed.
    pub fn is_crossed(&mut self, axis: usize, lower: [i32; 3]) -> Result<bool, ContourError> {
        let Some(found) = self.find(lower)? else { return Ok(false) };
        let edge = edge_in_cell(axis, lower, lower);
        Ok(is_marked(cell_mask(self.packed(found)), edge))
    }

    /// The crossing of the edge along `axis` from `lower`, and whether its lower end is inside.
    pub fn crossing(
        &mut self,
        axis: usize,
        lower: [i32; 3],
    ) -> Result<([i32; 3], bool), ContourError> {
        let found = self.cell(lower)?;
        let mask = cell_mask(self.packed(found));
        let before = (0..axis).filter(|a| (mask ^ mask >> (1 << a)) & 1 == 1).count();
        let brick = self.loaded(found);
        let offset = brick.offsets.get(brick.offset_firsts[found.rank] as usize + before);
        let offset = *offset.ok_or_else(|| self.contradiction("an offset for every own edge"))?;
        Ok((self.crossing_at(axis, lower, offset), mask & 1 == 1))
    }

    /// The crossing at `offset` of 65536 on the edge along `axis` from `lower`.
    #[inline]
    pub fn crossing_at(&self, axis: usize, lower: [i32; 3], offset: u16) -> [i32; 3] {
        let cell = self.cell_units();
        let mut crossing = lower.map(|c| c * cell);
        let steps = i64::from(cell / CROSSING_UNITS);
        let step = ((i64::from(offset) * steps + (1 << 15)) >> 16).clamp(1, steps - 1);
        crossing[axis] += step as i32 * CROSSING_UNITS;
        crossing
    }

    /// The vertex on the face between two cells above the brick, if there is one, `key` of it in
    /// brick `owner`: its number there, and its place from here.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn far_point(
        &self,
        owner: usize,
        key: u64,
    ) -> Result<Option<(u32, [i32; 3])>, ContourError> {
        let (here, there) = (self.key.position(), self.layers.key(owner).position());
        let units = self.domain.brick_units() as i32;
        self.layers.read_with_points(owner, |record, points| {
            let found = points.binary_search_by_key(&key, |point| point.key.to_native());
            Ok(found.ok().map(|at| {
                let position = points[at].position.map(|c| c.to_native());
                let place = std::array::from_fn(|a| {
                    position[a] + (there[a] as i32 - here[a] as i32) * units
                });
                ((record.positions.len() + at) as u32, place)
            }))
        })
    }

    /// A place in model units.
    #[inline]
    pub fn to_model(&self, position: [i32; 3]) -> [f64; 3] {
        let (brick, side) = (self.key.position(), self.domain.brick_units());
        let lattice = std::array::from_fn(|a| i64::from(brick[a]) * side + i64::from(position[a]));
        self.domain.to_model(lattice)
    }
}
