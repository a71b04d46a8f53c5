//! What a thread needs to place the vertices of one brick after another: the brick's crossings, ready to be
//! looked up, and room for what is made of them.
//!
//! In:         a [`SignRecord`].
//! Out:        signs, marks, crossings with their planes, by place.
//! Units:      cells about the brick's min corner; planes in lattice units from there.
//! Memory:     some 40 bytes a crossing, and what clusters take.

use std::collections::HashMap;

use glam::DVec3;

use crate::contour::mdc::INSET_UNITS;
use crate::contour::mdc::block_planes::BlockPlanes;
use crate::contour::mdc::cell::number_at;
use crate::contour::mdc::cluster::{ClusterOptions, Clustering, Leaves};
use crate::contour::mdc::features::Halo;
use crate::contour::mdc::joined_faces::Beyond;
use crate::contour::mdc::leaf_vertex::WaitingCells;
use crate::contour::mdc::patch_surfaces::PatchSurfaces;
use crate::contour::{ContourOptions, Method, SurfaceDetail};
use crate::geom::qef::QefOptions;
use crate::octree::{
    Border, CornerBits, Crossing, Domain, EdgeBits, EdgeWalk, LINES, NO_SOURCE, PATCH, ROWS, SIDE,
    SignRecord, SourcePlane, surface_of,
};

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
pub(super) struct Touched(pub(super) Box<[u64; SIDE * SIDE * SIDE / 64]>);

impl Touched {
    pub(super) fn new() -> Self {
        Self(Box::new([0; SIDE * SIDE * SIDE / 64]))
    }

    pub(super) fn find(&mut self, marks: &EdgeBits) {
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
    pub(super) touched: Touched,
    pub(super) marks: EdgeBits,
    pub(super) signs: CornerBits,
    /// First crossing of each row of edges.
    pub(super) row_starts: Vec<u32>,
    pub(super) crossings: Vec<EdgeCrossing>,
    pub(super) surfaces: SurfaceDetail,
    pub(super) sources: bool,
    pub(super) patches: PatchSurfaces,
    /// Where materials may meet, by ascending cell.
    pub(super) borders: Vec<Border>,
    /// Planes of the brick, and behind them those of edges that leave it.
    pub(super) planes: Vec<SourcePlane>,
    pub(super) normals: Vec<DVec3>,
    pub(super) waiting: WaitingCells,
    pub(super) clustering: Option<Clustering>,
    pub(super) leaves: Leaves,
    pub(super) block_planes: BlockPlanes,
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
            block_planes: BlockPlanes::default(),
            // The cut-off is tan² of half the angle.
            crease_cosine: (1.0 - qef.cutoff()) / (1.0 + qef.cutoff()),
            is_smooth: false,
            halo: Halo::new(),
            walls: Vec::new(),
            beyond: HashMap::new(),
        }
    }

    /// Signs, marks and crossings of the record.
    pub(super) fn load(&mut self, record: SignRecord) {
        self.marks.clear();
        self.crossings.clear();
        let mut row = 0;
        let mut has_patches = false;
        let cell_units = self.cell_units as f64;
        self.planes.clear();
        self.walls.clear();
        self.walls.extend(record.walls().iter().map(|face| face.to_native()));
        self.borders.clear();
        self.borders.extend(record.borders().iter().map(Border::from));
        self.planes.extend(record.planes().iter().map(SourcePlane::from));
        self.normals.clear();
        self.normals.push(DVec3::ZERO);
        self.normals.extend(self.planes.iter().map(SourcePlane::unit_normal));
        self.is_smooth = self.spans_less_than_a_crease();
        let mut walk = EdgeWalk::default();
        record.each_crossing(|Crossing { edge, plane }| {
            walk.go_to(edge);
            let (axis, at) = walk.position();
            self.marks.set_in_row(walk.row(), at[0]);
            while row <= walk.row() {
                self.row_starts[row] = self.crossings.len() as u32;
                row += 1;
            }
            self.crossings.push(if plane & PATCH == 0 {
                let offset = self.planes[plane as usize].offset_on_edge(axis, at, cell_units);
                let SourcePlane { material, source, .. } = self.planes[plane as usize];
                let surface = surface_of(material).bits();
                EdgeCrossing { offset, normal: plane + 1, surface, source }
            } else {
                let offset = f64::from(plane & 0xffff) / 65536.0;
                has_patches = true;
                EdgeCrossing { offset, normal: 0, surface: NO_SURFACE, source: NO_SOURCE }
            });
        });
        self.row_starts[row..].fill(self.crossings.len() as u32);
        if self.surfaces != SurfaceDetail::None && has_patches {
            let mut edges = Vec::with_capacity(self.crossings.len());
            record.each_crossing(|crossing| edges.push(crossing.edge));
            self.patches.find(edges.into_iter(), &mut self.crossings);
        }
        self.signs.from_marks(&self.marks, record.base_inside());
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
        self.crossings[self.rank_of(axis, at[2] * LINES + at[1], at[0])]
    }

    /// The number of the first crossing in a row of edges along `axis` that does not lie before `x`.
    #[inline]
    pub(super) fn rank_of(&self, axis: usize, row: usize, x: usize) -> usize {
        // At most the first 32 edges of the row: fewer bits are counted faster.
        let below = self.marks.rows(axis)[row] as u32 & ((1_u64 << x) - 1) as u32;
        (self.row_starts[axis * ROWS + row] + below.count_ones()) as usize
    }
}
