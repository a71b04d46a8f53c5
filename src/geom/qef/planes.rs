//! The cheap paths: cells whose hits have one, two or three distinct normals.
//!
//! In:         the hits of one cell.
//! Out:        [`Bundle`]: mass point, up to three groups of equal normals, coordinates of
//!             axis-parallel planes; and the vertex in closed form.
//! Invariant:  a closed form is the truncated solution of the same hits, without the sweeps: the
//!             mean plane of each group stands for the group, as the quadric's sums do.
//! Units:      cells about the cell's centre.
//! Fails:      never; hits without a usable normal count for the mass point only.

use crate::geom::qef::jacobi::Symmetric;
use crate::geom::qef::{Hit, QefOptions};
use glam::DVec3;

/// Squared difference of normals below which they are one: 1e-6 rad, above f32 rounding.
const SAME_NORMAL_SQUARED: f64 = 1e-12;

/// How far the square of a usable normal's length may be from one.
const UNIT_SLACK: f64 = 0.01;

/// Hits with one normal, up to sign.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    normal: DVec3,
    points: DVec3,
    count: f64,
}

/// What one pass over the hits finds out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle {
    pub(crate) mass_point: DVec3,
    /// Distinct normals; 4 stands for more than three.
    pub(crate) normals: u8,
    /// The coordinate of all planes across an axis, NaN if there is none or they differ.
    pub(crate) exact: DVec3,
    groups: [Group; 3],
}

/// Whether a hit's normal can be used.
#[inline]
pub(crate) fn is_usable(normal: DVec3) -> bool {
    // False for NaN.
    (normal.length_squared() - 1.0).abs() <= UNIT_SLACK
}

impl Bundle {
    /// Gathers the hits.
    #[inline]
    pub(crate) fn gather(hits: &[Hit]) -> Self {
        let mut mass = DVec3::ZERO;
        let mut groups = [Group::default(); 3];
        let mut normals = 0_usize;
        let mut planes = [AxisPlanes::default(); 3];
        for hit in hits {
            mass += hit.point;
            if !is_usable(hit.normal) {
                continue;
            }
            note_axis_plane(&mut planes, hit);
            if normals > 3 {
                continue;
            }
            match groups[..normals].iter_mut().find(|group| group.holds(hit.normal)) {
                Some(group) => {
                    group.points += hit.point;
                    group.count += 1.0;
                }
                None => {
                    if normals < 3 {
                        groups[normals] =
                            Group { normal: hit.normal, points: hit.point, count: 1.0 };
                    }
                    normals += 1;
                }
            }
        }
        Self {
            mass_point: mass / (hits.len().max(1) as f64),
            normals: normals as u8,
            exact: DVec3::from_array(planes.map(AxisPlanes::coordinate)),
            groups,
        }
    }

    /// Gathers points whose normals are all the same; `None` if it cannot be used.
    #[inline]
    pub(crate) fn flat(points: &[DVec3], normal: DVec3) -> Option<Self> {
        if !is_usable(normal) {
            return None;
        }
        let mut sum = DVec3::ZERO;
        let mut planes = [AxisPlanes::default(); 3];
        for &point in points {
            sum += point;
            note_axis_plane(&mut planes, &Hit { point, normal });
        }
        let count = points.len() as f64;
        let mut groups = [Group::default(); 3];
        groups[0] = Group { normal, points: sum, count };
        let exact = DVec3::from_array(planes.map(AxisPlanes::coordinate));
        Some(Self { mass_point: sum / count, normals: 1, exact, groups })
    }

    /// See [`with_exact_coordinates`].
    #[inline]
    pub(crate) fn with_exact_coordinates(&self, at: DVec3) -> DVec3 {
        with_exact_coordinates(self.exact, at)
    }

    /// The vertex on the planes nearest to the mass point, and its rank; `None` if they do not
    /// pass the cut.
    #[inline]
    pub(crate) fn closed_form(&self, options: &QefOptions) -> Option<(DVec3, u8)> {
        self.on_planes(options).map(|at| (at, self.normals))
    }

    #[inline]
    fn on_planes(&self, options: &QefOptions) -> Option<DVec3> {
        let [a, b, c] = &self.groups;
        let m = self.mass_point;
        match self.normals {
            1 => Some(m + a.normal * (a.offset(m) / a.normal.length_squared())),
            2 => Self::on_line(a, b, m, options.cutoff()),
            3 => self.at_corner([a, b, c], options.cutoff()),
            _ => None,
        }
    }

