//! Places the vertices of every brick: one per component in every leaf cell, then per cluster.
//!
//! In:         [`crate::octree::SignBrick`]s.
//! Out:        [`CellBrick`]s: cells with their masks, clusters, vertices on the lattice, offsets
//!             of crossings.
//! Invariant:  a vertex lies strictly inside its cell, and no two share a position.

use std::collections::HashMap;

use glam::DVec3;

use crate::contour::mdc::cell::{JOINED_FACES, ONE_VERTEX_BIT, components_of, number_at, place_of};
use crate::contour::mdc::cluster::{ClusterOptions, Clustering, Leaves};
use crate::contour::mdc::features::{Halo, Place};
use crate::contour::mdc::joined_faces::Beyond;
use crate::contour::mdc::leaf_vertex::WaitingCells;
use crate::contour::mdc::patch_surfaces::PatchSurfaces;
use crate::contour::mdc::plain::later;
use crate::contour::mdc::{INSET_UNITS, flags_of};
use crate::contour::{CELLS, ContourError, ContourOptions, ContourStats, Method, SurfaceDetail};
use crate::geom::qef::QefOptions;
use crate::monitor::{Gauge, Resident};
use crate::octree::{
    ArchivedSignBrick, Border, BrickKey, CellBrick, CornerBits, Domain, EdgeBits, LINES, NO_SOURCE,
    PATCH, ROWS, RecordBytes, SIDE, SourcePlane, decode_signs, edge_position, encode, surface_of,
};
use crate::store::{BrickFile, BrickPass, Resources, StoreError, ordered_by_weight};

/// What a byte of a record of signs takes while vertices are placed, with the record of cells.
const RECORD_FACTOR: u64 = 3;
/// The same with the pieces that clusters are made of.
const RECORD_FACTOR_WITH_CLUSTERS: u64 = 12;

struct Placed {
    key: u64,
    flags: u32,
    bytes: RecordBytes,
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
    let factor = if options.has_clusters() { RECORD_FACTOR_WITH_CLUSTERS } else { RECORD_FACTOR };
    let placed = ordered_by_weight(
        resources.pool,
        resources.scales(|number: &usize| factor * signs.record_bytes(*number)),
        || {
            if resources.monitor.cancelled() {
                return Err(ContourError::Store(StoreError::Cancelled));
            }
            Ok(numbers.next())
        },
        || Workspace::new(domain, options),
        |space, number| {
            let _brick = resident.hold(1);
            let (brick, stats) = space.place(signs, number, Vec::new())?;
            let key = signs.directory()[number].key;
            Ok(Placed { key, flags: flags_of(&brick), bytes: encode(&brick), stats })
        },
        |placed: Placed| {
            pass.counts.add(&placed.stats);
            pass.append(placed.key, placed.flags, &placed.bytes)?;
            Ok(pass.item_done()?)
        },
    );
    pass.end(placed, ContourError::is_stop)
}

/// A crossing as the cells around it need it.
#[derive(Clone, Copy)]
pub struct EdgeCrossing {
    /// Share of the edge.
    pub offset: f64,
    /// Number of its unit normal; 0, which is none, on patches.
    pub normal: u32,
    /// What it is, for the output; [`NO_SURFACE`] on patches until their rims tell.
    pub surface: u32,
    /// Its source triangle; likewise.
    pub source: u32,
}

/// In [`EdgeCrossing::surface`]: not known.
pub const NO_SURFACE: u32 = u32::MAX;

/// Cells of a brick that the surface passes, in Morton order.
struct Touched(Box<[u64; SIDE * SIDE * SIDE / 64]>);

impl Touched {
    fn new() -> Self {
        Self(Box::new([0; SIDE * SIDE * SIDE / 64]))
    }

    fn find(&mut self, marks: &EdgeBits) {
        self.0.fill(0);
        for z in 0..SIDE {
            for y in 0..SIDE {
                let row = number_at([0, y, z]);
                let mut touched = marks.cells_touched(z, y);
                while touched != 0 {
                    let number = row | number_at([touched.trailing_zeros() as usize, 0, 0]);
                    touched &= touched - 1;
                    self.0[number / 64] |= 1 << (number % 64);
                }
            }
        }
    }
}

/// What a thread needs to place the vertices of one brick after another.
pub struct Workspace {
    pub(super) cell_units: i64,
    pub(super) qef: QefOptions,
    pub(super) method: Method,
    touched: Touched,
    pub(super) marks: EdgeBits,
    pub(super) signs: CornerBits,
    /// First crossing of each row of edges.
    row_starts: Vec<u32>,
    crossings: Vec<EdgeCrossing>,
    pub(super) surfaces: SurfaceDetail,
    sources: bool,
    patches: PatchSurfaces,
    /// Where materials may meet, by ascending cell.
    pub(super) borders: Vec<Border>,
    /// Planes of the brick, and behind them those of edges that leave it.
    pub(super) planes: Vec<SourcePlane>,
    pub(super) normals: Vec<DVec3>,
    pub(super) waiting: WaitingCells,
    pub(super) clustering: Option<Clustering>,
    pub(super) leaves: Leaves,
    /// Cosine of the crease angle.
    pub(super) crease_cosine: f64,
    /// Whether no two planes of the brick differ by more than the crease angle.
    pub(super) is_smooth: bool,
    pub(super) halo: Halo,
    /// Walled faces of the brick.
    pub(super) walls: Vec<u32>,
    /// Bricks beyond a side, for faces that two bricks must agree on.
    pub(super) beyond: HashMap<u64, Beyond>,
}

