//! Rims: the edges that an odd number of a sheet's triangles meets.
//!
//! In:         borders by edge, and the bins.
//! Out:        a spool of [`RimEdge`]s by brick and source number.
//! Invariant:  of a sheet, an even number of rim edges meets at every point.
//! Units:      model units.
//! Memory:     the share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::bridge::sheets::{Sheets, Side};
use crate::bridge::{Like, PASSING};
use crate::octree::points::{owner, unpack_ends};
use crate::octree::{
    BinnedSoup, BorderUse, CLOSES, Domain, MOST_USES, SoupTriangle, TRANSPARENT, each_border,
};
use crate::store::{Record, Resources, Sorter, Spool, SpoolWriter, StoreError};

/// An edge of a rim. 96 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct RimEdge {
    /// Its ends as the sheet's first triangle would run along it, and the third corner.
    pub corners: [[f64; 3]; 3],
    /// The triangle.
    pub source: u32,
    /// Number of the sheet.
    pub sheet: u32,
    /// Of the triangle.
    pub part: u32,
    /// Of the triangle.
    pub material: u32,
    /// [`HELD`], [`TURNED`], [`NEW`].
    pub flags: u32,
    /// Zero.
    pub unused: u32,
}

/// Other sheets go on across the edge.
pub const HELD: u32 = 1;
/// The edge is one of a strip, whose triangles tell nothing about the surface.
pub const NEW: u32 = 4;
/// The triangle is turned over against the first one of its sheet.
pub const TURNED: u32 = 2;

impl RimEdge {
    /// The ends.
    pub fn ends(&self) -> [DVec3; 2] {
        [DVec3::from(self.corners[0]), DVec3::from(self.corners[1])]
    }

    /// The third corner of its triangle.
    pub fn opposite(&self) -> DVec3 {
        DVec3::from(self.corners[2])
    }

    /// What a triangle that closes the rim has from the one along it.
    pub fn like(&self) -> Like {
        let (material, of) = (self.material | CLOSES, self.source);
        Like { part: self.part, material, of, from: of }
    }

    /// Whether light passes its triangle.
    pub fn is_pane(&self) -> bool {
        self.material & TRANSPARENT != 0
    }

    pub fn length(&self) -> f64 {
        let [a, b] = self.ends();
        a.distance(b)
    }

    /// The direction out of the sheet, in the plane of the triangle; zero if that has no area.
    pub fn out(&self) -> DVec3 {
        let [a, b] = self.ends();
        let along = b - a;
        let inward = self.opposite() - a;
        let square = along.length_squared();
        if square == 0.0 {
            return DVec3::ZERO;
        }
        (along * (inward.dot(along) / square) - inward).normalize_or_zero()
    }
}

/// A rim edge before its triangle is at hand.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Pick {
    brick: u64,
    source: u32,
    corner: u32,
    sheet: u32,
    flags: u32,
}

impl Record for Pick {
    type Key = (u64, u32, u32);
    fn key(&self) -> Self::Key {
        (self.brick, self.source, self.corner)
    }
}

/// Finds the rims of all sheets, and numbers the sheets that have one.
pub fn find_rims(
    soup: &BinnedSoup,
    borders: &Spool<BorderUse>,
    sheets: &mut Sheets,
    domain: &Domain,
    resources: &Resources,
) -> Result<Spool<RimEdge>, StoreError> {
    let mut picks = Sorter::<Pick>::new(resources.scratch, resources.share_bytes / 4);
    each_border(borders, |uses| pick(uses, sheets, domain, &mut picks))?;
    let mut sorted = picks.finish()?;
    let mut next = sorted.next()?;
    let mut rims = SpoolWriter::create(resources.scratch, PASSING[1])?;
    let mut walk = soup.walk();
    while let (Some(first), Some(bin)) = (next, walk.next_bin()?) {
        if first.brick != bin.brick.0 {
            continue;
        }
        bin.each(soup, |triangle| {
            while let Some(pick) = next
                && (pick.brick, pick.source) == (bin.brick.0, triangle.source)
            {
                rims.push(rim_edge(triangle, &pick))?;
                next = sorted.next()?;
            }
            Ok(())
        })?;
    }
    rims.finish()
}

fn pick(
    uses: &[BorderUse],
    sheets: &mut Sheets,
    domain: &Domain,
    picks: &mut Sorter<Pick>,
) -> Result<(), StoreError> {
    if uses.len() == MOST_USES {
        return Ok(());
    }
    let mut sides: Vec<(Side, BorderUse)> = Vec::with_capacity(uses.len());
    for border in uses {
        sides.push((sheets.side_of(border.source)?, *border));
    }
    sides.sort_by_key(|(side, border)| (side.first, border.source));
    let groups = || sides.chunk_by(|a, b| a.0.first == b.0.first);
    let odd = groups().filter(|group| group.len() % 2 == 1).count();
    for group in groups() {
        if group.len() % 2 == 0 {
            continue;
        }
        let (side, border) = group[0];
        // Rims that share the edge face each other, as those of a box do whose edges lie on another.
        let is_held = odd == 1 && groups().any(|g| g[0].0.first != side.first && g.len() > 1);
        let brick = owner(domain, unpack_ends(border.ends)[0]);
        let flags = if is_held { HELD } else { 0 } | if side.is_turned { TURNED } else { 0 };
        let sheet = sheets.enter(side.first)?;
        let (source, corner) = (border.source, border.begins_at() as u32);
        picks.push(Pick { brick, source, corner, sheet, flags })?;
    }
    Ok(())
}

fn rim_edge(triangle: &SoupTriangle, pick: &Pick) -> RimEdge {
    let corner = |i: u32| triangle.corners[((pick.corner + i) % 3) as usize];
    let (a, b) = (corner(0), corner(1));
    let (a, b) = if pick.flags & TURNED == 0 { (a, b) } else { (b, a) };
    RimEdge {
        corners: [a, b, corner(2)],
        source: triangle.source,
        sheet: pick.sheet,
        part: triangle.part,
        material: triangle.material,
        flags: pick.flags,
        unused: 0,
    }
}
