//! Closes one component of odd faces by divide and conquer over planes.
//!
//! A virtual octree is centred on the component's own box, so that nothing depends on where the
//! bricks or the planes of the grid lie. Level by level and axis by axis its centre planes cut the
//! component; the odd faces in a cut are even in number, are paired, and each pair is joined by
//! flipping the edges between them. A flip toggles its two faces in the cut, and two across it,
//! which lie in later cuts.
//!
//! Memory: one bucket of faces per level and axis, each an external sort; of a cut one window of
//! faces at a time, however many there are.
//! Source: Ju 2004, section 4.2; time-forward processing after Chiang et al. 1995.

use crate::octree::Flip;
use crate::patch::Opening;
use crate::patch::faces::OddFace;
use crate::patch::pair::{Place, WINDOW_FACES, along_curve, pair};
use crate::patch::path::{SUB, Step, walk};
use crate::store::{Record, Scratch, Sorted, Sorter, StoreError};

use bytemuck::{Pod, Zeroable};

/// Levels of the largest component: the whole grid at depth 15.
const MAX_LEVELS: usize = 16;

/// An odd face in the frame of its cut, sorted by cut, group and place along a curve. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct CutFace {
    /// Number of its cell on the curve.
    curve: u32,
    cell: [u16; 2],
    plane: u16,
    group: [u16; 2],
    sub: [u8; 2],
}

impl Record for CutFace {
    type Key = (u16, [u16; 2], u32, [u8; 2]);
    fn key(&self) -> Self::Key {
        (self.plane, self.group, self.curve, self.sub)
    }
}

impl CutFace {
    /// Whether both are one face.
    fn is_at(&self, other: &Self) -> bool {
        self.is_beside(other) && self.curve == other.curve
    }

    /// Whether both lie in the same cut of the same node.
    fn is_beside(&self, other: &Self) -> bool {
        (self.plane, self.group) == (other.plane, other.group)
    }
}

/// Solves components; keeps what can be used again.
pub struct Solver {
    scratch: Scratch,
    share_bytes: u64,
}

/// The virtual octree of a component.
#[derive(Clone, Copy)]
struct Frame {
    origin: [i64; 3],
    levels: u32,
}

type Emit<'e> = dyn FnMut(Flip) -> Result<(), StoreError> + 'e;

impl Solver {
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { scratch: scratch.clone(), share_bytes }
    }

    /// Closes a component that lies in memory.
    pub fn solve(&self, faces: &[OddFace], emit: &mut Emit) -> Result<Opening, StoreError> {
        let mut opening = Opening::default();
        faces.iter().for_each(|&face| opening.add(face));
        if let Some(flip) = around_one_edge(faces) {
            emit(flip)?;
            return Ok(opening);
        }
        let mut cuts = Cuts::new(self, &opening);
        faces.iter().try_for_each(|&face| cuts.insert(face))?;
        cuts.run(emit)?;
        Ok(opening)
    }

    /// Closes a component that comes as a sorted stream.
    pub fn solve_sorted(
        &self,
        mut faces: Sorted<OddFace>,
        emit: &mut Emit,
    ) -> Result<Opening, StoreError> {
        let mut opening = Opening::default();
        let mut kept = Sorter::<OddFace>::new(&self.scratch, self.share_bytes / 2);
        while let Some(face) = faces.next()? {
            opening.add(face);
            kept.push(face)?;
        }
        let mut cuts = Cuts::new(self, &opening);
        let mut faces = kept.finish()?;
        while let Some(face) = faces.next()? {
            cuts.insert(face)?;
        }
        cuts.run(emit)?;
        Ok(opening)
    }
}

impl Opening {
    /// Takes a face, and the cells on both sides of it, into the box.
    fn add(&mut self, face: OddFace) {
        let at = face.at();
        let mut lo = at;
        lo[face.axis()] -= 1;
        if self.odd_faces == 0 {
            (self.lo_cell, self.hi_cell) = (lo, at);
        }
        self.odd_faces += 1;
        self.lo_cell = std::array::from_fn(|a| self.lo_cell[a].min(lo[a]));
        self.hi_cell = std::array::from_fn(|a| self.hi_cell[a].max(at[a]));
    }
}

