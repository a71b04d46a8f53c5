//! Which whole parts nobody sees.
//!
//! In:         the soup, its bodies, the verdicts on them.
//! Out:        of every part whether it stays: one with a body that does, or with none at all, since
//!             all its triangles are copies of others.
//! Memory:     a byte a part, in a table that spills.

use crate::hidden::bodies::each_triangle;
use crate::hidden::{Bodies, Verdict, Verdicts};
use crate::octree::{BinnedSoup, Domain};
use crate::store::{Resources, StoreError, Table};

/// By part whether somebody sees it.
pub struct PartsSeen {
    of_part: Table<u8>,
}

const IS_HIDDEN: u8 = 1;
const IS_SEEN: u8 = 2;

impl PartsSeen {
    /// Asks the bodies of all parts. Source numbers below `given` are those of the input.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn find(
        soup: &BinnedSoup,
        given: u64,
        (bodies, verdicts): (&mut Bodies, &mut Verdicts),
        domain: &Domain,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let mut of_part = Table::new(resources.scratch, resources.share_bytes / 16);
        each_triangle(soup, domain, resources, |triangle| {
            if u64::from(triangle.source) >= given {
                return Ok(());
            }
            let part = u64::from(triangle.part);
            while of_part.len() <= part {
                of_part.push(0)?;
            }
            let stays = verdicts.of(bodies.of(triangle.source)?)? == Verdict::Stays;
            let known = of_part.get(part)?;
            of_part.set(part, known | if stays { IS_SEEN } else { IS_HIDDEN })
        })?;
        Ok(Self { of_part })
    }

    /// Whether a part is in sight.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn is_seen(&mut self, part: u32) -> Result<bool, StoreError> {
        let part = u64::from(part);
        Ok(part >= self.of_part.len() || self.of_part.get(part)? != IS_HIDDEN)
    }
}
