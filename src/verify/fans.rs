//! Brings the wedges of every vertex together: the proof of closed, manifold and oriented.
//!
//! In:         the whole triangles of the tape.
//! Out:        a [`Judgement`] of all vertices.
//! Invariant:  the result depends on the triangles alone, not on the share.
//! Memory:     `share_bytes`. Vertices are cut into ranges whose wedges fit; one range is the
//!             common case and needs no disk. A range that turns out too full, or that has a vertex
//!             with too many wedges, is sorted externally; such a vertex is united externally.
//! Fails:      only as [`StoreError`].

use bytemuck::{Pod, Zeroable};

use crate::defect::Marks;
use crate::monitor::Monitor;
use crate::store::{Record, Scratch, ScratchFile, Sequence, StoreError};
use crate::verify::crowd::judge_by_sorting;
use crate::verify::link::{Judgement, Wedge};
use crate::verify::tape::Tape;

/// A wedge and its vertex.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Corner {
    pub(crate) vertex: u32,
    pub(crate) wedge: Wedge,
}

impl Record for Corner {
    type Key = (u32, Wedge);
    fn key(&self) -> Self::Key {
        (self.vertex, self.wedge)
    }
}

/// Shows the three corners of a triangle.
#[inline]
fn corners_of([a, b, c]: [u32; 3]) -> [Corner; 3] {
    [(a, [b, c]), (b, [c, a]), (c, [a, b])].map(|(vertex, wedge)| Corner { vertex, wedge })
}

/// Judges all vertices, whose numbers are below `space`; marks those with several fans.
pub(crate) fn judge_fans<'m>(
    tape: &Tape,
    space: u64,
    marks: Option<&'m Marks>,
    (scratch, share_bytes): (&Scratch, u64),
    monitor: &dyn Monitor,
) -> Result<Judgement<'m>, StoreError> {
    let mut judgement = Judgement::new(Sequence::new(scratch, share_bytes / 16), marks);
    let needed = range_bytes(tape.len() * 3, space);
    if needed <= share_bytes {
        let visit = |see: &mut dyn FnMut(Corner)| {
            tape.each_whole(monitor, |ids| {
                corners_of(ids).into_iter().for_each(&mut *see);
                Ok(())
            })
        };
        let most = most_wedges(share_bytes);
        if !judge_range(&mut judgement, 0, space, most, &visit)? {
            judge_by_sorting(&mut judgement, space, scratch, share_bytes, &visit)?;
        }
        return Ok(judgement);
    }
    let ranges = Ranges::fill(tape, space, scratch, share_bytes / 4, needed, monitor)?;
    let room_bytes = share_bytes / 2;
    for range in 0..ranges.lists.len() {
        let from = range as u64 * ranges.width;
        let width = ranges.width.min(space - from);
        let visit = |see: &mut dyn FnMut(Corner)| ranges.each(range, monitor, see);
        let fits = range_bytes(ranges.lists[range].corners, width) <= room_bytes;
        let most = most_wedges(room_bytes);
        if !fits || !judge_range(&mut judgement, from, width, most, &visit)? {
            judge_by_sorting(&mut judgement, space, scratch, room_bytes, &visit)?;
        }
    }
    Ok(judgement)
}

/// Memory that a range takes: its wedges, and where they start (counted in 32 bits).
fn range_bytes(corners: u64, vertices: u64) -> u64 {
    if corners > u64::from(u32::MAX) {
        return u64::MAX;
    }
    corners * size_of::<Wedge>() as u64 + (vertices + 1) * 4
}

/// A way to see all corners of a range, as often as needed.
pub(crate) type Visit<'v> = dyn Fn(&mut dyn FnMut(Corner)) -> Result<(), StoreError> + 'v;

/// Wedges of one vertex that are classified in memory, which takes some sixty bytes each.
pub(crate) fn most_wedges(share_bytes: u64) -> usize {
    (share_bytes / 4 / 60).max(64) as usize
}

