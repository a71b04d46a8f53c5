//! The proof: whether a file is closed, 2-manifold, oriented outward, free of degenerates and of
//! intersections.
//!
//! In:         a [`MeshSource`]: read once if all is well, else once more to tell what is not.
//! Out:        a [`Proof`]: exact counts, a few places of each defect, volume and area.
//! Invariant:  shares no code with the stages that build surfaces. Counts and places depend on the
//!             file alone, not on the share. A vertex is the file's own where it has numbers, a
//!             position otherwise, compared exactly.
//! Units:      model units.
//! Memory:     about `share_bytes` whatever the file, at least some tens of KiB. A sound surface
//!             leaves 8 bytes a vertex in scratch files; one that is not, or whose triangles lie
//!             too scattered in the file, 84 bytes a triangle, and 36 more for the fans.
//! Fails:      [`VerifyError`]: the source, the scratch disk, or a request to stop. Whatever is
//!             wrong with the mesh is in the proof.
//! Source:     the one-cycle test of vertex links; Tarjan 1975 for components; Shewchuk 1997 for
//!             exact signs.

mod bodies;
mod coincidence;
mod components;
mod cone;
mod crowd;
mod exact;
mod fans;
mod intake;
mod intersect;
mod link;
mod nesting;
mod numbering;
mod places;
mod positions;
mod proof;
mod prover;
mod slots;
mod stream;
mod tape;
#[cfg(test)]
mod tests;
mod window;

pub use proof::{Failure, Proof};

use std::error::Error;

use rayon::ThreadPool;

use crate::defect::{Defect, IntersectingTriangles, Marks, Meeting};
use crate::mesh::MeshSource;
use crate::monitor::{Monitor, Stage};
use crate::store::{Scratch, StoreError};
use crate::verify::intersect::Intersections;
use crate::verify::prover::Prover;
use crate::verify::stream::prove_sound;

/// What orientation is asked of closed components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outward {
    /// Every volume is positive: nothing is nested (fill rule `solid`).
    AllPositive,
    /// Positive outside, negative inside one other, positive inside two, and so on.
    AlternatesWithNesting,
    /// Nothing.
    NotAsked,
}

/// What tells vertices apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Vertices {
    /// Their numbers, in files that have any.
    #[default]
    Numbers,
    /// Their positions: of files that name a vertex several times, once for each attribute.
    Positions,
}

/// How to prove.
#[derive(Clone, Copy, Debug)]
pub struct ProofOptions {
    /// Memory that the proof may take.
    pub share_bytes: u64,
    /// What orientation is asked.
    pub outward: Outward,
    /// What tells vertices apart.
    pub vertices: Vertices,
    /// Whether pairs of triangles that intersect are asked.
    pub intersections: bool,
}

/// What can go wrong while proving.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError<E> {
    /// The file cannot be read.
    #[error("Cannot read the mesh to prove")]
    Source {
        /// The reader's own word.
        source: E,
    },
    /// The scratch disk failed, or the caller asked to stop.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// A mesh that is read for its proof.
pub type ProvedSource<'s, E> = Box<dyn MeshSource<Error = E> + Send + 's>;

/// Reads a whole mesh and judges it; `open` starts it from its first triangle, at most twice.
///
/// # Errors
/// The source cannot be read, the scratch disk fails, or the monitor asks to stop.
pub fn prove<'s, E: Error + Send>(
    open: &mut dyn FnMut() -> Result<ProvedSource<'s, E>, E>,
    scratch: &Scratch,
    options: &ProofOptions,
    pool: &ThreadPool,
    monitor: &dyn Monitor,
) -> Result<Proof, VerifyError<E>> {
    prove_marking(open, scratch, options, None, pool, monitor)
}

/// [`prove`], and marks all triangles of pairs that cross, overlap or touch, all that are degenerate,
/// and all non-manifold vertices.
///
/// # Errors
/// As [`prove`].
pub fn prove_marking<'s, E: Error + Send>(
    open: &mut dyn FnMut() -> Result<ProvedSource<'s, E>, E>,
    scratch: &Scratch,
    options: &ProofOptions,
    marks: Option<&Marks>,
    pool: &ThreadPool,
    monitor: &dyn Monitor,
) -> Result<Proof, VerifyError<E>> {
    monitor.begin(Stage::Verify, 0);
    let mut start = || open().map_err(|source| VerifyError::Source { source });
    let asked = || {
        let wanted = options.intersections;
        wanted.then(|| Intersections::new(scratch, options.share_bytes, pool).marking(marks))
    };
    let mut intersections = asked();
    let pairs = intersections.as_mut();
    let sound = prove_sound(&mut *start()?, scratch, options, marks, pairs, monitor)?;
    let proof = match sound {
        Some(mut proof) => {
            enter_intersections(intersections, &mut proof, pool, monitor)?;
            proof
        }
        None => {
            drop(intersections);
            let mut intersections = asked();
            let mut prover = Prover::new(scratch, options, marks, monitor);
            prover.read(&mut *start()?, intersections.as_mut())?;
            let mut found = Proof::default();
            enter_intersections(intersections, &mut found, pool, monitor)?;
            let mut proof = prover.judge()?;
            proof.intersecting_pairs = found.intersecting_pairs;
            proof.meetings = found.meetings;
            proof.places.append(&mut found.places);
            proof
        }
    };
    monitor.end(Stage::Verify);
    Ok(proof)
}

fn enter_intersections(
    intersections: Option<Intersections<'_>>,
    proof: &mut Proof,
    pool: &ThreadPool,
    monitor: &dyn Monitor,
) -> Result<(), StoreError> {
    let Some(intersections) = intersections else { return Ok(()) };
    let found = intersections.join(pool, monitor)?;
    proof.intersecting_pairs = found.pairs.total();
    proof.meetings = found.pairs;
    let mut places = Vec::new();
    for (meeting, found) in Meeting::ALL.into_iter().zip(&found.places) {
        places.extend(found.iter().map(|&(triangles, position)| IntersectingTriangles {
            triangles,
            position,
            meeting,
        }));
    }
    places.sort_unstable_by_key(|pair| pair.triangles);
    proof.places.extend(places.into_iter().map(Defect::IntersectingTriangles));
    Ok(())
}