/// The most frequent component by far: four faces around one edge. What the cuts would do, at once.
fn around_one_edge(faces: &[OddFace]) -> Option<Flip> {
    let [first, _, _, _] = faces else { return None };
    let axis = (0..3).find(|&axis| faces.iter().all(|face| face.axis() != axis))?;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut at = first.at();
    for across in [u, v] {
        at[across] = faces.iter().map(|face| face.at()[across]).max()?;
    }
    let mut wanted: [u64; 4] = std::array::from_fn(|i| {
        let (normal, other) = if i < 2 { (u, v) } else { (v, u) };
        let mut corner = at;
        corner[other] = corner[other].wrapping_sub(i as u32 % 2);
        OddFace::new(normal, corner, [0; 2]).place
    });
    let mut found: [u64; 4] = std::array::from_fn(|i| faces[i].place);
    wanted.sort_unstable();
    found.sort_unstable();
    if wanted != found {
        return None;
    }
    Some(Flip { axis, at, offset: middle_offset(faces, axis, at) })
}

/// Where the way between the two faces of the first cut crosses the edge.
fn middle_offset(faces: &[OddFace], axis: usize, at: [u32; 3]) -> u16 {
    let normal = (0..3).find(|&a| a != axis).unwrap_or(0);
    let mut ends =
        faces.iter().filter(|face| face.axis() == normal).map(|face| face.place_in_plane());
    let (Some(from), Some(to)) = (ends.next(), ends.next()) else { return 1 << 15 };
    let mut offset = 1 << 15;
    let done: Result<(), StoreError> = walk(from, to, |step| {
        offset = step.offset;
        Ok(())
    });
    debug_assert!(done.is_ok() && at[normal] > 0);
    offset
}

impl OddFace {
    /// The pierced place in the face's plane, in 1/256 cells along the axes after its normal.
    fn place_in_plane(self) -> Place {
        let at = self.at();
        [1, 2].map(|step| {
            i64::from(at[(self.axis() + step) % 3]) * SUB + i64::from(self.sub[step - 1])
        })
    }
}

/// The buckets of a component: one per level and axis, in the order in which they are cut.
struct Cuts {
    frame: Frame,
    buckets: Vec<Option<Sorter<CutFace>>>,
    scratch: Scratch,
    bucket_share: u64,
}

impl Cuts {
    fn new(solver: &Solver, opening: &Opening) -> Self {
        let extent: [u32; 3] = std::array::from_fn(|a| opening.hi_cell[a] + 1 - opening.lo_cell[a]);
        let longest = extent.into_iter().max().unwrap_or(1).max(2);
        let levels = longest.next_power_of_two().trailing_zeros();
        let origin = std::array::from_fn(|a| {
            i64::from(opening.lo_cell[a] + extent[a] / 2) - (1_i64 << (levels - 1))
        });
        assert!(levels as usize <= MAX_LEVELS, "the grid has at most 2^15 cells a side");
        let buckets = (0..3 * levels).map(|_| None).collect();
        let bucket_share = solver.share_bytes / 2 / u64::from(3 * levels);
        let frame = Frame { origin, levels };
        Self { frame, buckets, scratch: solver.scratch.clone(), bucket_share }
    }

