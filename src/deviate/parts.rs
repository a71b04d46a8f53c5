//! Which parts of a scene can be seen from outside of all of it.
//!
//! In:         all triangles, those of a part one after another.
//! Out:        [`PartsSeen`].
//! Invariant:  a part is seen if some of [`SAMPLES_OF_PART`] points spread over its area is, as
//!             [`crate::deviate::sight`] has it: so what is seen through an opening or behind a pane
//!             stays, and no grid decides what is small. One without an area is seen.
//! Memory:     half of the share; 24 bytes a part, in a table that spills.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::deviate::nearest::Walker;
use crate::deviate::reading::{Tape, read};
use crate::deviate::samples::{Spread, point_within};
use crate::deviate::sight::Sight;
use crate::deviate::tree::{Curve, Tree};
use crate::deviate::triangles::{BLOCK, Blocks, Triangle, Triangles};
use crate::deviate::{DeviateError, Means};
use crate::mesh::MeshSource;
use crate::store::{StoreError, Table, ordered};

/// Points that are looked at of a part, until one is seen.
const SAMPLES_OF_PART: u64 = 64;

/// Triangles of a part, and their area.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Extent {
    first: u64,
    triangles: u64,
    area: f64,
}

/// By part whether somebody sees it.
pub struct PartsSeen {
    hidden: Table<u8>,
}

impl PartsSeen {
    /// Reads `source` to its end, and looks at every part of it.
    ///
    /// # Errors
    /// [`DeviateError`]: the source fails, the scratch disk fails, or the caller cancels.
    pub fn find<S: MeshSource + ?Sized>(
        source: &mut S,
        means: &Means<'_>,
    ) -> Result<Self, DeviateError<S::Error>> {
        let mut extents = Table::<Extent>::new(means.scratch, means.share_bytes / 32);
        let tape = read(source, means, |part, measured| {
            let part = u64::from(part);
            while extents.len() <= part {
                let first = u64::from(measured.triangle.number);
                extents.push(Extent { first, ..Extent::zeroed() })?;
            }
            let known = extents.get(part)?;
            let area = known.area + measured.area;
            extents.set(part, Extent { triangles: known.triangles + 1, area, ..known })
        })?;
        let mut hidden = Table::new(means.scratch, means.share_bytes / 32);
        if tape.is_measurable() {
            look(tape, extents, &mut hidden, means)?;
        }
        Ok(Self { hidden })
    }

    /// Whether a part is in sight.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn is_seen(&mut self, part: u32) -> Result<bool, StoreError> {
        let part = u64::from(part);
        Ok(part >= self.hidden.len() || self.hidden.get(part)? == 0)
    }
}

/// Looks at all parts, in order.
fn look(
    tape: Tape,
    mut extents: Table<Extent>,
    hidden: &mut Table<u8>,
    means: &Means<'_>,
) -> Result<(), StoreError> {
    let bounds = tape.bounds;
    let tree = Tree::around(tape, means)?;
    let mut part = 0;
    ordered(
        means.pool,
        || {
            means.stop_if_asked()?;
            if part == extents.len() {
                return Ok(None);
            }
            part += 1;
            extents.get(part - 1).map(Some)
        },
        || Looker::new(&tree, bounds, means),
        |looker, extent| looker.is_hidden(extent),
        |is_hidden| hidden.push(u8::from(is_hidden)),
    )
}

/// Looks at parts; each worker has its own.
struct Looker<'t> {
    triangles: &'t Triangles<'t>,
    sight: Sight<'t>,
    room: Vec<Triangle>,
}

impl<'t> Looker<'t> {
    fn new(tree: &'t Tree<'_>, bounds: [[f64; 3]; 2], means: &Means<'_>) -> Self {
        let share_bytes = means.share_bytes / 8 / means.pool.current_num_threads() as u64;
        let extent = Curve::new(bounds).extent;
        let sight = Sight::new(Walker::new(tree, share_bytes), extent);
        Self { triangles: &tree.triangles, sight, room: Vec::new() }
    }

    fn is_hidden(&mut self, extent: Extent) -> Result<bool, StoreError> {
        if !extent.area.is_normal() {
            return Ok(false);
        }
        let mut spread = Spread::new(SAMPLES_OF_PART, extent.area);
        let mut at = extent.first;
        let end = extent.first + extent.triangles;
        while at < end {
            let count = (end - at).min(BLOCK as u64) as usize;
            let block = self.triangles.block(at, count, &mut self.room)?;
            at += block.len() as u64;
            for triangle in block {
                let normal = triangle.normal();
                let numbers = spread.take(normal.length() / 2.0);
                let normal = normal.normalize_or_zero();
                for (number, _) in (0..).zip(numbers) {
                    let point = point_within(triangle, number);
                    if self.sight.sees(point, normal, DVec3::ZERO)? {
                        return Ok(false);
                    }
                }
            }
        }
        Ok(true)
    }
}
