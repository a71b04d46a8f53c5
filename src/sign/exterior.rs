//! What the outside reaches of the region graph, and by which way.
//!
//! In:      the unions of regions: past no hit, past even hits, past panes.
//! Out:     answers about single regions.
//! Memory:  what the unions hold.

use crate::sign::flooded::{UNTOLD, WOUND};
use crate::sign::winding::{VoteStats, Votes, Windings};
use crate::store::{Labels, Resources, Sorter, StoreError};

/// Whether a region is reached from outside.
pub struct Exterior {
    pub strict: Labels,
    pub strict_outside: u32,
    pub loose: Labels,
    pub loose_outside: u32,
    /// Reached past panes too, where there are any.
    pub past_panes: Option<PastPanes>,
    pub windings: Option<Windings>,
}

/// What is reached past panes.
pub struct PastPanes {
    pub labels: Labels,
    pub outside: u32,
    /// Winding numbers by panes alone.
    pub windings: Windings,
}

impl Exterior {
    /// What the votes came to.
    pub fn vote_stats(&self) -> VoteStats {
        self.windings.as_ref().map_or_else(VoteStats::default, |windings| windings.stats)
    }

    /// What the winding number of a region says in its record.
    pub fn winding_bits(&mut self, region: u32, is_outside: bool) -> Result<u8, StoreError> {
        let Some(windings) = &mut self.windings else { return Ok(0) };
        if is_outside {
            return Ok(0);
        }
        if windings.stats.fell_back {
            return Ok(WOUND);
        }
        Ok(match windings.of(self.strict.label(region)?)? {
            Some(0) => 0,
            Some(_) => WOUND,
            None => UNTOLD,
        })
    }

    /// How many sets of the first `regions` regions the outside does not reach.
    pub fn closed_volumes(&mut self, regions: u64) -> Result<u64, StoreError> {
        let mut volumes = 0;
        // A set is told of by its smallest member, and empty space comes after all regions.
        for region in 0..regions as u32 {
            let label = self.strict.label(region)?;
            volumes += u64::from(label == region && label != self.strict_outside);
        }
        Ok(volumes)
    }

    /// Reached past no hit at all.
    pub fn reaches(&mut self, region: u32) -> Result<bool, StoreError> {
        Ok(self.strict.label(region)? == self.strict_outside)
    }

    /// Past edges that only panes hit, `None` where it is not reached so, else whether the winding
    /// number of panes is zero, or unknown.
    pub fn reaches_past_panes(&mut self, region: u32) -> Result<Option<bool>, StoreError> {
        let Some(past) = &mut self.past_panes else { return Ok(None) };
        if past.labels.label(region)? != past.outside {
            return Ok(None);
        }
        let number = past.windings.of(self.strict.label(region)?)?;
        Ok(Some(number.unwrap_or(0) == 0))
    }

    /// Reached past edges with an even number of hits.
    pub fn reaches_past_even(&mut self, region: u32) -> Result<bool, StoreError> {
        Ok(self.loose.label(region)? == self.loose_outside)
    }
}

/// The votes between what regions of all bricks were united to.
pub fn relabelled(
    votes: Sorter<Votes>,
    labels: &mut Labels,
    resources: &Resources,
) -> Result<Sorter<Votes>, StoreError> {
    let mut between = Sorter::new(resources.scratch, resources.share_bytes / 8);
    let mut sorted = votes.finish()?;
    while let Some(Votes { a, b, delta, count }) = sorted.next()? {
        let (a, b) = (labels.label(a)?, labels.label(b)?);
        between.push(Votes { a, b, delta, count }.ordered())?;
    }
    Ok(between)
}
