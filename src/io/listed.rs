//! The vertices that a file lists, in the order of their numbers, from the table of a reader.

use crate::io::error::IoError;
use crate::store::Table;

/// Positions that are handed on at a time.
pub(crate) const LISTED_POSITIONS: u64 = 4096;

/// How far a list has been read.
#[derive(Default)]
pub(crate) struct Listing {
    next: u64,
}

impl Listing {
    /// Replaces `positions` by the next ones of the table; `false` behind the last.
    pub(crate) fn next(
        &mut self,
        table: &mut Table<[f64; 3]>,
        positions: &mut Vec<[f64; 3]>,
    ) -> Result<bool, IoError> {
        positions.clear();
        let end = table.len().min(self.next + LISTED_POSITIONS);
        for vertex in self.next..end {
            positions.push(table.get(vertex)?);
        }
        self.next = end;
        Ok(!positions.is_empty())
    }
}
