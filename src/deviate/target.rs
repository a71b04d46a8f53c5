//! A surface that points are measured against, whoever has them: a map has one for each pixel.
//!
//! Invariant:  the distance of a point is that to the nearest of all triangles, whatever the share, the
//!             threads, and the points beside it.
//! Memory:     three eighths of the share while it is read, an eighth as it stays, and an eighth while
//!             points are measured.

use glam::DVec3;

use crate::deviate::nearest::{Near, Walker};
use crate::deviate::reading::read;
use crate::deviate::tree::Tree;
use crate::deviate::{DeviateError, Means};
use crate::mesh::{LengthUnit, MeshSource};
use crate::store::{StoreError, ordered};

/// Points that a worker takes at a time.
const CHUNK: usize = 512;

/// A surface that points are measured against.
pub struct Target {
    pub(crate) tree: Tree<'static>,
    diagonal: f64,
    /// The largest coordinate, without its sign.
    pub(crate) reach: f64,
    unit: Option<LengthUnit>,
}

impl Target {
    /// Reads `source` to its end; `None` if it has no area, or is so large that squares of its
    /// lengths are no numbers. Triangles with infinite corners are left out.
    ///
    /// # Errors
    /// [`DeviateError`]: the source fails, the scratch disk fails, or the caller cancels.
    pub fn read<S: MeshSource + ?Sized>(
        source: &mut S,
        means: &Means<'_>,
    ) -> Result<Option<Self>, DeviateError<S::Error>> {
        let tape = read(source, means, |_, _| Ok(()))?;
        if !tape.is_measurable() {
            return Ok(None);
        }
        let [low, high] = tape.bounds.map(DVec3::from);
        let (diagonal, unit) = (low.distance(high), source.unit());
        let reach = low.abs().max(high.abs()).max_element();
        Ok(Some(Self { tree: Tree::around(tape, means)?, diagonal, reach, unit }))
    }

    /// Diagonal of its box, model units.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// What a model unit is, where the file says so.
    #[must_use]
    pub fn unit(&self) -> Option<LengthUnit> {
        self.unit
    }

    /// The distance of each of the `points` from the surface, in their order; model units.
    ///
    /// Neighbours are measured the sooner the nearer they are to each other.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn distances(
        &self,
        points: &[[f64; 3]],
        means: &Means<'_>,
    ) -> Result<Vec<f64>, StoreError> {
        let distance =
            |near: Option<Near>| near.map_or(f64::INFINITY, |near| near.distance_squared.sqrt());
        self.each_nearest(points, distance, means)
    }

    /// The point of the surface that is nearest to each of the `points`, in their order.
    ///
    /// # Errors
    /// As for [`Self::distances`].
    pub fn nearest_points(
        &self,
        points: &[[f64; 3]],
        means: &Means<'_>,
    ) -> Result<Vec<[f64; 3]>, StoreError> {
        let point = |near: Option<Near>| near.map_or([f64::NAN; 3], |near| near.point.into());
        self.each_nearest(points, point, means)
    }

    fn each_nearest<T: Send>(
        &self,
        points: &[[f64; 3]],
        tell: impl Fn(Option<Near>) -> T + Sync,
        means: &Means<'_>,
    ) -> Result<Vec<T>, StoreError> {
        let mut told = Vec::with_capacity(points.len());
        let mut chunks = points.chunks(CHUNK);
        let share_bytes = means.share_bytes / 8 / means.pool.current_num_threads() as u64;
        ordered(
            means.pool,
            || {
                means.stop_if_asked()?;
                Ok(chunks.next())
            },
            || Walker::new(&self.tree, share_bytes),
            |walker, chunk: &[[f64; 3]]| {
                let nearest = chunk
                    .iter()
                    .map(|point| walker.nearest(DVec3::from(*point), DVec3::ZERO).map(&tell));
                nearest.collect::<Result<Vec<T>, StoreError>>()
            },
            |found| {
                told.extend(found);
                Ok(())
            },
        )?;
        Ok(told)
    }
}
