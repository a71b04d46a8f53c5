//! Which ambiguous faces join their inside corners: those in walls, but for what manifoldness asks.
//!
//! In:        the signs of all bricks, with their walled faces.
//! Out:       of a cell, a bit for each face that joins its two inside corners; the others join the
//!            outside ones.
//! Invariant: the decision is the face's, so both cells beside it are told the same. At no face do
//!            both cells have one component that touches it twice: there the dual surface would have
//!            an edge with four polygons. Where that would be, the face is turned, which splits both
//!            components, and no split makes another face worse.
//! Units:     cells.
//! Memory:    13 KiB for each neighbouring brick that a decision needs.
//! Fails:     [`ContourError`].
//! Source:    Schaefer, Ju, Warren 2007, section 3, and Nielson 2004 for the faces that must be
//!            turned. Walls are ours, and so is the order: faces are turned in six rounds, by axis
//!            and by parity, so that no two of a round share a cell and none waits for a far one.

use std::collections::HashMap;

use crate::contour::ContourError;
use crate::contour::mdc::table::{AMBIGUOUS_FACES, touches_twice};
use crate::contour::mdc::workspace::Workspace;
use crate::octree::{BrickKey, CornerBits, EdgeBits, SIDE, SignBricks, face_index};

/// All six faces.
const ALL_FACES: u8 = 0x3f;

/// A brick beyond the one under way.
pub(super) struct Beyond {
    corners: CornerBits,
    walls: Vec<u32>,
}

/// A cell, by its brick and its place there.
#[derive(Clone, Copy)]
struct GridCell {
    key: BrickKey,
    at: [usize; 3],
}

/// Decides about faces of cells in and around one brick.
struct Faces<'w> {
    signs: SignBricks<'w>,
    own: BrickKey,
    corners: &'w CornerBits,
    walls: &'w [u32],
    beyond: &'w mut HashMap<u64, Beyond>,
}

impl Workspace {
    /// Which faces of a cell of brick `key` join their inside corners, and how many of them are not
    /// as the walls would have them.
    pub(super) fn joined_faces(
        &mut self,
        signs: SignBricks,
        key: BrickKey,
        at: [usize; 3],
        mask: u8,
    ) -> Result<(u8, u32), ContourError> {
        let ambiguous = AMBIGUOUS_FACES[usize::from(mask)];
        if ambiguous == 0 {
            return Ok((0, 0));
        }
        let mut faces = Faces {
            signs,
            own: key,
            corners: &self.signs,
            walls: &self.walls,
            beyond: &mut self.beyond,
        };
        let cell = GridCell { key, at };
        let walled = faces.walled(cell, mask)?;
        let joined = faces.joined_before(cell, mask, walled, ROUNDS)?;
        Ok((joined, (joined ^ walled).count_ones()))
    }
}

/// One after the last round.
const ROUNDS: usize = 6;

/// The round in which a face of the cell may be turned.
fn round_of(at: [usize; 3], face: usize) -> usize {
    // Bricks have an even number of cells along a side.
    face / 2 * 2 + (at[face / 2] + face % 2) % 2
}

impl Faces<'_> {
    /// The faces of the cell that walls pass along.
    fn walled(&mut self, cell: GridCell, mask: u8) -> Result<u8, ContourError> {
        let ambiguous = AMBIGUOUS_FACES[usize::from(mask)];
        let mut walled = 0;
        for face in (0..6).filter(|face| ambiguous >> face & 1 == 1) {
            let beyond = self.across(cell, face)?;
            let owner = if face % 2 == 0 { cell } else { beyond };
            if !self.is_listed(face / 2, owner)? {
                continue;
            }
            // Where all six are ambiguous the pieces of the surface would not be apart.
            let other = self.mask(beyond)?;
            let is_checkered =
                [mask, other].iter().any(|mask| AMBIGUOUS_FACES[usize::from(*mask)] == ALL_FACES);
            walled |= u8::from(!is_checkered) << face;
        }
        Ok(walled)
    }

    /// The faces of the cell that are joined when the rounds before `round` are over, by those that
    /// are `walled`.
    fn joined_before(
        &mut self,
        cell: GridCell,
        mask: u8,
        walled: u8,
        round: usize,
    ) -> Result<u8, ContourError> {
        let mut joined = walled;
        for face in 0..6 {
            // What is not touched twice at first never will be.
            if round_of(cell.at, face) < round && touches_twice(mask, walled, face) {
                joined ^= u8::from(self.is_turned(cell, mask, walled, face)?) << face;
            }
        }
        Ok(joined)
    }

    /// Whether a face that the cell, by its walled faces, touches twice is turned.
    fn is_turned(
        &mut self,
        cell: GridCell,
        mask: u8,
        walled: u8,
        face: usize,
    ) -> Result<bool, ContourError> {
        let round = round_of(cell.at, face);
        let beyond = self.across(cell, face)?;
        let other = self.mask(beyond)?;
        let other_walled = self.walled(beyond, other)?;
        if !touches_twice(other, other_walled, face ^ 1) {
            return Ok(false);
        }
        let joined = self.joined_before(cell, mask, walled, round)?;
        let other_joined = self.joined_before(beyond, other, other_walled, round)?;
        Ok(touches_twice(mask, joined, face) && touches_twice(other, other_joined, face ^ 1))
    }

    /// The cell beyond a face.
    fn across(&self, cell: GridCell, face: usize) -> Result<GridCell, ContourError> {
        let GridCell { key, mut at } = cell;
        let (axis, is_up) = (face / 2, face % 2 == 1);
        let is_inside = if is_up { at[axis] + 1 < SIDE } else { at[axis] > 0 };
        if is_inside {
            at[axis] = if is_up { at[axis] + 1 } else { at[axis] - 1 };
            return Ok(GridCell { key, at });
        }
        at[axis] = if is_up { 0 } else { SIDE - 1 };
        let key = if is_up { Some(key.upper(axis)) } else { key.lower(1 << axis) };
        Ok(GridCell { key: key.ok_or_else(|| self.missing())?, at })
    }

    fn mask(&mut self, cell: GridCell) -> Result<u8, ContourError> {
        if cell.key == self.own {
            return Ok(self.corners.cell_mask(cell.at));
        }
        Ok(self.beyond(cell.key)?.corners.cell_mask(cell.at))
    }

    fn is_listed(&mut self, axis: usize, owner: GridCell) -> Result<bool, ContourError> {
        let number = face_index(axis, owner.at);
        if owner.key == self.own {
            return Ok(self.walls.binary_search(&number).is_ok());
        }
        Ok(self.beyond(owner.key)?.walls.binary_search(&number).is_ok())
    }

    fn beyond(&mut self, key: BrickKey) -> Result<&Beyond, ContourError> {
        if !self.beyond.contains_key(&key.0) {
            let found = self.signs.find(key).ok_or_else(|| self.missing())?;
            let view = self.signs.view(found)?;
            let record = view.record()?;
            let mut marks = EdgeBits::default();
            record.each_crossing(|crossing| marks.set(crossing.edge));
            let mut corners = CornerBits::default();
            corners.from_marks(&marks, record.base_inside());
            let walls = record.walls().iter().map(|face| face.to_native()).collect();
            self.beyond.insert(key.0, Beyond { corners, walls });
        }
        self.beyond.get(&key.0).ok_or_else(|| self.missing())
    }

    fn missing(&self) -> ContourError {
        let expected = "a brick beyond a crossed side";
        ContourError::Contradiction { brick: self.own.position(), expected }
    }
}
