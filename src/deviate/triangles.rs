//! Triangles that were read, where they lie: on a tape of their own, or in the spool of a soup, which is
//! not copied.
//!
//! Memory:     none but the tape's.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::geom::mix_words;
use crate::octree::{SoupBlock, SoupSpool, SoupTriangle};
use crate::store::{Sequence, StoreError};

/// Triangles at one time on their way from where they lie.
pub(crate) const BLOCK: usize = 1024;

/// A triangle as it was read.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) corners: [[f64; 3]; 3],
    /// Its number among those with finite corners.
    pub(crate) number: u32,
    /// 1 where light passes, else 0.
    pub(crate) is_pane: u32,
}

impl Triangle {
    #[inline]
    pub(crate) fn points(&self) -> [DVec3; 3] {
        let [a, b, c] = self.corners;
        [DVec3::from_array(a), DVec3::from_array(b), DVec3::from_array(c)]
    }

    /// Its normal, twice as long as its area is large.
    #[inline]
    pub(crate) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.points();
        (b - a).cross(c - a)
    }

    /// A triangle of a soup, by its place there.
    fn of_soup(number: u32, triangle: &SoupTriangle) -> Self {
        let is_pane = u32::from(triangle.is_pane());
        Self { corners: triangle.corners, number, is_pane }
    }
}

/// A triangle that comes, with what several ask of it.
pub(crate) struct Measured {
    pub(crate) triangle: Triangle,
    /// Its normal, twice as long as its area is large.
    pub(crate) normal: DVec3,
    pub(crate) area: f64,
    /// Of its corners.
    pub(crate) hashes: [u64; 3],
}

impl Measured {
    #[inline]
    pub(crate) fn new(triangle: Triangle) -> Self {
        let normal = triangle.normal();
        let hashes = triangle.corners.map(|corner| hash_of(&corner));
        Self { triangle, normal, area: normal.length() / 2.0, hashes }
    }
}

/// A hash of numbers, the same for both zeros.
#[inline]
pub(crate) fn hash_of(numbers: &[f64; 3]) -> u64 {
    mix_words(numbers.map(|x| (x + 0.0).to_bits()))
}

/// Records that are read some at a time.
pub(crate) trait Blocks {
    type Record: Pod;

    fn len(&self) -> u64;

    /// Whether all are in memory.
    fn is_resident(&self) -> bool;

    /// At most `count` records from number `start` on, as [`Sequence::block`] has them.
    fn block<'a>(
        &'a self,
        start: u64,
        count: usize,
        room: &'a mut Vec<Self::Record>,
    ) -> Result<&'a [Self::Record], StoreError>;
}

impl<R: Pod> Blocks for Sequence<R> {
    type Record = R;

    fn len(&self) -> u64 {
        Self::len(self)
    }

    fn is_resident(&self) -> bool {
        Self::is_resident(self)
    }

    #[inline]
    fn block<'a>(
        &'a self,
        start: u64,
        count: usize,
        room: &'a mut Vec<R>,
    ) -> Result<&'a [R], StoreError> {
        Self::block(self, start, count, room)
    }
}

/// Where triangles lie.
pub(crate) enum Triangles<'s> {
    Taped(Sequence<Triangle>),
    Spooled(&'s SoupSpool),
}

impl Blocks for Triangles<'_> {
    type Record = Triangle;

    fn len(&self) -> u64 {
        match self {
            Self::Taped(tape) => tape.len(),
            Self::Spooled(spool) => spool.len(),
        }
    }

    fn is_resident(&self) -> bool {
        matches!(self, Self::Taped(tape) if tape.is_resident())
    }

    #[inline]
    fn block<'a>(
        &'a self,
        start: u64,
        count: usize,
        room: &'a mut Vec<Triangle>,
    ) -> Result<&'a [Triangle], StoreError> {
        let spool = match self {
            Self::Taped(tape) => return tape.block(start, count, room),
            Self::Spooled(spool) => spool,
        };
        let mut triangles = SoupBlock::default();
        spool.read(start, count, &mut triangles)?;
        room.clear();
        room.extend((start as u32..).zip(triangles.iter()).map(|(n, t)| Triangle::of_soup(n, t)));
        Ok(room)
    }
}

/// Shows all triangles of a soup in order.
pub(crate) fn each_of_soup(
    spool: &SoupSpool,
    mut visit: impl FnMut(&Triangle) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let (mut reader, mut number) = (spool.reader(0, spool.len()), 0);
    while let Some(block) = reader.next_block()? {
        for triangle in block {
            visit(&Triangle::of_soup(number, triangle))?;
            number += 1;
        }
    }
    Ok(())
}
