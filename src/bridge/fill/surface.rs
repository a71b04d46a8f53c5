//! A smooth surface through a rim that goes on as the rim's triangles do.
//!
//! The ball (or plane) is taken that fits the rim and its triangles' normals best. What the rim and
//! the corners behind it deviate from it, along its normals, is continued by a spline over the
//! ball's stereographic chart. So balls and planes are met exactly, and other surfaces as well as
//! thin plates do.
//!
//! Source: Guennebaud, Gross 2007, Algebraic point set surfaces, section 4.2 (the fit).

use glam::{DVec2, DVec3};

use crate::bridge::fill::outline::{Outline, rim_normals};
use crate::bridge::fill::spline::{Site, Spline};

/// Corners of the rim, and corners behind it, whose deviation is continued.
const MOST_SITES: usize = 160;
/// Triangles that lean away from the ball by more than 60 degrees do not go on.
const LEAN_COSINE: f64 = 0.5;

/// Heights that are zero everywhere, until they are known.
const FLAT: [Site; 3] = [
    Site { place: DVec2::ZERO, value: 0.0, give: 0.0 },
    Site { place: DVec2::X, value: 0.0, give: 0.0 },
    Site { place: DVec2::Y, value: 0.0, give: 0.0 },
];
/// How easily a corner of the rim, or one behind it, is missed, in cubed lengths of the rim's
/// edges or cubed distances from the rim. A noisy rim of a flat face throws the surface up six
/// times its noise at 0, a saddle is flattened at 100.
const GIVE: f64 = 1.0;

/// A ball, or a plane, as the zeros of `constant + linear * p + square * p * p`.
#[derive(Clone, Copy, Debug)]
struct Ball {
    constant: f64,
    linear: DVec3,
    square: f64,
}

/// The surface; everything inside is in diameters of the loop, from its centre.
pub struct Surface {
    centre: DVec3,
    unit: f64,
    ball: Ball,
    /// The point of the chart's origin, its normal and two directions across.
    pole: DVec3,
    frame: [DVec3; 3],
    heights: Spline,
}

impl Surface {
    /// The surface through a loop; `edge` is the length of its triangles' edges. `None` where it
    /// is no function over the ball.
    pub fn through(
        points: &[DVec3],
        opposite: &[Option<DVec3>],
        outline: &Outline,
        edge: f64,
    ) -> Option<Self> {
        let (centre, unit) = (outline.centre, outline.diameter);
        let own = |p: DVec3| (p - centre) / unit;
        let rim: Vec<DVec3> = points.iter().map(|&p| own(p)).collect();
        let behind: Vec<Option<DVec3>> = opposite.iter().map(|o| o.map(own)).collect();
        let mut normals = rim_normals(&rim, &behind);
        let mut ball = Ball::fit(&rim, &behind, &normals, outline.normal);
        let lean = |i: usize, ball: &Ball, normal: &DVec3| {
            ball.slope(rim[i]).normalize_or_zero().dot(*normal) < LEAN_COSINE
        };
        let before = normals.iter().flatten().count();
        for (i, normal) in normals.iter_mut().enumerate() {
            *normal = normal.filter(|normal| !lean(i, &ball, normal));
        }
        if normals.iter().flatten().count() < before {
            ball = Ball::fit(&rim, &behind, &normals, outline.normal);
        }
        let normal = ball.slope(DVec3::ZERO).try_normalize().unwrap_or(outline.normal);
        let pole = ball.foot(DVec3::ZERO, normal);
        let across = normal.any_orthonormal_vector();
        let frame = [across, normal.cross(across), normal];
        let flat = Spline::through(&FLAT)?;
        let mut surface = Self { centre, unit, ball, pole, frame, heights: flat };
        let sites = surface.sites(&rim, &behind, &normals, edge / unit);
        surface.heights = Spline::through(&sites)?;
        Some(surface)
    }

    /// The point of the surface over the ball's point that is nearest.
    pub fn nearest(&self, place: DVec3) -> DVec3 {
        let own = (place - self.centre) / self.unit;
        let foot = self.ball.foot(own, self.frame[2]);
        let height = self.heights.at(self.chart(foot));
        self.centre + self.unit * (foot + height * self.ball.normal(foot))
    }

    /// The ball's normal near a place.
    pub fn normal(&self, place: DVec3) -> DVec3 {
        let own = (place - self.centre) / self.unit;
        self.ball.normal(self.ball.foot(own, self.frame[2]))
    }

