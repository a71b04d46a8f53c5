//! Closes the dual surface: flips edges until no face is odd.
//!
//! In:         the brick file of scan; bricks that see an odd face are flagged.
//! Out:        [`Flips`]: the flipped edges per brick, with the place of the patch on each.
//! Invariant:  afterwards every face of every cell has an even number of marked edges.
//! Units:      cells; offsets on edges in 1/65536.
//! Memory:     the share: odd faces, labels and flips are sorted externally; resident at one time
//!             are the faces of one cut of one component.
//! Fails:      [`PatchError`]: the scratch disk, or a brick that is none. Geometry cannot fail.
//! Source:     Ju 2004, section 4 (divide and conquer over boundary cycles), restated over Z/2:
//!             no cycle is traced, a set of odd faces is cut and paired plane by plane.

mod faces;
mod pair;
mod path;
mod solve;

use serde::{Deserialize, Serialize};

use crate::octree::{BrickError, BrickKey, EdgeBits, FlipRecord, Flips, decode_hits};
use crate::patch::faces::{ComponentFace, LocalComponents, find_components};
use crate::patch::solve::Solver;
use crate::store::{BrickFile, Resources, Sorter, StoreError, Unite, ordered_by_weight};

pub use faces::OddFace;

/// What can go wrong while patching.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PatchError {
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A brick's record is not what scan writes.
    #[error(transparent)]
    Brick(#[from] BrickError),
}

/// An opening that was closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Opening {
    /// Odd faces of the component: about 1.5 times the rim's length in cells.
    pub odd_faces: u64,
    /// Box of the component in cells, low and high.
    pub lo_cell: [u32; 3],
    /// See `lo_cell`.
    pub hi_cell: [u32; 3],
}

/// Openings that are listed one by one.
const LISTED_OPENINGS: usize = 16;

/// Counts of patching.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PatchStats {
    /// Odd faces that scan left.
    pub odd_faces: u64,
    /// Their connected components.
    pub components: u64,
    /// Components that cross a brick border.
    pub border_components: u64,
    /// Edges flipped.
    pub flipped_edges: u64,
    /// The largest components, largest first.
    pub largest: Vec<Opening>,
}

impl PatchStats {
    /// Takes note of a solved component.
    fn add(&mut self, opening: Opening) {
        self.components += 1;
        self.odd_faces += opening.odd_faces;
        let at = self.largest.partition_point(|other| *other > opening);
        if at < LISTED_OPENINGS {
            self.largest.insert(at, opening);
            self.largest.truncate(LISTED_OPENINGS);
        }
    }
}

/// Finds the flips that close the surface of `hits`; `odd_flag` marks the bricks to look at.
///
/// # Errors
/// [`PatchError`].
pub fn patch(
    hits: &BrickFile,
    odd_flag: u32,
    cell_units: f64,
    resources: &Resources,
) -> Result<(Flips, PatchStats), PatchError> {
    let mut stats = PatchStats::default();
    let mut flips = Sorter::<FlipRecord>::new(resources.scratch, resources.share_bytes / 4);
    let border = collect_faces(hits, odd_flag, cell_units, resources, &mut flips, &mut stats)?;
    if border.labels > 0 {
        let faces = label_faces(border, resources)?;
        solve_components(faces, resources, &mut flips, &mut stats)?;
    }
    let (flips, flipped) = Flips::write(flips, resources)?;
    stats.flipped_edges = flipped;
    Ok((flips, stats))
}

/// What a byte of a record takes while its odd faces are found and closed.
const RECORD_FACTOR: u64 = 3;

/// Faces of components that reach a brick border, with the labels that their bricks gave them.
struct BorderFaces {
    faces: Sorter<ComponentFace>,
    labels: u64,
}

