//! Cuts polygons in space into triangles by clipping ears.
//!
//! In: the corners of one polygon in order. Out: always `n - 2` triangles of corner numbers, in the
//! polygon's own direction; their boundary is the polygon's, so no area is dropped silently.
//!
//! The polygon is seen along the axis on which its Newell normal is largest. Turns are judged by
//! exact predicates, so the answer does not depend on rounding. A polygon that only turns left is
//! fanned. When no ear is left (self-crossing, flat or non-finite polygons), or after
//! [`MOST_TESTS`] point tests, what remains is fanned from its first corner. So it is where the
//! polygons of one cutter together took more tests than are granted to so many corners.
//!
//! Memory: 20 bytes a corner, kept between polygons. Time: O(n) for convex polygons, O(n^2) as a
//! rule, bounded by [`MOST_TESTS`] for one polygon, by [`FREE_TESTS`] and [`TESTS_PER_CORNER`] for
//! all. Source: Meisters, "Polygons have ears" (1975).

use robust::{Coord, orient2d};

/// Point-in-ear tests that are spent on one polygon before the rest of it is fanned.
pub const MOST_TESTS: u64 = 1 << 26;
/// Tests that all polygons of a cutter have in common ...
pub const FREE_TESTS: u64 = 1 << 27;
/// ... and tests that each of their corners adds: enough for any number of concave polygons of a
/// thousand corners.
pub const TESTS_PER_CORNER: u64 = 512;

/// How much an ear may touch; each level is tried only when the one before finds nothing.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Leniency {
    /// No other corner in the ear or on its border.
    Clean,
    /// Other corners may lie on the border: pinched and bridged polygons.
    Touching,
    /// Corners on a straight line or a spike give triangles without area.
    Flat,
}

/// Cuts polygons; keeps its buffers from one polygon to the next.
#[derive(Debug, Default)]
pub struct EarClipper {
    flat: Vec<[f64; 2]>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Tests spent on this polygon, and how many may be.
    tests: u64,
    most_tests: u64,
    /// Tests spent on and corners of the polygons before.
    earlier_tests: u64,
    earlier_corners: u64,
}

impl EarClipper {
    /// Replaces `triangles` by the `n - 2` triangles of the polygon; none below three corners.
    pub fn cut(&mut self, corners: &[[f64; 3]], triangles: &mut Vec<[u32; 3]>) {
        triangles.clear();
        let count = corners.len();
        if count <= 3 {
            triangles.extend((count == 3).then_some([0, 1, 2]));
            return;
        }
        self.earlier_corners += count as u64;
        self.flatten(corners);
        if (0..count).all(|i| self.turn((i + count - 1) % count, i, (i + 1) % count) > 0.0) {
            triangles.extend((1..count as u32 - 1).map(|i| [0, i, i + 1]));
            return;
        }
        self.link(count);
        self.clip(count, triangles);
    }

