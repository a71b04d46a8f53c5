//! Creases of the surface that run into an opening, and how they go on in it.
//!
//! Two that lie on one line, or on one arc of a circle, are joined. Three to six that meet in a point are led to it, so that a
//! corner that was cut off is there again.

use glam::{DMat3, DVec3};

/// A crease enters the opening if the surface around lies 60 degrees to the side, or behind.
const INTO_COSINE: f64 = 0.5;
/// Creases of an arc leave its chord by up to 60 degrees.
const ARC_COSINE: f64 = 0.5;
/// How much more than the crease a face may turn, as a difference of cosines.
const ARC_SLACK: f64 = 0.1;
/// Points of one arc.
const MOST_OF_ARC: f64 = 256.0;
/// Creases that may end at a loop; where there are more, the surface is round.
const MOST_CREASES: usize = 64;
/// Creases that may meet in a corner; cones and domes of few facets have more.
const MOST_AT_CORNER: usize = 6;
/// Creases of a corner or an arc are bent by 30 degrees or more, not those of coarse domes.
const SHARP_COSINE: f64 = 0.866;
/// Triangles that make a crease do not lie on one another: their angle is at least 6 degrees.
const LEAST_SINE: f64 = 0.1;
/// A corner is at most this far from the rim, in diameters of the loop.
const CORNER_REACH: f64 = 0.75;
/// Lines meet if they pass their corner within this part of the loop's diameter, or within a cell.
const CORNER_MISS: f64 = 0.02;
/// A stretch of the rim is the crease itself if it leaves it by less than this part of its length.
const ALONG_RIM: f64 = 0.02;

/// Cosines of the angles that matter.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    crease_cosine: f64,
    /// Whether creases are joined by arcs.
    pub arcs: bool,
}

impl Angles {
    pub fn new(crease_deg: f64) -> Self {
        Self { crease_cosine: cosine(crease_deg.clamp(0.0, 90.0).to_radians()), arcs: true }
    }
}

/// Where an opening is to be divided.
pub struct Creases {
    /// Corners of the loop at which creases arrive, ascending.
    pub ends: Vec<usize>,
    /// The point in which they meet; without it the two ends are joined.
    pub apex: Option<DVec3>,
    /// Points between the two ends, from the first to the second.
    pub path: Vec<DVec3>,
}

/// A corner of the loop with a crease.
struct Arrival {
    corner: usize,
    direction: DVec3,
    normals: [DVec3; 2],
    /// From the corner into the surface around.
    outward: DVec3,
}

impl Arrival {
    fn is_sharp(&self) -> bool {
        self.normals[0].dot(self.normals[1]) < SHARP_COSINE
    }
}

/// Creases by which the loop is to be divided; the parts may have more of them.
pub fn find_creases(
    points: &[DVec3],
    opposite: &[Option<DVec3>],
    normals: &[Option<DVec3>],
    angles: Angles,
    cell: f64,
) -> Option<Creases> {
    let count = points.len();
    let mut arrivals = Vec::new();
    for corner in 0..count {
        let before = (corner + count - 1) % count;
        let (Some(first), Some(second)) = (normals[before], normals[corner]) else { continue };
        let (Some(behind), Some(ahead)) = (opposite[before], opposite[corner]) else { continue };
        let cross = first.cross(second);
        // Of a fold back onto itself the direction is noise.
        if first.dot(second) < angles.crease_cosine && cross.length() > LEAST_SINE {
            let direction = cross.normalize();
            let outward = behind + ahead - 2.0 * points[corner];
            arrivals.push(Arrival { corner, direction, normals: [first, second], outward });
        }
    }
    if arrivals.len() < 2 || arrivals.len() > MOST_CREASES {
        return None;
    }
    one_line(points, &arrivals, angles, cell, false)
        .or_else(|| meeting_point(points, &arrivals, cell))
        .or_else(|| one_line(points, &arrivals, angles, cell, true).filter(|_| angles.arcs))
}

/// The two ends that lie best on one line, or on one arc.
fn one_line(
    points: &[DVec3],
    arrivals: &[Arrival],
    angles: Angles,
    cell: f64,
    is_arc: bool,
) -> Option<Creases> {
    let mut best: Option<(f64, [&Arrival; 2])> = None;
    for (i, one) in arrivals.iter().enumerate() {
        for two in &arrivals[i + 1..] {
            let chord = (points[two.corner] - points[one.corner]).normalize_or_zero();
            let Some(straight) = angles.straightness(one, two, chord, is_arc) else { continue };
            if best.is_none_or(|(so_far, _)| straight > so_far)
                && !runs_along_rim(points, [one.corner, two.corner], cell)
            {
                best = Some((straight, [one, two]));
            }
        }
    }
    let (_, [one, two]) = best?;
    let ends = vec![one.corner, two.corner];
    let path = if is_arc { arc(points, one, two, cell) } else { Vec::new() };
    Some(Creases { ends, apex: None, path })
}

