//! The records of bricks: what lies in a brick file, as rkyv archives.
//!
//! One kind per stage that writes them: [`HitBrick`] (scan), [`SignBrick`] (sign), and
//! [`crate::octree::CellBrick`] (contour; that of marching cubes is in `edge_brick`). All are
//! validated before they are read; the store has checked their hash before that.
//!
//! Units: positions and plane offsets in lattice units from the brick's min corner.

use rkyv::rancor::{BoxedError, Strategy};
use rkyv::ser::Serializer;
use rkyv::ser::allocator::ArenaHandle;
use rkyv::ser::sharing::Share;
use rkyv::util::AlignedVec;
use rkyv::{Archive, Deserialize, Serialize};

use crate::octree::ambiguous::OWN_FACES;
use crate::octree::border::{ArchivedBorder, Border, check_borders};
use crate::octree::edge_bits::AXIS_EDGES;

/// Most hits that are kept of one edge: first, last, and one in between.
pub const MAX_HITS: usize = 3;
/// In [`Crossing::plane`]: no plane, the crossing belongs to a patch.
pub const PATCH: u32 = 1 << 31;
/// In [`Crossing::plane`]: a plane number that names none.
pub const NO_PLANE: u32 = PATCH - 1;

/// A record that is not what its kind demands.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BrickError {
    /// The archive does not validate.
    #[error("Not a {kind} brick")]
    Invalid {
        /// Which kind was expected.
        kind: &'static str,
        /// What the validation found.
        source: BoxedError,
    },
    /// The brick is as it was hit, and its hits are missing.
    #[error("A sign brick is as it was hit, and there are no hits of it")]
    NoHits,
    /// A field is out of its range.
    #[error("A {kind} brick has {field} {found}, the limit is {limit}")]
    OutOfRange {
        /// Which kind.
        kind: &'static str,
        /// Which field.
        field: &'static str,
        /// Its value.
        found: u64,
        /// The limit.
        limit: u64,
    },
}

/// The plane of a source triangle, with its origin. 32 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct SourcePlane {
    /// `normal . p = offset` for points of the plane, lattice units from the brick's min corner.
    pub offset: f64,
    /// Unit normal from the original corners; zero when the triangle has none.
    pub normal: [f32; 3],
    /// Number of the source triangle.
    pub source: u32,
    /// Part number.
    pub part: u32,
    /// Material with its bits, as in [`crate::octree::SoupTriangle`].
    pub material: u32,
}

impl From<&ArchivedSourcePlane> for SourcePlane {
    fn from(archived: &ArchivedSourcePlane) -> Self {
        Self {
            offset: archived.offset.to_native(),
            normal: [0, 1, 2].map(|a| archived.normal[a].to_native()),
            source: archived.source.to_native(),
            part: archived.part.to_native(),
            material: archived.material.to_native(),
        }
    }
}

/// An edge that was hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct HitEdge {
    /// Edge number (17 bits), count class (2 bits at 17), number of kept hits (2 bits at 19), and
    /// [`Self::signed_sum`] (11 bits at 21).
    pub bits: u32,
}

impl From<&ArchivedHitEdge> for HitEdge {
    #[inline]
    fn from(archived: &ArchivedHitEdge) -> Self {
        Self { bits: archived.bits.to_native() }
    }
}

/// Where the signed sum begins in the bits of an edge that was hit.
const SIGNED_SUM: u32 = 21;
/// Sums that are larger, up or down, are kept as this one.
const MOST_SIGNED_SUM: i16 = 1023;

impl HitEdge {
    /// Packs an edge number, a count class and a number of kept hits.
    #[must_use]
    pub fn new(edge: u32, class: u32, kept: usize, signed_sum: i16) -> Self {
        let sum = i32::from(signed_sum.clamp(-MOST_SIGNED_SUM, MOST_SIGNED_SUM));
        Self { bits: edge | class << 17 | (kept as u32) << 19 | (sum as u32) << SIGNED_SUM }
    }

