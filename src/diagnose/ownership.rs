//! Parts and materials, by how many triangles they have.

use std::cmp::Reverse;

use serde::{Deserialize, Serialize};

use crate::defect::Smallest;
use crate::diagnose::{DiagnoseError, Means};
use crate::store::{StoreError, Table};

/// One part or material.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// Its name as written in the file; may be empty.
    pub name: String,
    /// Its triangles.
    pub triangles: u64,
}

/// All parts, or all materials.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owners {
    /// Those that have triangles.
    pub count: u64,
    /// The eight with the most triangles, most first.
    pub largest: Vec<Owner>,
}

/// Counts triangles by number of part or material.
pub(crate) struct Census {
    counts: Table<u64>,
}

impl Census {
    pub(crate) fn new(means: &Means<'_>, share_bytes: u64) -> Self {
        Self { counts: Table::new(means.scratch, share_bytes) }
    }

    pub(crate) fn count(&mut self, number: u32) -> Result<(), StoreError> {
        let number = u64::from(number);
        while self.counts.len() <= number {
            self.counts.push(0)?;
        }
        let count = self.counts.get(number)?;
        self.counts.set(number, count + 1)
    }

    /// Those with triangles, and the names of the largest.
    pub(crate) fn list<E>(
        &mut self,
        mut name_of: impl FnMut(u32) -> Result<String, E>,
    ) -> Result<Owners, DiagnoseError<E>> {
        let mut owners = Owners::default();
        let mut largest = Smallest::new();
        for number in 0..self.counts.len() {
            let triangles = self.counts.get(number)?;
            if triangles > 0 {
                owners.count += 1;
                largest.offer((Reverse(triangles), number as u32), ());
            }
        }
        for ((Reverse(triangles), number), ()) in largest.iter() {
            let name = name_of(*number).map_err(|source| DiagnoseError::Source { source })?;
            owners.largest.push(Owner { name, triangles: *triangles });
        }
        Ok(owners)
    }
}
