//! Two triangles that go through each other or touch.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::defect::place::Point;

/// How two triangles meet, beyond what they share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Meeting {
    /// Each goes through the plane of the other, and they share a segment.
    Crossing,
    /// They lie in one plane and share an area.
    Overlapping,
    /// They have the same three vertices.
    Duplicate,
    /// They touch: nothing of one is on the far side of the other, or they share a point only.
    Touching,
}

impl Meeting {
    /// All ways to meet.
    pub const ALL: [Self; 4] = [Self::Crossing, Self::Overlapping, Self::Duplicate, Self::Touching];
}

/// How many pairs of triangles meet in each way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeetingCounts {
    /// Pairs that go through each other.
    pub crossing: u64,
    /// Pairs that share an area of their plane.
    pub overlapping: u64,
    /// Pairs with the same vertices.
    pub duplicate: u64,
    /// Pairs that touch.
    pub touching: u64,
}

impl MeetingCounts {
    /// The count of one way.
    pub fn of_mut(&mut self, meeting: Meeting) -> &mut u64 {
        match meeting {
            Meeting::Crossing => &mut self.crossing,
            Meeting::Overlapping => &mut self.overlapping,
            Meeting::Duplicate => &mut self.duplicate,
            Meeting::Touching => &mut self.touching,
        }
    }

    /// All pairs.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.crossing + self.overlapping + self.duplicate + self.touching
    }

    /// Adds other counts.
    pub fn add(&mut self, other: &Self) {
        self.crossing += other.crossing;
        self.overlapping += other.overlapping;
        self.duplicate += other.duplicate;
        self.touching += other.touching;
    }
}

/// Two triangles that meet anywhere but in vertices and edges that they share.
///
/// Matters because inside and outside are undefined there: slicers, booleans and simulations fail
/// or guess. Touching counts, since the smallest change makes it a crossing. Repaired by
/// contouring, which places each vertex in a cell of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntersectingTriangles {
    /// Their numbers in the file, from 0, the smaller one first.
    pub triangles: [u64; 2],
    /// The middle of the overlap of their boxes, in model units.
    pub position: [f64; 3],
    /// How they meet.
    pub meeting: Meeting,
}

impl fmt::Display for IntersectingTriangles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.triangles;
        let how = match self.meeting {
            Meeting::Crossing => "cross",
            Meeting::Overlapping => "overlap",
            Meeting::Duplicate => "are one triangle twice,",
            Meeting::Touching => "touch",
        };
        write!(f, "Triangles {a} and {b} {how} near {}", Point(self.position))
    }
}
