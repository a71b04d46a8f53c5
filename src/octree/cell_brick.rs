//! The record of a brick in `cells.bricks`: its cells with their vertices.
//!
//! Units: positions in lattice units from the brick's min corner.

use rkyv::rancor::BoxedError;
use rkyv::{Archive, Deserialize, Serialize};

use crate::octree::brick::{ArchiveSize, BrickError, ROOT_BYTES, out_of_range};

/// In [`CellBrick::sources`]: not known.
pub const NO_SOURCE: u32 = u32::MAX;

/// Highest level of a cluster: the whole brick.
pub const MAX_LEVEL: u32 = 5;

/// A vertex on a face between two cells of the cut, where the segment that joins their vertices
/// does not pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct FacePoint {
    /// The axis across the face (2 bits at 62), whether the lower cell lies in another brick (1 bit
    /// at 61), the vertex of the upper cell (24 bits at 24) and of the lower one (24 bits at 0), by
    /// their numbers in their bricks.
    pub key: u64,
    /// Where it is.
    pub position: [i32; 3],
}

/// A vertex that belongs into an empty cell beside its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct VertexReach {
    /// The number of its leaf cell, which has no other vertex.
    pub cell: u16,
    /// The face to pass: twice its axis, and one more on the max side.
    pub face: u8,
    /// Whether the vertex is there; else it stays in its own cell.
    pub is_granted: bool,
    /// Squared way from the middle of the cell's crossings, in cells: of several that want into one
    /// cell the nearest goes.
    pub far: f32,
    /// Where.
    pub position: [i32; 3],
}

/// The planes of a face as far as clusters above the brick know them: all normals are within
/// `spread` of one, all offsets of points within an interval.
#[derive(Clone, Copy, Debug, PartialEq, Archive, Serialize, Deserialize)]
pub struct Facet {
    /// A unit normal.
    pub normal: [f64; 3],
    /// Smallest and largest offset of the planes, in cells from the min corner of the cell.
    pub offsets: [f64; 2],
    /// Farthest that the end of another normal is from that of this one.
    pub spread: f64,
    /// Sum of the crossings, in cells from that corner.
    pub points: [f64; 3],
    /// How many crossings.
    pub count: f64,
}

/// What clusters above the brick ask of a brick that is one vertex: a disk with one arc per face.
#[derive(Clone, Debug, PartialEq, Archive, Serialize, Deserialize)]
pub struct Summary {
    /// How often the surface crosses each of the twelve edges, a byte each.
    pub edges: [u64; 2],
    /// Its planes.
    pub facets: Vec<Facet>,
}

/// The vertex of a cluster above the brick, in each of its bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Above {
    /// Level of its cell: 6 to 15.
    pub level: u32,
    /// The number in the file of the brick that has the vertex: the first with surface.
    pub owner: u32,
    /// Where it is, from the min corner of this brick.
    pub position: [i32; 3],
}

/// What contouring leaves of a brick: its cells with their vertices.
///
/// The cut is the set of cells that have vertices of their own: clusters, and the leaf cells that
/// no cluster covers. Vertices are numbered along it.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct CellBrick {
    /// Cell number in Morton order (15 bits), corner mask (8 bits at 15), faces that join their
    /// inside corners (6 bits at 23), flag of one vertex for all components (1 bit at 29); ascending.
    pub cells: Vec<u32>,
    /// Clusters: number of their first cell (15 bits), level 1 to 5 (3 bits at 15), number of
    /// vertices (8 bits at 18); ascending, none within another.
    pub clusters: Vec<u32>,
    /// Of each cluster with several vertices: the one that each component of its cells belongs to.
    pub members: Vec<u8>,
    /// Numbers of the first cells of those cells of the cut whose face points are all vertices.
    pub flagged: Vec<u16>,
    /// Clusters that must not be, as in `clusters` without the number of vertices; ascending.
    pub banned: Vec<u32>,
    /// Vertices of leaf cells of the cut that belong into a cell beside, by ascending cell.
    pub reaches: Vec<VertexReach>,
    /// Vertex positions, cell after cell of the cut, component after component.
    pub positions: Vec<[i32; 3]>,
    /// Offsets of the crossings on the cells' own edges (those that leave their min corner), in
    /// 1/65536 of the edge, cell after cell, axis after axis.
    pub offsets: Vec<u16>,
    /// What the same crossings are ([`crate::mesh::Surface`]): one for each, or one for all, or
    /// none where the output names no materials.
    pub surfaces: Vec<u32>,
    /// The source triangles that the same crossings lie on, [`NO_SOURCE`] where none is known:
    /// likewise, or none where the output has nothing of them.
    pub sources: Vec<u32>,
    /// Vertices on the faces that the brick owns, by ascending key; numbered after those of cells.
    pub points: Vec<FacePoint>,
    /// Of a brick that may be part of a larger cluster: what that asks of it.
    pub summary: Option<Summary>,
    /// Of a brick that is part of one: its vertex. Then the brick's own cluster has no position,
    /// but in the brick that owns the vertex.
    pub above: Option<Above>,
}