    /// Puts a face into the bucket of the cut that it lies in.
    fn insert(&mut self, face: OddFace) -> Result<(), StoreError> {
        let at = face.at();
        let relative: [u32; 3] =
            std::array::from_fn(|a| (i64::from(at[a]) - self.frame.origin[a]) as u32);
        let axis = face.axis();
        let plane = relative[axis];
        let levels = self.frame.levels;
        assert!(plane > 0 && plane < 1 << levels, "odd faces lie inside the frame");
        let level = levels - 1 - plane.trailing_zeros();
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        // Axes that were cut at this level already separate halves, the others whole nodes.
        let group = across.map(|a| (relative[a] >> (levels - level - u32::from(a < axis))) as u16);
        let cell = across.map(|a| relative[a]);
        let curve = along_curve(cell, levels);
        let (plane, cell) = (plane as u16, cell.map(|c| c as u16));
        let record = CutFace { curve, cell, plane, group, sub: face.sub };
        let bucket = &mut self.buckets[level as usize * 3 + axis];
        let (scratch, share) = (&self.scratch, self.bucket_share);
        bucket.get_or_insert_with(|| Sorter::new(scratch, share)).push(record)
    }

    /// Cuts level by level, axis by axis.
    fn run(&mut self, emit: &mut Emit) -> Result<(), StoreError> {
        let mut window = Vec::new();
        for number in 0..self.buckets.len() {
            let Some(bucket) = self.buckets[number].take() else { continue };
            let mut sorted = bucket.finish()?;
            let mut next = sorted.next()?;
            while let Some(face) = next {
                let mut count = 0;
                while next.is_some_and(|other| other.is_at(&face)) {
                    count += 1;
                    next = sorted.next()?;
                }
                // Toggled twice is not odd.
                if count % 2 == 1 {
                    window.push(face);
                }
                let goes_on = next.is_some_and(|other| other.is_beside(&face));
                if window.len() == WINDOW_FACES || !goes_on {
                    self.close_window(number % 3, &mut window, emit)?;
                }
            }
        }
        Ok(())
    }

    /// Pairs odd faces of one node's cut and flips the edges on the ways between them.
    fn close_window(
        &mut self,
        axis: usize,
        window: &mut Vec<CutFace>,
        emit: &mut Emit,
    ) -> Result<(), StoreError> {
        let places: Vec<Place> = window
            .iter()
            .map(|f| [0, 1].map(|i| i64::from(f.cell[i]) * SUB + i64::from(f.sub[i])))
            .collect();
        let plane = window.first().map_or(0, |face| u32::from(face.plane));
        window.clear();
        for (a, b) in pair(&places) {
            walk(places[a], places[b], |step| self.flip(axis, plane, step, emit))?;
        }
        Ok(())
    }

