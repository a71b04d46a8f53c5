//! Walks a tree: the triangle nearest to a point, and whether a ray meets any.

use glam::DVec3;

use crate::deviate::pages::Pages;
use crate::deviate::tree::{Bounds, Node, Tree};
use crate::deviate::triangles::{Triangle, Triangles};
use crate::geom::{are_within, closest_on_triangle};
use crate::store::{Sequence, StoreError};

/// What is nearest to a point.
#[derive(Clone, Copy)]
pub(crate) struct Near {
    pub(crate) distance_squared: f64,
    pub(crate) point: DVec3,
    /// Of the angle between the normals, the cosine without its sign; negative where either has
    /// none.
    pub(crate) cosine: f64,
    triangle: Triangle,
}

impl Near {
    /// Whether this goes before another: nearer, then more alike, then first in the file.
    fn goes_before(&self, other: &Self) -> bool {
        let order = self.distance_squared.total_cmp(&other.distance_squared);
        let order = order.then(other.cosine.total_cmp(&self.cosine));
        order.then(self.triangle.number.cmp(&other.triangle.number)).is_lt()
    }
}

/// The cosine of the angle between two normals, without its sign; -1 where either has none.
fn cosine_between(one: DVec3, other: DVec3) -> f64 {
    let lengths = one.length() * other.length();
    if lengths > 0.0 && lengths.is_finite() {
        (one.dot(other).abs() / lengths).min(1.0)
    } else {
        -1.0
    }
}

/// What `point` with `normal` has nearest on one triangle; `None` if that is farther than `bound`,
/// squared.
#[inline]
pub(crate) fn near_on(
    point: DVec3,
    normal: DVec3,
    triangle: &Triangle,
    bound: f64,
) -> Option<Near> {
    let closest = closest_on_triangle(point, triangle.points());
    let distance_squared = point.distance_squared(closest);
    (distance_squared <= bound).then(|| {
        let cosine = cosine_between(normal, triangle.normal());
        Near { distance_squared, point: closest, cosine, triangle: *triangle }
    })
}

/// What a search within a reach ends with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Within {
    /// A triangle settled the question.
    Settled,
    /// None of those that were asked did; the square of the distance to the nearest one.
    Open(f64),
    /// Nothing is within the reach.
    Nothing,
}

/// All that may be within some reach of a piece of a plane.
struct Around {
    low: DVec3,
    high: DVec3,
    normal: DVec3,
    on_plane: DVec3,
    reach: f64,
}

impl Around {
    /// Whether a box has a part in it; some have not though this says so.
    fn meets(&self, bounds: &Bounds) -> bool {
        let (low, high) = (DVec3::from(bounds.low), DVec3::from(bounds.high));
        if low.cmpgt(self.high).any() || high.cmplt(self.low).any() {
            return false;
        }
        let half = (high - low) / 2.0;
        let from_plane = self.normal.dot(low.midpoint(high) - self.on_plane).abs();
        from_plane <= self.reach + self.normal.abs().dot(half)
    }
}

/// What a box has in it, while it waits to be looked at.
#[derive(Clone, Copy)]
struct Open {
    /// Of the distance to what is in it, at least.
    bound: f64,
    /// Level of the box; what is in the lowest ones are triangles.
    level: u32,
    first: u32,
    count: u32,
}

impl Open {
    fn new(bound: f64, level: u32, node: &Node) -> Self {
        Self { bound, level, first: node.first, count: node.count }
    }
}

/// A walker of one tree; each worker has its own.
pub(crate) struct Walker<'t> {
    triangles: Pages<'t, Triangles<'t>>,
    levels: Vec<Pages<'t, Sequence<Node>>>,
    /// Boxes to look into, the next one last.
    stack: Vec<Open>,
    /// What the last point had nearest: a good guess for the next.
    last: Option<Triangle>,
}

impl<'t> Walker<'t> {
    /// A walker whose pages take about `share_bytes`.
    pub(crate) fn new(tree: &'t Tree<'_>, share_bytes: u64) -> Self {
        let levels = tree.levels.iter().map(|level| Pages::new(level, share_bytes / 8));
        Self {
            triangles: Pages::new(&tree.triangles, share_bytes / 2),
            levels: levels.collect(),
            stack: Vec::new(),
            last: None,
        }
    }

    /// What is nearest to `point`; of several, what is most like `normal`; `None` in an empty tree.
    pub(crate) fn nearest(
        &mut self,
        point: DVec3,
        normal: DVec3,
    ) -> Result<Option<Near>, StoreError> {
        let guess = |triangle| near_on(point, normal, &triangle, f64::INFINITY);
        let mut best = self.last.and_then(guess);
        let farthest = |best: &Option<Near>| best.map_or(f64::INFINITY, |b| b.distance_squared);
        self.start();
        while let Some(open) = self.stack.pop() {
            if open.bound > farthest(&best) {
                continue;
            }
            if open.level == 0 {
                for triangle in self.triangles.group(open.first, open.count)? {
                    let near = near_on(point, normal, triangle, farthest(&best));
                    best = match (best, near) {
                        (Some(best), Some(near)) if !near.goes_before(&best) => Some(best),
                        (best, near) => near.or(best),
                    };
                }
                continue;
            }
            let most = farthest(&best);
            self.enter(&open, |bounds| {
                Some(bounds.distance_squared(point)).filter(|b| *b <= most)
            })?;
        }
        self.last = best.map(|best| best.triangle);
        Ok(best)
    }

