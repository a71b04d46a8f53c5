//! What the flood found, as relabelling reads it: brick by brick, region by region.
//!
//! In:      the bricks of the region graph, their parities, and what the outside reaches.
//! Out:     spools that a later run can go on from.
//! Memory:  a block of each.

use bytemuck::{Pod, Zeroable};

use crate::octree::BrickKey;
use crate::sign::SignError;
use crate::sign::exterior::Exterior;
use crate::sign::graph::GraphBrick;
use crate::store::{FileState, Resources, Spool, SpoolPeek, SpoolWriter, StoreError};

/// Spool of the bricks.
pub const FLOODED: &str = "flooded.spool";
/// Spool of what is known of each region, brick after brick.
pub const REGIONS: &str = "regions.spool";

/// A brick of the flood. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct FloodedBrick {
    /// Its key.
    pub key: u64,
    /// How many regions it has.
    pub regions: u32,
    /// 1 when its min corner is inside by parity, else 0.
    pub base_inside: u16,
    /// 1 when no hit of it can be lost, if the outside reaches one of its regions and not the other; else 0.
    pub is_parted: u16,
}

/// In a record of a region: the outside reaches it.
pub const OUTSIDE: u8 = 1;
/// In a record of a region: only walls closer than a cell keep the outside away.
pub const SEALED_BY_RESOLUTION: u8 = 2;

/// In a record of a region: the winding number is not zero.
pub const WOUND: u8 = 4;
/// In a record of a region: no votes tell its winding number.
pub const UNTOLD: u8 = 8;

/// In a record of a region: the outside reaches it past panes, and it is inside of one.
pub const PANE: u8 = 16;

/// What the outside reaches.
pub struct Flooded {
    bricks: Spool<FloodedBrick>,
    regions: Spool<u8>,
}

impl Flooded {
    /// Writes down what the flood found. Past panes the outside reaches what is outside by parity;
    /// what is inside there is the pane itself.
    pub(crate) fn write(
        bricks: &[GraphBrick],
        parities: &[bool],
        odd_regions: Option<&Spool<u8>>,
        mut exterior: Exterior,
        resources: &Resources,
    ) -> Result<Self, SignError> {
        let mut records = SpoolWriter::create(resources.scratch, FLOODED)?;
        let mut regions = SpoolWriter::create(resources.scratch, REGIONS)?;
        let mut odd = odd_regions.map(SpoolPeek::new);
        for (brick, &inside) in bricks.iter().zip(parities) {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            let (count, base_inside) = (u32::from(brick.regions), u16::from(inside));
            let is_parted = u16::from(brick.is_parted);
            records.push(FloodedBrick {
                key: brick.key,
                regions: count,
                base_inside,
                is_parted,
            })?;
            for region in brick.first_region..brick.first_region + count {
                let is_odd = match &mut odd {
                    Some(odd) => odd.next()? == Some(1),
                    None => false,
                };
                let past_panes = exterior.reaches_past_panes(region)?;
                let is_behind = past_panes == Some(true) && is_odd == inside;
                let outside = exterior.reaches(region)? || is_behind;
                let pane = if past_panes.is_some() && !outside { PANE } else { 0 };
                let sealed = !outside && exterior.reaches_past_even(region)?;
                let bits = if outside { OUTSIDE } else { 0 };
                let bits = bits | if sealed { SEALED_BY_RESOLUTION } else { 0 };
                regions.push(pane | bits | exterior.winding_bits(region, outside)?)?;
            }
        }
        Ok(Self { bricks: records.finish()?, regions: regions.finish()? })
    }

    /// Opens what an earlier run wrote.
    ///
    /// # Errors
    /// A file is missing or damaged.
    pub fn open(resources: &Resources, files: &[FileState]) -> Result<Self, StoreError> {
        Ok(Self {
            bricks: Spool::open(resources.scratch, FileState::find(files, FLOODED)?)?,
            regions: Spool::open(resources.scratch, FileState::find(files, REGIONS)?)?,
        })
    }

    /// The files, as they have to be found again.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        vec![self.bricks.state().clone(), self.regions.state().clone()]
    }

    /// The number of regions.
    #[must_use]
    pub fn region_count(&self) -> u64 {
        self.regions.len()
    }

    /// Reads it brick by brick.
    pub(crate) fn by_brick(&self) -> FloodReader<'_> {
        FloodReader { bricks: SpoolPeek::new(&self.bricks), regions: &self.regions, next: 0 }
    }
}

/// Bricks in order, with what is known of their regions.
pub(crate) struct FloodReader<'f> {
    bricks: SpoolPeek<'f, FloodedBrick>,
    regions: &'f Spool<u8>,
    next: u64,
}

impl FloodReader<'_> {
    /// The next brick.
    pub fn next(&mut self) -> Result<Option<FloodedBrick>, StoreError> {
        let brick = self.bricks.next()?;
        self.next += brick.map_or(0, |brick| u64::from(brick.regions));
        Ok(brick)
    }

    /// The next brick, which is the one with this key, and what is known of its regions.
    pub fn next_at(&mut self, key: BrickKey) -> Result<(FloodedBrick, Vec<u8>), SignError> {
        let brick = self.next()?.filter(|brick| brick.key == key.0);
        let (position, expected) = (key.position(), "the bricks of the flood");
        let brick = brick.ok_or(SignError::Contradiction { brick: position, expected })?;
        let regions = self.regions_of(&brick)?;
        Ok((brick, regions))
    }

    /// What is known of the regions of the brick that came last.
    fn regions_of(&self, brick: &FloodedBrick) -> Result<Vec<u8>, StoreError> {
        let mut regions = Vec::new();
        let first = self.next - u64::from(brick.regions);
        self.regions.read(first, brick.regions as usize, &mut regions)?;
        Ok(regions)
    }
}