impl ArchiveSize for CellBrick {
    fn archive_bytes(&self) -> usize {
        let lists = [&self.cells, &self.clusters, &self.banned, &self.surfaces, &self.sources];
        let words: usize = lists.iter().map(|list| list.len()).sum();
        let halves = self.offsets.len() + self.flagged.len();
        let places = 12 * self.positions.len() + 24 * self.points.len() + 20 * self.reaches.len();
        let facets = self.summary.as_ref().map_or(0, |summary| 80 * summary.facets.len());
        4 * words + 2 * halves + self.members.len() + places + facets + 3 * ROOT_BYTES
    }
}

/// Which of these clusters of a brick, ascending, covers a leaf cell.
#[must_use]
pub fn cluster_over(clusters: &[u32], cell: u32) -> Option<u32> {
    let after = clusters.partition_point(|cluster| *cluster & 0x7fff <= cell);
    let cluster = clusters[after.checked_sub(1)?];
    let end = (cluster & 0x7fff) + (1 << (3 * (cluster >> 15 & 7)));
    (cell < end).then_some(cluster)
}

impl CellBrick {
    /// Drops the reaches of leaf cells that a cluster covers.
    pub fn drop_covered_reaches(&mut self) {
        let clusters = &self.clusters;
        self.reaches.retain(|reach| cluster_over(clusters, reach.cell.into()).is_none());
    }
}

impl ArchivedCellBrick {
    /// The brick that the archive holds.
    #[must_use]
    pub fn to_brick(&self) -> CellBrick {
        rkyv::deserialize::<CellBrick, BoxedError>(self).expect("plain vectors deserialise")
    }

    /// Its vertices that may reach beyond their cells.
    #[must_use]
    pub fn to_reaches(&self) -> Vec<VertexReach> {
        rkyv::deserialize::<Vec<VertexReach>, BoxedError>(&self.reaches)
            .expect("plain vectors deserialise")
    }

    /// What larger clusters ask of it.
    #[must_use]
    pub fn to_summary(&self) -> Option<Summary> {
        rkyv::deserialize::<Option<Summary>, BoxedError>(&self.summary)
            .expect("plain vectors deserialise")
    }
}

/// Highest level of a cluster above the brick: the largest grid.
const TOP_LEVEL: u32 = 15;

/// Validates a [`CellBrick`].
///
/// # Errors
/// [`BrickError`] when the bytes are none.
pub fn decode_cells(bytes: &[u8]) -> Result<&ArchivedCellBrick, BrickError> {
    let kind = "cell";
    let brick = rkyv::access::<ArchivedCellBrick, BoxedError>(bytes)
        .map_err(|source| BrickError::Invalid { kind, source })?;
    if let Some(cell) = brick.cells.iter().find(|cell| cell.to_native() >> 30 != 0) {
        return Err(out_of_range(kind, "cell", cell.to_native().into(), 1 << 30));
    }
    let is_reach = |reach: &ArchivedVertexReach| reach.cell.to_native() < 1 << 15 && reach.face < 6;
    if let Some(reach) = brick.reaches.iter().find(|reach| !is_reach(reach)) {
        let number = u64::from(reach.face) << 16 | u64::from(reach.cell.to_native());
        return Err(out_of_range(kind, "reach", number, 6 << 16));
    }
    if let Some(above) = brick.above.as_ref() {
        let level = above.level.to_native();
        if !(MAX_LEVEL + 1..=TOP_LEVEL).contains(&level) {
            return Err(out_of_range(kind, "level", level.into(), u64::from(TOP_LEVEL) + 1));
        }
    }
    let is_cluster = |cluster: u32| {
        let (first, level) = (cluster & 0x7fff, cluster >> 15 & 7);
        (1..=MAX_LEVEL).contains(&level) && first.is_multiple_of(1 << (3 * level))
    };
    let clusters = brick.clusters.iter().chain(brick.banned.iter());
    match clusters.map(|cluster| cluster.to_native()).find(|cluster| !is_cluster(*cluster)) {
        Some(cluster) => Err(out_of_range(kind, "cluster", cluster.into(), 1 << 26)),
        None => Ok(brick),
    }
}
