//! What of a surface lies farther from another one than some length, as triangles: whole ones where
//! all of a triangle does, and pieces where a part of it does.
//!
//! All of a piece of a triangle is far where no triangle of the other surface comes within the length:
//! those of a ball around it are asked, and where that does not tell, all that may. Nothing of it is far
//! where one triangle is near all of its corners, since the distance from what is convex is convex. Else it
//! is halved, until its edges are short; then the middle of the ball decides.
//!
//! In:         a [`MeshSource`], a [`Target`], a [`Gap`].
//! Out:        [`Piece`]s in the order of the source. Triangles with infinite corners, and those without
//!             area, are left out.
//! Invariant:  depends on the surfaces and the gap alone: workers forget between items, and what makes
//!             an item does not depend on them. Borders are right to the length of an edge that is
//!             not halved.
//! Memory:     a quarter of the share: an eighth for pages of the tree, an eighth for pieces.

use glam::DVec3;

use crate::deviate::nearest::{Walker, Within};
use crate::deviate::pieces::{Joiner, Piece};
use crate::deviate::{DeviateError, Means, Target};
use crate::geom::{ball_around, closest_on_triangle, longest_edge};
use crate::mesh::{MeshSource, TriangleBatch};
use crate::store::{Scales, StoreError, ordered_by_weight};

/// A triangle that may have more pieces than about this is cut before it goes to a worker, unless all
/// of it is near or far.
const MOST_PIECES: f64 = 4096.0;
/// Triangles of an item.
const CHUNK: usize = 256;
/// Distances are right to this share of the largest coordinate.
const ROUNDING: f64 = 1.0 / (1_u64 << 44) as f64;
/// What is farther than the tolerance by less than this share of a fine edge is near, so that walls just as
/// thick as it are so all over, whatever their vertices were rounded to.
const SLACK: f64 = 1.0 / 512.0;

/// What is far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// What lies farther away than this, model units.
    pub tolerance: f64,
    /// Edges are not halved if they are no longer than this, model units.
    pub finest: f64,
}

/// How a piece lies to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Near,
    Far,
    Mixed,
}

impl Target {
    /// Hands on what of `source` lies farther from the surface than `gap` says, triangle by triangle.
    ///
    /// # Errors
    /// [`DeviateError`]: the source fails, the scratch disk fails, `take` does, or the caller cancels.
    pub fn apart<S: MeshSource + ?Sized>(
        &self,
        source: &mut S,
        gap: &Gap,
        means: &Means<'_>,
        mut take: impl FnMut(&Piece) -> Result<(), DeviateError<S::Error>>,
    ) -> Result<(), DeviateError<S::Error>>
    where
        S::Error: Send,
    {
        // One more for the thread that makes items.
        let judges = means.pool.current_num_threads() as u64 + 1;
        let judge = || Judge::new(self, gap, means.share_bytes / 8 / judges);
        let mut items = Items::new(source, judge());
        let mut joiner = Joiner::default();
        let mut pieces = Vec::new();
        ordered_by_weight(
            means.pool,
            Scales { most_bytes: means.share_bytes / 8, weigh: |item: &Item| item.weight_bytes },
            || {
                means.stop_if_asked()?;
                items.next(means)
            },
            judge,
            |judge, item| Ok(judge.far_pieces(item.pieces)?),
            |found: Vec<Piece>| {
                for piece in found {
                    joiner.add(piece, |piece| {
                        pieces.push(piece);
                        Ok(())
                    })?;
                }
                pieces.drain(..).try_for_each(|piece| take(&piece))
            },
        )?;
        joiner.finish(|piece| {
            pieces.push(piece);
            Ok(())
        })?;
        pieces.iter().try_for_each(take)
    }
}

/// What a worker takes at a time: some small triangles, or a piece of a large one.
struct Item {
    pieces: Vec<Piece>,
    /// What all pieces of it may take.
    weight_bytes: u64,
}

/// Makes items of what a source delivers.
struct Items<'s, 't, S: MeshSource + ?Sized> {
    source: &'s mut S,
    judge: Judge<'t>,
    batch: TriangleBatch,
    /// How many triangles of the batch are done, and of the source before it.
    at: usize,
    before: u64,
    /// Pieces of a large triangle, the next one last.
    cut: Vec<Piece>,
}

impl<'s, 't, S: MeshSource + ?Sized> Items<'s, 't, S> {
    fn new(source: &'s mut S, judge: Judge<'t>) -> Self {
        let (batch, cut) = (TriangleBatch::default(), Vec::new());
        Self { source, judge, batch, at: 0, before: 0, cut }
    }

