//! Fills triangles into a band of samples, nearest first.
//!
//! In:         [`Piece`]s in samples of the whole view, and what to paint.
//! Out:        a [`Band`]: some rows of a view, one [`Sample`] per place.
//! Invariant:  a sample is decided by the triangles and their order alone, never by the rows that
//!             the band happens to hold. Triangles that share an edge share no sample across it,
//!             leave none out, and two faces of a silhouette cover the same samples.
//! Memory:     width x rows samples.
//! Source:     J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988.

use std::ops::Range;

use crate::report::preview::camera::Projected;
use crate::report::preview::clip::Piece;

/// Depths closer than this count as equal when a front and a back face meet: behind a silhouette
/// both have the same depth but for rounding. A thousandth of a millimetre on a metre.
const SAME_DEPTH: f32 = 1e-6;

/// One place of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample<P> {
    /// 0 near to 1 far; infinite where nothing was drawn.
    pub(crate) depth: f32,
    /// What is seen there.
    pub(crate) paint: P,
    /// Whether it is a back face.
    pub(crate) back: bool,
}

/// Rows `first_row ..` of a view.
pub(crate) struct Band<P> {
    /// Samples per row.
    pub(crate) width: usize,
    /// The first row of the view that is held.
    pub(crate) first_row: usize,
    /// Row after row.
    pub(crate) samples: Vec<Sample<P>>,
    /// Rows of the view that are its own; those beside them are there to be looked at.
    own: Range<usize>,
}

/// What a triangle is painted with.
pub(crate) struct Brush<P> {
    /// On the face.
    pub(crate) face: P,
    /// On a line along its edges, and the width of that line in samples.
    pub(crate) line: Option<(P, f64)>,
}

impl<P: Copy> Band<P> {
    /// A band of `rows` rows showing nothing but `background`.
    pub(crate) fn new(width: usize, rows: usize, background: P) -> Self {
        let nothing = Sample { depth: f32::INFINITY, paint: background, back: false };
        Self { width, first_row: 0, samples: vec![nothing; width * rows], own: 0..rows }
    }

    /// Forgets everything and holds the rows of `held`, of which `own` are its own; never more than
    /// at first.
    pub(crate) fn restart(&mut self, held: Range<usize>, own: Range<usize>, background: P) {
        let nothing = Sample { depth: f32::INFINITY, paint: background, back: false };
        self.first_row = held.start;
        self.samples.clear();
        self.samples.resize(self.width * held.len(), nothing);
        self.own = own;
    }

    /// Its own rows among those that it holds.
    pub(crate) fn own_rows(&self) -> Range<usize> {
        self.own.start - self.first_row..self.own.end - self.first_row
    }

    /// The samples of its own rows.
    pub(crate) fn own_samples(&self) -> &[Sample<P>] {
        let rows = self.own_rows();
        &self.samples[rows.start * self.width..rows.end * self.width]
    }

    /// Draws a triangle; `brush` is asked only when the triangle can touch a sample of the band.
    pub(crate) fn draw(&mut self, piece: &Piece, brush: impl FnOnce(bool) -> Brush<P>) {
        let Some(reach) = self.reach(&piece.corners) else { return };
        let Some(slopes) = Slopes::of(piece) else { return };
        self.fill(&slopes, reach, &brush(slopes.back));
    }

