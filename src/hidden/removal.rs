//! Takes hidden bodies out of the soup, and tells of them.
//!
//! In:         the soup, its bodies, the verdicts on them.
//! Out:        [`Seen`]; sizes in [`HiddenStats`].
//! Invariant:  what is sealed goes with what is hidden: it may lie within.
//! Memory:     the share.

use std::cmp::Reverse;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::hidden::bodies::each_triangle;
use crate::hidden::{Bodies, HiddenBody, HiddenStats, Verdict, Verdicts};
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, DropRecord, SoupSpool, write_bins,
};
use crate::store::{Record, Resources, Sorter, Spool, SpoolWriter, StoreError};

/// Spools of what is left: drops, added triangles, and their bins; they live within a step.
pub const SEEN: [&str; 3] = ["seen.drops", "seen.spool", "seen.entries"];

/// Bodies that are told of one by one.
const MOST_TOLD: usize = 32;

/// What is left of a soup.
pub struct Seen {
    drops: Spool<DropRecord>,
    triangles: SoupSpool,
    entries: Spool<BinEntry>,
}

impl Seen {
    /// The soup in these bins, without hidden bodies.
    #[must_use]
    pub fn soup<'b>(&'b self, bins: BinSpools<'b>) -> BinnedSoup<'b> {
        let added = BinSpools { triangles: &self.triangles, entries: &self.entries };
        BinnedSoup { bins, drops: &self.drops, added: Some(added) }
    }
}

/// Measures what nobody sees, and leaves it out; `None` where nothing changes by that. Source
/// numbers below `given` are those of the input.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn leave_out(
    soup: &BinnedSoup,
    given: u64,
    (bodies, verdicts): (&mut Bodies, &mut Verdicts),
    domain: &Domain,
    stats: &mut HiddenStats,
    resources: &Resources,
) -> Result<Option<Seen>, StoreError> {
    if stats.hidden_bodies + stats.sealed_bodies == 0 {
        return Ok(None);
    }
    measure(soup, (bodies, verdicts), domain, stats, resources)?;
    if stats.hidden_bodies == 0 {
        return Ok(None);
    }
    let mut drops = Sorter::<DropRecord>::new(resources.scratch, resources.share_bytes / 4);
    let mut added = Sorter::<BinTriangle>::new(resources.scratch, resources.share_bytes / 4);
    let mut reader = soup.drops.reader(0, soup.drops.len());
    while let Some(block) = reader.next_block()? {
        drops.extend(block)?;
    }
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        let brick = bin.brick.0;
        bin.each(soup, |triangle| {
            let stays = verdicts.of(bodies.of(triangle.source)?)? == Verdict::Stays;
            match u64::from(triangle.source) < given {
                true if stays => Ok(()),
                true => drops.push(DropRecord { brick, source: triangle.source, unused: 0 }),
                false if stays => added.push(BinTriangle { brick, triangle: *triangle }),
                false => Ok(()),
            }
        })?;
    }
    let mut spool = SpoolWriter::create(resources.scratch, SEEN[0])?;
    let mut sorted = drops.finish()?;
    while let Some(record) = sorted.next()? {
        spool.push(record)?;
    }
    let (triangles, entries) = write_bins(added, [SEEN[1], SEEN[2]], resources)?;
    Ok(Some(Seen { drops: spool.finish()?, triangles, entries }))
}

/// What a triangle adds to the size of its body. 80 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Piece {
    lo: [f64; 3],
    hi: [f64; 3],
    area: f64,
    body: u32,
    source: u32,
    part: u32,
    is_sealed: u32,
}

impl Record for Piece {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.body, self.source)
    }
}

/// Measures all bodies that nobody sees.
fn measure(
    soup: &BinnedSoup,
    (bodies, verdicts): (&mut Bodies, &mut Verdicts),
    domain: &Domain,
    stats: &mut HiddenStats,
    resources: &Resources,
) -> Result<(), StoreError> {
    let mut pieces = Sorter::<Piece>::new(resources.scratch, resources.share_bytes / 4);
    each_triangle(soup, domain, resources, |triangle| {
        let body = bodies.of(triangle.source)?;
        let verdict = verdicts.of(body)?;
        if verdict == Verdict::Stays {
            return Ok(());
        }
        let [p, q, r] = triangle.corners.map(DVec3::from);
        pieces.push(Piece {
            lo: p.min(q).min(r).to_array(),
            hi: p.max(q).max(r).to_array(),
            area: 0.5 * (q - p).cross(r - p).length(),
            body,
            source: triangle.source,
            part: triangle.part,
            is_sealed: u32::from(verdict == Verdict::Sealed),
        })
    })?;
    let mut sorted = pieces.finish()?;
    let mut next = sorted.next()?;
    while let Some(first) = next {
        let mut whole = HiddenBody {
            part: String::new(),
            part_number: first.part,
            is_sealed: first.is_sealed == 1,
            triangles: 0,
            area: 0.0,
            lo: first.lo,
            hi: first.hi,
        };
        while let Some(piece) = next.filter(|piece| piece.body == first.body) {
            whole.triangles += 1;
            whole.area += piece.area;
            whole.lo = DVec3::from(whole.lo).min(DVec3::from(piece.lo)).to_array();
            whole.hi = DVec3::from(whole.hi).max(DVec3::from(piece.hi)).to_array();
            next = sorted.next()?;
        }
        stats.tell(whole);
    }
    Ok(())
}

impl HiddenStats {
    fn tell(&mut self, body: HiddenBody) {
        if body.is_sealed {
            self.sealed_triangles += body.triangles;
        } else {
            self.hidden_triangles += body.triangles;
            self.hidden_area += body.area;
        }
        self.largest.push(body);
        // Hidden ones first; the sort is stable, and bodies come in order.
        self.largest.sort_by(|a, b| {
            let rank = |body: &HiddenBody| (body.is_sealed, Reverse(body.area.to_bits()));
            rank(a).cmp(&rank(b))
        });
        self.largest.truncate(MOST_TOLD);
    }
}
