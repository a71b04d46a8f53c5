//! A surface that is ready to be compared.
//!
//! Memory: half of the share while it is read, a quarter as it stays.

use crate::deviate::creases::Creases;
use crate::deviate::edges::find_creases;
use crate::deviate::reading::{BLOCK, Tape, read};
use crate::deviate::samples::{Sample, take_samples};
use crate::deviate::tree::{Tree, TreeBuilder};
use crate::deviate::{DeviateError, Means};
use crate::mesh::MeshSource;
use crate::store::{Sequence, StoreError};

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
        if options.is_coherent || !options.creases {
            let creases = options.creases.then(|| find_creases(&tape, means)).transpose()?;
            let tree = tree_of(tape, options.is_coherent, means)?;
            return Ok(Some(Self { bounds, tree, samples, creases }));
        }
        // Both sorts take their time on one thread.
        let (creases, tree) =
            means.pool.join(|| find_creases(&tape, means), || ordered_tree(&tape, means)?.finish());
        Ok(Some(Self { bounds, tree: tree?, samples, creases: Some(creases?) }))
    }
}

/// A tree around what was read; `is_coherent` as in [`SurfaceOptions`].
pub(crate) fn tree_of(
    tape: Tape,
    is_coherent: bool,
    means: &Means<'_>,
) -> Result<Tree, StoreError> {
    if is_coherent {
        return Tree::around(tape.triangles, tape.bounds, means);
    }
    let builder = ordered_tree(&tape, means)?;
    drop(tape);
    builder.finish()
}

/// The triangles of a tape on their way into a tree.
fn ordered_tree<'m>(tape: &Tape, means: &'m Means<'m>) -> Result<TreeBuilder<'m>, StoreError> {
    let mut builder = TreeBuilder::new(tape.bounds, means);
    tape.triangles.each_block(BLOCK, |block| {
        means.stop_if_asked()?;
        block.iter().try_for_each(|triangle| builder.add(*triangle))
    })?;
    Ok(builder)
}
