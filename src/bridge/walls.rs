//! Walls: a closed slab of triangles in place of each triangle of an open sheet.
//!
//! In:         bins, borders, and the fates of sheets.
//! Out:        the slabs in the bins that are added; the triangles of the sheets among the drops.
//! Invariant:  the walls of a sheet with two sides are closed mod 2: neighbours share their
//!             mitred corners, and at borders the wall has an end.
//! Memory:     the share.
//! Source:     ours.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::bridge::miters::{Miter, MiterUse, find_miters};
use crate::bridge::sheets::Sheets;
use crate::bridge::shells::{Fate, Shells};
use crate::bridge::{Added, Like, MendOptions};
use crate::octree::points::{is_owned, pack_point, snapped};
use crate::octree::{BinnedSoup, BorderUse, DropRecord, SnapBox, SoupTriangle};
use crate::store::{Record, Resources, Sorted, Sorter, Spool, StoreError};

/// A triangle that becomes a wall. 96 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct WallTriangle {
    triangle: SoupTriangle,
    /// A triangle of its shell.
    member: u32,
    /// The fate of its sheet, [`IS_TURNED`], [`IS_ONE_SIDED`].
    flags: u32,
}

const FATE: u32 = 3;
const IS_TURNED: u32 = 4;
const IS_ONE_SIDED: u32 = 8;

impl Record for WallTriangle {
    type Key = u32;
    fn key(&self) -> u32 {
        self.triangle.source
    }
}

/// An edge of a triangle at which its wall ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct WallEnd {
    source: u32,
    corner: u32,
}

impl Record for WallEnd {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.source, self.corner)
    }
}

/// Makes walls of all sheets that are to become some.
pub fn raise_walls(
    soup: &BinnedSoup,
    borders: &Spool<BorderUse>,
    sheets: &mut Sheets,
    shells: &mut Shells,
    options: &MendOptions,
    (added, drops): (&mut Added, &mut Sorter<DropRecord>),
    resources: &Resources,
) -> Result<(), StoreError> {
    let share_bytes = resources.share_bytes / 8;
    let mut triangles = Sorter::<WallTriangle>::new(resources.scratch, share_bytes);
    let mut uses = Sorter::<MiterUse>::new(resources.scratch, share_bytes);
    let domain = shells.domain;
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        bin.each(soup, |triangle| {
            let Some((sheet, side)) = sheets.find(triangle.source)? else { return Ok(()) };
            let fate = shells.fate(sheet)?;
            if fate == Fate::Stays {
                return Ok(());
            }
            drops.push(DropRecord { brick: bin.brick.0, source: triangle.source, unused: 0 })?;
            let corners = snapped(domain, triangle);
            let has_width = (0..3).all(|i| corners[i] != corners[(i + 1) % 3]);
            if !has_width || !is_owned(triangle, domain, bin.brick.0) {
                return Ok(());
            }
            let flags = if side.is_turned { IS_TURNED } else { 0 }
                | if side.is_one_sided { IS_ONE_SIDED } else { 0 };
            let (member, flags) = (shells.member(sheet)?, fate as u32 | flags);
            triangles.push(WallTriangle { triangle: *triangle, member, flags })?;
            let normal = normal_of(triangle, side.is_turned).to_array();
            for (corner, point) in corners.into_iter().enumerate() {
                let packed = pack_point(point);
                let vertex = [(packed >> 64) as u64, packed as u64];
                let (source, corner) = (triangle.source, corner as u32);
                // Where there is but one side, every triangle is a wall of its own.
                let sheet = if side.is_one_sided { source } else { sheet };
                let is_alone = u32::from(side.is_one_sided);
                uses.push(MiterUse { vertex, normal, sheet, source, corner, is_alone })?;
            }
            Ok(())
        })?;
    }
    let mut builder = Builder {
        miters: find_miters(uses, resources)?,
        ends: wall_ends(borders, sheets, shells, resources)?,
        next_end: None,
        thickness: options.thickness,
        room: options.bounds.grown(0.5 * options.thickness),
    };
    builder.next_end = builder.ends.next()?;
    let mut sorted = triangles.finish()?;
    while let Some(wall) = sorted.next()? {
        builder.raise(&wall, added)?;
    }
    Ok(())
}

