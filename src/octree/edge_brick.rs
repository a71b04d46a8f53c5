//! The record of a brick whose vertices lie on edges, as marching cubes leaves it.
//!
//! Units: places on an edge in lattice units from its lower end.

use rkyv::rancor::BoxedError;
use rkyv::{Archive, Deserialize, Serialize};

use crate::octree::{ArchiveSize, BrickError};

/// What marching cubes leaves of a brick: its cells, and the vertices on the edges that it owns.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct EdgeBrick {
    /// Cell number x + 32y + 1024z (15 bits), corner mask (8 bits at 15); ascending.
    pub cells: Vec<u32>,
    /// Where the surface crosses the cells' own edges (those that leave their min corner), cell
    /// after cell, axis after axis.
    pub places: Vec<u32>,
}

/// Room for the heads of two lists, the root, and gaps.
const ROOT_BYTES: usize = 64;

impl ArchiveSize for EdgeBrick {
    fn archive_bytes(&self) -> usize {
        4 * (self.cells.len() + self.places.len()) + ROOT_BYTES
    }
}

impl EdgeBrick {
    /// The axes along which an own edge of a cell with this corner mask is crossed: bit 0 is x.
    #[must_use]
    pub const fn own_axes(mask: u8) -> u8 {
        let min = (mask & 1).wrapping_neg();
        let differs = mask ^ min;
        differs >> 1 & 1 | differs >> 1 & 2 | differs >> 2 & 4
    }
}

/// Validates an [`EdgeBrick`].
///
/// # Errors
/// [`BrickError`] when the bytes are none.
pub fn decode_edges(bytes: &[u8]) -> Result<&ArchivedEdgeBrick, BrickError> {
    let kind = "edge";
    let out_of_range = |field, found, limit| BrickError::OutOfRange { kind, field, found, limit };
    let brick = rkyv::access::<ArchivedEdgeBrick, BoxedError>(bytes)
        .map_err(|source| BrickError::Invalid { kind, source })?;
    let mut own = 0;
    for cell in brick.cells.iter().map(|cell| cell.to_native()) {
        if cell >> 23 != 0 {
            return Err(out_of_range("cell", cell.into(), 1 << 23));
        }
        own += u64::from(EdgeBrick::own_axes((cell >> 15) as u8).count_ones());
    }
    let places = brick.places.len() as u64;
    if own != places { Err(out_of_range("places", places, own)) } else { Ok(brick) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::encode;

    #[test]
    fn a_brick_with_a_place_too_many_is_refused() {
        // The min corner inside: crossed along all axes. All but it: the same.
        let brick = EdgeBrick { cells: vec![1 << 15, 7 | 0xfe << 15], places: vec![5; 6] };
        let bytes = encode(&brick);
        let back = decode_edges(&bytes).expect("our own bytes are valid");
        assert_eq!((back.cells.len(), back.places.len()), (2, 6));
        let wrong = EdgeBrick { places: vec![5; 7], ..brick };
        let error = decode_edges(&encode(&wrong)).map(|_| ()).expect_err("one too many");
        assert!(matches!(
            error,
            BrickError::OutOfRange { field: "places", found: 7, limit: 6, .. }
        ));
        assert!(decode_edges(&bytes[..bytes.len() - 8]).is_err());
    }

    #[test]
    fn own_axes_are_those_whose_corner_differs_from_the_min_corner() {
        assert_eq!(EdgeBrick::own_axes(0b0000_0001), 0b111);
        assert_eq!(EdgeBrick::own_axes(0b0000_0011), 0b110);
        assert_eq!(EdgeBrick::own_axes(0b0001_0000), 0b100);
        assert_eq!(EdgeBrick::own_axes(0b1110_1000), 0);
    }
}
