//! From signs and Hermite data to a surface: vertices in cells, polygons around crossed edges.
//!
//! In:         the brick file of sign generation.
//! Out:        vertices and triangles into a [`crate::mesh::MeshSink`], numbered in Morton order of
//!             the bricks.
//! Invariant:  closed and 2-manifold by construction; every vertex strictly inside its cell (its
//!             edge for [`mc`]), on the lattice that the output file holds exactly; no triangle is
//!             degenerate.
//! Units:      lattice units within a brick, model units at the sink.
//! Memory:     per worker one brick and the border of its seven lower (upper for [`mc`])
//!             neighbours; 4 bytes a brick.
//! Fails:      [`ContourError`]: the scratch disk, the sink, or bricks that contradict each other.
//! Source:     that of the method; see [`mdc`] and [`mc`].
//!
//! [`mdc`] is manifold dual contouring, the method that the guarantees rest on. [`mc`] is marching
//! cubes, for comparison. Another method gets a folder beside them, a [`Method`] with what it
//! cannot promise, and an arm wherever the compiler asks for one: here, in `maker` and in `write`.

pub mod mc;
pub mod mdc;

mod count;
mod maker;

#[cfg(test)]
mod above_tests;
#[cfg(test)]
mod noise_tests;
mod write;

use serde::{Deserialize, Serialize};

use crate::mesh::Surface;
use crate::octree::{BrickError, Domain, SignBricks};
use crate::store::{BrickFile, BrickWriter, Resources, StoreError};

pub use count::count_triangles;
pub use write::{WriteError, WriteProgress, write_surface};

/// Name of the brick file that [`place_vertices`] leaves.
pub const CELLS: &str = "cells.bricks";

/// Name of the brick file that [`separate`] leaves: bricks that stand for those of [`CELLS`].
pub const SURFACE: &str = "surface.bricks";

/// Names of files that [`separate`] needs while it runs.
pub const LOOKS: [&str; 2] = mdc::LOOKS;

/// How the surface is drawn from the signs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Manifold dual contouring.
    #[default]
    Mdc,
    /// Dual contouring: one vertex a cell.
    Dc,
    /// Dual marching cubes: the vertices of manifold dual contouring in the middle of their
    /// crossings.
    Dmc,
    /// Marching cubes.
    Mc,
}

impl Method {
    /// What it cannot promise of its surface; `None` for the method that the guarantees rest on.
    /// A proof that fails ends the run of that one only.
    #[must_use]
    pub const fn caveat(self) -> Option<&'static str> {
        match self {
            Self::Mdc => None,
            Self::Dc => Some(
                "dual contouring has one vertex a cell, so sheets that share a cell are joined \
                 there, which is not manifold, and triangles may intersect",
            ),
            Self::Dmc => Some(
                "dual marching cubes rounds creases and corners off, by up to a cell, and its \
                 triangles may intersect",
            ),
            Self::Mc => Some(
                "marching cubes cuts creases and corners off, by up to a cell, and leaves slivers \
                 where the surface passes near a corner of the grid",
            ),
        }
    }
}

/// Settings of contouring that change the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContourOptions {
    /// The method.
    pub method: Method,
    /// Dihedral angles below this are noise.
    pub crease_deg: f64,
    /// Largest distance of a cluster's vertex to the planes it stands for, in cells; 0 for none.
    pub decimate_cells: f64,
    /// What triangles tell of what they are ([`crate::mesh::Surface`]).
    pub surfaces: SurfaceDetail,
    /// Whether they tell of the source triangles that they come from; only with surfaces.
    pub sources: bool,
}

/// What triangles of the output tell of what they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceDetail {
    /// Nothing.
    #[default]
    None,
    /// Their material; patches have that of their rim.
    Material,
    /// Their material, and whether they close what was open.
    MaterialAndPatch,
}

impl SurfaceDetail {
    /// As much of a packed [`crate::mesh::Surface`] as is told.
    pub(crate) const fn of(self, bits: u32) -> u32 {
        match self {
            Self::None => 0,
            Self::Material => Surface::from_bits(bits).material(),
            Self::MaterialAndPatch => bits,
        }
    }
}

impl ContourOptions {
    /// The threshold at which cells are merged, in cells; 0 for none.
    #[must_use]
    pub fn merged_cells(&self) -> f64 {
        if self.method == Method::Mdc { self.decimate_cells } else { 0.0 }
    }

    /// Whether cells are clustered.
    pub(crate) fn has_clusters(&self) -> bool {
        self.merged_cells() > 0.0
    }
}

/// What can go wrong while contouring.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ContourError {
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A brick's record is not what its stage writes.
    #[error(transparent)]
    Brick(#[from] BrickError),
    /// Two bricks contradict each other: a bug, or a disk that lies.
    #[error("Brick {brick:?}: expected {expected}, found otherwise")]
    Contradiction {
        /// Position of the brick.
        brick: [u32; 3],
        /// What holds for every sound set of bricks.
        expected: &'static str,
    },
}

impl ContourError {
    /// Whether the work so far is worth keeping.
    #[must_use]
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Store(error) if error.is_stop())
    }
}