/// The unit normal on the side of the sheet's first triangle.
fn normal_of(triangle: &SoupTriangle, is_turned: bool) -> DVec3 {
    let [p, q, r] = triangle.corners.map(DVec3::from);
    let normal = (q - p).cross(r - p).normalize_or_zero();
    if is_turned { -normal } else { normal }
}

fn wall_ends(
    borders: &Spool<BorderUse>,
    sheets: &mut Sheets,
    shells: &mut Shells,
    resources: &Resources,
) -> Result<Sorted<WallEnd>, StoreError> {
    let mut ends = Sorter::new(resources.scratch, resources.share_bytes / 8);
    let mut reader = borders.reader(0, borders.len());
    while let Some(block) = reader.next_block()? {
        for border in block {
            if let Some((sheet, _)) = sheets.find(border.source)?
                && shells.fate(sheet)? != Fate::Stays
            {
                let (source, corner) = (border.source, border.begins_at() as u32);
                ends.push(WallEnd { source, corner })?;
            }
        }
    }
    ends.finish()
}

/// Builds walls by ascending source number.
struct Builder {
    miters: Sorted<Miter>,
    ends: Sorted<WallEnd>,
    next_end: Option<WallEnd>,
    thickness: f64,
    /// Walls stay in it.
    room: SnapBox,
}

impl Builder {
    fn raise(&mut self, wall: &WallTriangle, added: &mut Added) -> Result<(), StoreError> {
        let triangle = &wall.triangle;
        let mut miters = [DVec3::ZERO; 3];
        for miter in &mut miters {
            let next = self.miters.next()?;
            let next = next.expect("every corner of a wall has a miter");
            debug_assert_eq!(next.source, triangle.source);
            *miter = DVec3::from(next.by);
        }
        let is_one_sided = wall.flags & IS_ONE_SIDED != 0;
        let mut has_end = [is_one_sided; 3];
        while let Some(end) = self.next_end
            && end.source <= triangle.source
        {
            if end.source == triangle.source {
                has_end[end.corner as usize] = true;
            }
            self.next_end = self.ends.next()?;
        }
        let (low, high) = match wall.flags & FATE {
            _ if is_one_sided => (-0.5, 0.5),
            fate if fate == Fate::Behind as u32 => (-1.0, 0.0),
            fate if fate == Fate::Before as u32 => (0.0, 1.0),
            _ => (-0.5, 0.5),
        };
        let is_turned = wall.flags & IS_TURNED != 0;
        let by = [low, high].map(|by| by * self.thickness);
        let slab = Slab::new(triangle, miters, by, &self.room);
        let SoupTriangle { part, material, source, .. } = *triangle;
        let like = Like { part, material, of: wall.member, from: source };
        slab.push(has_end, is_turned, added, like)
    }
}

/// The two faces of a wall.
pub struct Slab {
    low: [DVec3; 3],
    high: [DVec3; 3],
}

impl Slab {
    /// The faces of a triangle's wall, so far from it along its miters; they stay in `room`.
    pub fn new(
        triangle: &SoupTriangle,
        miters: [DVec3; 3],
        [low, high]: [f64; 2],
        room: &SnapBox,
    ) -> Self {
        let corners = triangle.corners.map(DVec3::from);
        let (lo, hi) = (DVec3::from(room.lo), DVec3::from(room.hi));
        let at = |by: f64| std::array::from_fn(|i| (corners[i] + miters[i] * by).clamp(lo, hi));
        Self { low: at(low), high: at(high) }
    }

    /// Pushes both faces, and the ends at the edges that have one. The high face looks up the
    /// sheet's side.
    pub fn push(
        &self,
        has_end: [bool; 3],
        is_turned: bool,
        added: &mut Added,
        like: Like,
    ) -> Result<(), StoreError> {
        let mut put = |corners: [DVec3; 3]| {
            let [p, q, r] = corners.map(|c| c.to_array());
            added.push(if is_turned { [p, r, q] } else { [p, q, r] }, like)
        };
        let ([a, b, c], [d, e, f]) = (self.high, self.low);
        put([a, b, c])?;
        put([d, f, e])?;
        for i in (0..3).filter(|&i| has_end[i]) {
            let j = (i + 1) % 3;
            put([self.low[i], self.low[j], self.high[j]])?;
            put([self.low[i], self.high[j], self.high[i]])?;
        }
        Ok(())
    }
}
