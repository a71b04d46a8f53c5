//! A step that writes one brick file, item by item, with checkpoints on the way.
//!
//! In:         items in the step's own order; some give a brick.
//! Out:        the brick file, and what the step counted.
//! Invariant:  the file and the counts do not depend on where an earlier run was stopped.
//! Memory:     that of [`BrickWriter`].
//! Fails:      only as [`StoreError`]. A step that is stopped notes how far it has come.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::store::{BrickFile, BrickWriter, Progress, Resources, StoreError};

/// One pass over the items of a step. `C` is what the step counts.
pub struct BrickPass<'r, C> {
    resources: Resources<'r>,
    writer: BrickWriter,
    /// What was counted so far.
    pub counts: C,
    items: u64,
    saved_bytes: u64,
}

impl<'r, C: Default + Serialize + DeserializeOwned> BrickPass<'r, C> {
    /// Starts the brick file `name`, or goes on where an earlier run noted its progress.
    ///
    /// # Errors
    /// The file cannot be created, or is not what the earlier run noted.
    pub fn start(name: &str, resources: &Resources<'r>) -> Result<Self, StoreError> {
        let resources = *resources;
        let noted = resources.checkpoints.start().and_then(|progress| {
            let counts = serde_json::from_str(&progress.counts).ok()?;
            let file = progress.files.into_iter().find(|file| file.name == name)?;
            Some((file, counts, progress.items))
        });
        match noted {
            Some((file, counts, items)) => {
                let writer = BrickWriter::reopen(resources.scratch, &file)?;
                let saved_bytes = writer.end_bytes();
                resources.monitor.advance(items);
                Ok(Self { resources, writer, counts, items, saved_bytes })
            }
            None => {
                let writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
                Ok(Self { resources, writer, counts: C::default(), items: 0, saved_bytes: 0 })
            }
        }
    }

    /// Items that an earlier run has done.
    #[must_use]
    pub fn items(&self) -> u64 {
        self.items
    }

    /// Appends a brick; see [`BrickWriter::append`].
    ///
    /// # Errors
    /// The disk is full.
    pub fn append(&mut self, key: u64, flags: u32, bytes: &[u8]) -> Result<(), StoreError> {
        self.writer.append(key, flags, bytes)
    }

    /// An item is done: its brick is appended and its counts are added.
    ///
    /// # Errors
    /// The progress cannot be noted.
    pub fn item_done(&mut self) -> Result<(), StoreError> {
        self.items += 1;
        self.resources.monitor.advance(1);
        let since = self.writer.end_bytes() - self.saved_bytes;
        if since >= self.resources.checkpoints.interval_bytes() { self.save() } else { Ok(()) }
    }

    fn save(&mut self) -> Result<(), StoreError> {
        let Some(file) = self.writer.save()? else { return Ok(()) };
        self.saved_bytes = file.len_bytes;
        let counts = serde_json::to_string(&self.counts).expect("plain records serialise");
        let progress = Progress { items: self.items, files: vec![file], counts };
        self.resources.checkpoints.save(progress)
    }

    /// Ends the pass with the `result` of its loop. One that was stopped notes its progress.
    ///
    /// # Errors
    /// That of the loop; or the directory cannot be written.
    pub fn end<E: From<StoreError>>(
        mut self,
        result: Result<(), E>,
        is_stop: impl Fn(&E) -> bool,
    ) -> Result<(BrickFile, C), E> {
        match result {
            Ok(()) => Ok((self.writer.finish(self.resources.cached_windows)?, self.counts)),
            Err(error) => {
                if is_stop(&error) {
                    // The error that stopped the step is the one to tell, also on a full disk.
                    let _ = self.save();
                }
                Err(error)
            }
        }
    }
}
