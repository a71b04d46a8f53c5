//! Pieces of triangles: halves of halves, which are joined again where both halves are there.
//!
//! Invariant:  pieces come in the order of the cuts, first halves before second ones. What is handed
//!             on is the same however they came: no two of it are halves of one piece.
//! Memory:     a piece for each time that a triangle was halved.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::geom::{halve, rejoin};
use crate::store::StoreError;

/// A path has a bit for each cut.
const MOST_CUTS: u32 = 63;

/// A triangle, or what is left of one after some cuts.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Piece {
    /// Its corners, model units.
    pub corners: [[f64; 3]; 3],
    /// The number of the triangle that it is of.
    pub number: u64,
    /// For each cut, the first one highest, whether it is the second half.
    path: u64,
    cuts: u64,
}

impl Piece {
    /// A whole triangle.
    pub(crate) fn whole(number: u64, corners: [[f64; 3]; 3]) -> Self {
        Self { corners, number, path: 0, cuts: 0 }
    }

    pub(crate) fn points(&self) -> [DVec3; 3] {
        self.corners.map(DVec3::from)
    }

    /// Its area, square model units.
    #[must_use]
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.points();
        (b - a).cross(c - a).length() / 2.0
    }

    /// Both halves; `None` after too many cuts.
    pub(crate) fn halves(&self) -> Option<[Self; 2]> {
        if self.cuts == u64::from(MOST_CUTS) {
            return None;
        }
        let (path, cuts) = (self.path << 1, self.cuts + 1);
        let [first, second] = halve(&self.points()).map(|half| half.map(Into::into));
        let first = Self { corners: first, path, cuts, ..*self };
        Some([first, Self { corners: second, path: path | 1, ..first }])
    }

    fn is_second_half(&self) -> bool {
        self.path & 1 == 1
    }

    /// Whether `other` lies in the second half that this first one waits for.
    fn waits_for(&self, other: &Self) -> bool {
        self.number == other.number
            && self.cuts <= other.cuts
            && other.path >> (other.cuts - self.cuts) == self.path | 1
    }

    /// What this and its second half were cut from.
    fn joined(&self, second: &Self) -> Option<Self> {
        if self.cuts != second.cuts || !self.waits_for(second) {
            return None;
        }
        let corners = rejoin(&[self.points(), second.points()])?.map(Into::into);
        Some(Self { corners, number: self.number, path: self.path >> 1, cuts: self.cuts - 1 })
    }
}

/// Joins halves as they come.
#[derive(Default)]
pub(crate) struct Joiner {
    /// First halves, each in the second half that the one before it waits for.
    waiting: Vec<Piece>,
}

impl Joiner {
    /// Takes the next piece; `emit` has those that nothing can be joined to any more.
    pub(crate) fn add(
        &mut self,
        mut piece: Piece,
        mut emit: impl FnMut(Piece) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        while piece.is_second_half() {
            let Some(joined) = self.waiting.last().and_then(|first| first.joined(&piece)) else {
                // Its first half is not whole, so what they were cut from is not, and so on up.
                self.finish(&mut emit)?;
                return emit(piece);
            };
            self.waiting.pop();
            piece = joined;
        }
        if self.waiting.last().is_some_and(|first| !first.waits_for(&piece)) {
            self.finish(&mut emit)?;
        }
        if piece.cuts == 0 {
            return emit(piece);
        }
        self.waiting.push(piece);
        Ok(())
    }

    /// Hands on what waits.
    pub(crate) fn finish(
        &mut self,
        emit: impl FnMut(Piece) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        self.waiting.drain(..).try_for_each(emit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::Random;

    const TRIANGLE: [[f64; 3]; 3] = [[0.0; 3], [3.0, 0.0, 1.0], [1.0, 2.0, 0.5]];

    fn leaves(piece: Piece, cuts: u64) -> Vec<Piece> {
        if piece.cuts == cuts {
            return vec![piece];
        }
        let halves = piece.halves().expect("few cuts");
        halves.into_iter().flat_map(|half| leaves(half, cuts)).collect()
    }

    fn join(pieces: &[Piece]) -> Vec<Piece> {
        let (mut joiner, mut out) = (Joiner::default(), Vec::new());
        let mut emit = |piece| {
            out.push(piece);
            Ok(())
        };
        for piece in pieces {
            joiner.add(*piece, &mut emit).expect("nothing fails");
            assert!(joiner.waiting.len() <= 8);
        }
        joiner.finish(&mut emit).expect("nothing fails");
        out
    }

    /// The same from the definition: two halves that are both there are one.
    fn join_all(pieces: &[Piece]) -> Vec<Piece> {
        let mut pieces = pieces.to_vec();
        loop {
            let pair = (1..pieces.len()).find_map(|i| Some((i, pieces[i - 1].joined(&pieces[i])?)));
            let Some((i, joined)) = pair else { return pieces };
            pieces.splice(i - 1..=i, [joined]);
        }
    }

    #[test]
    fn all_pieces_of_a_triangle_are_the_triangle() {
        let whole = Piece::whole(7, TRIANGLE);
        let other = Piece::whole(8, TRIANGLE);
        assert_eq!(join(&[leaves(whole, 8), leaves(other, 5)].concat()), [whole, other]);
    }

    #[test]
    fn pieces_are_joined_wherever_both_halves_are_there_whatever_is_missing() {
        let mut random = Random::new(5);
        let all: Vec<_> = (0..3).flat_map(|i| leaves(Piece::whole(i, TRIANGLE), 7)).collect();
        for round in 0..200 {
            let share = f64::from(round % 20) / 20.0;
            let there: Vec<_> =
                all.iter().copied().filter(|_| random.share() >= share * 0.2).collect();
            let joined = join(&there);
            assert_eq!(joined, join_all(&there));
            // However they come: joined before, in part.
            let (front, back) = there.split_at(there.len() / 3);
            assert_eq!(join(&[join(front), join(back)].concat()), joined);
        }
    }
}
