//! The planes of a cluster: few groups place its vertex, all of them judge it.
//!
//! In:         the crossings of the cluster's leaf cells, each with the plane that it lies on.
//! Out:        a vertex, and its largest distance to any of the planes.
//! Invariant:  every group counts alike, however many crossings it has: a lip beside a plate of a
//!             thousand crossings is not outvoted.
//! Units:      cells, from the brick's min corner.
//! Memory:     a crossing takes 16 bytes, a group 64.
//! Source:     Ju et al. 2002 (quadrics); the largest distance in place of the mean is ours.

use glam::DVec3;

use crate::geom::qef::{Hit, QefOptions, solve_inside};

/// Most groups of planes that one vertex can stand for.
pub const MAX_GROUPS: usize = 8;

/// In [`PlaneHit::plane`]: this plane judges the vertex and does not place it.
pub const JUDGES_ONLY: u32 = 1 << 31;

/// Distances that are measured before they are held against the threshold.
const JUDGED_TOGETHER: usize = 16;

/// A group of several planes.
const MIXED: u32 = u32::MAX;

/// A plane in cells: unit normal and offset.
#[derive(Clone, Copy, Debug)]
pub struct CellPlane {
    /// The unit normal.
    pub normal: DVec3,
    /// `normal . p` of its points.
    pub offset: f64,
}

impl CellPlane {
    /// How far a point is from it.
    #[inline]
    fn distance(&self, point: DVec3) -> f64 {
        (self.normal.dot(point) - self.offset).abs()
    }
}

/// A crossing of a leaf cell, or the middle of those of a block on one plane: where, and on which plane of the
/// brick.
#[derive(Clone, Copy, Debug)]
pub struct PlaneHit {
    /// Number of the plane, and perhaps [`JUDGES_ONLY`].
    pub plane: u32,
    /// The crossing.
    pub point: [f32; 3],
}

/// Planes whose normals are within half the crease angle.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    normals: DVec3,
    points: DVec3,
    count: f64,
    plane: u32,
}

impl Group {
    /// The crossings of one plane, none yet.
    #[inline]
    pub fn of_plane(plane: u32) -> Self {
        Self { normals: DVec3::ZERO, points: DVec3::ZERO, count: 0.0, plane }
    }

    /// Adds a crossing of the plane of [`Self::of_plane`].
    #[inline]
    pub fn add_point(&mut self, point: DVec3) {
        self.points += point;
        self.count += 1.0;
    }

    /// All crossings of the plane are added.
    #[inline]
    pub fn close(&mut self, planes: &[CellPlane]) {
        self.normals = planes[self.plane as usize].normal * self.count;
    }

    /// Its plane at the mean of its crossings.
    #[inline]
    pub fn to_hit(self) -> PlaneHit {
        let point = (self.points / self.count).as_vec3().to_array();
        PlaneHit { plane: self.plane, point }
    }

    /// A group of one crossing.
    pub fn of(hit: &PlaneHit, planes: &[CellPlane]) -> Self {
        let normals = planes[hit.plane as usize].normal;
        let points = DVec3::from(hit.point.map(f64::from));
        Self { normals, points, count: 1.0, plane: hit.plane }
    }

    /// Takes `other` in if its normals point the same way, up to sign.
    fn take_in(&mut self, other: &Self, planes: &[CellPlane], cosine_squared: f64) -> bool {
        if self.is_same_plane(other, planes) {
            let dot = self.normals.dot(other.normals);
            self.normals += if dot < 0.0 { -other.normals } else { other.normals };
        } else {
            let (a, b) = (self.normals, other.normals);
            let dot = a.dot(b);
            if dot * dot < cosine_squared * a.length_squared() * b.length_squared() {
                return false;
            }
            self.normals += if dot < 0.0 { -b } else { b };
            self.plane = MIXED;
        }
        self.points += other.points;
        self.count += other.count;
        true
    }

    /// The normal of a plane as it is added to this group, if it surely belongs there: the group is of this
    /// plane, or of several that point the same way.
    #[inline]
    fn turned(&self, plane: u32, normal: DVec3, cosine_squared: f64) -> Option<DVec3> {
        if self.plane == plane {
            return Some(normal);
        }
        let dot = self.normals.dot(normal);
        let is_alike = self.plane == MIXED
            && dot * dot
                >= cosine_squared * self.normals.length_squared() * normal.length_squared();
        is_alike.then_some(if dot < 0.0 { -normal } else { normal })
    }

    /// Takes in a crossing if its normal points the same way, up to sign.
    #[inline]
    fn take_in_hit(&mut self, hit: &PlaneHit, planes: &[CellPlane], cosine_squared: f64) -> bool {
        let normal = planes[hit.plane as usize].normal;
        let Some(normal) = self.turned(hit.plane, normal, cosine_squared) else {
            return self.take_in(&Self::of(hit, planes), planes, cosine_squared);
        };
        self.normals += normal;
        self.points += DVec3::from(hit.point.map(f64::from));
        self.count += 1.0;
        true
    }

