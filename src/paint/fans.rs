//! The triangles around a vertex, divided along creases; each part has one normal.
//!
//! Memory: 40 bytes a triangle.

use glam::DVec3;

use crate::paint::drawing::DrawnCorner;
use crate::store::Parts;

/// Facets of a round surface whose vertices lie so far off it that their heights are this many times
/// as much may meet at an angle of 1 radian: half by their vertices, half by its curvature.
const BEND: f64 = 12.0;
/// Edges of facets do not hide creases that are sharper, degrees.
const MOST_BEND_DEG: f64 = 30.0;

/// Of facets whose height is less than so many times as much no normal tells anything.
const NARROW: f64 = 4.0;

/// Nor of those that are so much narrower than the widest at their vertex: three vertices on one
/// crease.
const LEAST_SHARE: f64 = 1e-3;

/// Room for one vertex after another.
pub struct Fans {
    /// Dihedral angles with a smaller cosine divide.
    cosine: f64,
    crease: f64,
    slack: f64,
    parts: Parts,
    /// Each corner's part, by the first corner in it.
    firsts: Vec<usize>,
    /// Edges at the vertex: the other end, the corner, whether the edge leads there.
    edges: Vec<(u32, usize, bool)>,
    /// Neighbours of which one has no normal at least.
    narrow: Vec<[usize; 2]>,
    /// Corners of triangles whose normals count.
    counts: Vec<bool>,
    /// Corners that belong to a part.
    is_in: Vec<bool>,
}

impl Fans {
    /// Divided where the dihedral angle is larger, degrees, and larger than `slack` can bend facets of
    /// one round surface.
    pub fn new(crease_deg: f64, slack: f64) -> Self {
        let crease = crease_deg.to_radians();
        Self {
            cosine: crease.cos(),
            crease,
            slack,
            parts: Parts::default(),
            firsts: Vec::new(),
            edges: Vec::new(),
            narrow: Vec::new(),
            counts: Vec::new(),
            is_in: Vec::new(),
        }
    }

    /// Of each corner around one vertex the first corner of its part.
    pub fn divide(&mut self, corners: &[DrawnCorner]) -> &[usize] {
        self.parts.reset(corners.len());
        self.find_normals(corners);
        self.edges.clear();
        for (at, corner) in corners.iter().enumerate() {
            let [next, last] = corner.others;
            self.edges.extend([(next, at, true), (last, at, false)]);
        }
        self.edges.sort_unstable();
        for edge in self.edges.chunk_by(|one, other| one.0 == other.0) {
            // Where more than two meet, all are apart.
            let &[(_, one, leads), (_, other, comes)] = edge else { continue };
            if leads == comes {
                continue;
            }
            let [a, b] = [one, other].map(|at| normal_of(&corners[at]));
            if !(self.counts[one] && self.counts[other]) {
                self.narrow.push([one, other]);
            } else if a.dot(b) >= self.cosine
                || a.dot(b) >= self.bent_cosine(corners[one].height.min(corners[other].height))
            {
                self.parts.unite(one, other);
            }
        }
        self.take_in_narrow();
        self.firsts.clear();
        self.firsts.extend_from_slice(self.parts.firsts());
        &self.firsts
    }

    /// Which triangles are wide enough that their normals count: the widest at least.
    fn find_normals(&mut self, corners: &[DrawnCorner]) {
        let heights = corners.iter().map(|corner| f64::from(corner.height));
        let widest = heights.fold(0.0, f64::max);
        let least = (NARROW * self.slack).clamp(LEAST_SHARE * widest, 0.5 * widest);
        self.counts.clear();
        self.counts.extend(
            corners.iter().map(|corner| {
                normal_of(corner) != DVec3::ZERO && f64::from(corner.height) >= least
            }),
        );
    }

    /// The mean of the normals of a part, weighted by their angles; that of the first where they
    /// cancel.
    pub fn normal(&self, corners: &[DrawnCorner], part: usize) -> [f32; 3] {
        let own = || (0..corners.len()).filter(|at| self.firsts[*at] == part);
        let counting = || own().filter(|at| self.counts[*at]);
        let first =
            counting().next().or(own().next()).map_or(DVec3::Z, |at| normal_of(&corners[at]));
        let sum: DVec3 =
            counting().map(|at| normal_of(&corners[at]) * f64::from(corners[at].angle)).sum();
        let mean = sum.try_normalize().or(first.try_normalize()).unwrap_or(DVec3::Z);
        mean.as_vec3().to_array()
    }

