//! Where materials meet, or may: edges of the soup in the cells that have crossings of several.
//!
//! Units: cells, from the brick's min corner.

use rkyv::rancor::BoxedError;
use rkyv::{Archive, Deserialize, Serialize};

use crate::octree::brick::{ArchiveSize, BrickError, ROOT_BYTES, out_of_range};
use crate::octree::edge_bits::SIDE;

/// Cells of a brick.
const CELLS: u64 = (SIDE * SIDE * SIDE) as u64;

/// A piece of an edge of the soup in a cell. 28 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct Border {
    /// The cell: x + 32 y + 1024 z.
    pub cell: u16,
    /// Whether triangles of several materials share the edge.
    pub is_shared: bool,
    /// The middle of the piece.
    pub point: [f32; 3],
    /// Along the edge; of unit length.
    pub direction: [f32; 3],
}

impl From<&ArchivedBorder> for Border {
    fn from(archived: &ArchivedBorder) -> Self {
        Self {
            cell: archived.cell.to_native(),
            is_shared: archived.is_shared,
            point: archived.point.map(|c| c.to_native()),
            direction: archived.direction.map(|c| c.to_native()),
        }
    }
}

/// The borders of a brick.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct BorderBrick {
    /// By ascending cell.
    pub borders: Vec<Border>,
}

impl ArchiveSize for BorderBrick {
    fn archive_bytes(&self) -> usize {
        size_of::<ArchivedBorder>() * self.borders.len() + ROOT_BYTES
    }
}

/// Validates a [`BorderBrick`].
///
/// # Errors
/// [`BrickError`] when the bytes are none.
pub fn decode_borders(bytes: &[u8]) -> Result<&ArchivedBorderBrick, BrickError> {
    let kind = "border";
    let brick = rkyv::access::<ArchivedBorderBrick, BoxedError>(bytes)
        .map_err(|source| BrickError::Invalid { kind, source })?;
    check_borders(kind, &brick.borders)?;
    Ok(brick)
}

/// Refuses borders in cells that no brick has.
pub(crate) fn check_borders(
    kind: &'static str,
    borders: &[ArchivedBorder],
) -> Result<(), BrickError> {
    let mut cells = borders.iter().map(|border| u64::from(border.cell.to_native()));
    match cells.find(|cell| *cell >= CELLS) {
        Some(cell) => Err(out_of_range(kind, "border", cell, CELLS)),
        None => Ok(()),
    }
}
