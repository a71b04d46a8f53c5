//! Clusters above the brick: solids with flat faces over many bricks, clean and dirty.
//!
//! The judge is the proof, which shares no code with this.

use glam::DVec3;

use crate::contour::noise_tests::{Contoured, Hit, brick_at, contour_bricks};
use crate::contour::{ContourOptions, Method, SurfaceDetail};
use crate::mesh::shapes::Random;
use crate::octree::{BrickKey, Domain, SIDE, SignBrick, SnapBox, SourcePlane};
use crate::store::Backing;

/// A convex solid: planes with unit normals outward, offsets in cells of the grid; and dirt.
struct Solid {
    depth: u32,
    planes: Vec<(DVec3, f64)>,
    /// Boxes whose corners are inside or outside by chance, or inside altogether.
    noise: Vec<(DVec3, DVec3)>,
    lips: Vec<(DVec3, DVec3)>,
    seed: u64,
}

impl Solid {
    /// A box of half sides `half` about `centre`, both in shares of the grid, turned.
    fn turned_box(depth: u32, centre: DVec3, half: DVec3, turn: glam::DQuat) -> Self {
        let cells = f64::from(1_u32 << depth);
        let planes = (0..6).map(|face| {
            let sign = if face % 2 == 0 { -1.0 } else { 1.0 };
            let normal = (turn * (DVec3::AXES[face / 2] * sign)).as_vec3().as_dvec3();
            let on = centre * cells + normal * half[face / 2] * cells;
            (normal, normal.dot(on))
        });
        Self { depth, planes: planes.collect(), noise: Vec::new(), lips: Vec::new(), seed: 1 }
    }

    fn random_at(&self, kind: u64, at: [usize; 3]) -> Random {
        let place = at.iter().fold(kind, |key, &c| key << 10 | c as u64);
        Random::new(self.seed.wrapping_mul(0x1_0000_0001) ^ place << 20 ^ place)
    }

    fn is_inside(&self, at: [usize; 3]) -> bool {
        let point = DVec3::from(at.map(|c| c as f64));
        let holds =
            |(low, high): &(DVec3, DVec3)| point.cmpge(*low).all() && point.cmple(*high).all();
        if self.noise.iter().any(holds) {
            return self.random_at(3, at).share() < 0.4;
        }
        self.lips.iter().any(holds) || self.planes.iter().all(|(n, d)| n.dot(point) <= *d)
    }

    /// The plane of the crossing on an edge, in cells of the grid.
    fn hit(&self, axis: usize, at: [usize; 3]) -> (DVec3, f64) {
        let mut beyond = at;
        beyond[axis] += 1;
        let (inner, outer) = if self.is_inside(at) { (at, beyond) } else { (beyond, at) };
        let [inner, outer] = [inner, outer].map(|c| DVec3::from(c.map(|c| c as f64)));
        let share = |(n, d): &(DVec3, f64)| (d - n.dot(inner)) / n.dot(outer - inner);
        let crossed = self.planes.iter().filter(|(n, d)| n.dot(inner) <= *d && n.dot(outer) > *d);
        let first = crossed.min_by(|a, b| share(a).total_cmp(&share(b)));
        first.copied().unwrap_or_else(|| {
            let mut random = self.random_at(axis as u64, at);
            let is_lip = self.noise.is_empty();
            let share = if is_lip { 0.5 } else { random.share() };
            let normal = DVec3::AXES[axis] * (outer - inner)[axis];
            let turned =
                (DVec3::from(random.point()) + DVec3::AXES[axis] * 1e-3).normalize_or_zero();
            let normal = if is_lip { normal } else { turned.as_vec3().as_dvec3() };
            (normal, normal.dot(DVec3::from(at.map(|c| c as f64)) + DVec3::AXES[axis] * share))
        })
    }

    fn brick(&self, key: u64, cell: f64) -> Option<SignBrick> {
        let base = BrickKey(key).position().map(|c| c as usize * SIDE);
        let low = DVec3::from(base.map(|c| c as f64));
        let hit = |axis, at| {
            let (normal, offset) = self.hit(axis, at);
            let offset = (offset - normal.dot(low)) * cell;
            let normal = normal.as_vec3().to_array();
            Hit::Plane(SourcePlane { offset, normal, ..SourcePlane::default() })
        };
        let brick = brick_at(base, |at| self.is_inside(at), hit);
        (!brick.crossings.is_empty()).then_some(brick)
    }

    fn contour(&self, decimate_cells: f64, backing: Backing, threads: usize) -> Contoured {
        let unit = SnapBox { lo: [0.0; 3], hi: [1.0; 3] };
        let domain = Domain::around(&unit, self.depth, false).expect("room enough");
        let bricks = (0..1_u64 << (3 * (self.depth - 5)))
            .filter_map(|key| Some((key, self.brick(key, f64::from(domain.cell_units))?)));
        let options = ContourOptions {
            method: Method::Mdc,
            crease_deg: 12.0,
            decimate_cells,
            surfaces: SurfaceDetail::None,
            sources: false,
        };
        let found = contour_bricks(&domain, bricks, &options, backing, threads);
        assert!(found.proof.holds(), "{:?}", found.proof.failures());
        assert_eq!(found.proof.unused_vertices, 0);
        assert_eq!(found.stats.vertices, found.kept.vertices.len() as u64);
        found
    }
}