/// How the vertices of cells and of clusters are placed.
pub fn cluster_options(domain: &Domain, options: &ContourOptions) -> ClusterOptions {
    let cell_units = i64::from(domain.cell_units);
    let inset = 0.5 - INSET_UNITS as f64 / cell_units as f64;
    ClusterOptions {
        threshold_cells: options.decimate_cells,
        qef: QefOptions::new(options.crease_deg, DVec3::splat(-inset), DVec3::splat(inset)),
        cell_units,
        inset_units: INSET_UNITS,
    }
}

impl Workspace {
    /// A workspace for bricks of this domain.
    pub fn new(domain: &Domain, options: &ContourOptions) -> Self {
        let cluster_options = cluster_options(domain, options);
        let ClusterOptions { qef, cell_units, .. } = cluster_options;
        Self {
            cell_units,
            qef,
            method: options.method,
            touched: Touched::new(),
            marks: EdgeBits::default(),
            signs: CornerBits::default(),
            row_starts: vec![0; 3 * ROWS],
            crossings: Vec::new(),
            surfaces: options.surfaces,
            sources: options.sources,
            patches: PatchSurfaces::default(),
            borders: Vec::new(),
            planes: Vec::new(),
            normals: Vec::new(),
            waiting: WaitingCells::default(),
            clustering: options.has_clusters().then(|| Clustering::new(cluster_options)),
            leaves: Leaves::default(),
            // The cut-off is tan² of half the angle.
            crease_cosine: (1.0 - qef.cutoff()) / (1.0 + qef.cutoff()),
            is_smooth: false,
            halo: Halo::new(),
            walls: Vec::new(),
            beyond: HashMap::new(),
        }
    }