    fn next(&mut self, means: &Means<'_>) -> Result<Option<Item>, DeviateError<S::Error>> {
        let (mut pieces, mut many) = (Vec::new(), 0.0);
        while pieces.len() < CHUNK {
            let Some(piece) = self.piece(means)? else { break };
            let mut more = self.judge.most_pieces(&piece);
            if more > MOST_PIECES {
                means.stop_if_asked()?;
                match (self.judge.verdict(&piece.points(), false)?, piece.halves()) {
                    (Verdict::Near, _) => continue,
                    (Verdict::Mixed, Some([first, second])) => {
                        self.cut.extend([second, first]);
                        continue;
                    }
                    (Verdict::Far | Verdict::Mixed, _) => more = 1.0,
                }
            }
            if !pieces.is_empty() && many + more > MOST_PIECES {
                self.cut.push(piece);
                break;
            }
            pieces.push(piece);
            many += more;
        }
        let weight_bytes = (many * size_of::<Piece>() as f64) as u64;
        Ok((!pieces.is_empty()).then_some(Item { pieces, weight_bytes }))
    }

    /// The next triangle with an area, or piece of one.
    fn piece(&mut self, means: &Means<'_>) -> Result<Option<Piece>, DeviateError<S::Error>> {
        if let Some(piece) = self.cut.pop() {
            return Ok(Some(piece));
        }
        loop {
            while let Some(corners) = self.batch.corners.get(self.at) {
                let piece = Piece::whole(self.before + self.at as u64, *corners);
                self.at += 1;
                let area = piece.area();
                if area > 0.0 && area.is_finite() {
                    return Ok(Some(piece));
                }
            }
            self.before += self.batch.len() as u64;
            self.at = 0;
            let more = self.source.next_batch(&mut self.batch);
            if !more.map_err(|source| DeviateError::Source { source })? {
                self.batch.clear();
                return Ok(None);
            }
            means.monitor.advance(self.batch.len() as u64);
        }
    }
}

/// Tells near from far; each worker has its own.
struct Judge<'t> {
    walker: Walker<'t>,
    gap: Gap,
    slack: f64,
}

impl<'t> Judge<'t> {
    fn new(target: &'t Target, gap: &Gap, share_bytes: u64) -> Self {
        let slack = (gap.finest * SLACK).max(4.0 * target.reach * ROUNDING);
        Self { walker: Walker::new(&target.tree, share_bytes), gap: *gap, slack }
    }

    /// About how many pieces that are not halved any more this one may have.
    fn most_pieces(&self, piece: &Piece) -> f64 {
        let (_, longest_squared) = longest_edge(&piece.points());
        let edges = longest_squared / (self.gap.finest * self.gap.finest);
        if edges <= 1.0 { 1.0 } else { 4.0 * edges }
    }

    /// What of some pieces is far, joined as far as that goes.
    fn far_pieces(&mut self, pieces: Vec<Piece>) -> Result<Vec<Piece>, StoreError> {
        self.walker.forget();
        let (mut joiner, mut found) = (Joiner::default(), Vec::new());
        let mut emit = |piece| {
            found.push(piece);
            Ok(())
        };
        let mut stack = Vec::new();
        for piece in pieces {
            stack.push(piece);
            while let Some(piece) = stack.pop() {
                let points = piece.points();
                let is_fine = longest_edge(&points).1 <= self.gap.finest * self.gap.finest;
                let halves = if is_fine { None } else { piece.halves() };
                match (self.verdict(&points, halves.is_none())?, halves) {
                    (Verdict::Far, _) => joiner.add(piece, &mut emit)?,
                    (Verdict::Mixed, Some([first, second])) => stack.extend([second, first]),
                    (Verdict::Near | Verdict::Mixed, _) => {}
                }
            }
        }
        joiner.finish(&mut emit)?;
        Ok(found)
    }

    /// How a piece lies; a fine one is never mixed.
    fn verdict(&mut self, points: &[DVec3; 3], is_fine: bool) -> Result<Verdict, StoreError> {
        let far = self.gap.tolerance + self.slack;
        let (middle, radius) = ball_around(points);
        if is_fine {
            return Ok(match self.walker.within(middle, far, |_| true)? {
                Within::Settled => Verdict::Near,
                Within::Open(_) | Within::Nothing => Verdict::Far,
            });
        }
        // Nearer, and farther, than what decides for a fine piece, by more than rounding.
        let near_squared = (far - self.slack / 2.0).powi(2);
        let surely_far = far + self.slack / 2.0;
        let found = self.walker.within(middle, surely_far + radius, |triangle| {
            let corners = triangle.points();
            points.iter().all(|point| {
                let closest = closest_on_triangle(*point, corners);
                point.distance_squared(closest) <= near_squared
            })
        })?;
        Ok(match found {
            Within::Settled => Verdict::Near,
            Within::Nothing => Verdict::Far,
            // Its middle is far: so all of it may be, as a face of a wall is from the other one.
            Within::Open(distance_squared) if distance_squared > surely_far * surely_far => {
                match self.walker.reaches(points, surely_far)? {
                    true => Verdict::Mixed,
                    false => Verdict::Far,
                }
            }
            Within::Open(_) => Verdict::Mixed,
        })
    }
}
