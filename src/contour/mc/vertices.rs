//! Places a vertex on every crossed edge, and reads them back.
//!
//! In:         [`SignBrick`](crate::octree::SignBrick)s.
//! Out:        [`EdgeBrick`]s: cells with their masks, places on the edges that the brick owns.
//! Invariant:  a vertex lies strictly inside of its edge, so no two share a position. It is placed
//!             by the brick that owns the edge, and by no other.

use crate::contour::mc::cycles::CYCLES;
use crate::contour::mc::{cell_mask, cell_number, checked};
use crate::contour::{CELLS, ContourError, ContourStats};
use crate::monitor::{Gauge, Resident};
use crate::octree::{
    BrickKey, CornerBits, Crossing, Domain, EdgeBits, EdgeBrick, PATCH, SIDE, SignBricks,
    SignRecord, SourcePlane, clamp_to_edge, decode_edges, edge_index, edge_position, encode,
};
use crate::store::{BrickFile, BrickPass, Resources, StoreError, ordered_by_weight};

/// What a byte of a record of signs takes while vertices are placed, with the record of edges.
const RECORD_FACTOR: u64 = 3;

struct Placed {
    key: u64,
    bytes: rkyv::util::AlignedVec,
    stats: ContourStats,
}

/// Places the vertices of all bricks.
///
/// # Errors
/// [`ContourError`].
pub fn place_vertices(
    signs: SignBricks,
    domain: &Domain,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    let mut pass = BrickPass::<ContourStats>::start(CELLS, resources)?;
    let mut numbers = pass.items() as usize..signs.len();
    let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
    let placed = ordered_by_weight(
        resources.pool,
        resources.scales(|number: &usize| RECORD_FACTOR * signs.record_bytes(*number)),
        || {
            if resources.monitor.cancelled() {
                return Err(ContourError::Store(StoreError::Cancelled));
            }
            Ok(numbers.next())
        },
        || Workspace::new(domain),
        |space, number| {
            let _brick = resident.hold(1);
            space.place(signs, number)
        },
        |placed: Placed| {
            pass.counts.add(&placed.stats);
            // The flags of the directory say how many vertices come from each brick.
            pass.append(placed.key, placed.stats.cell_vertices as u32, &placed.bytes)?;
            Ok(pass.item_done()?)
        },
    );
    pass.end(placed, ContourError::is_stop)
}

struct Workspace {
    cell_units: u32,
    marks: EdgeBits,
    signs: CornerBits,
    /// Own crossings along each axis: edge number and place, ascending.
    own: [Vec<(u32, u32)>; 3],
}

impl Workspace {
    fn new(domain: &Domain) -> Self {
        Self {
            cell_units: domain.cell_units,
            marks: EdgeBits::default(),
            signs: CornerBits::default(),
            own: [const { Vec::new() }; 3],
        }
    }

    fn place(&mut self, signs: SignBricks, number: usize) -> Result<Placed, ContourError> {
        let key = signs.key(number);
        let view = signs.view(number)?;
        self.load(view.record()?);
        let mut stats = ContourStats::default();
        let mut brick = EdgeBrick::default();
        // Cells and the own edges along an axis come in the same order.
        let mut next = [0; 3];
        for z in 0..SIDE {
            for y in 0..SIDE {
                let mut touched = self.marks.cells_touched(z, y);
                while touched != 0 {
                    let at = [touched.trailing_zeros() as usize, y, z];
                    touched &= touched - 1;
                    let mask = self.signs.cell_mask(at);
                    let cell = at[0] + SIDE * (at[1] + SIDE * at[2]);
                    brick.cells.push(cell as u32 | u32::from(mask) << 15);
                    let axes = EdgeBrick::own_axes(mask);
                    for axis in (0..3).filter(|axis| axes >> axis & 1 == 1) {
                        let place = self.own_place(axis, next[axis], at);
                        brick.places.push(place.ok_or(ContourError::Contradiction {
                            brick: key.position(),
                            expected: "marks where the signs of corners differ",
                        })?);
                        next[axis] += 1;
                    }
                    stats.cells += 1;
                    stats.multi_cells += u64::from(CYCLES[usize::from(mask)].iter().count() > 1);
                }
            }
        }
        stats.cell_vertices = brick.places.len() as u64;
        Ok(Placed { key: key.0, bytes: encode(&brick), stats })
    }

    /// Marks, signs and own crossings of the record.
    fn load(&mut self, record: SignRecord) {
        self.marks.clear();
        self.own.iter_mut().for_each(Vec::clear);
        let cell_units = f64::from(self.cell_units);
        let planes = record.planes();
        record.each_crossing(|Crossing { edge, plane }| {
            self.marks.set(edge);
            let (axis, at) = edge_position(edge);
            if at.contains(&SIDE) {
                return;
            }
            let share = if plane & PATCH == 0 {
                let plane = SourcePlane::from(&planes[plane as usize]);
                plane.offset_on_edge(axis, at, cell_units)
            } else {
                clamp_to_edge(f64::from(plane & 0xffff) / 65536.0 * cell_units, cell_units)
            };
            let place = (share * cell_units).round() as u32;
            self.own[axis].push((edge, place.clamp(1, self.cell_units - 1)));
        });
        self.signs.from_marks(&self.marks, record.base_inside());
    }

    /// The place of own crossing `number` along `axis`, if it is on the edge that leaves `at`.
    fn own_place(&self, axis: usize, number: usize, at: [usize; 3]) -> Option<u32> {
        let &(edge, place) = self.own[axis].get(number)?;
        (edge == edge_index(axis, at)).then_some(place)
    }
}

/// The vertices of brick `number` in model units.
///
/// # Errors
/// [`ContourError`].
pub fn read_positions(
    cells: &BrickFile,
    number: usize,
    domain: &Domain,
    positions: &mut Vec<[f64; 3]>,
) -> Result<(), ContourError> {
    let view = cells.view(number)?;
    let record = decode_edges(&view)?;
    let entry = cells.directory()[number];
    let key = BrickKey(entry.key);
    if record.places.len() != entry.flags as usize {
        let expected = "as many vertices as the directory says";
        return Err(ContourError::Contradiction { brick: key.position(), expected });
    }
    let base = key.position().map(|c| i64::from(c) * domain.brick_units());
    positions.clear();
    let mut places = record.places.iter();
    for cell in record.cells.iter().map(|cell| cell.to_native()) {
        let n = cell_number(cell);
        let at = [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE];
        let axes = EdgeBrick::own_axes(cell_mask(cell));
        for (axis, place) in (0..3).filter(|axis| axes >> axis & 1 == 1).zip(places.by_ref()) {
            let place = checked(place.to_native(), domain.cell_units, key)?;
            let mut point: [i64; 3] =
                std::array::from_fn(|a| base[a] + at[a] as i64 * i64::from(domain.cell_units));
            point[axis] += i64::from(place);
            positions.push(domain.to_model(point));
        }
    }
    Ok(())
}
