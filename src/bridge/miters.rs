//! Miters: how far each corner of a wall's triangle goes for one unit of thickness.
//!
//! At a vertex of a sheet the wall's other side is where the planes of all triangles around, moved
//! by the thickness, meet; in the middle of a flat that is straight out, at a crease the miter. So
//! walls have no gaps at creases, and end at rims in the rim's own plane.
//!
//! In:         [`MiterUse`]s: every triangle of a wall at every corner, with its normal.
//! Out:        [`Miter`]s by triangle and corner.
//! Units:      multiples of the thickness.
//! Memory:     the share; one vertex at a time.
//! Source:     the least squares solution of smallest length, by the quadric of `geom::qef`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::geom::qef::{Qef, QefOptions};
use crate::store::{Record, Resources, Sorted, Sorter, StoreError};

/// A miter is never longer than this: the sides of a thin wedge would meet far away.
const LONGEST: f64 = 3.0;

/// A corner of a triangle in a wall. 64 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct MiterUse {
    /// The vertex, packed in two words.
    pub vertex: [u64; 2],
    /// Unit normal on the side of the sheet's first triangle.
    pub normal: [f64; 3],
    pub sheet: u32,
    pub source: u32,
    pub corner: u32,
    /// 1 where `sheet` is the triangle itself, since its sheet has one side only.
    pub is_alone: u32,
}

impl Record for MiterUse {
    type Key = ([u64; 2], u32, u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.vertex, self.is_alone, self.sheet, self.source, self.corner)
    }
}

/// The miter of a corner. 32 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Miter {
    pub by: [f64; 3],
    pub source: u32,
    pub corner: u32,
}

impl Record for Miter {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.source, self.corner)
    }
}

/// Finds the miters of all corners.
pub fn find_miters(
    uses: Sorter<MiterUse>,
    resources: &Resources,
) -> Result<Sorted<Miter>, StoreError> {
    let mut miters = Sorter::new(resources.scratch, resources.share_bytes / 8);
    let mut sorted = uses.finish()?;
    let mut next = sorted.next()?;
    let options =
        QefOptions::new(QefOptions::CREASE_DEG, DVec3::splat(-LONGEST), DVec3::splat(LONGEST));
    let mut around: Vec<(u32, u32)> = Vec::new();
    while let Some(first) = next {
        let mut planes = Qef::default();
        around.clear();
        while let Some(one) = next
            && (one.vertex, one.is_alone, one.sheet) == (first.vertex, first.is_alone, first.sheet)
        {
            let normal = DVec3::from(one.normal);
            if normal != DVec3::ZERO {
                planes.add_plane(normal, normal);
            }
            around.push((one.source, one.corner));
            next = sorted.next()?;
        }
        let by = if planes.count() == 0 { DVec3::ZERO } else { planes.solve(&options).position };
        let by = by.to_array();
        for &(source, corner) in &around {
            miters.push(Miter { by, source, corner })?;
        }
    }
    miters.finish()
}
