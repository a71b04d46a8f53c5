//! The bricks of cells, and behind them those that a later step has made anew, or their face points only.

use crate::contour::ContourError;
use crate::contour::mdc::HAS_POINTS_ONLY;
use crate::monitor::{Gauge, Resident};
use crate::octree::{ArchivedCellBrick, ArchivedFacePoint, BrickKey, decode_cells};
use crate::store::{BrickFile, Resources, StoreError, View, ordered_by_weight};

/// Whether a record has nothing but face points.
fn has_points_only(file: &BrickFile, number: usize) -> bool {
    file.directory()[number].flags & HAS_POINTS_ONLY != 0
}

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

    /// The record of a brick in the second file.
    fn anew(&self, number: usize) -> Option<(&'f BrickFile, usize)> {
        let anew = self.anew?;
        Some((anew, anew.find(self.first.directory()[number].key)?))
    }

    /// Its record there, if that has its face points only.
    fn points_of(&self, number: usize) -> Option<(&'f BrickFile, usize)> {
        self.anew(number).filter(|(file, number)| has_points_only(file, *number))
    }

    /// Its record but for its face points.
    fn cells_of(&self, number: usize) -> (&'f BrickFile, usize) {
        let whole = self.anew(number).filter(|(file, number)| !has_points_only(file, *number));
        whole.unwrap_or((self.first, number))
    }

    /// What the directory says of a brick.
    pub fn flags(&self, number: usize) -> u32 {
        let (file, number) = self.anew(number).unwrap_or((self.first, number));
        file.directory()[number].flags
    }

    /// Whether a brick was made anew, with more than its face points.
    pub fn is_anew(&self, number: usize) -> bool {
        self.anew(number).is_some_and(|(file, number)| !has_points_only(file, number))
    }

    /// The length of a brick's records.
    pub fn record_bytes(&self, number: usize) -> u64 {
        let points = self.points_of(number).map_or(0, |(file, number)| file.record_bytes(number));
        let (file, number) = self.cells_of(number);
        file.record_bytes(number) + points
    }

    /// The record of a brick, whose face points may be missing.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn read<R>(
        &self,
        number: usize,
        use_it: impl FnOnce(&ArchivedCellBrick) -> Result<R, ContourError>,
    ) -> Result<R, ContourError> {
        let (file, number) = self.cells_of(number);
        let view: View = file.view(number)?;
        use_it(decode_cells(&view)?)
    }

    /// The record of a brick, and its face points.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn read_with_points<R>(
        &self,
        number: usize,
        use_it: impl FnOnce(&ArchivedCellBrick, &[ArchivedFacePoint]) -> Result<R, ContourError>,
    ) -> Result<R, ContourError> {
        let Some((file, of_points)) = self.points_of(number) else {
            return self.read(number, |record| use_it(record, &record.points));
        };
        let view = file.view(of_points)?;
        let points = &decode_cells(&view)?.points;
        self.read(number, |record| use_it(record, points))
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
