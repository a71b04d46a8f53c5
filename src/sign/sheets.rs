//! Open sheets that the patch runs along become plates of about a cell.
//!
//! A patch that closes a flat sheet lies in the sheet itself: the marks cancel, and the surface
//! would be gone without a word. The corners just behind it are made inside instead: its visible
//! side stays where it was, and the result is closed because signs are a function of corners. The
//! outside is then flooded again, so that nothing is left hollow between plates.
//!
//! In:      bricks in which a patch flipped an odd edge, and what the flood reaches.
//! Out:     corners to be made inside, for every brick that holds them.
//! Memory:  the share; the corners are sorted externally.

use bytemuck::{Pod, Zeroable};

use crate::octree::Flips;
use crate::octree::{BrickKey, LINES, ROWS, SIDE, edge_position, find_regions};
use crate::sign::SignError;
use crate::sign::graph::{Exterior, GraphBrick};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::store::{
    BrickFile, FileState, Record, Resources, Sorter, Spool, SpoolPeek, SpoolWriter, StoreError,
    ordered_by_weight,
};

/// Spool of the corners behind sheets.
pub const SHEETS: &str = "sheets.spool";

/// A corner of a brick that is inside because a sheet passes in front of it. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SheetCorner {
    /// Key of the brick.
    pub brick: u64,
    /// Number of the corner in the brick: x + 33y + 1089z.
    pub corner: u32,
    /// Zero.
    pub unused: u32,
}

impl Record for SheetCorner {
    type Key = (u64, u32);
    fn key(&self) -> Self::Key {
        (self.brick, self.corner)
    }
}

/// Corners behind sheets, by brick.
pub struct Sheets {
    spool: Spool<SheetCorner>,
}

struct SheetItem {
    load: LoadItem,
    exterior: Vec<bool>,
}

/// Finds the corners behind all sheets that nothing else makes inside.
pub fn find_sheets(
    hits: &BrickFile,
    flips: &Flips,
    bricks: &[GraphBrick],
    exterior: &mut Exterior,
    resources: &Resources,
) -> Result<Sheets, SignError> {
    let mut corners = Sorter::<SheetCorner>::new(resources.scratch, resources.share_bytes / 4);
    let mut items = LoadItems::new(hits, flips, None, resources);
    let mut number = 0;
    ordered_by_weight(
        resources.pool,
        resources.scales(|item: &SheetItem| item.load.weight_bytes(hits)),
        || {
            while let Some(load) = items.next()? {
                let brick = &bricks[number];
                number += 1;
                if brick.has_sheet {
                    let first = brick.first_region;
                    let exterior = (first..first + u32::from(brick.regions))
                        .map(|region| exterior.reaches(region))
                        .collect::<Result<_, StoreError>>()?;
                    return Ok(Some(SheetItem { load, exterior }));
                }
            }
            Ok::<_, SignError>(None)
        },
        Loaded::default,
        |loaded, item| {
            loaded.load(hits, &item.load)?;
            Ok(corners_behind(loaded, &item))
        },
        |found: Vec<SheetCorner>| Ok(corners.extend(&found)?),
    )?;
    let mut spool = SpoolWriter::create(resources.scratch, SHEETS)?;
    let mut sorted = corners.finish()?;
    let mut last = None;
    while let Some(corner) = sorted.next()? {
        if last != Some(corner) {
            spool.push(corner)?;
            last = Some(corner);
        }
    }
    Ok(Sheets { spool: spool.finish()? })
}

fn corners_behind(loaded: &Loaded, item: &SheetItem) -> Vec<SheetCorner> {
    let regions = find_regions(&loaded.barrier);
    let mut corners = Vec::new();
    for &(edge, faces_up) in &loaded.sheet_edges {
        let (axis, lower) = edge_position(edge);
        let mut upper = lower;
        upper[axis] += 1;
        let outside = |at| item.exterior[usize::from(regions.at(at))];
        if outside(lower) && outside(upper) {
            let behind = if faces_up { lower } else { upper };
            push_in_bricks(item.load.brick, behind, &mut corners);
        }
    }
    corners
}

/// The corner in each of the one to eight bricks that hold it.
fn push_in_bricks(brick: BrickKey, at: [usize; 3], corners: &mut Vec<SheetCorner>) {
    let position = brick.position();
    let choices = |a: usize| -> Vec<(u32, usize)> {
        let (here, c) = (position[a], at[a]);
        match c {
            0 if here > 0 => vec![(here, 0), (here - 1, SIDE)],
            SIDE => vec![(here, SIDE), (here + 1, 0)],
            _ => vec![(here, c)],
        }
    };
    for (z, lz) in choices(2) {
        for &(y, ly) in &choices(1) {
            for &(x, lx) in &choices(0) {
                let corner = (lz * ROWS + ly * LINES + lx) as u32;
                let brick = BrickKey::new([x, y, z]).0;
                corners.push(SheetCorner { brick, corner, unused: 0 });
            }
        }
    }
}

impl Sheets {
    /// Opens the corners that an earlier run found.
    pub fn open(resources: &Resources, files: &[FileState]) -> Result<Self, StoreError> {
        Ok(Self { spool: Spool::open(resources.scratch, FileState::find(files, SHEETS)?)? })
    }

    /// The file, as it has to be found again.
    pub fn state(&self) -> &FileState {
        self.spool.state()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.spool.is_empty()
    }

    /// Reads the corners brick by brick.
    pub fn by_brick(&self) -> SheetReader<'_> {
        SheetReader { corners: SpoolPeek::new(&self.spool) }
    }
}

/// Corners by ascending brick.
pub struct SheetReader<'s> {
    corners: SpoolPeek<'s, SheetCorner>,
}

impl SheetReader<'_> {
    /// The brick of the next corner.
    pub fn peek_brick(&mut self) -> Result<Option<u64>, StoreError> {
        Ok(self.corners.peek()?.map(|corner| corner.brick))
    }

    /// Takes all corners of `brick`, which is not after the next brick.
    pub fn take(&mut self, brick: u64) -> Result<Vec<u32>, StoreError> {
        self.corners.take_while(|corner| corner.brick == brick, |corner| corner.corner)
    }
}