    /// Sum over all hits: +1 where the triangle faces up the axis, -1 where down; clamped.
    #[must_use]
    pub const fn signed_sum(self) -> i16 {
        (self.bits as i32 >> SIGNED_SUM) as i16
    }

    /// The count class after one more hit. 0, 1, then 2 (even, more than none), 3 (odd, more than
    /// one), 2, 3, ...: the low bit stays the exact parity.
    #[must_use]
    pub const fn next_class(class: u32) -> u32 {
        match class {
            0 => 1,
            1 | 3 => 2,
            _ => 3,
        }
    }

    /// The edge number.
    #[must_use]
    pub const fn edge(self) -> u32 {
        self.bits & 0x1_ffff
    }

    /// The count class.
    #[must_use]
    pub const fn class(self) -> u32 {
        self.bits >> 17 & 3
    }

    /// How many hits are kept.
    #[must_use]
    pub const fn kept(self) -> usize {
        (self.bits >> 19 & 3) as usize
    }
}

/// What scan conversion leaves of a brick.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct HitBrick {
    /// Edges with hits, by ascending edge number.
    pub edges: Vec<HitEdge>,
    /// Plane numbers of the kept hits, edge after edge, from the lower end of the edge up.
    pub hits: Vec<u32>,
    /// Planes of the triangles that hit, by ascending source number.
    pub planes: Vec<SourcePlane>,
}

/// A marked edge after the signs are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Archive, Serialize, Deserialize)]
pub struct Crossing {
    /// The edge number.
    pub edge: u32,
    /// Plane number in the brick; or [`PATCH`] and the offset on the edge in 1/65536.
    pub plane: u32,
}

/// What sign generation leaves of a brick.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct SignBrick {
    /// Whether the brick's min corner is inside.
    pub base_inside: bool,
    /// Marked edges by ascending edge number; the signs of all corners follow from them.
    pub crossings: Vec<Crossing>,
    /// The planes that the crossings use.
    pub planes: Vec<SourcePlane>,
    /// Where materials may meet, by ascending cell.
    pub borders: Vec<Border>,
    /// Ambiguous faces ([`crate::octree::face_index`]) that a wall passes along, ascending.
    pub walls: Vec<u32>,
}

type BrickSerializer<'a> = Strategy<Serializer<AlignedVec, ArenaHandle<'a>, Share>, BoxedError>;

/// A brick whose archive has a size that is known before.
pub trait ArchiveSize {
    /// About the size of the archive; not less.
    fn archive_bytes(&self) -> usize;
}

/// Room for what an archive has besides its lists: their heads, the root, and gaps.
pub(crate) const ROOT_BYTES: usize = 96;

impl ArchiveSize for HitBrick {
    fn archive_bytes(&self) -> usize {
        4 * (self.edges.len() + self.hits.len()) + 32 * self.planes.len() + ROOT_BYTES
    }
}

impl ArchiveSize for SignBrick {
    fn archive_bytes(&self) -> usize {
        let borders = size_of::<ArchivedBorder>() * self.borders.len();
        8 * self.crossings.len()
            + 32 * self.planes.len()
            + borders
            + 4 * self.walls.len()
            + ROOT_BYTES
    }
}

/// The bytes of an archive, aligned as it asks.
pub type RecordBytes = AlignedVec;

/// The archive of a brick.
pub fn encode<B>(brick: &B) -> RecordBytes
where
    B: ArchiveSize + for<'a> Serialize<BrickSerializer<'a>>,
{
    // Asked for at once: an archive that grows by doubling takes up to three times its size.
    let room = AlignedVec::with_capacity(brick.archive_bytes());
    rkyv::api::high::to_bytes_in::<_, BoxedError>(brick, room).expect("plain vectors serialise")
}

