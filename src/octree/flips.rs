//! Flipped edges: sorted by brick, equal ones cancelled in pairs.

use bytemuck::{Pod, Zeroable};

use crate::octree::edge_bits::{SIDE, edge_index, edge_position};
use crate::octree::key::BrickKey;
use crate::store::{
    FileState, Record, Resources, Sorted, Sorter, Spool, SpoolPeek, SpoolWriter, StoreError,
};

/// Spool of the flips.
pub const FLIPS: &str = "flips.spool";

/// A flipped edge of a brick. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct FlipRecord {
    /// Key of the brick.
    pub brick: u64,
    /// Edge number in the brick.
    pub edge: u32,
    /// Where the patch crosses the edge, in 1/65536.
    pub offset: u16,
    /// Zero.
    pub unused: u16,
}

impl Record for FlipRecord {
    type Key = (u64, u32, u16);
    fn key(&self) -> Self::Key {
        (self.brick, self.edge, self.offset)
    }
}

/// A flipped edge of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flip {
    /// The edge's direction.
    pub axis: usize,
    /// Its lower corner, in cells of the grid.
    pub at: [u32; 3],
    /// Where the patch crosses it, in 1/65536.
    pub offset: u16,
}

impl Flip {
    /// The edge in each of the one, two or four bricks that hold it.
    pub fn in_bricks(self) -> impl Iterator<Item = FlipRecord> {
        let side = SIDE as u32;
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        (0..4_u32).filter_map(move |combination| {
            let mut position = self.at.map(|c| c / side);
            let mut local = self.at.map(|c| (c % side) as usize);
            for (bit, across) in [(1, u), (2, v)] {
                if combination & bit != 0 {
                    if local[across] != 0 || position[across] == 0 {
                        return None;
                    }
                    position[across] -= 1;
                    local[across] = SIDE;
                }
            }
            let brick = BrickKey::new(position).0;
            let edge = edge_index(self.axis, local);
            Some(FlipRecord { brick, edge, offset: self.offset, unused: 0 })
        })
    }
}

/// The flips of all bricks.
pub struct Flips {
    spool: Spool<FlipRecord>,
}

impl Flips {
    /// Sorts and writes; the number of flips as the bricks hold them.
    pub fn write(
        flips: Sorter<FlipRecord>,
        resources: &Resources,
    ) -> Result<(Self, u64), StoreError> {
        let mut writer = SpoolWriter::create(resources.scratch, FLIPS)?;
        let mut owned = 0;
        let mut sorted = flips.finish()?;
        let mut last = None;
        loop {
            let next = sorted_group(&mut sorted, &mut last)?;
            let Some((record, count)) = next else { break };
            if count % 2 == 1 {
                let (_, at) = edge_position(record.edge);
                owned += u64::from(at.iter().all(|&c| c < SIDE));
                writer.push(record)?;
            }
        }
        Ok((Self { spool: writer.finish()? }, owned))
    }

    /// Opens the flips that an earlier run left.
    ///
    /// # Errors
    /// They are missing or damaged.
    pub fn open(resources: &Resources, files: &[FileState]) -> Result<Self, StoreError> {
        Ok(Self { spool: Spool::open(resources.scratch, FileState::find(files, FLIPS)?)? })
    }

    /// The file, as it has to be found again.
    #[must_use]
    pub fn state(&self) -> &FileState {
        self.spool.state()
    }

    /// Reads the flips brick by brick.
    #[must_use]
    pub fn by_brick(&self) -> FlipReader<'_> {
        FlipReader { flips: SpoolPeek::new(&self.spool) }
    }

    /// Whether nothing was flipped.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spool.is_empty()
    }
}

/// The next edge and how often it was flipped; `last` carries the look-ahead.
fn sorted_group(
    sorted: &mut Sorted<FlipRecord>,
    last: &mut Option<FlipRecord>,
) -> Result<Option<(FlipRecord, u64)>, StoreError> {
    let first = match last.take() {
        Some(first) => first,
        None => match sorted.next()? {
            Some(first) => first,
            None => return Ok(None),
        },
    };
    let mut count = 1;
    while let Some(next) = sorted.next()? {
        if (next.brick, next.edge) != (first.brick, first.edge) {
            *last = Some(next);
            break;
        }
        count += 1;
    }
    Ok(Some((first, count)))
}

/// Flips by ascending brick.
pub struct FlipReader<'f> {
    flips: SpoolPeek<'f, FlipRecord>,
}

impl FlipReader<'_> {
    /// The brick of the next flip.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn peek_brick(&mut self) -> Result<Option<u64>, StoreError> {
        Ok(self.flips.peek()?.map(|flip| flip.brick))
    }

    /// Takes all flips of `brick`, which is not after the next brick.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn take(&mut self, brick: u64) -> Result<Vec<FlipRecord>, StoreError> {
        self.flips.take_while(|flip| flip.brick == brick, |flip| flip)
    }
}
