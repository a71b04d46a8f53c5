//! Runs: triangles that follow each other in the file and lie beside each other, as most files have
//! them. A tree is made of runs, so that not every triangle has to be sorted.
//!
//! In:         triangles, in file order.
//! Out:        [`Run`]s, each triangle in one of them.
//! Invariant:  the box of a run is no larger than its triangles are together: where the next triangle
//!             would be somewhere else, the run ends. Depends on the triangles and their order alone.
//! Memory:     a sixteenth of the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::Means;
use crate::deviate::pages::PAGE;
use crate::deviate::tree::{Bounds, GROUP, Node};
use crate::deviate::triangles::Measured;
use crate::geom::{mix, mix_words};
use crate::store::{Sequence, StoreError};

/// Triangles that follow each other in the file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Run {
    pub(crate) node: Node,
    /// Of all its triangles: copies have the same.
    pub(crate) hash: u64,
    /// Of all its triangles.
    pub(crate) area: f64,
}

/// Runs while triangles come.
pub(crate) struct Runs {
    list: Sequence<Run>,
    low: DVec3,
    high: DVec3,
    /// Lengths of its triangles, in all.
    lengths: f64,
    first: u32,
    count: u32,
    hash: u64,
    area: f64,
}

impl Runs {
    pub(crate) fn new(means: &Means<'_>) -> Self {
        Self {
            list: Sequence::new(means.scratch, means.share_bytes / 16),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            lengths: 0.0,
            first: 0,
            count: 0,
            hash: 0,
            area: 0.0,
        }
    }

    /// Takes in the next triangle, which has this box.
    pub(crate) fn add(
        &mut self,
        measured: &Measured,
        [low, high]: [DVec3; 2],
    ) -> Result<(), StoreError> {
        let triangle = &measured.triangle;
        let length = (high - low).max_element();
        let (both_low, both_high) = (self.low.min(low), self.high.max(high));
        let is_beside = (both_high - both_low).max_element() <= self.lengths + length;
        // A run lies on one page.
        let is_full =
            u64::from(self.count) == GROUP || u64::from(triangle.number).is_multiple_of(PAGE);
        if self.count > 0 && (is_full || !is_beside) {
            self.close()?;
        }
        if self.count == 0 {
            (self.low, self.high, self.lengths) = (low, high, 0.0);
            (self.first, self.hash, self.area) = (triangle.number, 0, 0.0);
        } else {
            (self.low, self.high) = (both_low, both_high);
        }
        self.lengths += length;
        self.count += 1;
        self.area += measured.area;
        let hash = mix_words(measured.hashes);
        self.hash = mix(self.hash ^ hash ^ u64::from(triangle.is_pane));
        Ok(())
    }

    fn close(&mut self) -> Result<(), StoreError> {
        let bounds = Bounds { low: self.low.into(), high: self.high.into() };
        let node = Node { bounds, first: self.first, count: self.count };
        self.list.push(Run { node, hash: self.hash, area: self.area })?;
        self.count = 0;
        Ok(())
    }

    /// All runs.
    pub(crate) fn finish(mut self) -> Result<Sequence<Run>, StoreError> {
        if self.count > 0 {
            self.close()?;
        }
        Ok(self.list)
    }
}
