//! Measures what samples show: how far from the other surface the point lies.
//!
//! In:         a [`Scene`] with means, and bands that were drawn.
//! Out:        distances, model units.
//! Memory:     the share: a quarter for each tree, an eighth while points are measured.
//! Fails:      as [`PreviewError`].

use rayon::ThreadPool;

use crate::deviate::{DeviateError, Means, Target};
use crate::mesh::LengthUnit;
use crate::monitor::Monitor;
use crate::report::preview::scene::{Measuring, Scene};
use crate::report::preview::{PreviewError, Side};
use crate::store::Scratch;

/// What points of each side are measured against.
pub(crate) struct Ruler<'m> {
    scratch: &'m Scratch,
    monitor: &'m dyn Monitor,
    pool: ThreadPool,
    share_bytes: u64,
    /// The output for points of the input, and the other way round.
    others: [Option<Target>; 2],
}

impl<'m> Ruler<'m> {
    /// Reads the surfaces that points of `sides` are measured against; `None` where nothing is to be
    /// measured, or where a surface has no area.
    pub(crate) fn read<E: std::error::Error>(
        scene: &Scene<'_, '_, E>,
        (measuring, monitor): (Option<Measuring<'m>>, &'m dyn Monitor),
        sides: &[Side],
        share_bytes: u64,
    ) -> Result<Option<Self>, PreviewError<E>> {
        let Some(Measuring { scratch, threads }) = measuring else { return Ok(None) };
        if scene.output.is_none() {
            return Ok(None);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|source| PreviewError::Threads { threads, source })?;
        let mut ruler = Self { scratch, monitor, pool, share_bytes, others: [None, None] };
        for &side in sides {
            let target = ruler.target(scene, other(side))?;
            if target.is_none() {
                return Ok(None);
            }
            ruler.others[side as usize] = target;
        }
        Ok(Some(ruler))
    }

    fn target<E: std::error::Error>(
        &self,
        scene: &Scene<'_, '_, E>,
        side: Side,
    ) -> Result<Option<Target>, PreviewError<E>> {
        let Some(mut source) = scene.open(side)? else { return Ok(None) };
        // Contouring writes neighbours after each other.
        let target = Target::read(&mut *source, &self.means());
        target.map_err(|error| match error {
            DeviateError::Source { source } => PreviewError::Source { side, source },
            DeviateError::Store(error) => PreviewError::measure(error),
        })
    }

    /// How far `points` of a side lie from the other one.
    pub(crate) fn distances<E: std::error::Error>(
        &self,
        side: Side,
        points: &[[f64; 3]],
    ) -> Result<Vec<f64>, PreviewError<E>> {
        let Some(target) = &self.others[side as usize] else {
            return Ok(vec![f64::INFINITY; points.len()]);
        };
        target.distances(points, &self.means()).map_err(PreviewError::measure)
    }

    /// How far what the output has nearest to `points` lies from the input.
    pub(crate) fn distances_at_output<E: std::error::Error>(
        &self,
        points: &[[f64; 3]],
    ) -> Result<Vec<f64>, PreviewError<E>> {
        let Some(output) = &self.others[Side::Input as usize] else {
            return self.distances(Side::Output, points);
        };
        let points = output.nearest_points(points, &self.means()).map_err(PreviewError::measure)?;
        self.distances(Side::Output, &points)
    }

    /// Diagonal of the box of the largest surface that was read, model units.
    pub(crate) fn diagonal(&self) -> f64 {
        self.others.iter().flatten().map(Target::diagonal).fold(0.0, f64::max)
    }

    /// What a model unit is, where a file says so.
    pub(crate) fn unit(&self) -> Option<LengthUnit> {
        self.others.iter().flatten().find_map(Target::unit)
    }

    fn means(&self) -> Means<'_> {
        let Self { scratch, monitor, pool, share_bytes, .. } = self;
        Means { scratch, pool, share_bytes: *share_bytes, monitor: *monitor }
    }
}

fn other(side: Side) -> Side {
    match side {
        Side::Input => Side::Output,
        Side::Output => Side::Input,
    }
}