    /// Columns and rows of the sample centres inside the box around a triangle, if there are any.
    fn reach(&self, corners: &[Projected; 3]) -> Option<[usize; 4]> {
        let [a, b, c] = corners;
        let rows = self.samples.len() / self.width;
        let span = |lo: f64, hi: f64, first: usize, count: usize| {
            // Sample centres lie at halves; a cast of a negative number gives 0.
            let lo = ((lo - 0.5).ceil() as usize).max(first);
            let end = ((hi - 0.5).floor() + 1.0) as usize;
            (lo < end.min(first + count)).then_some((lo, end.min(first + count)))
        };
        let (row, row_end) =
            span(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), self.first_row, rows)?;
        let (column, column_end) =
            span(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), 0, self.width)?;
        Some([column, column_end, row, row_end])
    }

    fn fill(&mut self, slopes: &Slopes, reach: [usize; 4], brush: &Brush<P>) {
        let [column, column_end, row, row_end] = reach;
        let Slopes { edges, depths, back, .. } = slopes;
        let nearest = depths.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let line_width = brush.line.as_ref().map(|&(paint, wanted)| {
            // Small triangles keep a face between their lines.
            (paint, wanted.min(0.15 * slopes.height))
        });
        for y in row..row_end {
            let along = edges.map(|edge| edge.row(y as f64 + 0.5));
            let start = (y - self.first_row) * self.width;
            let (first, end) = columns(edges, &along, (column, column_end));
            for x in first..end {
                let centre = x as f64 + 0.5;
                let weights: [f64; 3] = std::array::from_fn(|i| edges[i].at(along[i], centre));
                if !(0..3).all(|i| edges[i].owns(weights[i])) {
                    continue;
                }
                // Edge i is opposite to corner i + 2.
                let sum = weights[0] + weights[1] + weights[2];
                let depth =
                    (weights[1] * depths[0] + weights[2] * depths[1] + weights[0] * depths[2])
                        / sum;
                let depth = depth.clamp(nearest, farthest);
                let sample = &mut self.samples[start + x];
                if !(0.0..=1.0).contains(&depth) || !is_nearer(depth as f32, *back, sample) {
                    continue;
                }
                let on_line = |width: f64| {
                    (0..3).any(|i| edges[i].mesh && weights[i] < width * edges[i].length)
                };
                let paint = match line_width {
                    Some((paint, width)) if on_line(width) => paint,
                    _ => brush.face,
                };
                *sample = Sample { depth: depth as f32, paint, back: *back };
            }
        }
    }
}

/// The columns of a row that may lie inside of all edges, within `column..end`: a sample more on each
/// side than is, so that no rounding leaves one out.
fn columns(edges: &[Slope; 3], along: &[f64; 3], (column, end): (usize, usize)) -> (usize, usize) {
    let (mut lo, mut hi) = (column as f64, end as f64);
    for (edge, row) in edges.iter().zip(along) {
        let crossing = edge.x + row / edge.dy;
        if edge.dy > 0.0 {
            hi = hi.min(crossing + 1.5);
        } else if edge.dy < 0.0 {
            lo = lo.max(crossing - 1.5);
        }
    }
    // A cast takes what is below zero for zero.
    ((lo as usize).max(column), (hi as usize).min(end))
}

#[inline]
fn is_nearer<P>(depth: f32, back: bool, sample: &Sample<P>) -> bool {
    match (back, sample.back) {
        (false, true) => depth <= sample.depth + SAME_DEPTH,
        (true, false) => depth < sample.depth - SAME_DEPTH,
        _ => depth < sample.depth,
    }
}

/// An edge function: twice the area between an edge and a sample, positive inside.
///
/// It is computed from the lower end of the edge whichever way the triangle runs, so that all
/// triangles at an edge get the same number but for its sign.
#[derive(Clone, Copy)]
struct Slope {
    x: f64,
    y: f64,
    dx: f64,
    dy: f64,
    /// Samples exactly on the edge belong to the triangle on this side of it.
    closed: bool,
    mesh: bool,
    length: f64,
}

impl Slope {
    fn between(from: &Projected, to: &Projected, mesh: bool) -> Self {
        let closed = (from.x, from.y) < (to.x, to.y);
        let (lo, hi) = if closed { (from, to) } else { (to, from) };
        let sign = if closed { 1.0 } else { -1.0 };
        let (dx, dy) = (hi.x - lo.x, hi.y - lo.y);
        let length = (dx * dx + dy * dy).sqrt();
        Self { x: lo.x, y: lo.y, dx: sign * dx, dy: sign * dy, closed, mesh, length }
    }

    #[inline]
    fn row(&self, y: f64) -> f64 {
        self.dx * (y - self.y)
    }

    #[inline]
    fn at(&self, row: f64, x: f64) -> f64 {
        row - self.dy * (x - self.x)
    }

    #[inline]
    fn owns(&self, weight: f64) -> bool {
        weight > 0.0 || (weight == 0.0 && self.closed)
    }
}

/// A triangle turned so that its edge functions are positive inside.
struct Slopes {
    edges: [Slope; 3],
    depths: [f64; 3],
    back: bool,
    /// The smallest height, in samples.
    height: f64,
}

