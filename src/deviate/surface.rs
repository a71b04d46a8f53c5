//! A surface that is ready to be compared.
//!
//! Memory: half of the share while it is read, a quarter as it stays.

use crate::deviate::creases::Creases;
use crate::deviate::edges::EdgeFinder;
use crate::deviate::reading::{Tape, read, survey_soup};
use crate::deviate::samples::{Sample, take_samples};
use crate::deviate::tree::Tree;
use crate::deviate::{DeviateError, Means};
use crate::mesh::MeshSource;
use crate::octree::SoupSpool;
use crate::store::{Sequence, StoreError};

/// What is asked of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceOptions {
    /// Samples of its area; at most as many corners are measured besides.
    pub samples: u64,
    /// Whether its sharp edges are sought.
    pub creases: bool,
}

/// A surface that is ready to be compared.
pub struct Surface<'s> {
    pub(crate) bounds: [[f64; 3]; 2],
    pub(crate) tree: Tree<'s>,
    pub(crate) samples: Sequence<Sample>,
    pub(crate) creases: Option<Creases>,
}

impl Surface<'static> {
    /// Reads `source` to its end; `None` if it has no area, or is so large that squares of its
    /// lengths are no numbers. Triangles with infinite corners are left out.
    ///
    /// # Errors
    /// [`DeviateError`]: the source fails, the scratch disk fails, or the caller cancels.
    pub fn read<S: MeshSource + ?Sized>(
        source: &mut S,
        options: &SurfaceOptions,
        means: &Means<'_>,
    ) -> Result<Option<Self>, DeviateError<S::Error>> {
        let mut finder = options.creases.then(|| EdgeFinder::new(means));
        let tape = read(source, means, |_, measured| {
            finder.as_mut().map_or(Ok(()), |finder| finder.add(measured))
        })?;
        Ok(Self::around(tape, finder, options, means)?)
    }
}

impl<'s> Surface<'s> {
    /// The same of a soup that was read before, whose triangles stay where they are.
    ///
    /// # Errors
    /// The scratch disk fails, or the caller cancels.
    pub fn of_soup(
        soup: &'s SoupSpool,
        options: &SurfaceOptions,
        means: &Means<'_>,
    ) -> Result<Option<Self>, StoreError> {
        let mut finder = options.creases.then(|| EdgeFinder::new(means));
        let tape = survey_soup(soup, means, |measured| {
            finder.as_mut().map_or(Ok(()), |finder| finder.add(measured))
        })?;
        Self::around(tape, finder, options, means)
    }

    fn around(
        tape: Tape<'s>,
        finder: Option<EdgeFinder<'_>>,
        options: &SurfaceOptions,
        means: &Means<'_>,
    ) -> Result<Option<Self>, StoreError> {
        if !tape.is_measurable() {
            return Ok(None);
        }
        let bounds = tape.bounds;
        let creases = finder.map(|finder| finder.finish(&tape)).transpose()?;
        let samples = take_samples(&tape, options.samples, means)?;
        Ok(Some(Self { bounds, tree: Tree::around(tape, means)?, samples, creases }))
    }
}