    /// Heights over the ball: of the rim, and of its triangles a little behind it.
    fn sites(
        &self,
        rim: &[DVec3],
        behind: &[Option<DVec3>],
        normals: &[Option<DVec3>],
        edge: f64,
    ) -> Vec<Site> {
        let count = rim.len();
        let taken = count.min(MOST_SITES);
        let chosen: Vec<usize> = (0..taken).map(|k| k * count / taken).collect();
        let site = |p: DVec3| {
            let foot = self.ball.foot(p, self.frame[2]);
            let value = (p - foot).dot(self.ball.normal(foot));
            Site { place: self.chart(foot), value, give: 0.0 }
        };
        let own = |i: usize| {
            let edge = rim[i].distance(rim[(i + 1) % count]) * (count as f64 / taken as f64);
            Site { give: GIVE * edge * edge * edge, ..site(rim[i]) }
        };
        let mut sites: Vec<Site> = chosen.iter().map(|&i| own(i)).collect();
        for &i in &chosen {
            if let (Some(corner), Some(_)) = (behind[i], normals[i]) {
                let next = rim[(i + 1) % count];
                let middle = (rim[i] + next) / 2.0;
                // A long triangle tells how the surface runs near the rim, not where it ends.
                let reach = 2.0 * edge.max(rim[i].distance(next));
                let share = (reach / middle.distance(corner)).min(1.0);
                let behind = middle + share * (corner - middle);
                let mut back = site(behind);
                // An edge lies below its ends where the surface is round; that is no slope.
                let ends = (site(rim[i]).value + site(next).value) / 2.0;
                back.value -= (site(middle).value - ends) * (1.0 - share);
                let distance = behind.distance(middle);
                back.give = GIVE * distance * distance * distance;
                sites.push(back);
            }
        }
        sites.retain(|site| site.place.is_finite() && site.value.is_finite());
        sites
    }

    /// Stereographic coordinates of a point of the ball.
    fn chart(&self, foot: DVec3) -> DVec2 {
        let [u, v, up] = self.frame;
        let off = foot - self.pole;
        // Far beyond the equator the chart has no end.
        let stretch = 2.0 / (1.0 + self.ball.normal(foot).dot(up)).max(0.1);
        stretch * DVec2::new(off.dot(u), off.dot(v))
    }
}

impl Ball {
    /// Normals are taken at the middles of triangles, distances at the rim.
    fn fit(
        rim: &[DVec3],
        behind: &[Option<DVec3>],
        normals: &[Option<DVec3>],
        loop_normal: DVec3,
    ) -> Self {
        let count = rim.len();
        let (mut weight, mut place, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let (mut squares, mut products) = (0.0, 0.0);
        for i in 0..count {
            let next = rim[(i + 1) % count];
            if let (Some(n), Some(corner)) = (normals[i], behind[i]) {
                let (w, p) = (rim[i].distance(next), (rim[i] + next + corner) / 3.0);
                weight += w;
                place += w * p;
                normal += w * n;
                squares += w * p.dot(p);
                products += w * p.dot(n);
            }
        }
        let mean_square = rim.iter().map(|p| p.dot(*p)).sum::<f64>() / count as f64;
        let spread = if weight > 0.0 { squares - place.dot(place) / weight } else { 0.0 };
        let plane = Self { constant: 0.0, linear: loop_normal, square: 0.0 };
        if spread <= 1e-12 * squares {
            return plane;
        }
        let square = (products - place.dot(normal) / weight) / spread / 2.0;
        let linear = (normal - 2.0 * square * place) / weight;
        // The rim's centre is the origin.
        let constant = -square * mean_square;
        let size = linear.length_squared() - 4.0 * square * constant;
        if size.is_finite() && size > 1e-6 {
            let scale = 1.0 / size.sqrt();
            Self { constant: constant * scale, linear: linear * scale, square: square * scale }
        } else {
            plane
        }
    }

    fn slope(&self, place: DVec3) -> DVec3 {
        self.linear + 2.0 * self.square * place
    }

    /// Of a point on the ball.
    fn normal(&self, foot: DVec3) -> DVec3 {
        self.slope(foot).normalize_or_zero()
    }

    /// The nearest point of the ball; towards `fallback` from its middle.
    fn foot(&self, place: DVec3, fallback: DVec3) -> DVec3 {
        let slope = self.slope(place);
        let steep = slope.length();
        // The slope is 1 on the ball itself, and 0 in its middle.
        let direction = if steep > 0.05 { slope / steep } else { fallback };
        let value = self.constant + self.linear.dot(place) + self.square * place.length_squared();
        let root = (steep * steep - 4.0 * self.square * value).max(0.0).sqrt();
        place - direction * (2.0 * value / (steep + root))
    }
}