impl Angles {
    /// Cosine of the angle between two creases and the line that joins them, if they go on in each
    /// other.
    fn straightness(
        &self,
        one: &Arrival,
        two: &Arrival,
        chord: DVec3,
        is_arc: bool,
    ) -> Option<f64> {
        // Where the rim runs along the crease a little, what is around lies to the side.
        let leans = |a: &Arrival, ahead: DVec3| a.outward.normalize_or_zero().dot(ahead);
        let into = leans(one, chord) <= INTO_COSINE && leans(two, -chord) <= INTO_COSINE;
        let [first, second] = [one, two].map(|arrival| along(arrival.direction, chord));
        let straight = first.dot(chord).min(second.dot(chord));
        // What is left of the crease at one end is right of it at the other.
        let left = one.normals[0].dot(two.normals[1]);
        let right = one.normals[1].dot(two.normals[0]);
        if !is_arc {
            let is_straight = straight.min(left).min(right) >= self.crease_cosine;
            return (into && is_straight).then_some(straight);
        }
        // On an arc both ends lean to the same side of the chord, by the same angle; one face
        // stays as it is, the other turns with the crease.
        let is_even = (first + second).normalize_or_zero().dot(chord) >= self.crease_cosine;
        let turns = first.dot(second) - ARC_SLACK;
        let goes_on = left.max(right) >= self.crease_cosine && left.min(right) >= turns;
        let is_sharp = one.is_sharp() && two.is_sharp();
        (into && is_even && goes_on && is_sharp && straight >= ARC_COSINE).then_some(straight)
    }
}

fn along(direction: DVec3, chord: DVec3) -> DVec3 {
    if direction.dot(chord) < 0.0 { -direction } else { direction }
}

/// Points of a curve between two ends, along their creases: a cubic, close to an arc of a circle.
fn arc(points: &[DVec3], one: &Arrival, two: &Arrival, cell: f64) -> Vec<DVec3> {
    let (start, end) = (points[one.corner], points[two.corner]);
    let chord = end - start;
    let axis = chord.normalize_or_zero();
    let [first, second] = [one, two].map(|arrival| along(arrival.direction, axis));
    // The controls of an arc of angle t are chord / (3 cos^2(t / 4)) away: within a thousandth for
    // half angles up to 60 degrees.
    let cosine = (first.dot(axis) + second.dot(axis)) / 2.0;
    let reach = chord.length() * 2.0 / (3.0 * (1.0 + cosine));
    let controls = [start, start + reach * first, end - reach * second, end];
    let count = (chord.length() / cell).ceil().clamp(1.0, MOST_OF_ARC) as u32;
    let at = |k: u32| {
        let t = f64::from(k) / f64::from(count);
        let s = 1.0 - t;
        s * s * s * controls[0]
            + 3.0 * s * s * t * controls[1]
            + 3.0 * s * t * t * controls[2]
            + t * t * t * controls[3]
    };
    (1..count).map(at).collect()
}

/// Whether the rim between two corners, on either side, is the line between them.
fn runs_along_rim(points: &[DVec3], [from, to]: [usize; 2], cell: f64) -> bool {
    let count = points.len();
    let length = points[from].distance(points[to]);
    let near = (ALONG_RIM * length).min(cell / 4.0);
    let axis = (points[to] - points[from]).normalize_or_zero();
    let is_near = |corner: usize| {
        let off = (points[corner % count] - points[from]).reject_from_normalized(axis);
        off.length() <= near
    };
    (from..to).all(is_near) || (to..from + count).all(is_near)
}

/// The point in which all creases meet.
fn meeting_point(points: &[DVec3], arrivals: &[Arrival], cell: f64) -> Option<Creases> {
    if !(3..=MOST_AT_CORNER).contains(&arrivals.len()) || !arrivals.iter().all(Arrival::is_sharp) {
        return None;
    }
    let origin = points[arrivals[0].corner];
    // Least squares of the distances to the lines: sum of (I - d d^T) (x - p).
    let mut matrix = DMat3::ZERO;
    let mut right = DVec3::ZERO;
    for arrival in arrivals {
        let d = arrival.direction;
        let off = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += off;
        right += off * (points[arrival.corner] - origin);
    }
    // Of lines that all but run in parallel the product of the three squared sines is tiny.
    if matrix.determinant().abs() < 1e-3 {
        return None;
    }
    let apex = origin + matrix.inverse() * right;
    let diameter = arrivals
        .iter()
        .flat_map(|a| arrivals.iter().map(move |b| points[a.corner].distance(points[b.corner])))
        .fold(0.0, f64::max);
    let miss = cell.min(diameter / 4.0).max(CORNER_MISS * diameter);
    let meets = |a: &Arrival| {
        let to_apex = apex - points[a.corner];
        to_apex.reject_from_normalized(a.direction).length() <= miss
            && to_apex.length() <= CORNER_REACH * diameter
            && to_apex.dot(a.outward) < 0.0
    };
    let is_new = apex.is_finite() && points.iter().all(|&point| point != apex);
    (is_new && arrivals.iter().all(meets)).then(|| Creases {
        ends: arrivals.iter().map(|a| a.corner).collect(),
        apex: Some(apex),
        path: Vec::new(),
    })
}

/// The same on every machine, unlike that of the system's library.
fn cosine(angle: f64) -> f64 {
    let square = angle * angle;
    // From the last term of the series to the first; exact to rounding up to 90 degrees.
    (1..=12).rev().fold(1.0, |sum, i| {
        let step = f64::from(2 * i * (2 * i - 1));
        1.0 - square / step * sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cosine_is_that_of_the_library() {
        for degrees in 0..=90 {
            let angle = f64::from(degrees).to_radians();
            assert!((cosine(angle) - angle.cos()).abs() < 1e-15, "{degrees}");
        }
    }
}
