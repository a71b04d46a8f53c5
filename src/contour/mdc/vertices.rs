//! Places one vertex per component in every leaf cell.
//!
//! In:         [`crate::octree::SignBrick`]s.
//! Out:        [`CellBrick`]s: cells with their masks, vertices on the lattice, edge offsets.
//! Invariant:  a vertex lies strictly inside its cell, and no two share a position.

use std::collections::HashMap;

use glam::DVec3;

use crate::contour::mdc::table::{NO_FACE, TWO_SIDED, axis_of_edge, corner_of_edge};
use crate::contour::mdc::{FLIPPED_BIT, components_of};
use crate::contour::{CELLS, ContourError, ContourOptions, ContourStats};
use crate::geom::qef::{
    Attempt, Hit, QefOptions, Waiting, begin, solve, solve_flat, solve_together,
};
use crate::monitor::{Gauge, Resident};
use crate::octree::{
    ArchivedSignBrick, BrickKey, CellBrick, CornerBits, Domain, EdgeBits, LINES, PATCH, ROWS, SIDE,
    SourcePlane, decode_signs, edge_position, encode,
};
use crate::store::{BrickFile, BrickPass, Resources, StoreError, ordered_by_weight};

/// A vertex keeps this many lattice units from the walls of its cell.
const INSET_UNITS: i64 = 2;

/// What a byte of a record of signs takes while vertices are placed, with the record of cells.
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
    signs: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
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
        || Workspace::new(domain, options),
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

/// A crossing as the cells around it need it.
#[derive(Clone, Copy)]
struct EdgeCrossing {
    /// Share of the edge.
    offset: f64,
    /// Number of its unit normal; 0, which is none, on patches.
    normal: u32,
}

/// Vertices that are placed together: enough to hide how long a root takes.
const TOGETHER: usize = 4;

/// Cells whose vertices wait until there are enough of them, at the end of a brick or before.
#[derive(Default)]
struct WaitingCells {
    count: usize,
    cells: [Waiting; TOGETHER],
    /// The cell, and the number of its vertex.
    places: [([usize; 3], usize); TOGETHER],
}

/// Crossings of one cell: places about its centre, in cells, and numbers of normals.
struct Around {
    count: usize,
    points: [DVec3; 12],
    normals: [u32; 12],
}

impl Around {
    fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }

    /// The one normal of all crossings.
    #[inline]
    fn flat_normal(&self) -> Option<u32> {
        let normals = &self.normals[..self.count];
        normals.iter().all(|normal| *normal == normals[0]).then_some(normals[0])
    }

    /// The first `count` of these.
    #[inline]
    fn hits(&self, normals: &[DVec3]) -> [Hit; 12] {
        let mut hits = [Hit { point: DVec3::ZERO, normal: DVec3::ZERO }; 12];
        for (i, hit) in hits[..self.count].iter_mut().enumerate() {
            *hit = Hit { point: self.points[i], normal: normals[self.normals[i] as usize] };
        }
        hits
    }
}

struct Workspace {
    cell_units: i64,
    qef: QefOptions,
    marks: EdgeBits,
    signs: CornerBits,
    /// First crossing of each row of edges.
    row_starts: Vec<u32>,
    crossings: Vec<EdgeCrossing>,
    planes: Vec<SourcePlane>,
    normals: Vec<DVec3>,
    waiting: WaitingCells,
    /// Corner signs of bricks beyond a side, for faces that two bricks must agree on.
    beyond: HashMap<u64, CornerBits>,
}

impl Workspace {
    fn new(domain: &Domain, options: &ContourOptions) -> Self {
        let cell_units = i64::from(domain.cell_units);
        let inset = 0.5 - INSET_UNITS as f64 / cell_units as f64;
        let qef = QefOptions::new(options.crease_deg, DVec3::splat(-inset), DVec3::splat(inset));
        Self {
            cell_units,
            qef,
            marks: EdgeBits::default(),
            signs: CornerBits::default(),
            row_starts: vec![0; 3 * ROWS],
            crossings: Vec::new(),
            planes: Vec::new(),
            normals: Vec::new(),
            waiting: WaitingCells::default(),
            beyond: HashMap::new(),
        }
    }

    fn place(&mut self, signs: &BrickFile, number: usize) -> Result<Placed, ContourError> {
        let key = signs.directory()[number].key;
        let view = signs.view(number)?;
        let record = decode_signs(&view)?;
        self.load(record);
        self.beyond.clear();
        let mut stats = ContourStats::default();
        let mut brick = CellBrick::default();
        for z in 0..SIDE {
            for y in 0..SIDE {
                let mut touched = self.marks.cells_touched(z, y);
                while touched != 0 {
                    let at = [touched.trailing_zeros() as usize, y, z];
                    touched &= touched - 1;
                    self.place_in_cell(signs, BrickKey(key), at, &mut brick, &mut stats)?;
                }
            }
        }
        self.place_waiting(&mut brick, &mut stats);
        Ok(Placed { key, bytes: encode(&brick), stats })
    }