/// Looks at every flagged brick, solves the components that lie inside of it, keeps the others.
fn collect_faces(
    hits: &BrickFile,
    odd_flag: u32,
    cell_units: f64,
    resources: &Resources,
    flips: &mut Sorter<FlipRecord>,
    stats: &mut PatchStats,
) -> Result<BorderFaces, PatchError> {
    let faces = Sorter::<ComponentFace>::new(resources.scratch, resources.share_bytes / 4);
    let mut border = BorderFaces { faces, labels: 0 };
    let workers = resources.pool.current_num_threads() as u64;
    let solver_share = resources.share_bytes / 4 / workers;
    let mut flagged = (0..hits.len()).filter(|&n| hits.directory()[n].flags & odd_flag != 0);
    ordered_by_weight(
        resources.pool,
        resources.scales(|number: &usize| RECORD_FACTOR * hits.record_bytes(*number)),
        || {
            if resources.monitor.cancelled() {
                return Err(PatchError::Store(StoreError::Cancelled));
            }
            Ok(flagged.next())
        },
        || (EdgeBits::default(), Solver::new(resources.scratch, solver_share)),
        |(marks, solver), number| {
            let view = hits.view(number)?;
            let brick = BrickKey(hits.directory()[number].key);
            let found = find_components(decode_hits(&view)?, brick, cell_units, marks);
            solve_inside(found, solver)
        },
        |solved: SolvedBrick| {
            flips.extend(&solved.flips)?;
            solved.openings.iter().for_each(|&opening| stats.add(opening));
            for mut face in solved.border {
                face.label += border.labels as u32;
                border.faces.push(face)?;
            }
            border.labels += u64::from(solved.labels);
            if border.labels > u64::from(u32::MAX) {
                let limit = u32::MAX.into();
                return Err(StoreError::TooMany { what: "Openings at brick borders", limit }.into());
            }
            resources.monitor.advance(1);
            Ok(())
        },
    )?;
    Ok(border)
}

/// A brick whose inner components are solved.
struct SolvedBrick {
    flips: Vec<FlipRecord>,
    openings: Vec<Opening>,
    border: Vec<ComponentFace>,
    labels: u32,
}

fn solve_inside(found: LocalComponents, solver: &mut Solver) -> Result<SolvedBrick, PatchError> {
    let mut flips = Vec::new();
    let mut openings = Vec::new();
    for component in found.inner {
        openings.push(solver.solve(&component, &mut |flip| {
            flips.extend(flip.in_bricks());
            Ok(())
        })?);
    }
    Ok(SolvedBrick { flips, openings, border: found.border, labels: found.border_labels })
}

/// Unites the labels that meet at brick borders, and sorts the faces by component.
fn label_faces(
    border: BorderFaces,
    resources: &Resources,
) -> Result<Sorter<ComponentFace>, StoreError> {
    let share = resources.share_bytes / 4;
    let mut labels = Unite::new(resources.scratch, share, border.labels)?;
    let mut once =
        crate::store::SpoolWriter::<ComponentFace>::create(resources.scratch, "faces.spool")?;
    let mut sorted = border.faces.finish()?;
    let mut last: Option<ComponentFace> = None;
    while let Some(face) = sorted.next()? {
        match last {
            // A face between two bricks is seen by both; the record of its owner comes first.
            Some(seen) if seen.face.place == face.face.place => {
                labels.unite(seen.label, face.label)?;
            }
            _ => {
                once.push(face)?;
                last = Some(face);
            }
        }
    }
    let mut labels = labels.finish()?;
    let once = once.finish()?;
    let mut by_component = Sorter::new(resources.scratch, share);
    let mut reader = once.reader(0, once.len());
    while let Some(block) = reader.next_block()? {
        for face in block {
            let label = labels.label(face.label)?;
            by_component.push(ComponentFace { label, by_label: 1, ..*face })?;
        }
    }
    Ok(by_component)
}

/// Solves the components that cross brick borders, one after the other.
fn solve_components(
    faces: Sorter<ComponentFace>,
    resources: &Resources,
    flips: &mut Sorter<FlipRecord>,
    stats: &mut PatchStats,
) -> Result<(), PatchError> {
    let solver = Solver::new(resources.scratch, resources.share_bytes / 4);
    let mut sorted = faces.finish()?;
    let mut component: Option<(u32, Sorter<OddFace>)> = None;
    loop {
        let face = sorted.next()?;
        let label = face.map(|face| face.label);
        if component.as_ref().map(|open| open.0) != label
            && let Some((_, faces)) = component.take()
        {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            let opening = solver.solve_sorted(faces.finish()?, &mut |flip| {
                flip.in_bricks().try_for_each(|record| flips.push(record))
            })?;
            stats.border_components += 1;
            stats.add(opening);
        }
        let Some(face) = face else { return Ok(()) };
        let (_, faces) = component.get_or_insert_with(|| {
            (face.label, Sorter::new(resources.scratch, resources.share_bytes / 8))
        });
        faces.push(face.face)?;
    }
}