/// Counting sort of a range's wedges by vertex, then a judgement each; `false`, and nothing done,
/// when a vertex has more than `most` of them.
fn judge_range(
    judgement: &mut Judgement,
    from: u64,
    width: u64,
    most: usize,
    visit: &Visit<'_>,
) -> Result<bool, StoreError> {
    let place = |corner: &Corner| (u64::from(corner.vertex) - from) as usize;
    let mut ends = vec![0_u32; width as usize];
    visit(&mut |corner| ends[place(&corner)] += 1)?;
    if ends.iter().any(|&count| count as usize > most) {
        return Ok(false);
    }
    let mut total = 0_u32;
    for end in &mut ends {
        // Now the start of each vertex; filling moves it to its end.
        total += std::mem::replace(end, total);
    }
    let mut wedges = vec![[0; 2]; total as usize];
    visit(&mut |corner| {
        let end = &mut ends[place(&corner)];
        wedges[*end as usize] = corner.wedge;
        *end += 1;
    })?;
    let mut start = 0;
    for (vertex, &end) in (from..).zip(&ends) {
        judgement.judge(vertex as u32, &mut wedges[start..end as usize])?;
        start = end as usize;
    }
    Ok(true)
}

/// Corners in one file, in blocks of one range each. The blocks of a range are a chain: each begins
/// with where the one before it lies. So memory does not grow with their number.
struct Ranges {
    file: ScratchFile,
    width: u64,
    block_corners: usize,
    lists: Vec<BlockList>,
}

struct BlockList {
    open: Vec<Corner>,
    /// Where the last block lies, or [`NO_BLOCK`].
    last: u64,
    corners: u64,
}

const NO_BLOCK: u64 = u64::MAX;
/// Bytes before the corners of a block.
const LINK_BYTES: u64 = size_of::<u64>() as u64;

impl Ranges {
    /// Writes all corners of the tape; `needed` is the memory that one range would take.
    fn fill(
        tape: &Tape,
        space: u64,
        scratch: &Scratch,
        share_bytes: u64,
        needed: u64,
        monitor: &dyn Monitor,
    ) -> Result<Self, StoreError> {
        let corner_bytes = size_of::<Corner>() as u64;
        // Half of what a range may take, since vertices differ.
        let wanted = needed.div_ceil(share_bytes).max(2);
        let count = wanted.min((share_bytes / 512).max(1)).min(space.max(1));
        let block_corners = (share_bytes / count / corner_bytes).clamp(16, 4096) as usize;
        let width = space.div_ceil(count).max(1);
        let empty = || BlockList { open: Vec::new(), last: NO_BLOCK, corners: 0 };
        let lists = (0..space.div_ceil(width)).map(|_| empty()).collect();
        let file = scratch.anonymous("fans")?;
        let mut ranges = Self { file, width, block_corners, lists };
        let mut end = 0;
        tape.each_whole(monitor, |ids| {
            corners_of(ids).into_iter().try_for_each(|corner| ranges.push(corner, &mut end))
        })?;
        Ok(ranges)
    }

    fn push(&mut self, corner: Corner, end: &mut u64) -> Result<(), StoreError> {
        let list = &mut self.lists[(u64::from(corner.vertex) / self.width) as usize];
        if list.open.len() == self.block_corners {
            let bytes: &[u8] = bytemuck::cast_slice(&list.open);
            self.file.write_at(&list.last.to_le_bytes(), *end)?;
            self.file.write_at(bytes, *end + LINK_BYTES)?;
            list.last = *end;
            *end += LINK_BYTES + bytes.len() as u64;
            list.open.clear();
        }
        if list.open.capacity() == 0 {
            list.open.reserve_exact(self.block_corners);
        }
        list.open.push(corner);
        list.corners += 1;
        Ok(())
    }

    /// Shows all corners of a range, in no order that means anything.
    fn each(
        &self,
        range: usize,
        monitor: &dyn Monitor,
        see: &mut dyn FnMut(Corner),
    ) -> Result<(), StoreError> {
        let list = &self.lists[range];
        let mut block = vec![Corner::zeroed(); self.block_corners];
        let mut at = list.last;
        while at != NO_BLOCK {
            if monitor.cancelled() {
                return Err(StoreError::Cancelled);
            }
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut block);
            self.file.read_at(bytes, at + LINK_BYTES)?;
            let mut link = [0; LINK_BYTES as usize];
            self.file.read_at(&mut link, at)?;
            block.iter().copied().for_each(&mut *see);
            at = u64::from_le_bytes(link);
        }
        list.open.iter().copied().for_each(see);
        Ok(())
    }
}
