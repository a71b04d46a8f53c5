//! The triangles around a vertex, divided along creases; each part has one normal.
//!
//! Memory: 40 bytes a triangle.

use glam::DVec3;

use crate::paint::drawing::DrawnCorner;

/// Facets of a round surface whose vertices lie so far off it that their heights are this many times
/// as much may meet at an angle of 1 radian: half by their vertices, half by its curvature.
const BEND: f64 = 12.0;
/// Edges of facets do not hide creases that are sharper, degrees.
const MOST_BEND_DEG: f64 = 30.0;

/// Room for one vertex after another.
pub struct Fans {
    /// Dihedral angles with a smaller cosine divide.
    cosine: f64,
    crease: f64,
    slack: f64,
    /// Each corner's part, by the first corner in it.
    parts: Vec<usize>,
    /// Edges at the vertex: the other end, the corner, whether the edge leads there.
    edges: Vec<(u32, usize, bool)>,
    /// Neighbours of which one has no normal at least.
    narrow: Vec<[usize; 2]>,
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
            parts: Vec::new(),
            edges: Vec::new(),
            narrow: Vec::new(),
            is_in: Vec::new(),
        }
    }

    /// Of each corner around one vertex the first corner of its part.
    pub fn divide(&mut self, corners: &[DrawnCorner]) -> &[usize] {
        self.parts.clear();
        self.parts.extend(0..corners.len());
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
            if a == DVec3::ZERO || b == DVec3::ZERO {
                self.narrow.push([one, other]);
            } else if a.dot(b) >= self.cosine
                || a.dot(b) >= self.bent_cosine(corners[one].height.min(corners[other].height))
            {
                unite(&mut self.parts, one, other);
            }
        }
        self.take_in_narrow(corners);
        for at in 0..self.parts.len() {
            self.parts[at] = self.parts[self.parts[at]];
        }
        &self.parts
    }

    /// The cosine at which facets divide of which the smaller one has this height.
    fn bent_cosine(&self, height: f32) -> f64 {
        let bend = BEND * self.slack / f64::from(height).max(f64::MIN_POSITIVE);
        self.crease.max(bend.min(MOST_BEND_DEG.to_radians())).cos()
    }

    /// Gives triangles without a normal to one neighbour each, so that they join no two.
    fn take_in_narrow(&mut self, corners: &[DrawnCorner]) {
        let has_normal = |at: usize| normal_of(&corners[at]) != DVec3::ZERO;
        self.is_in.clear();
        self.is_in.extend((0..corners.len()).map(has_normal));
        loop {
            let waiting = self.narrow.len();
            let (parts, is_in) = (&mut self.parts, &mut self.is_in);
            self.narrow.retain(|&[one, other]| {
                if is_in[one] != is_in[other] {
                    unite(parts, one, other);
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

/// Joins the parts of two corners.
fn unite(parts: &mut [usize], one: usize, other: usize) {
    let [a, b] = [one, other].map(|at| root(parts, at));
    parts[a.max(b)] = a.min(b);
}

/// The first of a part, with the way there made shorter.
fn root(parts: &mut [usize], mut at: usize) -> usize {
    while parts[at] != at {
        parts[at] = parts[parts[at]];
        at = parts[at];
    }
    at
}

fn normal_of(corner: &DrawnCorner) -> DVec3 {
    DVec3::from(corner.normal.map(f64::from))
}

/// The mean of normals, weighted by their angles; that of the first where they cancel.
pub fn mean_normal<'c>(corners: impl Iterator<Item = &'c DrawnCorner> + Clone) -> [f32; 3] {
    let first = corners.clone().next().map_or(DVec3::ZERO, normal_of);
    let sum: DVec3 = corners.map(|corner| normal_of(corner) * f64::from(corner.angle)).sum();
    let mean = sum.try_normalize().or(first.try_normalize()).unwrap_or(DVec3::Z);
    mean.as_vec3().to_array()
}
