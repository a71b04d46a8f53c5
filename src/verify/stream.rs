//! The proof in one pass, for surfaces that are sound and whose triangles lie near each other.
//!
//! In:         a mesh source.
//! Out:        its [`Proof`], which holds for the topology; or nothing, and then the file has to be
//!             read again to tell what is wrong, or to be sure.
//! Invariant:  a proof from here equals the one from the passes over the tape.
//! Memory:     that of the window.

use crate::defect::Marks;
use crate::mesh::{MeshSource, TriangleBatch};
use crate::monitor::Monitor;
use crate::store::{Scratch, StoreError};
use crate::verify::intake::Intake;
use crate::verify::intersect::Intersections;
use crate::verify::positions::{PositionKey, key_of};
use crate::verify::slots::Name;
use crate::verify::tape::stop_if_asked;
use crate::verify::window::{Sound, Window};
use crate::verify::{Outward, Proof, ProofOptions, VerifyError, Vertices};

/// Beyond this, the products of tiny and huge coordinates need a closer look.
const MOST_REACH: f64 = 1.0e30;

/// The vertices under way, by what tells them apart.
enum Windows {
    Numbers(Window<u32>),
    Positions(Window<PositionKey>),
}

/// Reads a mesh as long as it is sound, and marks degenerate triangles.
pub(crate) fn prove_sound<S: MeshSource + ?Sized>(
    source: &mut S,
    scratch: &Scratch,
    options: &ProofOptions,
    marks: Option<&Marks>,
    mut intersections: Option<&mut Intersections<'_>>,
    monitor: &dyn Monitor,
) -> Result<Option<Proof>, VerifyError<S::Error>> {
    let mut intake = Intake::default();
    let mut windows = None;
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).map_err(|source| VerifyError::Source { source })? {
        stop_if_asked(monitor)?;
        if options.vertices == Vertices::Positions {
            batch.indices.clear();
        }
        let windows = windows.get_or_insert_with(|| {
            if batch.indices.is_empty() {
                Windows::Positions(Window::new(scratch, options.share_bytes))
            } else {
                Windows::Numbers(Window::new(scratch, options.share_bytes))
            }
        });
        let pairs = intersections.as_deref_mut();
        let goes_on = match windows {
            Windows::Numbers(window) => {
                let numbers = batch.indices.iter().copied();
                take((&mut intake, marks), window, pairs, &batch, numbers, |number, _| number)?
            }
            Windows::Positions(window) => {
                let keys = batch.corners.iter().map(|corners| corners.map(key_of));
                let number = |_, arrival: u64| arrival as u32;
                take((&mut intake, marks), window, pairs, &batch, keys, number)?
            }
        };
        if !goes_on {
            return Ok(None);
        }
        monitor.advance(batch.len() as u64);
    }
    let listed = source.vertex_count().filter(|_| options.vertices == Vertices::Numbers);
    intake.close(listed, source.discarded());
    let sound = match windows {
        None => None,
        Some(Windows::Numbers(window)) => window.finish()?,
        Some(Windows::Positions(window)) => window.finish()?,
    };
    Ok(sound.and_then(|sound| conclude(intake, sound, options.outward)))
}

/// Takes the triangles of a batch, whose corners have these names; `false` ends the attempt.
fn take<N: Name>(
    (intake, marks): (&mut Intake, Option<&Marks>),
    window: &mut Window<N>,
    mut intersections: Option<&mut Intersections<'_>>,
    batch: &TriangleBatch,
    names: impl Iterator<Item = [N; 3]>,
    number: impl Fn(N, u64) -> u32,
) -> Result<bool, StoreError> {
    for (at, (corners, names)) in batch.corners.iter().zip(names).enumerate() {
        let [a, b, c] = names;
        let is_whole = a != b && b != c && c != a;
        let (triangle, ids) = (intake.triangles, batch.indices.get(at).copied());
        let Some(cone) = intake.add(corners, ids) else {
            return Ok(false);
        };
        intake.mark(triangle, marks)?;
        if let (Some(intersections), true) = (&mut intersections, cone.has_area) {
            intersections.add(triangle, ids, corners)?;
        }
        if !is_whole || !window.add(names, corners, &cone, &number)? {
            return Ok(false);
        }
    }
    Ok(!window.is_full())
}

/// The proof, unless the orientation needs a closer look.
fn conclude(mut intake: Intake, sound: Sound, outward: Outward) -> Option<Proof> {
    let mut reach = intake.bounds.iter().flatten().flatten();
    let is_settled = match outward {
        Outward::NotAsked => true,
        Outward::AllPositive => sound.doubtful == 0,
        Outward::AlternatesWithNesting => sound.doubtful == 0 && sound.components == 1,
    };
    if !is_settled || reach.any(|x| x.abs() > MOST_REACH) || sound.vertices > u64::from(u32::MAX) {
        return None;
    }
    let mut proof = Proof::default();
    intake.enter_into(&mut proof);
    proof.vertices = intake.vertices.unwrap_or(sound.vertices);
    proof.unused_vertices = proof.vertices - sound.vertices;
    // Every edge has two triangles.
    proof.edges = intake.triangles / 2 * 3;
    proof.components = sound.components;
    let faces_less_edges = intake.triangles as i64 - proof.edges as i64;
    proof.euler_characteristic = sound.vertices as i64 + faces_less_edges;
    proof.places.append(&mut intake.degenerate_places);
    Some(proof)
}
