//! Ambiguous faces that a component of both cells beside them touches twice: they are flipped.
//!
//! Source: Schaefer, Ju, Warren 2007, section 3; see [`table`](crate::contour::mdc::table).

use crate::contour::ContourError;
use crate::contour::mdc::table::{NO_FACE, TWO_SIDED};
use crate::contour::mdc::vertices::Workspace;
use crate::octree::{BrickKey, CornerBits, EdgeBits, SIDE, decode_signs};
use crate::store::BrickFile;

impl Workspace {
    /// Whether one component touches an ambiguous face twice, and so does one of the cell beyond.
    pub(super) fn is_flipped(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        at: [usize; 3],
        mask: u8,
    ) -> Result<bool, ContourError> {
        let face = TWO_SIDED[usize::from(mask)];
        if face == NO_FACE {
            return Ok(false);
        }
        let (axis, high) = (usize::from(face / 2), face % 2 == 1);
        let mut cell = at;
        let inside = if high { at[axis] + 1 < SIDE } else { at[axis] > 0 };
        let other = if inside {
            cell[axis] = if high { at[axis] + 1 } else { at[axis] - 1 };
            self.mask_at(cell)
        } else {
            cell[axis] = if high { 0 } else { SIDE - 1 };
            let neighbour = if high { Some(key.upper(axis)) } else { key.lower(1 << axis) };
            self.mask_beyond(signs, key, neighbour, cell)?
        };
        Ok(TWO_SIDED[usize::from(other)] == face ^ 1)
    }

    fn mask_beyond(
        &mut self,
        signs: &BrickFile,
        key: BrickKey,
        neighbour: Option<BrickKey>,
        cell: [usize; 3],
    ) -> Result<u8, ContourError> {
        let missing = || ContourError::Contradiction {
            brick: key.position(),
            expected: "a brick beyond a crossed side",
        };
        let neighbour = neighbour.ok_or_else(missing)?;
        if let Some(corners) = self.beyond.get(&neighbour.0) {
            return Ok(corners.cell_mask(cell));
        }
        let view = signs.view(signs.find(neighbour.0).ok_or_else(missing)?)?;
        let record = decode_signs(&view)?;
        let mut marks = EdgeBits::default();
        record.crossings.iter().for_each(|crossing| marks.set(crossing.edge.to_native()));
        let mut corners = CornerBits::default();
        corners.from_marks(&marks, record.base_inside);
        let mask = corners.cell_mask(cell);
        self.beyond.insert(neighbour.0, corners);
        Ok(mask)
    }
}