    /// The way that its normals point, of unit length.
    pub fn direction(&self) -> DVec3 {
        self.normals.normalize_or_zero()
    }

    /// The sum of its crossings, and how many there are.
    pub fn crossings(&self) -> (DVec3, f64) {
        (self.points, self.count)
    }

    /// Whether both are of one plane: by its number, or as two triangles of one face have it.
    fn is_same_plane(&self, other: &Self, planes: &[CellPlane]) -> bool {
        if self.plane == MIXED || other.plane == MIXED {
            return false;
        }
        let [a, b] = [self, other].map(|group| &planes[group.plane as usize]);
        self.plane == other.plane
            || (a.normal == b.normal && a.offset == b.offset)
            || (a.normal == -b.normal && a.offset == -b.offset)
    }

    /// The group as one crossing of its mean plane, about `centre`.
    pub fn mean(&self, planes: &[CellPlane], centre: DVec3) -> Hit {
        let mut point = self.points / self.count;
        if self.plane == MIXED {
            let normal = self.normals.normalize_or_zero();
            return Hit { point: point - centre, normal };
        }
        let CellPlane { normal, offset } = planes[self.plane as usize];
        point -= normal * (normal.dot(point) - offset);
        for axis in 0..3 {
            if normal[axis].abs() == 1.0 {
                point[axis] = offset * normal[axis];
            }
        }
        Hit { point: point - centre, normal }
    }
}

/// Adds a crossing to a list of groups that starts at `from`; false if there is no room.
#[inline]
pub fn add_hit(
    groups: &mut Vec<Group>,
    from: usize,
    hit: &PlaneHit,
    planes: &[CellPlane],
    cosine_squared: f64,
) -> bool {
    // Most cells have one group.
    if let Some(known) = groups.get_mut(from)
        && known.take_in_hit(hit, planes, cosine_squared)
    {
        return true;
    }
    add_group(groups, from, &Group::of(hit, planes), planes, cosine_squared)
}

/// The groups that the crossings of these planes make, if they are no more than two; both are the first where
/// they are one.
pub fn one_or_two_groups(
    of_planes: &[Group],
    planes: &[CellPlane],
    cosine_squared: f64,
) -> Option<(usize, [Group; 2])> {
    let mut groups = [*of_planes.first()?; 2];
    let mut count = 1;
    for one in &of_planes[1..] {
        if groups[0].take_in(one, planes, cosine_squared) {
            continue;
        }
        if count == 1 {
            groups[1] = *one;
            count = 2;
        } else if !groups[1].take_in(one, planes, cosine_squared) {
            return None;
        }
    }
    Some((count, groups))
}

/// Adds `group` to a list of groups that starts at `from`; false if there is no room.
pub fn add_group(
    groups: &mut Vec<Group>,
    from: usize,
    group: &Group,
    planes: &[CellPlane],
    cosine_squared: f64,
) -> bool {
    if groups[from..].iter_mut().any(|known| known.take_in(group, planes, cosine_squared)) {
        return true;
    }
    let has_room = groups.len() - from < MAX_GROUPS;
    if has_room {
        groups.push(*group);
    }
    has_room
}

/// Places the vertex of the groups in the box of `options` about `centre`; in the middle of `points` where there
/// are none. `None` if it lies outside.
pub fn place(
    groups: &[Group],
    planes: &[CellPlane],
    centre: DVec3,
    middle: DVec3,
    options: &QefOptions,
) -> Option<DVec3> {
    let mut hits = [Hit { point: middle - centre, normal: DVec3::ZERO }; MAX_GROUPS];
    for (hit, group) in hits.iter_mut().zip(groups) {
        *hit = group.mean(planes, centre);
    }
    solve_inside(&hits[..groups.len().max(1)], options)
}

/// The largest distance of `vertex` to the planes of these groups, each of one plane; `None` if one is beyond
/// the threshold.
#[inline]
pub fn largest_distance_of(
    of_planes: &[Group],
    planes: &[CellPlane],
    vertex: DVec3,
    threshold: f64,
) -> Option<f64> {
    let largest = of_planes.iter().fold(0.0, |largest, group| {
        let distance = planes[group.plane as usize].distance(vertex);
        // Not a number is no distance; the method for that takes longer.
        if distance > largest { distance } else { largest }
    });
    (largest <= threshold).then_some(largest)
}

/// The largest distance of `vertex` to the planes of `hits`; `None` if one is beyond the threshold.
#[inline]
pub fn largest_distance(
    hits: &[PlaneHit],
    planes: &[CellPlane],
    vertex: DVec3,
    threshold: f64,
) -> Option<f64> {
    let mut largest = 0.0;
    for some in hits.chunks(JUDGED_TOGETHER) {
        for hit in some {
            let plane = &planes[(hit.plane & !JUDGES_ONLY) as usize];
            let distance = plane.distance(vertex);
            // Not a number is no distance; the method for that takes longer.
            largest = if distance > largest { distance } else { largest };
        }
        if largest > threshold {
            return None;
        }
    }
    Some(largest)
}