/// Counts of contouring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContourStats {
    /// Cells with at least one vertex.
    pub cells: u64,
    /// Cells with two vertices or more.
    pub multi_cells: u64,
    /// Ambiguous faces that are not as walls and gaps would have them, to keep the surface manifold;
    /// counted once per cell.
    pub flipped_faces: u64,
    /// Vertices in cells; on edges by marching cubes.
    pub cell_vertices: u64,
    /// Vertices that were pulled back into their cell, of those that were placed: in most cells that become
    /// part of a cluster none is.
    pub clamped_vertices: u64,
    /// Vertices on creases or corners that their cells' own edges do not see.
    pub feature_vertices: u64,
    /// Edges of the grid that the surface crosses; without clusters each gives two triangles, and
    /// four where it is drawn as a fan.
    pub crossed_edges: u64,
    /// Cells of the octree that became one vertex, or several.
    pub clusters: u64,
    /// Cells that did not because a vertex would lie too far from a plane.
    pub refused_by_error: u64,
    /// Cells that did not because of the shape of the surface in them, or because a vertex would lie
    /// outside of them.
    pub refused_by_shape: u64,
    /// Largest distance of a cluster's vertex to a plane that it stands for, cells.
    pub cluster_error_cells: f64,
    /// Vertices in clusters and in cells that no cluster covers.
    pub cut_vertices: u64,
    /// Cells whose face points are vertices, so that the surfaces in them stay apart.
    pub flagged_cells: u64,
    /// Clusters that were split for the same reason, or because the vertex of another brick reaches
    /// in.
    pub split_clusters: u64,
    /// Vertices on faces between cells.
    pub face_points: u64,
    /// Polygons: one per crossed edge; one per boundary cycle of a cell by marching cubes.
    pub polygons: u64,
    /// Polygons drawn as a fan around their crossing.
    pub fans: u64,
    /// Smallest angle of all triangles, degrees; 180 without triangles.
    pub least_angle_deg: f64,
    /// Sum over the triangles of the smallest angle of each, degrees.
    pub sum_of_least_angles_deg: f64,
    /// Triangles written.
    pub triangles: u64,
    /// Vertices written.
    pub vertices: u64,
}

impl Default for ContourStats {
    fn default() -> Self {
        Self {
            cells: 0,
            multi_cells: 0,
            flipped_faces: 0,
            cell_vertices: 0,
            clamped_vertices: 0,
            feature_vertices: 0,
            crossed_edges: 0,
            clusters: 0,
            refused_by_error: 0,
            refused_by_shape: 0,
            cluster_error_cells: 0.0,
            cut_vertices: 0,
            flagged_cells: 0,
            split_clusters: 0,
            face_points: 0,
            polygons: 0,
            fans: 0,
            least_angle_deg: 180.0,
            sum_of_least_angles_deg: 0.0,
            triangles: 0,
            vertices: 0,
        }
    }
}

impl ContourStats {
    /// The mean over the triangles of the smallest angle of each, degrees.
    #[must_use]
    pub fn mean_least_angle_deg(&self) -> f64 {
        self.sum_of_least_angles_deg / self.triangles.max(1) as f64
    }

    /// Adds the counts of a brick; what the written file has in all is not added.
    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.multi_cells += other.multi_cells;
        self.flipped_faces += other.flipped_faces;
        self.cell_vertices += other.cell_vertices;
        self.clamped_vertices += other.clamped_vertices;
        self.crossed_edges += other.crossed_edges;
        self.cluster_error_cells = self.cluster_error_cells.max(other.cluster_error_cells);
        self.least_angle_deg = self.least_angle_deg.min(other.least_angle_deg);
        self.sum_of_least_angles_deg += other.sum_of_least_angles_deg;
        self.feature_vertices += other.feature_vertices;
        self.clusters += other.clusters;
        self.refused_by_error += other.refused_by_error;
        self.refused_by_shape += other.refused_by_shape;
        self.cut_vertices += other.cut_vertices;
        self.polygons += other.polygons;
        self.fans += other.fans;
    }
}

/// Places the vertices of all bricks.
///
/// # Errors
/// [`ContourError`].
pub fn place_vertices(
    signs: SignBricks,
    domain: &Domain,
    options: &ContourOptions,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    match options.method {
        Method::Mdc | Method::Dc | Method::Dmc => {
            mdc::place_vertices(signs, domain, options, resources)
        }
        Method::Mc => mc::place_vertices(signs, domain, resources),
    }
}

/// Keeps surfaces apart that pass through one cell of `cells`, which were placed from `signs`; the
/// bricks that changed.
///
/// Methods that do not promise it change nothing.
///
/// # Errors
/// [`ContourError`].
pub fn separate(
    signs: SignBricks,
    cells: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
    placed: &ContourStats,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    if options.method == Method::Mdc {
        return mdc::separate(signs, cells, domain, options, placed, resources);
    }
    let writer = BrickWriter::create(resources.scratch, SURFACE, resources.backing)?;
    Ok((writer.finish(resources.cached_windows)?, *placed))
}