    /// Signs, marks and crossings of the record.
    fn load(&mut self, record: &ArchivedSignBrick) {
        self.marks.clear();
        self.crossings.clear();
        let mut row = 0;
        let cell_units = self.cell_units as f64;
        self.planes.clear();
        self.planes.extend(record.planes.iter().map(SourcePlane::from));
        self.normals.clear();
        self.normals.push(DVec3::ZERO);
        self.normals.extend(self.planes.iter().map(SourcePlane::unit_normal));
        for crossing in record.crossings.iter() {
            let (edge, plane) = (crossing.edge.to_native(), crossing.plane.to_native());
            self.marks.set(edge);
            let here = edge as usize / LINES;
            while row <= here {
                self.row_starts[row] = self.crossings.len() as u32;
                row += 1;
            }
            self.crossings.push(if plane & PATCH == 0 {
                let (axis, at) = edge_position(edge);
                let offset = self.planes[plane as usize].offset_on_edge(axis, at, cell_units);
                EdgeCrossing { offset, normal: plane + 1 }
            } else {
                let offset = f64::from(plane & 0xffff) / 65536.0;
                EdgeCrossing { offset, normal: 0 }
            });
        }
        self.row_starts[row..].fill(self.crossings.len() as u32);
        self.signs.from_marks(&self.marks, record.base_inside);
    }

    /// The crossing of a marked edge.
    #[inline]
    fn crossing(&self, axis: usize, at: [usize; 3]) -> EdgeCrossing {
        let row = at[2] * LINES + at[1];
        let below = self.marks.rows(axis)[row] & ((1 << at[0]) - 1);
        let rank = self.row_starts[axis * ROWS + row] + below.count_ones();
        self.crossings[rank as usize]
    }

    fn place_in_cell(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        at: [usize; 3],
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        let mask = self.signs.cell_mask(at);
        let mut cell = (at[0] + SIDE * (at[1] + SIDE * at[2])) as u32 | u32::from(mask) << 15;
        if self.is_flipped(signs, key, at, mask)? {
            cell |= FLIPPED_BIT;
            stats.flipped_faces += 1;
        }
        let components = components_of(cell);
        if components.count == 1 {
            self.place_alone(at, components.edge_masks[0], brick, stats);
        } else {
            let masks = &components.edge_masks[..usize::from(components.count)];
            self.place_apart(at, masks, brick, stats);
        }
        for axis in 0..3 {
            if (mask ^ mask >> (1 << axis)) & 1 == 1 {
                let offset = self.crossing(axis, at).offset;
                brick.offsets.push((offset * 65536.0).clamp(1.0, 65535.0) as u16);
            }
        }
        brick.cells.push(cell);
        stats.cells += 1;
        stats.multi_cells += u64::from(components.count > 1);
        stats.cell_vertices += u64::from(components.count);
        Ok(())
    }

    /// Whether one component touches an ambiguous face twice, and so does one of the cell beyond.
    fn is_flipped(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        at: [usize; 3],
        mask: u8,
    ) -> Result<bool, ContourError> {
        let face = TWO_SIDED[usize::from(mask)];
        if face == NO_FACE {
            return Ok(false);
        }
        let (axis, high) = (usize::from(face / 2), face % 2 == 1);
        let mut cell = at;
        let inside = if high { at[axis] + 1 < SIDE } else { at[axis] > 0 };
        let other = if inside {
            cell[axis] = if high { at[axis] + 1 } else { at[axis] - 1 };
            self.signs.cell_mask(cell)
        } else {
            cell[axis] = if high { 0 } else { SIDE - 1 };
            let neighbour = if high { Some(key.upper(axis)) } else { key.lower(1 << axis) };
            self.mask_beyond(signs, key, neighbour, cell)?
        };
        Ok(TWO_SIDED[usize::from(other)] == face ^ 1)
    }

    fn mask_beyond(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        neighbour: Option<BrickKey>,
        cell: [usize; 3],
    ) -> Result<u8, ContourError> {
        let missing = || ContourError::Contradiction {
            brick: key.position(),
            expected: "a brick beyond a crossed side",
        };
        let neighbour = neighbour.ok_or_else(missing)?;
        if let Some(corners) = self.beyond.get(&neighbour.0) {
            return Ok(corners.cell_mask(cell));
        }
        let view = signs.view(signs.find(neighbour.0).ok_or_else(missing)?)?;
        let record = decode_signs(&view)?;
        let mut marks = EdgeBits::default();
        record.crossings.iter().for_each(|crossing| marks.set(crossing.edge.to_native()));
        let mut corners = CornerBits::default();
        corners.from_marks(&marks, record.base_inside);
        let mask = corners.cell_mask(cell);
        self.beyond.insert(neighbour.0, corners);
        Ok(mask)
    }