    /// Looks along the largest axis of the Newell normal, from the side that turns left.
    fn flatten(&mut self, corners: &[[f64; 3]]) {
        let normal = newell_normal(corners);
        let size = normal.map(f64::abs);
        let axis = if size[0] > size[1] && size[0] > size[2] {
            0
        } else if size[1] > size[2] {
            1
        } else {
            2
        };
        let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            std::mem::swap(&mut u, &mut v);
        }
        self.flat.clear();
        self.flat.extend(corners.iter().map(|corner| [corner[u], corner[v]]));
    }

    fn link(&mut self, count: usize) {
        let count = count as u32;
        self.next.clear();
        self.next.extend((0..count).map(|i| (i + 1) % count));
        self.previous.clear();
        self.previous.extend((0..count).map(|i| (i + count - 1) % count));
    }

    fn clip(&mut self, count: usize, triangles: &mut Vec<[u32; 3]>) {
        let mut left = count;
        let mut at = 0_u32;
        let mut leniency = Leniency::Clean;
        let mut refused = 0;
        self.tests = 0;
        let granted = FREE_TESTS.saturating_add(TESTS_PER_CORNER * self.earlier_corners);
        self.most_tests = MOST_TESTS.min(granted.saturating_sub(self.earlier_tests));
        while left > 3 && self.tests < self.most_tests {
            if self.is_ear(at, leniency) {
                let (before, after) = (self.previous[at as usize], self.next[at as usize]);
                triangles.push([before, at, after]);
                self.next[before as usize] = after;
                self.previous[after as usize] = before;
                left -= 1;
                at = after;
                leniency = Leniency::Clean;
                refused = 0;
                continue;
            }
            at = self.next[at as usize];
            refused += 1;
            if refused >= left {
                refused = 0;
                leniency = match leniency {
                    Leniency::Clean => Leniency::Touching,
                    Leniency::Touching => Leniency::Flat,
                    Leniency::Flat => break,
                };
            }
        }
        self.earlier_tests += self.tests;
        let mut middle = self.next[at as usize];
        for _ in 2..left {
            let after = self.next[middle as usize];
            triangles.push([at, middle, after]);
            middle = after;
        }
    }

    fn is_ear(&mut self, at: u32, leniency: Leniency) -> bool {
        let (before, after) = (self.previous[at as usize], self.next[at as usize]);
        self.tests += 1;
        let turn = self.turn(before as usize, at as usize, after as usize);
        if leniency == Leniency::Flat {
            return turn == 0.0;
        }
        if turn.is_nan() || turn <= 0.0 {
            return false;
        }
        let [a, b, c] = [before, at, after].map(|corner| self.flat[corner as usize]);
        let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
        let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
        let mut other = self.next[after as usize];
        while other != before {
            self.tests += 1;
            let p = self.flat[other as usize];
            let near = p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1];
            if near && p != a && p != b && p != c && covers([a, b, c], p, leniency) {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }

    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        orient(self.flat[a], self.flat[b], self.flat[c])
    }
}

