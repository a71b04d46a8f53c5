//! Tasks for workers, and the chunks of a cell that is too crowded for one task.
//!
//! In:         the parcels of a cell.
//! Out:        tasks, which together show each pair of its triangles once.
//! Memory:     that of a task.

use crate::store::{Sequence, StoreError};
use crate::verify::intersect::cell::{Cell, CellTask};
use crate::verify::intersect::join::Group;
use crate::verify::intersect::parcels::{Packed, Parcel};

/// A cell that does not fit in memory and that no division makes smaller.
pub(crate) struct Crowd {
    group: Group,
    /// The first parcel of the first chunk.
    first: u64,
    /// The first parcel of the second chunk; before that the first chunk is joined with itself.
    second: Option<u64>,
}

impl Crowd {
    /// Of the parcels of a cell, none of which are joined yet.
    pub(crate) fn new(group: Group) -> Self {
        Self { group, first: 0, second: None }
    }

    /// The next two chunks, of so many triangles at most.
    pub(crate) fn next_task(
        &mut self,
        packed: &Packed,
        most: u64,
    ) -> Result<Option<CellTask>, StoreError> {
        let count = self.group.parcels.len();
        if self.second.is_some_and(|second| second >= count) {
            self.first = self.chunk_end(self.first, most)?;
            self.second = None;
        }
        if self.first >= count {
            return Ok(None);
        }
        let end = self.chunk_end(self.first, most)?;
        let mut task = task_of(packed, self.group.cells.clone());
        append(&mut task, packed, &self.group.parcels, self.first..end)?;
        match self.second {
            None => self.second = Some(end),
            Some(second) => {
                let second_end = self.chunk_end(second, most)?;
                task.border = Some(task.parcels.len());
                task.counts = false;
                append(&mut task, packed, &self.group.parcels, second..second_end)?;
                self.second = Some(second_end);
            }
        }
        Ok(Some(task))
    }

    /// Where a chunk ends; it has one parcel at least.
    fn chunk_end(&self, first: u64, most: u64) -> Result<u64, StoreError> {
        let (mut at, mut triangles) = (first, 0);
        let mut buffer = Vec::new();
        while let Some(parcel) = self.group.parcels.block(at, 1, &mut buffer)?.first() {
            triangles += u64::from(parcel.triangles);
            if triangles > most && at > first {
                break;
            }
            at += 1;
        }
        Ok(at)
    }
}

/// A task without parcels yet.
pub(crate) fn task_of(packed: &Packed, cells: Vec<Cell>) -> CellTask {
    let (parcels, words) = (Vec::new(), Vec::new());
    CellTask { cells, parcels, words, named: packed.named, border: None, counts: true }
}

/// Appends some parcels to a task.
pub(crate) fn append(
    task: &mut CellTask,
    packed: &Packed,
    parcels: &Sequence<Parcel>,
    range: std::ops::Range<u64>,
) -> Result<(), StoreError> {
    let mut buffer = Vec::new();
    for at in range {
        let block = parcels.block(at, 1, &mut buffer)?;
        let parcel = block.first().copied().expect("ranges of parcels end where the list ends");
        packed.read(&parcel, &mut task.words)?;
        task.parcels.push(parcel);
    }
    Ok(())
}
