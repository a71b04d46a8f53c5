//! One polygon on its way from a reader into batches, cut into triangles.
//!
//! In: corners in order. Out: triangles, as many as the batch has room for; the rest waits.
//! Memory: 52 bytes a corner, at most [`MOST_CORNERS`].

use std::path::Path;

use crate::geom::EarClipper;
use crate::io::BATCH_TRIANGLES;
use crate::io::error::IoError;
use crate::mesh::TriangleBatch;

/// The most corners of one polygon.
pub(crate) const MOST_CORNERS: usize = 1 << 18;

/// Opaque white, the colour of vertices without one.
pub(crate) const WHITE: [u8; 4] = [255; 4];

/// What a reader knows of a corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Corner {
    pub(crate) vertex: u32,
    pub(crate) uv: [f32; 2],
    pub(crate) colour: [u8; 4],
}

/// Which optional columns of a batch a file fills.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Columns {
    pub(crate) indices: bool,
    pub(crate) uvs: bool,
    pub(crate) colours: bool,
}

/// What all triangles of a polygon share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Owner {
    pub(crate) part: u32,
    pub(crate) material: u32,
    pub(crate) polygon: u32,
}

/// Collects a polygon, cuts it, and hands its triangles out.
#[derive(Debug, Default)]
pub(crate) struct PolygonCutter {
    columns: Columns,
    positions: Vec<[f64; 3]>,
    corners: Vec<Corner>,
    owner: Owner,
    triangles: Vec<[u32; 3]>,
    delivered: usize,
    clipper: EarClipper,
}

impl PolygonCutter {
    pub(crate) fn new(columns: Columns) -> Self {
        Self { columns, ..Self::default() }
    }

    /// The number of corners so far.
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Adds a corner to the polygon that is being read.
    #[inline]
    pub(crate) fn push(
        &mut self,
        path: &Path,
        position: [f64; 3],
        corner: Corner,
    ) -> Result<(), IoError> {
        if self.positions.len() == MOST_CORNERS {
            return Err(IoError::too_many(path, "corners in one polygon", MOST_CORNERS as u64));
        }
        self.positions.push(position);
        self.corners.push(corner);
        Ok(())
    }

    /// Says what texture coordinate a corner has that was added before.
    pub(crate) fn set_uv(&mut self, corner: usize, uv: [f32; 2]) {
        if let Some(corner) = self.corners.get_mut(corner) {
            corner.uv = uv;
        }
    }

    /// Forgets the polygon that is being read.
    #[inline]
    pub(crate) fn clear(&mut self) {
        self.positions.clear();
        self.corners.clear();
        self.triangles.clear();
        self.delivered = 0;
    }

    /// The polygon is complete: its triangles are ready for delivery.
    #[inline]
    pub(crate) fn close(&mut self, owner: Owner) {
        self.owner = owner;
        self.clipper.cut(&self.positions, &mut self.triangles);
        self.delivered = 0;
    }

    /// Moves triangles into the batch until it is full or, `true`, none is left.
    #[inline]
    pub(crate) fn deliver(&mut self, batch: &mut TriangleBatch) -> bool {
        let room = BATCH_TRIANGLES.saturating_sub(batch.len());
        let end = self.triangles.len().min(self.delivered + room);
        for &triangle in &self.triangles[self.delivered..end] {
            let Owner { part, material, polygon } = self.owner;
            batch.push(triangle.map(|i| self.positions[i as usize]), part, material, polygon);
            let corners = triangle.map(|i| self.corners[i as usize]);
            if self.columns.indices {
                batch.indices.push(corners.map(|corner| corner.vertex));
            }
            if self.columns.uvs {
                batch.uvs.push(corners.map(|corner| corner.uv));
            }
            if self.columns.colours {
                batch.colours.push(corners.map(|corner| corner.colour));
            }
        }
        self.delivered = end;
        if end < self.triangles.len() {
            return false;
        }
        self.clear();
        true
    }
}

/// The number of a polygon as batches hold it.
pub(crate) fn polygon_number(path: &Path, number: u64) -> Result<u32, IoError> {
    // The largest number says "no polygon".
    let limit = u64::from(u32::MAX);
    if number >= limit {
        return Err(IoError::too_many(path, "polygons", limit));
    }
    Ok(number as u32)
}

/// An index as files write it, counted from 0, if there is such a vertex.
#[inline]
pub(crate) fn checked_index(index: f64, count: u64) -> Option<u32> {
    // The cast saturates, and gives back what it was given for whole numbers only.
    let vertex = index as u32;
    (f64::from(vertex) == index && u64::from(vertex) < count).then_some(vertex)
}
