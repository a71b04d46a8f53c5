//! Records on their way from a worker into a sort that all workers fill.

use std::sync::{Mutex, PoisonError};

use crate::store::{Record, Sorter, StoreError};

/// Gathers records and hands them over in numbers; their order does not matter there.
pub struct Outbox<'s, R: Record> {
    sorter: &'s Mutex<Sorter<R>>,
    records: Vec<R>,
}

/// Records that a worker gathers before it locks the sort.
const OUTBOX_RECORDS: usize = 1024;

impl<'s, R: Record> Outbox<'s, R> {
    /// An empty one for `sorter`.
    #[must_use]
    pub fn new(sorter: &'s Mutex<Sorter<R>>) -> Self {
        Self { sorter, records: Vec::new() }
    }

    /// Takes a record.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        self.records.push(record);
        if self.records.len() >= OUTBOX_RECORDS { self.send() } else { Ok(()) }
    }

    /// Hands over what was gathered. Whoever drops an outbox has sent it before, or has failed.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn send(&mut self) -> Result<(), StoreError> {
        if self.records.is_empty() {
            return Ok(());
        }
        let mut sorter = self.sorter.lock().unwrap_or_else(PoisonError::into_inner);
        sorter.extend(&self.records)?;
        self.records.clear();
        Ok(())
    }
}
