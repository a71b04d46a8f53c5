//! A surface that is ready to be compared.
//!
//! Memory: half of the share while it is read, a quarter as it stays.

use crate::deviate::creases::{Creases, find_creases};
use crate::deviate::reading::{BLOCK, read};
use crate::deviate::samples::{Sample, take_samples};
use crate::deviate::tree::{Tree, TreeBuilder};
use crate::deviate::{DeviateError, Means};
use crate::mesh::MeshSource;
use crate::store::Sequence;

/// What is asked of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceOptions {
    /// Samples of its area; at most as many corners are measured besides.
    pub samples: u64,
    /// Whether its sharp edges are sought.
    pub creases: bool,
    /// Whether triangles lie near those before and after them in the file: then they are not sorted.
    /// Distances are the same, and found sooner or later.
    pub is_coherent: bool,
}

/// A surface that is ready to be compared.
pub struct Surface {
    pub(crate) bounds: [[f64; 3]; 2],
    pub(crate) tree: Tree,
    pub(crate) samples: Sequence<Sample>,
    pub(crate) creases: Option<Creases>,
}

impl Surface {
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
        let tape = read(source, means)?;
        if !tape.is_measurable() {
            return Ok(None);
        }
        let bounds = tape.bounds;
        let samples = take_samples(&tape, options.samples, means)?;
        let creases = options.creases.then(|| find_creases(&tape, means)).transpose()?;
        let tree = if options.is_coherent {
            Tree::around(tape.triangles, bounds, means)?
        } else {
            let mut builder = TreeBuilder::new(bounds, means);
            tape.triangles.each_block(BLOCK, |block| {
                means.stop_if_asked()?;
                block.iter().try_for_each(|triangle| builder.add(*triangle))
            })?;
            drop(tape);
            builder.finish()?
        };
        Ok(Some(Self { bounds, tree, samples, creases }))
    }
}
