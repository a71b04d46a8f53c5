//! Creases of the surface that run into an opening, and how they go on in it.
//!
//! Two that lie on one line are joined. Three to six that meet in a point are led to it, so that a
//! corner that was cut off is there again.

use glam::{DMat3, DVec3};

/// Creases that may end at a loop; where there are more, the surface is round.
const MOST_CREASES: usize = 64;
/// Creases that may meet in a corner; cones and domes of few facets have more.
const MOST_AT_CORNER: usize = 6;
/// Creases of a corner are bent by 30 degrees or more, not those of coarse domes.
const CORNER_COSINE: f64 = 0.866;
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
}

impl Angles {
    pub fn new(crease_deg: f64) -> Self {
        Self { crease_cosine: cosine(crease_deg.clamp(0.0, 90.0).to_radians()) }
    }
}

/// Where an opening is to be divided.
pub struct Creases {
    /// Corners of the loop at which creases arrive, ascending.
    pub ends: Vec<usize>,
    /// The point in which they meet; without it the two ends are joined.
    pub apex: Option<DVec3>,
}

/// A corner of the loop with a crease.
struct Arrival {
    corner: usize,
    direction: DVec3,
    normals: [DVec3; 2],
    /// From the corner into the surface around.
    outward: DVec3,
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
    straight_line(points, &arrivals, angles, cell)
        .or_else(|| meeting_point(points, &arrivals, cell))
}

/// The two ends that lie best on one line.
fn straight_line(
    points: &[DVec3],
    arrivals: &[Arrival],
    angles: Angles,
    cell: f64,
) -> Option<Creases> {
    let mut best: Option<(f64, [usize; 2])> = None;
    for (i, one) in arrivals.iter().enumerate() {
        for two in &arrivals[i + 1..] {
            let chord = (points[two.corner] - points[one.corner]).normalize_or_zero();
            let straight = chord.dot(one.direction).abs().min(chord.dot(two.direction).abs());
            // What is left of the crease at one end is right of it at the other.
            let same = one.normals[0].dot(two.normals[1]).min(one.normals[1].dot(two.normals[0]));
            let into = one.outward.dot(chord) <= 0.0 && two.outward.dot(chord) >= 0.0;
            let agree = into && straight.min(same) >= angles.crease_cosine;
            if agree
                && best.is_none_or(|(so_far, _)| straight > so_far)
                && !runs_along_rim(points, [one.corner, two.corner], cell)
            {
                best = Some((straight, [one.corner, two.corner]));
            }
        }
    }
    best.map(|(_, ends)| Creases { ends: ends.to_vec(), apex: None })
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
    let sharp = |a: &Arrival| a.normals[0].dot(a.normals[1]) < CORNER_COSINE;
    if !(3..=MOST_AT_CORNER).contains(&arrivals.len()) || !arrivals.iter().all(sharp) {
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
    (is_new && arrivals.iter().all(meets))
        .then(|| Creases { ends: arrivals.iter().map(|a| a.corner).collect(), apex: Some(apex) })
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
