//! The bricks of cells, and behind them those that a later step has made anew.

use crate::contour::ContourError;
use crate::monitor::{Gauge, Resident};
use crate::octree::{ArchivedCellBrick, BrickKey, decode_cells};
use crate::store::{BrickFile, Resources, StoreError, View, ordered_by_weight};

/// Bricks of cells by the numbers that they have in the first file; a brick of the second file
/// stands for the one of the first with its key.
#[derive(Clone, Copy)]
pub struct Layers<'f> {
    first: &'f BrickFile,
    anew: Option<&'f BrickFile>,
}

impl<'f> Layers<'f> {
    /// `anew` has bricks of `first`, and perhaps not all of them.
    pub fn new(first: &'f BrickFile, anew: Option<&'f BrickFile>) -> Self {
        Self { first, anew }
    }

    /// The first file.
    pub fn first(&self) -> &'f BrickFile {
        self.first
    }

    /// The number of bricks.
    pub fn bricks(&self) -> usize {
        self.first.len()
    }

    /// The key of a brick.
    pub fn key(&self, number: usize) -> BrickKey {
        BrickKey(self.first.directory()[number].key)
    }

    /// The number of the brick with this key.
    pub fn find(&self, key: BrickKey) -> Option<usize> {
        self.first.find(key.0)
    }

    fn file_of(&self, number: usize) -> (&'f BrickFile, usize) {
        let key = self.first.directory()[number].key;
        match self.anew.and_then(|anew| Some((anew, anew.find(key)?))) {
            Some(found) => found,
            None => (self.first, number),
        }
    }

    /// What the directory says of a brick.
    pub fn flags(&self, number: usize) -> u32 {
        let (file, number) = self.file_of(number);
        file.directory()[number].flags
    }

    /// Whether a brick was made anew.
    pub fn is_anew(&self, number: usize) -> bool {
        let key = self.first.directory()[number].key;
        self.anew.is_some_and(|anew| anew.find(key).is_some())
    }

    /// The length of a brick's record.
    pub fn record_bytes(&self, number: usize) -> u64 {
        let (file, number) = self.file_of(number);
        file.record_bytes(number)
    }

    /// The record of a brick.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn read<R>(
        &self,
        number: usize,
        use_it: impl FnOnce(&ArchivedCellBrick) -> Result<R, ContourError>,
    ) -> Result<R, ContourError> {
        let (file, number) = self.file_of(number);
        let view: View = file.view(number)?;
        use_it(decode_cells(&view)?)
    }

    /// Visits the bricks that are wanted on all threads, and takes what comes of them in their
    /// order. A byte of a record takes `factor` bytes while it is visited.
    ///
    /// # Errors
    /// The first error of `visit` or `take`, or that the caller cancels.
    pub fn each<W, O: Send>(
        &self,
        factor: u64,
        is_wanted: impl Fn(usize) -> bool,
        workspace: impl Fn() -> W + Sync,
        visit: impl Fn(&mut W, usize) -> Result<O, ContourError> + Sync,
        take: impl FnMut(O) -> Result<(), ContourError>,
        resources: &Resources,
    ) -> Result<(), ContourError> {
        let mut numbers = (0..self.bricks()).filter(|number| is_wanted(*number));
        let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
        ordered_by_weight(
            resources.pool,
            resources.scales(|number: &usize| factor * self.record_bytes(*number)),
            || {
                if resources.monitor.cancelled() {
                    return Err(ContourError::Store(StoreError::Cancelled));
                }
                Ok(numbers.next())
            },
            workspace,
            |space, number| {
                let _brick = resident.hold(1);
                visit(space, number)
            },
            take,
        )
    }
}