    /// Looks for what is within `reach` of `point`, nearer and nearer, until a triangle `settles` the
    /// question.
    pub(crate) fn within(
        &mut self,
        point: DVec3,
        reach: f64,
        settles: impl Fn(&Triangle) -> bool,
    ) -> Result<Within, StoreError> {
        let mut bound_squared = reach * reach;
        let mut nearest = None;
        let mut is_settled = |triangle: &Triangle, bound_squared: &mut f64| {
            let closest = closest_on_triangle(point, triangle.points());
            let distance_squared = point.distance_squared(closest);
            if distance_squared > *bound_squared {
                return false;
            }
            *bound_squared = distance_squared;
            nearest = Some(*triangle);
            settles(triangle)
        };
        let mut found = self.last.is_some_and(|last| is_settled(&last, &mut bound_squared));
        self.start();
        while !found && let Some(open) = self.stack.pop() {
            if open.bound > bound_squared {
                continue;
            }
            if open.level == 0 {
                let mut triangles = self.triangles.group(open.first, open.count)?.iter();
                found = triangles.any(|triangle| is_settled(triangle, &mut bound_squared));
                continue;
            }
            let near = |b: &f64| *b <= bound_squared;
            self.enter(&open, |bounds| Some(bounds.distance_squared(point)).filter(near))?;
        }
        self.last = nearest;
        Ok(match nearest {
            _ if found => Within::Settled,
            Some(_) => Within::Open(bound_squared),
            None => Within::Nothing,
        })
    }

    /// Whether any triangle has a point no farther than `reach` from a `piece` of a plane, but for
    /// rounding.
    pub(crate) fn reaches(&mut self, piece: &[DVec3; 3], reach: f64) -> Result<bool, StoreError> {
        let [a, b, c] = *piece;
        let around = Around {
            low: a.min(b).min(c) - reach,
            high: a.max(b).max(c) + reach,
            normal: (b - a).cross(c - a).normalize_or_zero(),
            on_plane: a,
            reach,
        };
        self.start();
        while let Some(open) = self.stack.pop() {
            if open.level == 0 {
                for triangle in self.triangles.group(open.first, open.count)? {
                    if are_within(reach, piece, &triangle.points()) {
                        self.last = Some(*triangle);
                        return Ok(true);
                    }
                }
                continue;
            }
            self.enter(&open, |bounds| around.meets(bounds).then_some(0.0))?;
        }
        Ok(false)
    }

    /// Forgets what the last point had nearest: then an answer depends on the tree and the point.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// A triangle that the ray meets and light does not pass, whichever is found first.
    pub(crate) fn blocker(
        &mut self,
        origin: DVec3,
        direction: DVec3,
    ) -> Result<Option<Triangle>, StoreError> {
        let inverse = direction.recip();
        self.start();
        while let Some(open) = self.stack.pop() {
            if open.level == 0 {
                for triangle in self.triangles.group(open.first, open.count)? {
                    if triangle.is_pane == 0 && is_met(origin, direction, triangle) {
                        return Ok(Some(*triangle));
                    }
                }
                continue;
            }
            // What stops the ray is near more often than not.
            self.enter(&open, |bounds| bounds.entered(origin, inverse))?;
        }
        Ok(None)
    }

    /// Begins with all boxes of the highest level, which is one; of an empty tree there is none.
    fn start(&mut self) {
        self.stack.clear();
        let level = self.levels.len() as u32;
        self.stack.extend((level > 0).then_some(Open { bound: 0.0, level, first: 0, count: 1 }));
    }

    /// Puts the boxes within one onto the stack that `bound` is told of, the nearest last.
    #[inline]
    fn enter(
        &mut self,
        open: &Open,
        bound: impl Fn(&Bounds) -> Option<f64>,
    ) -> Result<(), StoreError> {
        let (from, level) = (self.stack.len(), open.level - 1);
        for node in self.levels[level as usize].group(open.first, open.count)? {
            if let Some(bound) = bound(&node.bounds) {
                self.stack.push(Open::new(bound, level, node));
            }
        }
        self.stack[from..].sort_unstable_by(|a, b| b.bound.total_cmp(&a.bound));
        Ok(())
    }
}

/// Whether a ray meets a triangle, in floating point.
///
/// Source: Moeller and Trumbore 1997, Fast, minimum storage ray-triangle intersection.
#[inline]
pub(crate) fn is_met(origin: DVec3, direction: DVec3, triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.points();
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    // All parts are compared with the determinant, whatever its sign.
    let sign = determinant.signum();
    let most = determinant.abs();
    let from = origin - a;
    let u = from.dot(across) * sign;
    if most == 0.0 || u < 0.0 || u > most {
        return false;
    }
    let up = from.cross(ab);
    let v = direction.dot(up) * sign;
    v >= 0.0 && u + v <= most && ac.dot(up) * sign > 0.0
}
