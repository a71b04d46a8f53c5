//! Vertices whose triangles, seen from somewhere, lie side by side around them: no two of those
//! meet anywhere but in what they share.
//!
//! In:         triangles with areas, or some of them, and the places of their vertices.
//! Out:        for each vertex, whether that is proved for all of its triangles that are here.
//! Invariant:  exact, and only ever a proof: what is in doubt is not flat.
//! Memory:     36 bytes a triangle and 5 a vertex.
//!
//! Seen along a direction that the normals of all triangles of a vertex share, each triangle spans
//! an angle from its next corner to its previous one, all turning the same way. Where the corners
//! at which the angles begin are those at which they end, the angles make up whole rounds, as many
//! as they pass a ray: one round has every direction once. Where one begins and another ends alone,
//! a ray that none of them passes leaves less than a round. What lies side by side in sight does so
//! in space.

use crate::geom::signs::Point;
use crate::verify::intersect::filters::{Normal, SureProduct, minus};
use crate::verify::intersect::pair::Face;

/// Directions are whole numbers of at most so many bits, and so are products of two.
const DIRECTION: f64 = (1 << 20) as f64;
/// Added and taken away, it rounds smaller numbers to whole ones.
const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
/// The ray leads about here. Edges of models seldom do, which would leave doubts.
const RAY: Point = [619.0, -347.0, 431.0];
/// The corner after each, and the one after that.
const NEXT: [usize; 4] = [1, 2, 0, 1];
/// Corners that are so few are compared each with each, which is faster than to sort them.
const FEW: usize = 24;

/// Finds flat fans; has room that is used again and again.
#[derive(Default)]
pub(crate) struct FlatFans {
    /// Where the corners of each vertex end.
    ends: Vec<u32>,
    /// Corners by vertex: four times the triangle and which of its corners.
    corners: Vec<u32>,
    /// Where the angles around a vertex begin and where they end.
    next: Vec<u32>,
    previous: Vec<u32>,
    /// By vertex.
    pub(crate) is_flat: Vec<bool>,
}

impl FlatFans {
    /// Judges all vertices.
    pub(crate) fn find(&mut self, faces: &[Face], normals: &[Normal], positions: &[Point]) {
        self.sort_corners(faces, positions.len());
        self.is_flat.clear();
        let mut start = 0;
        for (&position, at) in positions.iter().zip(0..) {
            let end = self.ends[at] as usize;
            let is_flat = self.is_flat(start..end, position, faces, normals, positions);
            self.is_flat.push(is_flat);
            start = end;
        }
    }

    fn sort_corners(&mut self, faces: &[Face], vertices: usize) {
        let Self { ends, corners, .. } = self;
        ends.clear();
        // One more in front, so that starts become ends while corners are entered.
        ends.resize(vertices + 1, 0);
        for vertex in faces.iter().flat_map(|face| face.vertices) {
            ends[vertex as usize + 1] += 1;
        }
        let mut sum = 0;
        for end in ends.iter_mut() {
            sum += *end;
            *end = sum;
        }
        corners.resize(3 * faces.len(), 0);
        for (face, first) in faces.iter().zip((0..).step_by(4)) {
            for (vertex, corner) in face.vertices.into_iter().zip(first..) {
                let end = &mut ends[vertex as usize];
                corners[*end as usize] = corner;
                *end += 1;
            }
        }
    }

    #[inline]
    fn is_flat(
        &mut self,
        range: std::ops::Range<usize>,
        position: Point,
        faces: &[Face],
        normals: &[Normal],
        positions: &[Point],
    ) -> bool {
        let corners = &self.corners[range];
        let mut sum = [0.0; 3];
        for &corner in corners {
            let towards = normals[corner as usize / 4].towards;
            sum = [sum[0] + towards[0], sum[1] + towards[1], sum[2] + towards[2]];
        }
        let most = sum[0].abs().max(sum[1].abs()).max(sum[2].abs());
        let sight = sum.map(|x| (x * (DIRECTION / most) + ROUND) - ROUND);
        // Exactly upright on the plane of the line of sight and the ray.
        let across = [
            sight[1] * RAY[2] - sight[2] * RAY[1],
            sight[2] * RAY[0] - sight[0] * RAY[2],
            sight[0] * RAY[1] - sight[1] * RAY[0],
        ];
        self.next.clear();
        self.previous.clear();
        let (mut passed, mut passed_behind) = (0, 0);
        let mut is_sure = true;
        for &corner in corners {
            let (at, corner) = (corner as usize / 4, corner as usize % 4);
            let face = &faces[at];
            let (next, previous) = (face.vertices[NEXT[corner]], face.vertices[NEXT[corner + 1]]);
            let from = SureProduct::of(minus(positions[next as usize], position), across);
            let to = SureProduct::of(minus(positions[previous as usize], position), across);
            is_sure &= face.tame & normals[at].leads(sight, DIRECTION) & from.is_sure & to.is_sure;
            passed += u32::from(!from.is_positive & to.is_positive);
            passed_behind += u32::from(from.is_positive & !to.is_positive);
            self.next.push(next);
            self.previous.push(previous);
        }
        if !is_sure {
            return false;
        }
        match imbalance(&mut self.next, &mut self.previous) {
            0 => passed == 1,
            2 => passed == 0 || passed_behind == 0,
            _ => false,
        }
    }
}

/// The sum of squares of how much more often each number comes in one list than in the other, at
/// least as far as 3.
fn imbalance(a: &mut [u32], b: &mut [u32]) -> usize {
    if a.len() <= FEW {
        let equal = |a: &[u32], b: &[u32]| -> usize {
            a.iter().map(|x| b.iter().map(|y| usize::from(x == y)).sum::<usize>()).sum()
        };
        return equal(a, a) + equal(b, b) - 2 * equal(a, b);
    }
    a.sort_unstable();
    b.sort_unstable();
    let (mut i, mut j, mut sum) = (0, 0, 0);
    while i < a.len() || j < b.len() {
        let x = a.get(i).copied().unwrap_or(u32::MAX).min(b.get(j).copied().unwrap_or(u32::MAX));
        let count = |list: &[u32]| list.iter().take_while(|&&y| y == x).count();
        let (in_a, in_b) = (count(&a[i..]), count(&b[j..]));
        sum += in_a.abs_diff(in_b).pow(2);
        i += in_a;
        j += in_b;
    }
    sum
}

/// The corners of a triangle whose fans are flat.
#[derive(Clone, Copy)]
pub(crate) struct FlatCorners([u32; 4]);

impl FlatCorners {
    /// Of a triangle, by the flat vertices.
    #[inline]
    pub(crate) fn of(number: u32, face: &Face, is_flat: &[bool]) -> Self {
        // In other places is what no other triangle has.
        let own = !number;
        let [a, b, c] =
            face.vertices.map(|vertex| if is_flat[vertex as usize] { vertex } else { own });
        Self([a, b, c, own])
    }

    /// Whether two triangles have one in common.
    #[inline]
    pub(crate) fn share(&self, other: &Self) -> bool {
        let [a, b, c, _] = other.0;
        // Without branches, four at one time.
        let same = |x: u32, y: u32| u32::from(x == y);
        self.0.iter().fold(0, |any, &own| any | same(own, a) | same(own, b) | same(own, c)) > 0
    }
}