const HALF: DVec3 = DVec3::new(0.31, 0.27, 0.22);

/// A place off all planes of the octree's upper levels.
const CENTRE: DVec3 = DVec3::new(0.513, 0.487, 0.521);

fn turn(random: &mut Random) -> glam::DQuat {
    let axis = DVec3::from(random.point()).normalize_or(DVec3::X);
    glam::DQuat::from_axis_angle(axis, random.within(0.2, 1.3))
}

#[test]
fn a_box_over_many_bricks_is_clustered_as_in_one() {
    let none = glam::DQuat::IDENTITY;
    let one = Solid::turned_box(5, CENTRE, HALF, none).contour(0.1, Backing::Memory, 1);
    assert_eq!((one.kept.vertices.len(), one.kept.triangles.len()), (8, 12));
    for depth in [6, 7] {
        let many = Solid::turned_box(depth, CENTRE, HALF, none).contour(0.1, Backing::Memory, 1);
        assert_eq!(many.kept.triangles.len(), 12, "depth {depth}");
        assert_eq!(many.stats.cut_vertices, one.stats.cut_vertices);
        // Vertices are numbered along the same octree.
        assert_eq!(many.kept.triangles, one.kept.triangles);
    }
}

#[test]
fn a_turned_box_over_many_bricks_is_sound_and_light() {
    let mut random = Random::new(21);
    for threshold in [0.05, 0.3, 2.0] {
        let solid = Solid::turned_box(7, CENTRE, HALF, turn(&mut random));
        let found = solid.contour(threshold, Backing::Memory, 1);
        let (leaves, cut) = (found.stats.cell_vertices, found.stats.cut_vertices);
        assert!(cut * 15 < leaves, "{cut} of {leaves} at {threshold}");
        assert!(found.stats.cluster_error_cells <= threshold);
    }
}

#[test]
fn faces_between_clusters_of_many_bricks_have_points() {
    // A corner in the cluster below x = 128; flat clusters of half its side above, beside the
    // dirty one: the segment between their vertices misses their face.
    let (centre, half) = (DVec3::new(0.6445, 0.5, 0.5), DVec3::new(0.254, 0.4, 0.12));
    let mut solid = Solid::turned_box(8, centre, half, glam::DQuat::IDENTITY);
    let at = DVec3::new(200.0, 200.0, 154.0);
    solid.noise.push((at, at + 9.0));
    let found = solid.contour(0.1, Backing::Memory, 1);
    assert!(found.far_points > 0);
}

#[test]
fn a_lip_of_one_cell_on_a_plate_of_many_bricks_survives() {
    let (centre, half) = (CENTRE, DVec3::new(0.4, 0.4, 0.2));
    let mut solid = Solid::turned_box(8, centre, half, glam::DQuat::IDENTITY);
    let top = ((centre.z + half.z) * 256.0).floor();
    solid.lips.push((DVec3::new(150.0, 150.0, top - 4.0), DVec3::new(155.0, 155.0, top + 1.0)));
    let found = solid.contour(0.1, Backing::Memory, 1);
    let highest = found.kept.vertices.iter().map(|v| v[2]).fold(f64::MIN, f64::max);
    let mut plain = solid;
    plain.lips.clear();
    let bare = plain.contour(0.1, Backing::Memory, 1);
    let of_plate = bare.kept.vertices.iter().map(|v| v[2]).fold(f64::MIN, f64::max);
    assert_eq!(bare.kept.triangles.len(), 12);
    let cell = 1.0 / 230.0;
    assert!(highest - of_plate > 0.5 * cell, "{highest} {of_plate}");
}

#[test]
fn dirt_among_clusters_of_many_bricks_meets_nothing_on_any_threads() {
    let mut random = Random::new(23);
    for threshold in [0.1, 0.8, 3.0] {
        let mut solid = Solid::turned_box(7, CENTRE, HALF, turn(&mut random));
        solid.seed = random.below(1 << 20) as u64;
        for _ in 0..3 {
            let at = DVec3::from(random.point()) * 34.0 + 64.0;
            solid.noise.push((at, at + random.within(2.0, 14.0)));
        }
        let one = solid.contour(threshold, Backing::Memory, 1);
        for (backing, threads) in [(Backing::Mapped, 4), (Backing::Memory, 4)] {
            let other = solid.contour(threshold, backing, threads);
            assert!(one.kept.vertices == other.kept.vertices, "{threshold}");
            assert!(one.kept.triangles == other.kept.triangles, "{threshold}");
        }
    }
}
