//! Tests pairs of a cell and keeps those that intersect.
//!
//! In:         pairs of triangles of a cell.
//! Out:        how many intersect, and the first of them; pairs with a wide triangle, which may be
//!             found again in other cells, go to a sort of all.
//! Fails:      only as [`StoreError`].

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

use crate::defect::{DefectKind, Marks, Meeting, MeetingCounts, Smallest};
use crate::geom::signs::Point;
use crate::store::{Record, Sorter, StoreError};
use crate::verify::intersect::grid::box_of;
use crate::verify::intersect::pair::{Face, Sharing, intersect, meeting_of};

/// A pair of triangles, by the smaller number first.
pub(crate) type Pair = [u64; 2];

/// A pair that may be found in several cells, since one of the two is wide.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct WidePair {
    pub(crate) pair: Pair,
    pub(crate) place: Point,
    /// Its number among [`Meeting::ALL`].
    pub(crate) meeting: u64,
}

impl Record for WidePair {
    type Key = Pair;
    fn key(&self) -> Pair {
        self.pair
    }
}

/// Pairs that may be found in several cells; they are counted when all are there.
pub(crate) type WidePairs = Mutex<Sorter<WidePair>>;

/// Pairs that a worker keeps back before it hands them on.
const MOST_KEPT: usize = 256;
/// What was found.
pub(crate) struct Found {
    pub(crate) pairs: MeetingCounts,
    /// The first pairs of each way to meet, and where the overlaps of their boxes have their
    /// middles.
    pub(crate) places: [Smallest<Pair, Point>; 4],
    /// Triangles that begin in the cell.
    pub(crate) triangles: u64,
}

impl Found {
    pub(crate) fn new() -> Self {
        let places = std::array::from_fn(|_| Smallest::new());
        Self { pairs: MeetingCounts::default(), places, triangles: 0 }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.pairs.add(&other.pairs);
        self.triangles += other.triangles;
        for (own, others) in self.places.iter_mut().zip(&other.places) {
            others.iter().for_each(|&(pair, place)| own.offer(pair, place));
        }
    }

    /// Counts a pair; the number is its way to meet, among [`Meeting::ALL`].
    pub(crate) fn count(&mut self, pair: Pair, place: Point, meeting: u64) {
        let meeting = meeting as usize;
        *self.pairs.of_mut(Meeting::ALL[meeting]) += 1;
        self.places[meeting].offer(pair, place);
    }
}

/// Tests pairs of a cell.
pub(crate) struct Judge<'b> {
    pub(crate) positions: &'b [Point],
    pub(crate) faces: &'b [Face],
    pub(crate) numbers: &'b [u64],
    pub(crate) is_wide: &'b [bool],
    pub(crate) found: Found,
    pub(crate) kept: Vec<WidePair>,
    pub(crate) wide: &'b WidePairs,
    pub(crate) marks: Option<&'b Marks>,
    pub(crate) failure: Option<StoreError>,
}

impl Judge<'_> {
    /// Tests the pairs of a queue and empties it. They all share the same number of corners, so
    /// that the tests take the same way.
    pub(crate) fn judge(&mut self, queue: &mut Vec<(u32, u32, Sharing)>) {
        for (a, b, sharing) in queue.drain(..) {
            let [a, b] = [a as usize, b as usize];
            if intersect(sharing, &self.faces[a], &self.faces[b], self.positions) {
                self.enter(a, b, sharing);
            }
        }
    }

    #[cold]
    fn enter(&mut self, a: usize, b: usize, sharing: Sharing) {
        let corner = |vertex: u32| self.positions[vertex as usize];
        let place = middle_of_overlap([a, b].map(|at| self.faces[at].vertices.map(corner)));
        let meeting = meeting_of(sharing, &self.faces[a], &self.faces[b], self.positions);
        let numbers = [self.numbers[a], self.numbers[b]];
        let pair = [numbers[0].min(numbers[1]), numbers[0].max(numbers[1])];
        self.mark(pair, meeting);
        let meeting = meeting as u64;
        if self.is_wide[a] || self.is_wide[b] {
            self.kept.push(WidePair { pair, place, meeting });
            if self.kept.len() == MOST_KEPT {
                self.hand_on();
            }
        } else {
            self.found.count(pair, place, meeting);
        }
    }

    /// Marks both triangles; copies are told by who compares corners.
    fn mark(&mut self, pair: Pair, meeting: Meeting) {
        let kind = match meeting {
            Meeting::Crossing => DefectKind::IntersectingTriangles,
            Meeting::Overlapping => DefectKind::OverlappingTriangles,
            Meeting::Touching => DefectKind::TouchingTriangles,
            Meeting::Duplicate => return,
        };
        let Some(marks) = self.marks else { return };
        if let Err(error) = marks.triangles(kind, &pair.map(|number| number as u32)) {
            self.failure.get_or_insert(error);
        }
    }

    /// Hands on what it keeps back.
    pub(crate) fn hand_on(&mut self) {
        // The sort does not care in which order they come, nor whether another worker failed.
        let mut wide = self.wide.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = wide.extend(&self.kept) {
            self.failure.get_or_insert(error);
        }
        self.kept.clear();
    }
}

/// The middle of the overlap of two boxes, by which a pair is found again.
#[cold]
fn middle_of_overlap(corners: [[Point; 3]; 2]) -> Point {
    let [[a_low, a_high], [b_low, b_high]] = corners.map(|corners| box_of(&corners));
    std::array::from_fn(|i| a_low[i].max(b_low[i]).midpoint(a_high[i].min(b_high[i])) + 0.0)
}