    /// The cells of brick `number` with their vertices; none of the `banned` cells is a cluster.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn place(
        &mut self,
        signs: &BrickFile,
        number: usize,
        banned: Vec<u32>,
    ) -> Result<(CellBrick, ContourStats), ContourError> {
        let key = signs.directory()[number].key;
        let view = signs.view(number)?;
        let record = decode_signs(&view)?;
        self.load(record);
        self.beyond.clear();
        self.halo.clear();
        self.touched.find(&self.marks);
        let mut stats = ContourStats::default();
        let mut brick = CellBrick { banned, ..CellBrick::default() };
        for word in 0..self.touched.0.len() {
            let mut bits = self.touched.0[word];
            while bits != 0 {
                let number = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                self.place_in_cell(signs, BrickKey(key), number, &mut brick, &mut stats)?;
            }
        }
        self.place_waiting(&mut brick, &mut stats);
        if let Some(mut clustering) = self.clustering.take() {
            self.leaves.components.push(brick.positions.len() as u32);
            self.leaves.hit_starts.push(self.leaves.hits.len() as u32);
            clustering.cut(&mut brick, &self.leaves);
            stats.refused_by_error += clustering.refusals.by_error;
            stats.refused_by_shape += clustering.refusals.by_shape;
            stats.cluster_error_cells = clustering.refusals.largest_error;
            self.place_remaining(&mut brick, &mut stats);
            brick.drop_covered_reaches();
            brick.summary = clustering.summary(&brick, &self.leaves);
            self.clustering = Some(clustering);
        }
        for list in [&mut brick.surfaces, &mut brick.sources] {
            if list.iter().all(|one| *one == list[0]) {
                list.truncate(1);
            }
        }
        stats.crossed_edges += brick.offsets.len() as u64;
        stats.clusters += brick.clusters.len() as u64;
        stats.cut_vertices += brick.positions.len() as u64;
        Ok((brick, stats))
    }

    /// Signs, marks and crossings of the record.
    fn load(&mut self, record: &ArchivedSignBrick) {
        self.marks.clear();
        self.crossings.clear();
        let mut row = 0;
        let mut has_patches = false;
        let cell_units = self.cell_units as f64;
        self.planes.clear();
        self.walls.clear();
        self.walls.extend(record.walls.iter().map(|face| face.to_native()));
        self.borders.clear();
        self.borders.extend(record.borders.iter().map(Border::from));
        self.planes.extend(record.planes.iter().map(SourcePlane::from));
        self.normals.clear();
        self.normals.push(DVec3::ZERO);
        self.normals.extend(self.planes.iter().map(SourcePlane::unit_normal));
        self.is_smooth = self.spans_less_than_a_crease();
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
                let SourcePlane { material, source, .. } = self.planes[plane as usize];
                let surface = surface_of(material).bits();
                EdgeCrossing { offset, normal: plane + 1, surface, source }
            } else {
                let offset = f64::from(plane & 0xffff) / 65536.0;
                has_patches = true;
                EdgeCrossing { offset, normal: 0, surface: NO_SURFACE, source: NO_SOURCE }
            });
        }
        self.row_starts[row..].fill(self.crossings.len() as u32);
        if self.surfaces != SurfaceDetail::None && has_patches {
            let edges = record.crossings.iter().map(|crossing| crossing.edge.to_native());
            self.patches.find(edges, &mut self.crossings);
        }
        self.signs.from_marks(&self.marks, record.base_inside);
        if self.clustering.is_some() {
            self.begin_leaves();
        }
    }

    /// Whether all normals of the brick are within half the crease angle of the first.
    fn spans_less_than_a_crease(&self) -> bool {
        // The cut-off is tan² of half the angle.
        let cosine_squared = 1.0 / (1.0 + self.qef.cutoff());
        let Some(first) = self.normals.get(1) else { return true };
        self.normals[1..].iter().all(|normal| normal.dot(*first).powi(2) >= cosine_squared)
    }

    /// Whether the edge along `axis` from `at` is crossed.
    #[inline]
    pub(super) fn is_marked(&self, axis: usize, at: [usize; 3]) -> bool {
        self.marks.rows(axis)[at[2] * LINES + at[1]] >> at[0] & 1 == 1
    }

    /// Which corners of the cell at `at` are inside.
    #[inline]
    pub(super) fn mask_at(&self, at: [usize; 3]) -> u8 {
        self.signs.cell_mask(at)
    }

    /// The crossing of a marked edge.
    #[inline]
    pub(super) fn crossing(&self, axis: usize, at: [usize; 3]) -> EdgeCrossing {
        let row = at[2] * LINES + at[1];
        let below = self.marks.rows(axis)[row] & ((1 << at[0]) - 1);
        let rank = self.row_starts[axis * ROWS + row] + below.count_ones();
        self.crossings[rank as usize]
    }

    fn place_in_cell(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        number: usize,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        let at = place_of(number);
        let mask = self.signs.cell_mask(at);
        let mut cell = number as u32 | u32::from(mask) << 15;
        if self.method == Method::Dc {
            cell |= ONE_VERTEX_BIT;
        } else {
            let (joined, turned) = self.joined_faces(signs, key, at, mask)?;
            cell |= u32::from(joined) << JOINED_FACES;
            stats.flipped_faces += u64::from(turned);
        }
        let components = components_of(cell);
        let masks = &components.edge_masks[..usize::from(components.count)];
        let is_clustering = self.clustering.is_some();
        if is_clustering {
            self.leaves.components.push(brick.positions.len() as u32);
        }
        if self.method == Method::Dmc {
            self.place_in_middle(at, masks, brick);
        } else if components.count == 1 && is_clustering && self.surfaces == SurfaceDetail::None {
            let place = Place { signs, key };
            let own = self.add_borderless_leaf(at, mask, masks[0]);
            if self.is_plain(place, at, own.all())? {
                brick.positions.push(later(brick.cells.len()));
            } else {
                let around = self.around(at, masks[0]);
                self.place_alone(place, at, &around, brick, stats)?;
            }
        } else if components.count == 1 {
            let place = Place { signs, key };
            let around = self.around(at, masks[0]);
            let border = self.border_planes(at, &around);
            if is_clustering {
                self.add_leaf(at, mask, &around, &border);
            }
            if !border.is_none() {
                self.place_on_border(at, &around, &border, brick, stats);
            } else if is_clustering && self.is_plain(place, at, around.own_normals())? {
                brick.positions.push(later(brick.cells.len()));
            } else {
                self.place_alone(place, at, &around, brick, stats)?;
            }
        } else {
            if is_clustering {
                for &edges in masks {
                    let around = self.around(at, edges);
                    let border = self.border_planes(at, &around);
                    self.add_leaf(at, mask, &around, &border);
                }
            }
            self.place_apart(at, masks, brick, stats);
        }
        for axis in 0..3 {
            if (mask ^ mask >> (1 << axis)) & 1 == 1 {
                let EdgeCrossing { offset, surface, source, .. } = self.crossing(axis, at);
                brick.offsets.push((offset * 65536.0).clamp(1.0, 65535.0) as u16);
                if self.surfaces != SurfaceDetail::None {
                    brick.surfaces.push(self.surfaces.of(surface));
                }
                if self.sources {
                    brick.sources.push(source);
                }
            }
        }
        brick.cells.push(cell);
        stats.cells += 1;
        stats.multi_cells += u64::from(components.count > 1);
        stats.cell_vertices += u64::from(components.count);
        Ok(())
    }
}
