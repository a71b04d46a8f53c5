//! The bricks of signs, some of which say no more than that their crossings are the hits of the brick.
//!
//! In:         the files that scan and sign generation leave.
//! Out:        base sign, crossings, planes, borders and walls of each brick, wherever they lie.
//! Invariant:  of a brick that is [`AS_HIT`] each hit edge is marked and has one hit, so edges and hits go
//!             together one by one.
//! Units:      as [`SignBrick`](crate::octree::SignBrick).
//! Memory:     the two records of a brick, mapped.
//! Fails:      [`SignBrickError`]: a record cannot be read, or the hits of a brick are missing.

use rkyv::rend::u32_le;

use crate::octree::brick::ArchivedSourcePlane;
use crate::octree::{
    ArchivedBorder, ArchivedHitBrick, ArchivedSignBrick, BrickError, BrickKey, Crossing, HitEdge,
    decode_hits, decode_signs,
};
use crate::store::{BrickFile, StoreError, View};

/// Flag in the directory of signs: crossings and planes are those of the record of hits.
pub const AS_HIT: u32 = 1;

/// Why a brick of signs cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SignBrickError {
    /// The store fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A record is not what its stage writes.
    #[error(transparent)]
    Brick(#[from] BrickError),
    /// The brick is as it was hit, and there are no hits of it.
    #[error("Brick {brick:?}: expected one hit of every edge, found other hits or none")]
    NoHits {
        /// Position of the brick.
        brick: [u32; 3],
    },
}

/// All bricks of signs.
#[derive(Clone, Copy)]
pub struct SignBricks<'f> {
    signs: &'f BrickFile,
    hits: Option<&'f BrickFile>,
}

impl<'f> SignBricks<'f> {
    /// The bricks of `signs`, made from `hits`.
    #[must_use]
    pub fn new(signs: &'f BrickFile, hits: &'f BrickFile) -> Self {
        Self { signs, hits: Some(hits) }
    }

    /// Bricks of which none is as it was hit.
    #[must_use]
    pub fn whole(signs: &'f BrickFile) -> Self {
        Self { signs, hits: None }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.signs.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.signs.is_empty()
    }

    /// The key of a brick.
    #[must_use]
    pub fn key(&self, number: usize) -> BrickKey {
        BrickKey(self.signs.directory()[number].key)
    }

    /// The number of the brick with this key.
    #[must_use]
    pub fn find(&self, key: BrickKey) -> Option<usize> {
        self.signs.find(key.0)
    }

    /// The length of a brick's records.
    #[must_use]
    pub fn record_bytes(&self, number: usize) -> u64 {
        let hits = self.hits_of(number).map_or(0, |(hits, number)| hits.record_bytes(number));
        self.signs.record_bytes(number) + hits
    }

    /// The record of hits of a brick that is as it was hit.
    fn hits_of(&self, number: usize) -> Option<(&'f BrickFile, usize)> {
        let entry = self.signs.directory()[number];
        let hits = self.hits.filter(|_| entry.flags & AS_HIT != 0)?;
        Some((hits, hits.find(entry.key)?))
    }

    /// Shows a brick.
    ///
    /// # Errors
    /// [`SignBrickError`].
    pub fn view(&self, number: usize) -> Result<SignView, SignBrickError> {
        let signs = self.signs.view(number)?;
        let brick = self.key(number).position();
        let hits = match self.hits_of(number) {
            Some((hits, number)) => Some(hits.view(number)?),
            None if self.signs.directory()[number].flags & AS_HIT != 0 => {
                return Err(SignBrickError::NoHits { brick });
            }
            None => None,
        };
        Ok(SignView { signs, hits, brick })
    }
}

/// The bytes of a brick.
pub struct SignView {
    signs: View,
    hits: Option<View>,
    brick: [u32; 3],
}

impl SignView {
    /// What they say, validated.
    ///
    /// # Errors
    /// [`SignBrickError`].
    pub fn record(&self) -> Result<SignRecord<'_>, SignBrickError> {
        let signs = decode_signs(&self.signs)?;
        let hits = self.hits.as_ref().map(|view| decode_hits(view)).transpose()?;
        if hits.is_some_and(|hits| hits.hits.len() != hits.edges.len()) {
            return Err(SignBrickError::NoHits { brick: self.brick });
        }
        Ok(SignRecord { signs, hits })
    }
}

/// A brick of signs.
#[derive(Clone, Copy)]
pub struct SignRecord<'v> {
    signs: &'v ArchivedSignBrick,
    hits: Option<&'v ArchivedHitBrick>,
}

impl<'v> SignRecord<'v> {
    /// Whether the brick's min corner is inside.
    #[must_use]
    pub fn base_inside(&self) -> bool {
        self.signs.base_inside
    }

    /// The planes that crossings name.
    #[must_use]
    pub fn planes(&self) -> &'v [ArchivedSourcePlane] {
        self.hits.map_or(&self.signs.planes, |hits| &hits.planes)
    }

    /// Where materials may meet, by ascending cell.
    #[must_use]
    pub fn borders(&self) -> &'v [ArchivedBorder] {
        &self.signs.borders
    }

    /// Ambiguous faces that a wall passes along, ascending.
    #[must_use]
    pub fn walls(&self) -> &'v [u32_le] {
        &self.signs.walls
    }

    /// Shows the crossings by ascending edge number.
    #[inline]
    pub fn each_crossing(&self, visit: impl FnMut(Crossing)) {
        self.each_crossing_within([0, u32::MAX], visit);
    }

    /// The same of those with edge numbers from `first` up to before `end`.
    #[inline]
    pub fn each_crossing_within(&self, [first, end]: [u32; 2], mut visit: impl FnMut(Crossing)) {
        if let Some(hits) = self.hits {
            let edge_of = |bits: u32_le| HitEdge { bits: bits.to_native() }.edge();
            let start = hits.edges.partition_point(|edge| edge_of(edge.bits) < first);
            let edges = hits.edges[start..].iter().map(|edge| edge_of(edge.bits));
            for (edge, plane) in edges.take_while(|edge| *edge < end).zip(&hits.hits[start..]) {
                visit(Crossing { edge, plane: plane.to_native() });
            }
            return;
        }
        let crossings = &self.signs.crossings;
        let start = crossings.partition_point(|crossing| crossing.edge.to_native() < first);
        let crossings = crossings[start..]
            .iter()
            .map(|one| Crossing { edge: one.edge.to_native(), plane: one.plane.to_native() });
        crossings.take_while(|crossing| crossing.edge < end).for_each(visit);
    }
}