    /// The vertex of the only component of a cell, now or with others that wait.
    fn place_alone(
        &mut self,
        at: [usize; 3],
        edges: u16,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) {
        let around = self.around(at, edges);
        let attempt = match around.flat_normal() {
            Some(normal) => {
                let normal = self.normals[normal as usize];
                solve_flat(around.points(), normal, &self.qef).map(Attempt::Done)
            }
            None => None,
        };
        let attempt = attempt.unwrap_or_else(|| {
            let hits = around.hits(&self.normals);
            begin(&hits[..around.count], &self.qef)
        });
        match attempt {
            Attempt::Done(solution) => {
                brick.positions.push(self.to_lattice(at, solution.position));
                stats.clamped_vertices += u64::from(solution.clamped);
            }
            Attempt::Waiting(cell) => {
                let waiting = &mut self.waiting;
                waiting.cells[waiting.count] = cell;
                waiting.places[waiting.count] = (at, brick.positions.len());
                waiting.count += 1;
                brick.positions.push([0; 3]);
                if self.waiting.count == TOGETHER {
                    self.place_waiting(brick, stats);
                }
            }
        }
    }

    fn place_waiting(&mut self, brick: &mut CellBrick, stats: &mut ContourStats) {
        if self.waiting.count == 0 {
            return;
        }
        let solutions = solve_together(&self.waiting.cells, &self.qef);
        let places = self.waiting.places[..self.waiting.count].iter();
        for (&(at, number), solution) in places.zip(solutions) {
            brick.positions[number] = self.to_lattice(at, solution.position);
            stats.clamped_vertices += u64::from(solution.clamped);
        }
        self.waiting.count = 0;
    }

    /// The vertices of a cell with several components.
    fn place_apart(
        &self,
        at: [usize; 3],
        edge_masks: &[u16],
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) {
        let first = brick.positions.len();
        for &edges in edge_masks {
            let around = self.around(at, edges);
            let hits = &around.hits(&self.normals)[..around.count];
            let solution = solve(hits, &self.within_crossings(hits));
            let position = self.to_lattice(at, solution.position);
            let outward = hits.iter().fold(DVec3::ZERO, |sum, hit| sum + hit.normal);
            let position = self.apart_from(position, at, outward, &brick.positions[first..]);
            brick.positions.push(position);
            stats.clamped_vertices += u64::from(solution.clamped);
        }
    }

    /// The crossings on these edges of a cell.
    #[inline]
    fn around(&self, at: [usize; 3], edges: u16) -> Around {
        let mut around = Around { count: 0, points: [DVec3::ZERO; 12], normals: [0; 12] };
        let mut left = edges;
        while left != 0 {
            let edge = left.trailing_zeros() as u8;
            left &= left - 1;
            let axis = usize::from(axis_of_edge(edge));
            let corner = corner_of_edge(edge, 0);
            let corner = [0, 1, 2].map(|a| usize::from(corner >> a & 1));
            let crossing = self.crossing(axis, [0, 1, 2].map(|a| at[a] + corner[a]));
            let mut point = DVec3::from(corner.map(|c| c as f64 - 0.5));
            point[axis] = crossing.offset - 0.5;
            around.points[around.count] = point;
            around.normals[around.count] = crossing.normal;
            around.count += 1;
        }
        around
    }

    /// Where several components share a cell, each stays in the box of its own crossings: there
    /// they cannot pass one another.
    fn within_crossings(&self, hits: &[Hit]) -> QefOptions {
        let first = hits[0].point;
        let (lo, hi) = hits
            .iter()
            .fold((first, first), |(lo, hi), hit| (lo.min(hit.point), hi.max(hit.point)));
        let QefOptions { lo: cell_lo, hi: cell_hi, .. } = self.qef;
        let mut options = self.qef;
        options.lo = lo.clamp(cell_lo, cell_hi);
        options.hi = hi.clamp(cell_lo, cell_hi);
        options
    }

    /// Rounds to the lattice, strictly inside the cell.
    fn to_lattice(&self, at: [usize; 3], position: DVec3) -> [i32; 3] {
        std::array::from_fn(|a| {
            let units = ((position[a] + 0.5) * self.cell_units as f64).round() as i64;
            let units = units.clamp(INSET_UNITS, self.cell_units - INSET_UNITS);
            (at[a] as i64 * self.cell_units + units) as i32
        })
    }

    /// Moves a vertex whose place another component of the cell has taken, toward its inside.
    fn apart_from(
        &self,
        position: [i32; 3],
        at: [usize; 3],
        outward: DVec3,
        taken: &[[i32; 3]],
    ) -> [i32; 3] {
        if !taken.contains(&position) {
            return position;
        }
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| outward[b].abs().total_cmp(&outward[a].abs()));
        for step in 1..=taken.len() as i32 + 1 {
            for axis in axes {
                let inward = if outward[axis] > 0.0 { -1 } else { 1 };
                for direction in [inward, -inward] {
                    let mut moved = position;
                    moved[axis] += direction * step;
                    let low = at[axis] as i64 * self.cell_units;
                    let within = i64::from(moved[axis]) - low;
                    if within > 0 && within < self.cell_units && !taken.contains(&moved) {
                        return moved;
                    }
                }
            }
        }
        unreachable!("a cell has room for four vertices")
    }
}