    #[inline]
    fn on_line(a: &Group, b: &Group, m: DVec3, cutoff: f64) -> Option<DVec3> {
        let sine_squared = a.normal.cross(b.normal).length_squared();
        // λ2/λ1 > cut-off, said with the determinant and the trace of the 2x2 problem.
        let trace = a.count + b.count;
        let squared = (1.0 + cutoff) * (1.0 + cutoff);
        if a.count * b.count * sine_squared * squared <= cutoff * trace * trace {
            return None;
        }
        let (aa, bb) = (a.normal.length_squared(), b.normal.length_squared());
        let ab = a.normal.dot(b.normal);
        let (to_a, to_b) = (a.offset(m), b.offset(m));
        let along_a = (to_a * bb - to_b * ab) / sine_squared;
        let along_b = (to_b * aa - to_a * ab) / sine_squared;
        Some(m + a.normal * along_a + b.normal * along_b)
    }

    fn at_corner(&self, [a, b, c]: [&Group; 3], cutoff: f64) -> Option<DVec3> {
        let mut sum = [0.0; 6];
        for group in [a, b, c] {
            let (n, w) = (group.normal, group.count);
            let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
            for (sum, product) in sum.iter_mut().zip(products) {
                *sum += w * product;
            }
        }
        if !is_full_rank(&sum, cutoff) {
            return None;
        }
        let m = self.mass_point;
        let (bc, ca, ab) =
            (b.normal.cross(c.normal), c.normal.cross(a.normal), a.normal.cross(b.normal));
        let volume = a.normal.dot(bc);
        let moved = bc * a.offset(m) + ca * b.offset(m) + ab * c.offset(m);
        Some(m + moved / volume)
    }
}

/// Puts the axis-parallel planes' own coordinates in the place of rounded ones.
#[inline]
pub(crate) fn with_exact_coordinates(exact: DVec3, at: DVec3) -> DVec3 {
    DVec3::select(exact.is_nan_mask(), at, exact)
}

impl Group {
    #[inline]
    fn holds(&self, normal: DVec3) -> bool {
        let sign = 1.0_f64.copysign(self.normal.dot(normal));
        (normal * sign - self.normal).length_squared() <= SAME_NORMAL_SQUARED
    }

    /// How far along the normal the group's mean plane lies from `m`.
    #[inline]
    fn offset(&self, m: DVec3) -> f64 {
        self.normal.dot(self.points) / self.count - self.normal.dot(m)
    }
}

/// Whether the smallest eigenvalue is surely above `cutoff` times the largest.
///
/// A - tE is definite exactly when the smallest eigenvalue is above t, and the trace bounds the
/// largest. Pivots would not do: they exceed the smallest eigenvalue up to ninefold. Near the cut
/// the answer may be no for a matrix of full rank; the eigenvalues then decide.
#[inline]
pub(crate) fn is_full_rank(a: &Symmetric, cutoff: f64) -> bool {
    let t = cutoff * (a[0] + a[3] + a[5]);
    let (x, y, z) = (a[0] - t, a[3] - t, a[5] - t);
    let minor = x * y - a[1] * a[1];
    let determinant = z * minor - a[4] * (x * a[4] - a[1] * a[2]) + a[2] * (a[1] * a[4] - y * a[2]);
    x > 0.0 && minor > 0.0 && determinant > 0.0
}

/// The planes across one axis: the coordinate of the first, and whether all have it.
#[derive(Clone, Copy, Debug)]
struct AxisPlanes {
    coordinate: f64,
    differ: bool,
}

impl Default for AxisPlanes {
    fn default() -> Self {
        Self { coordinate: f64::NAN, differ: false }
    }
}

impl AxisPlanes {
    fn note(&mut self, coordinate: f64) {
        if self.coordinate.is_nan() {
            self.coordinate = coordinate;
        }
        self.differ |= self.coordinate != coordinate;
    }

    fn coordinate(self) -> f64 {
        if self.differ { f64::NAN } else { self.coordinate }
    }
}

#[inline]
fn note_axis_plane(planes: &mut [AxisPlanes; 3], hit: &Hit) {
    let n = hit.normal.abs();
    // Nearly all normals of free shapes leave here.
    if n.x != 1.0 && n.y != 1.0 && n.z != 1.0 {
        return;
    }
    if n == DVec3::X {
        planes[0].note(hit.point.x);
    } else if n == DVec3::Y {
        planes[1].note(hit.point.y);
    } else if n == DVec3::Z {
        planes[2].note(hit.point.z);
    }
}