impl Slopes {
    /// None for a triangle that is seen from its edge.
    fn of(piece: &Piece) -> Option<Self> {
        let [a, mut b, mut c] = piece.corners;
        let [ab, bc, ca] = piece.mesh_edges;
        let mut mesh = [ab, bc, ca];
        let mut area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        // y points down: what runs counterclockwise to the viewer has a negative area here.
        let back = area > 0.0;
        if !back {
            (b, c) = (c, b);
            mesh = [ca, bc, ab];
            area = -area;
        }
        if area == 0.0 {
            return None;
        }
        let edges = [
            Slope::between(&a, &b, mesh[0]),
            Slope::between(&b, &c, mesh[1]),
            Slope::between(&c, &a, mesh[2]),
        ];
        let longest = edges.iter().map(|edge| edge.length).fold(0.0, f64::max);
        Some(Self { edges, depths: [a.depth, b.depth, c.depth], back, height: area / longest })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(x: f64, y: f64) -> Projected {
        Projected { x, y, depth: 0.5 }
    }

    fn covered(corners: [Projected; 3]) -> Vec<bool> {
        let mut band = Band::new(16, 16, 0_u8);
        let piece = Piece { corners, mesh_edges: [true; 3] };
        band.draw(&piece, |_| Brush { face: 1, line: None });
        band.samples.iter().map(|sample| sample.paint == 1).collect()
    }

    proptest! {
        /// Coordinates at quarters, so that samples fall on edges and corners often.
        #[test]
        fn a_fan_covers_each_sample_inside_exactly_once(
            x in 0..64_u32, y in 0..64_u32, turn in any::<bool>()
        ) {
            let middle = at(f64::from(x) / 4.0, f64::from(y) / 4.0);
            let rim = [at(0.0, 0.0), at(16.0, 0.0), at(16.0, 16.0), at(0.0, 16.0)];
            let mut count = vec![0; 256];
            for i in 0..4 {
                let (from, to) = (rim[i], rim[(i + 1) % 4]);
                let corners = if turn { [to, from, middle] } else { [from, to, middle] };
                for (count, hit) in count.iter_mut().zip(covered(corners)) {
                    *count += usize::from(hit);
                }
            }
            prop_assert!(count.iter().all(|&count| count == 1), "{count:?}");
        }

        #[test]
        fn both_windings_cover_the_same_samples(
            corners in proptest::array::uniform3((-8.0..24.0, -8.0..24.0))
        ) {
            let [a, b, c] = corners.map(|(x, y)| at(x, y));
            prop_assert_eq!(covered([a, b, c]), covered([a, c, b]));
        }

        #[test]
        fn a_band_of_one_row_agrees_with_the_whole_view(
            corners in proptest::array::uniform3((-8.0..24.0, -8.0..24.0, 0.0..1.0)),
            row in 0..16_usize
        ) {
            let corners = corners.map(|(x, y, depth)| Projected { x, y, depth });
            let piece = Piece { corners, mesh_edges: [true; 3] };
            let mut whole = Band::new(16, 16, 0_u8);
            whole.draw(&piece, |_| Brush { face: 1, line: Some((2, 1.0)) });
            let mut one = Band::new(16, 1, 0_u8);
            one.restart(row..row + 1, row..row + 1, 0);
            one.draw(&piece, |_| Brush { face: 1, line: Some((2, 1.0)) });
            prop_assert_eq!(&one.samples[..], &whole.samples[row * 16..(row + 1) * 16]);
        }
    }

    #[test]
    fn a_front_face_wins_over_a_back_face_of_the_same_depth_in_either_order() {
        let front = [at(0.0, 0.0), at(0.0, 16.0), at(16.0, 0.0)];
        let back = [front[0], front[2], front[1]];
        for order in [[front, back], [back, front]] {
            let mut band = Band::new(16, 16, 0_u8);
            for corners in order {
                let piece = Piece { corners, mesh_edges: [true; 3] };
                band.draw(&piece, |back| Brush { face: 1 + u8::from(back), line: None });
            }
            assert!(band.samples.iter().any(|sample| sample.paint == 1));
            assert!(band.samples.iter().all(|sample| sample.paint != 2));
        }
    }
}