    /// Flips an edge in a cut: emits it, and toggles the two faces across the cut.
    fn flip(
        &mut self,
        axis: usize,
        plane: u32,
        step: Step,
        emit: &mut Emit,
    ) -> Result<(), StoreError> {
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        let (normal, edge_axis) = (across[step.along], across[1 - step.along]);
        let mut relative = [0; 3];
        relative[axis] = i64::from(plane);
        relative[normal] = step.line;
        relative[edge_axis] = step.row;
        let at = std::array::from_fn(|a| (relative[a] + self.frame.origin[a]) as u32);
        emit(Flip { axis: edge_axis, at, offset: step.offset })?;
        let along_edge = (step.offset >> 8).max(1) as u8;
        for (below, near) in [(0, 1), (1, 255)] {
            let mut corner = at;
            corner[axis] -= below;
            // The patch enters the face through the flipped edge.
            let sub =
                if (normal + 1) % 3 == axis { [near, along_edge] } else { [along_edge, near] };
            self.insert(OddFace::new(normal, corner, sub))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    /// The faces on which an edge hangs.
    fn faces_of(flip: &Flip) -> [(usize, [u32; 3]); 4] {
        let (u, v) = ((flip.axis + 1) % 3, (flip.axis + 2) % 3);
        let down = |a: usize| {
            let mut at = flip.at;
            at[a] -= 1;
            at
        };
        // A face with normal u spans the edge's axis and v.
        [(u, flip.at), (u, down(v)), (v, flip.at), (v, down(u))]
    }

    fn odd_faces(edges: &HashSet<(usize, [u32; 3])>) -> HashSet<(usize, [u32; 3])> {
        let mut odd = HashSet::new();
        for &(axis, at) in edges {
            for face in faces_of(&Flip { axis, at, offset: 0 }) {
                if !odd.remove(&face) {
                    odd.insert(face);
                }
            }
        }
        odd
    }

    fn solve(edges: &HashSet<(usize, [u32; 3])>, share_bytes: u64) -> Vec<Flip> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let solver = Solver::new(&scratch, share_bytes);
        let mut faces: Vec<OddFace> =
            odd_faces(edges).iter().map(|&(axis, at)| OddFace::new(axis, at, [128; 2])).collect();
        faces.sort_unstable_by_key(Record::key);
        let (mut flips, mut streamed) = (Vec::new(), Vec::new());
        if !faces.is_empty() {
            let mut emit = |flip| {
                flips.push(flip);
                Ok(())
            };
            let opening = solver.solve(&faces, &mut emit).expect("solving works");
            let mut sorter = Sorter::new(&scratch, share_bytes);
            sorter.extend(&faces).expect("pushing works");
            let sorted = sorter.finish().expect("sorting works");
            let mut emit = |flip| {
                streamed.push(flip);
                Ok(())
            };
            let again = solver.solve_sorted(sorted, &mut emit).expect("solving works");
            assert_eq!((opening, &flips), (again, &streamed), "a stream is solved like a list");
        }
        flips
    }

    fn residual(edges: &HashSet<(usize, [u32; 3])>, flips: &[Flip]) -> usize {
        let mut closed = edges.clone();
        for flip in flips {
            if !closed.remove(&(flip.axis, flip.at)) {
                closed.insert((flip.axis, flip.at));
            }
        }
        odd_faces(&closed).len()
    }

    fn edges(count: usize, side: u32) -> impl Strategy<Value = HashSet<(usize, [u32; 3])>> {
        proptest::collection::hash_set((0..3_usize, proptest::array::uniform3(3..side)), 1..count)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn random_marks_are_closed(edges in edges(300, 60)) {
            prop_assert_eq!(residual(&edges, &solve(&edges, 1 << 20)), 0);
        }

        #[test]
        fn the_answer_does_not_depend_on_the_share(edges in edges(2000, 30)) {
            prop_assert_eq!(solve(&edges, 16 << 10), solve(&edges, 1 << 24));
        }

        #[test]
        fn the_answer_moves_with_the_component(
            edges in edges(40, 12), shift in proptest::array::uniform3(0..50_u32),
        ) {
            let moved = edges
                .iter()
                .map(|&(axis, at)| (axis, std::array::from_fn(|a| at[a] + shift[a])))
                .collect();
            let back: Vec<Flip> = solve(&moved, 1 << 20)
                .into_iter()
                .map(|f| Flip { at: std::array::from_fn(|a| f.at[a] - shift[a]), ..f })
                .collect();
            prop_assert_eq!(solve(&edges, 1 << 20), back);
        }
    }

    #[test]
    fn a_cut_with_many_faces_is_closed_alike_from_disk() {
        // A slab of noise, whose first cut goes through its middle.
        let mut state = 1_u64;
        let mut below = |count: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) % count) as u32
        };
        let edges: HashSet<(usize, [u32; 3])> = (0..60_000)
            .map(|_| (below(3) as usize, [3 + below(3), 3 + below(220), 3 + below(220)]))
            .collect();
        let in_first_cut = odd_faces(&edges).iter().filter(|(a, at)| *a == 0 && at[0] == 4).count();
        assert!(in_first_cut > 2 * WINDOW_FACES, "{in_first_cut} faces");
        let flips = solve(&edges, 1 << 28);
        assert_eq!(residual(&edges, &flips), 0);
        assert!(flips == solve(&edges, 16 << 10), "other flips from disk");
    }

    #[test]
    fn one_missing_or_stray_mark_is_flipped_back() {
        for axis in 0..3 {
            let edges = HashSet::from([(axis, [9, 8, 7])]);
            let flips = solve(&edges, 1 << 20);
            assert_eq!(flips.len(), 1);
            assert_eq!((flips[0].axis, flips[0].at), (axis, [9, 8, 7]));
        }
    }
}