    /// The cosine at which facets divide of which the smaller one has this height.
    fn bent_cosine(&self, height: f32) -> f64 {
        let bend = BEND * self.slack / f64::from(height).max(f64::MIN_POSITIVE);
        self.crease.max(bend.min(MOST_BEND_DEG.to_radians())).cos()
    }

    /// Gives triangles without a normal to one neighbour each, so that they join no two.
    fn take_in_narrow(&mut self) {
        self.is_in.clone_from(&self.counts);
        loop {
            let waiting = self.narrow.len();
            let (parts, is_in) = (&mut self.parts, &mut self.is_in);
            self.narrow.retain(|&[one, other]| {
                if is_in[one] != is_in[other] {
                    parts.unite(one, other);
                    (is_in[one], is_in[other]) = (true, true);
                }
                !(is_in[one] && is_in[other])
            });
            if self.narrow.len() == waiting {
                break;
            }
        }
        self.narrow.clear();
    }
}

fn normal_of(corner: &DrawnCorner) -> DVec3 {
    DVec3::from(corner.normal.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan around vertex 0 of triangles with these normals and heights, closed.
    fn fan(triangles: &[(DVec3, f32)]) -> Vec<DrawnCorner> {
        let count = triangles.len() as u32;
        let corner = |(at, &(normal, height)): (u32, &(DVec3, f32))| DrawnCorner {
            vertex: 0,
            triangle: at,
            corner: 0,
            look: 0,
            others: [1 + at, 1 + (at + 1) % count],
            normal: normal.normalize_or_zero().as_vec3().to_array(),
            angle: 1.0,
            height,
        };
        (0..).zip(triangles).map(corner).collect()
    }

    #[test]
    fn a_fan_is_divided_where_two_creases_meet_it() {
        let (up, side) = (DVec3::Z, DVec3::X);
        let corners = fan(&[(up, 1.0), (up, 1.0), (side, 1.0), (side, 1.0), (up, 1.0)]);
        let mut fans = Fans::new(12.0, 0.0);
        assert_eq!(fans.divide(&corners), [0, 0, 2, 2, 0]);
        assert_eq!(fans.normal(&corners, 2), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_narrow_triangle_goes_with_one_neighbour_and_has_no_say() {
        let (up, side, none) = (DVec3::Z, DVec3::X, DVec3::ZERO);
        let corners = fan(&[(up, 1.0), (none, 0.0), (side, 1.0), (none, 0.0)]);
        let mut fans = Fans::new(12.0, 0.0);
        let parts = fans.divide(&corners).to_vec();
        assert_ne!(parts[0], parts[2], "it joins no two");
        assert!([parts[0], parts[2]].contains(&parts[1]));
        assert_eq!(fans.normal(&corners, parts[0]), [0.0, 0.0, 1.0]);
        // Of a bent facet that is less wide than the slack the normal tells as little.
        let corners = fan(&[(up, 1.0), (side, 0.1), (up, 1.0)]);
        assert_eq!(Fans::new(12.0, 0.0).divide(&corners), [0, 1, 0]);
        assert_eq!(Fans::new(12.0, 0.05).divide(&corners), [0, 0, 0]);
    }

    #[test]
    fn facets_of_round_surfaces_are_bent_and_creases_are_not() {
        let tilted =
            |degrees: f64| DVec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
        let parts = |degrees, slack, height| {
            let corners = fan(&[(DVec3::Z, height), (tilted(degrees), height), (DVec3::Z, height)]);
            let mut fans = Fans::new(12.0, slack);
            fans.divide(&corners)[1]
        };
        assert_eq!(parts(20.0, 0.1, 3.0), 0);
        assert_eq!(parts(20.0, 0.1, 30.0), 1, "large facets are not bent so much");
        assert_eq!(parts(20.0, 0.0, 3.0), 1);
        assert_eq!(parts(35.0, 0.1, 1.0), 1);
    }
}