pub(crate) fn out_of_range(
    kind: &'static str,
    field: &'static str,
    found: u64,
    limit: u64,
) -> BrickError {
    BrickError::OutOfRange { kind, field, found, limit }
}

/// Validates a [`HitBrick`].
///
/// # Errors
/// [`BrickError`] when the bytes are none.
pub fn decode_hits(bytes: &[u8]) -> Result<&ArchivedHitBrick, BrickError> {
    let kind = "hit";
    let brick = rkyv::access::<ArchivedHitBrick, BoxedError>(bytes)
        .map_err(|source| BrickError::Invalid { kind, source })?;
    // Without a way out of the loops they run over many at once.
    let (mut last, mut kept) = (0, 0_u32);
    for edge in brick.edges.iter().map(HitEdge::from) {
        last = edge.edge().max(last);
        kept += edge.kept() as u32;
    }
    if last >= 3 * AXIS_EDGES {
        return Err(out_of_range(kind, "edge", last.into(), (3 * AXIS_EDGES).into()));
    }
    if kept as usize != brick.hits.len() {
        return Err(out_of_range(kind, "kept hits", kept as u64, brick.hits.len() as u64));
    }
    let planes = brick.planes.len() as u64;
    let last = brick.hits.iter().fold(0, |last, hit| hit.to_native().max(last)).into();
    if !brick.hits.is_empty() && last >= planes {
        return Err(out_of_range(kind, "plane", last, planes));
    }
    Ok(brick)
}

/// Validates a [`SignBrick`].
///
/// # Errors
/// [`BrickError`] when the bytes are none.
pub fn decode_signs(bytes: &[u8]) -> Result<&ArchivedSignBrick, BrickError> {
    let kind = "sign";
    let brick = rkyv::access::<ArchivedSignBrick, BoxedError>(bytes)
        .map_err(|source| BrickError::Invalid { kind, source })?;
    let planes = brick.planes.len() as u64;
    for crossing in brick.crossings.iter() {
        let (edge, plane) = (crossing.edge.to_native(), crossing.plane.to_native());
        if edge >= 3 * AXIS_EDGES {
            return Err(out_of_range(kind, "edge", edge.into(), (3 * AXIS_EDGES).into()));
        }
        if plane & PATCH == 0 && u64::from(plane) >= planes {
            return Err(out_of_range(kind, "plane", plane.into(), planes));
        }
    }
    check_borders(kind, &brick.borders)?;
    match brick.walls.iter().find(|face| face.to_native() >= OWN_FACES) {
        Some(face) => Err(out_of_range(kind, "face", face.to_native().into(), OWN_FACES.into())),
        None => Ok(brick),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_keep_their_parity_when_they_saturate() {
        let mut class = 0;
        for hits in 1..10 {
            class = HitEdge::next_class(class);
            assert_eq!(class & 1, hits & 1, "{hits} hits");
            assert_eq!(class >> 1, u32::from(hits > 1), "{hits} hits");
        }
    }

    #[test]
    fn bricks_read_back_and_damaged_ones_are_refused() {
        let brick = HitBrick {
            edges: vec![HitEdge::new(5, 1, 1, -1), HitEdge::new(700, 3, 3, 1)],
            hits: vec![0, 1, 0, 1],
            planes: vec![SourcePlane::default(), SourcePlane { source: 9, ..Default::default() }],
        };
        let bytes = encode(&brick);
        let back = decode_hits(&bytes).expect("our own bytes are valid");
        assert_eq!(back.edges.len(), 2);
        assert_eq!(back.planes[1].source.to_native(), 9);
        let wrong = HitBrick { hits: vec![0, 1, 0, 2], ..brick };
        let error = decode_hits(&encode(&wrong)).map(|_| ()).expect_err("plane 2 does not exist");
        assert!(matches!(error, BrickError::OutOfRange { field: "plane", .. }));
        assert!(decode_hits(&bytes[..bytes.len() - 8]).is_err());
    }
}
