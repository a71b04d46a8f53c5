//! The bricks of signs, some of which say no more than that their crossings are the hits of the brick.
//!
//! In:         the files that scan and sign generation leave.
//! Out:        base sign, crossings, planes, borders and walls of each brick, wherever they lie.
//! Invariant:  of a brick that is [`AS_HIT`] each hit edge is marked and has one hit, so edges and hits go
//!             together one by one.
//! Units:      as [`SignBrick`](crate::octree::SignBrick).
//! Memory:     the two records of a brick, mapped.
//! Fails:      a record cannot be read, or the hits of a brick are missing.

use rkyv::rend::u32_le;

use crate::octree::brick::ArchivedSourcePlane;
use crate::octree::{
    ArchivedBorder, ArchivedHitBrick, ArchivedSignBrick, BrickError, BrickKey, Crossing, HitEdge,
    decode_hits, decode_signs,
};
use crate::store::{BrickFile, StoreError, View};

/// Flag in the directory of signs: crossings and planes are those of the record of hits.
pub const AS_HIT: u32 = 1;

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

    /// Whether a brick is as it was hit.
    fn is_as_hit(&self, number: usize) -> bool {
        self.signs.directory()[number].flags & AS_HIT != 0
    }

    /// The record of hits of a brick that is as it was hit.
    fn hits_of(&self, number: usize) -> Option<(&'f BrickFile, usize)> {
        let hits = self.hits.filter(|_| self.is_as_hit(number))?;
        Some((hits, hits.find(self.key(number).0)?))
    }

    /// Shows a brick.
    ///
    /// # Errors
    /// As [`BrickFile::view`].
    pub fn view(&self, number: usize) -> Result<SignView, StoreError> {
        let signs = self.signs.view(number)?;
        let hits = self.hits_of(number).map(|(hits, number)| hits.view(number)).transpose()?;
        Ok(SignView { signs, hits, is_as_hit: self.is_as_hit(number) })
    }
}

/// The bytes of a brick.
pub struct SignView {
    signs: View,
    hits: Option<View>,
    is_as_hit: bool,
}

impl SignView {
    /// What they say, validated.
    ///
    /// # Errors
    /// [`BrickError`]: they are no brick, or not each edge has the one hit that it should.
    pub fn record(&self) -> Result<SignRecord<'_>, BrickError> {
        let signs = decode_signs(&self.signs)?;
        let hits = self.hits.as_ref().map(|view| decode_hits(view)).transpose()?;
        if self.is_as_hit && hits.is_none_or(|hits| hits.hits.len() != hits.edges.len()) {
            return Err(BrickError::NoHits);
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
            let start = hits.edges.partition_point(|edge| HitEdge::from(edge).edge() < first);
            let edges = hits.edges[start..].iter().map(|edge| HitEdge::from(edge).edge());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{HitBrick, SignBrick, SourcePlane, encode};
    use crate::store::{Backing, BrickWriter, Scratch};

    const EDGES: [u32; 4] = [3, 40, 36_000, 80_000];

    fn file(scratch: &Scratch, name: &str, flags: u32, bytes: &[u8]) -> BrickFile {
        let mut writer = BrickWriter::create(scratch, name, Backing::Mapped).expect("room");
        writer.append(7, flags, bytes).expect("room");
        writer.finish(2).expect("room")
    }

    fn hits(kept: u32) -> HitBrick {
        HitBrick {
            edges: EDGES.map(|edge| HitEdge::new(edge, 1, 1, -1)).to_vec(),
            hits: (0..kept).rev().collect(),
            planes: (0..4).map(|source| SourcePlane { source, ..Default::default() }).collect(),
        }
    }

    fn crossings(bricks: SignBricks, range: [u32; 2]) -> Vec<Crossing> {
        let view = bricks.view(0).expect("readable");
        let mut found = Vec::new();
        view.record().expect("sound").each_crossing_within(range, |one| found.push(one));
        found
    }

    #[test]
    fn a_brick_that_is_as_it_was_hit_says_what_the_whole_one_says() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let hits = hits(4);
        let expected: Vec<Crossing> =
            EDGES.iter().zip(&hits.hits).map(|(&edge, &plane)| Crossing { edge, plane }).collect();
        let whole = SignBrick {
            crossings: expected.clone(),
            planes: hits.planes.clone(),
            ..SignBrick::default()
        };
        let whole = file(&scratch, "whole", 0, &encode(&whole));
        let as_hit = file(&scratch, "as_hit", AS_HIT, &encode(&SignBrick::default()));
        let hits = file(&scratch, "hits", 0, &encode(&hits));
        for range in [[0, u32::MAX], [0, 40], [40, 41], [41, 80_001], [80_001, u32::MAX]] {
            let within = |one: &Crossing| (range[0]..range[1]).contains(&one.edge);
            let expected: Vec<_> = expected.iter().copied().filter(within).collect();
            assert_eq!(crossings(SignBricks::new(&as_hit, &hits), range), expected);
            assert_eq!(crossings(SignBricks::whole(&whole), range), expected);
            assert_eq!(crossings(SignBricks::new(&whole, &hits), range), expected);
        }
    }

    #[test]
    fn missing_hits_are_told() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let as_hit = file(&scratch, "as_hit", AS_HIT, &encode(&SignBrick::default()));
        let mut twice = hits(4);
        twice.edges.pop();
        twice.edges[0] = HitEdge::new(EDGES[0], 2, 2, 0);
        let twice = file(&scratch, "twice", 0, &encode(&twice));
        for bricks in [SignBricks::whole(&as_hit), SignBricks::new(&as_hit, &twice)] {
            let view = bricks.view(0).expect("readable");
            assert!(matches!(view.record().map(|_| ()), Err(BrickError::NoHits)));
        }
    }
}
