//! The triangles of the file as the later passes see them: vertex numbers beside corners.
//!
//! In:         corners and vertex numbers in file order.
//! Invariant:  one entry per triangle of the file; [`Triangle::is_whole`] tells whether it has a
//!             part in the topology. Those with a corner at infinity are entered as `[0; 3]`.
//! Memory:     its shares, and a read buffer of at most an eighth of them.

use crate::monitor::Monitor;
use crate::store::{Scratch, Sequence, StoreError};

/// A triangle on the tape.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<'t> {
    /// Its number in the file.
    pub(crate) number: u64,
    /// Its vertices.
    pub(crate) ids: [u32; 3],
    /// Its corners in model units.
    pub(crate) corners: &'t [[f64; 3]; 3],
}

impl Triangle<'_> {
    /// Whether it has three vertices: only such triangles make up the surface.
    pub(crate) fn is_whole(&self) -> bool {
        is_whole(self.ids)
    }
}

/// Whether these are three vertices.
#[inline]
pub(crate) fn is_whole([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// All triangles of the file, to be read again and again.
pub(crate) struct Tape {
    ids: Sequence<[u32; 3]>,
    corners: Sequence<[[f64; 3]; 3]>,
    block_triangles: usize,
}

impl Tape {
    /// An empty tape.
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let block_triangles = (share_bytes / 8 / 84).clamp(16, 4096) as usize;
        Self {
            ids: Sequence::new(scratch, share_bytes / 7),
            corners: Sequence::new(scratch, share_bytes / 7 * 6),
            block_triangles,
        }
    }

    /// The number of triangles.
    pub(crate) fn len(&self) -> u64 {
        self.corners.len()
    }

    /// Appends corners; their vertex numbers follow now or later, in the same order.
    pub(crate) fn push_corners(&mut self, corners: [[f64; 3]; 3]) -> Result<(), StoreError> {
        self.corners.push(corners)
    }

    /// Appends the vertex numbers of the first triangle that has none yet.
    pub(crate) fn push_ids(&mut self, ids: [u32; 3]) -> Result<(), StoreError> {
        self.ids.push(ids)
    }

    /// Forgets all vertex numbers.
    pub(crate) fn clear_ids(&mut self) {
        self.ids.clear();
    }

    /// At most a block of corners from triangle `start` on.
    pub(crate) fn corners<'a>(
        &'a self,
        start: u64,
        buffer: &'a mut Vec<[[f64; 3]; 3]>,
    ) -> Result<&'a [[[f64; 3]; 3]], StoreError> {
        self.corners.block(start, self.block_triangles, buffer)
    }

    /// Shows the vertex numbers of every whole triangle, in file order.
    pub(crate) fn each_whole(
        &self,
        monitor: &dyn Monitor,
        mut visit: impl FnMut([u32; 3]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut start = 0;
        let mut buffer = Vec::new();
        loop {
            stop_if_asked(monitor)?;
            let block = self.ids.block(start, 7 * self.block_triangles, &mut buffer)?;
            if block.is_empty() {
                return Ok(());
            }
            start += block.len() as u64;
            for &ids in block.iter().filter(|&&ids| is_whole(ids)) {
                visit(ids)?;
            }
        }
    }

    /// Shows every triangle in file order until `visit` has enough and answers `false`.
    pub(crate) fn each(
        &self,
        monitor: &dyn Monitor,
        mut visit: impl FnMut(Triangle<'_>) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        let mut number = 0;
        let (mut id_buffer, mut corner_buffer) = (Vec::new(), Vec::new());
        loop {
            stop_if_asked(monitor)?;
            let corners = self.corners.block(number, self.block_triangles, &mut corner_buffer)?;
            let ids = self.ids.block(number, corners.len(), &mut id_buffer)?;
            if ids.is_empty() {
                return Ok(());
            }
            for (&ids, corners) in ids.iter().zip(corners) {
                if !visit(Triangle { number, ids, corners })? {
                    return Ok(());
                }
                number += 1;
            }
        }
    }
}

/// Ends the work when the caller wants that.
pub(crate) fn stop_if_asked(monitor: &dyn Monitor) -> Result<(), StoreError> {
    if monitor.cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
}
