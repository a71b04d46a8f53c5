//! Which triangle of the input an added one has its texture coordinates and colours from.
//!
//! Memory: a share; a table that spills.

use crate::store::{Resources, Spool, StoreError, Table};

/// The origins of all source numbers.
pub struct Origins {
    /// Source numbers of the input.
    given: u64,
    of_added: Table<u32>,
}

impl Origins {
    /// Those of added triangles, whose numbers follow upon the `given` ones of the input, spool
    /// after spool.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn new(
        given: u64,
        spools: &[&Spool<u32>],
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let mut of_added = Table::new(resources.scratch, resources.share_bytes / 8);
        for spool in spools {
            let mut reader = spool.reader(0, spool.len());
            while let Some(block) = reader.next_block()? {
                block.iter().try_for_each(|&origin| of_added.push(origin))?;
            }
        }
        Ok(Self { given, of_added })
    }

    /// The triangle of the input; `None` for one that is not known.
    pub(crate) fn of(&mut self, mut source: u32) -> Result<Option<u32>, StoreError> {
        while let Some(added) = u64::from(source).checked_sub(self.given) {
            if added >= self.of_added.len() {
                return Ok(None);
            }
            let origin = self.of_added.get(added)?;
            // What is added comes from what was there before.
            if origin >= source {
                return Ok(None);
            }
            source = origin;
        }
        Ok(Some(source))
    }
}