/// Twice the vector area, relative to the first corner to spare digits far from the origin.
fn newell_normal(corners: &[[f64; 3]]) -> [f64; 3] {
    let origin = corners[0];
    let relative = |corner: [f64; 3]| [0, 1, 2].map(|k| corner[k] - origin[k]);
    let mut normal = [0.0; 3];
    for pair in corners.windows(2) {
        let (a, b) = (relative(pair[0]), relative(pair[1]));
        for k in 0..3 {
            normal[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        }
    }
    normal
}

fn covers([a, b, c]: [[f64; 2]; 3], p: [f64; 2], leniency: Leniency) -> bool {
    let sides = [orient(a, b, p), orient(b, c, p), orient(c, a, p)];
    if leniency == Leniency::Clean {
        sides.iter().all(|&side| side >= 0.0)
    } else {
        sides.iter().all(|&side| side > 0.0)
    }
}

fn orient(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let coord = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    orient2d(coord(a), coord(b), coord(c))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cut(corners: &[[f64; 3]]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        EarClipper::default().cut(corners, &mut triangles);
        triangles
    }

    fn area(corners: &[[f64; 3]], [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
        newell_normal(&[a, b, c]).iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0
    }

    fn total(corners: &[[f64; 3]]) -> f64 {
        cut(corners).iter().map(|&triangle| area(corners, triangle)).sum()
    }

    /// Sum of the triangles' borders is the polygon's border, each edge once.
    fn border_is_kept(count: u32, triangles: &[[u32; 3]]) -> bool {
        let mut edges = std::collections::BTreeMap::<(u32, u32), i32>::new();
        for &[a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from.min(to), from.max(to))).or_default() +=
                    if from < to { 1 } else { -1 };
            }
        }
        for i in 0..count {
            let (from, to) = (i, (i + 1) % count);
            *edges.entry((from.min(to), from.max(to))).or_default() -=
                if from < to { 1 } else { -1 };
        }
        edges.values().all(|&sum| sum == 0)
    }

    #[test]
    fn a_concave_quad_is_cut_at_its_reflex_corner() {
        let dart = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 4.0, 0.0]];
        assert_eq!(total(&dart), 4.0);
        assert!(cut(&dart).iter().all(|triangle| triangle.contains(&2)));
    }

    #[test]
    fn an_l_shape_keeps_its_area_whatever_side_it_is_seen_from() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for axis in 0..3 {
            let mut corners: Vec<[f64; 3]> = l
                .iter()
                .map(|p| {
                    let mut corner = [7.0; 3];
                    corner[(axis + 1) % 3] = p[0];
                    corner[(axis + 2) % 3] = p[1];
                    corner
                })
                .collect();
            assert_eq!(total(&corners), 3.0);
            corners.reverse();
            assert_eq!(total(&corners), 3.0);
        }
    }

    #[test]
    fn a_keyhole_polygon_keeps_its_hole() {
        let ring = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ];
        let corners: Vec<_> = ring.iter().map(|p| [p[0], p[1], 0.0]).collect();
        assert_eq!(cut(&corners).len(), 8);
        assert_eq!(total(&corners), 12.0);
    }

    #[test]
    fn collinear_and_repeated_corners_still_give_all_triangles() {
        let line: Vec<_> = (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        assert_eq!(cut(&line).len(), 4);
        assert_eq!(cut(&[[1.0; 3]; 5]).len(), 3);
        let square = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 0.0],
        ];
        assert_eq!(cut(&square).len(), 4);
        assert_eq!(total(&square), 4.0);
    }

    #[test]
    fn a_comb_of_many_teeth_is_cut_exactly() {
        let mut corners = vec![];
        for i in 0..1000 {
            corners.push([f64::from(i), if i % 2 == 0 { 0.0 } else { 8.0 }, 0.0]);
        }
        corners.push([999.0, -1.0, 0.0]);
        corners.push([0.0, -1.0, 0.0]);
        assert_eq!(cut(&corners).len(), 1000);
        assert_eq!(total(&corners), 999.0 + 999.0 * 4.0);
    }

    #[test]
    fn all_polygons_together_have_a_limit_and_are_fanned_beyond_it() {
        // The teeth hide the ears from one another: each is found after a long search.
        let count = 3000_u32;
        let tooth = |i| {
            let x = f64::from(i);
            [x, f64::from(i % 2) * 1000.0 - 0.001 * x * x / f64::from(count), 0.0]
        };
        let mut corners: Vec<[f64; 3]> = (1..count).map(tooth).collect();
        corners.push([f64::from(count) / 2.0, -1e6, 0.0]);
        let mut cutter = EarClipper::default();
        let mut triangles = Vec::new();
        cutter.cut(&corners, &mut triangles);
        let granted = TESTS_PER_CORNER * u64::from(count);
        assert!(cutter.tests > granted, "no hard polygon: {}", cutter.tests);
        // As if many of them had come before.
        let spent = FREE_TESTS + granted;
        cutter = EarClipper { earlier_tests: spent, earlier_corners: count.into(), ..cutter };
        cutter.cut(&corners, &mut triangles);
        // The last test begun is ended.
        assert!(cutter.tests <= granted + u64::from(count), "{}", cutter.tests);
        assert_eq!(triangles.len() as u32, count - 2);
        assert!(border_is_kept(count, &triangles));
    }

    #[test]
    fn non_finite_corners_do_not_stop_the_cutting() {
        let corners = [[f64::NAN; 3], [0.0; 3], [f64::INFINITY, 1.0, 0.0], [1.0; 3], [1e308; 3]];
        assert_eq!(cut(&corners).len(), 3);
    }

    proptest! {
        #[test]
        fn any_polygon_gives_two_triangles_less_than_corners_and_keeps_its_border(
            corners in prop::collection::vec(prop::array::uniform3(-4_i8..4), 3..24)
        ) {
            let corners: Vec<_> = corners.iter().map(|c| c.map(f64::from)).collect();
            let triangles = cut(&corners);
            prop_assert_eq!(triangles.len(), corners.len() - 2);
            prop_assert!(border_is_kept(corners.len() as u32, &triangles));
        }

        #[test]
        fn star_shaped_polygons_keep_their_area(radii in prop::collection::vec(1_u8..9, 5..40)) {
            let step = std::f64::consts::TAU / radii.len() as f64;
            let corners: Vec<_> = radii.iter().enumerate().map(|(i, &r)| {
                let (sin, cos) = (i as f64 * step).sin_cos();
                [f64::from(r) * cos, f64::from(r) * sin, f64::from(r) * cos]
            }).collect();
            let normal = newell_normal(&corners);
            let expected = normal.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0;
            prop_assert!((total(&corners) - expected).abs() < 1e-9 * expected);
        }
    }
}
