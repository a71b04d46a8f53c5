//! A written file, part by part: each is read, and proved, as if it were alone.
//!
//! In:         a file whose parts come one after another, and how many triangles and vertices each
//!             has.
//! Out:        a source for each of them in turn.
//! Memory:     a batch, and that of the reader.
//! Fails:      as the reader does.

use std::sync::{Arc, Mutex, PoisonError};

use crate::io::{IoError, Source};
use crate::mesh::{Discarded, MeshSource, TriangleBatch};
use crate::repair::parts::part_sink::Numbered;

/// The file, read so far.
struct Reader {
    source: Source,
    batch: TriangleBatch,
    /// Of the batch.
    next: usize,
    /// Triangles that were handed on.
    delivered: u64,
}

impl Reader {
    /// Appends up to `most` of the next triangles; whether there were any.
    fn deliver(&mut self, most: u64, into: &mut TriangleBatch) -> Result<bool, IoError> {
        if self.next == self.batch.len() {
            self.next = 0;
            if !self.source.next_batch(&mut self.batch)? {
                self.batch.clear();
                return Ok(false);
            }
        }
        let left = (self.batch.len() - self.next) as u64;
        let range = self.next..self.next + left.min(most) as usize;
        into.corners.extend_from_slice(&self.batch.corners[range.clone()]);
        into.parts.extend_from_slice(&self.batch.parts[range.clone()]);
        into.materials.extend_from_slice(&self.batch.materials[range.clone()]);
        into.polygons.extend_from_slice(&self.batch.polygons[range.clone()]);
        if !self.batch.indices.is_empty() {
            into.indices.extend_from_slice(&self.batch.indices[range.clone()]);
        }
        self.delivered += range.len() as u64;
        self.next = range.end;
        Ok(true)
    }
}

/// Cuts a file into its parts.
pub struct Slices<F> {
    open: F,
    reader: Arc<Mutex<Option<Reader>>>,
}

impl<F: FnMut() -> Result<Source, IoError>> Slices<F> {
    /// Of the file that `open` begins to read.
    pub fn new(open: F) -> Self {
        Self { open, reader: Arc::new(Mutex::new(None)) }
    }

    /// The part behind what is there `before`, up to `after`.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn part(&mut self, before: Numbered, after: Numbered) -> Result<Slice, IoError> {
        let mut held = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        // Parts come in order, so that only what is read twice is begun anew.
        if held.as_ref().is_none_or(|reader| reader.delivered > before.triangles) {
            let source = (self.open)()?;
            let batch = TriangleBatch::default();
            *held = Some(Reader { source, batch, next: 0, delivered: 0 });
        }
        let reader = held.as_mut().expect("it was opened");
        let mut passed = TriangleBatch::default();
        while reader.delivered < before.triangles {
            passed.clear();
            if !reader.deliver(before.triangles - reader.delivered, &mut passed)? {
                break;
            }
        }
        drop(held);
        Ok(Slice { reader: Arc::clone(&self.reader), before, after })
    }
}

/// One part.
pub struct Slice {
    reader: Arc<Mutex<Option<Reader>>>,
    before: Numbered,
    after: Numbered,
}

impl MeshSource for Slice {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        let mut held = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(reader) = held.as_mut() else { return Ok(false) };
        let left = self.after.triangles.saturating_sub(reader.delivered);
        if left == 0 || !reader.deliver(left, batch)? {
            return Ok(false);
        }
        for index in batch.indices.as_flattened_mut() {
            // What names a vertex of another part names none of this one.
            *index = index.checked_sub(self.before.vertices as u32).unwrap_or(u32::MAX);
        }
        Ok(true)
    }

    fn discarded(&self) -> Discarded {
        let held = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        held.as_ref().map_or_else(Discarded::default, |reader| reader.source.discarded())
    }

    fn bytes_read(&self) -> u64 {
        0
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.after.vertices - self.before.vertices)
    }
}
