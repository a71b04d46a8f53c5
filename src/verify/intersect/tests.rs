//! Meshes against all pairs; the same for any share and any number of threads.

use std::convert::Infallible;

use rayon::ThreadPoolBuilder;

use crate::defect::{Defect, DefectKind, IntersectingTriangles};
use crate::geom::signs::{Point, Signs, is_tame};
use crate::mesh::shapes::{Corners, ListedTriangles, Random, sphere};
use crate::monitor::Void;
use crate::store::Scratch;
use crate::verify::intersect::exact_pair::meet;
use crate::verify::positions::key_of;
use crate::verify::{Outward, Proof, ProofOptions, ProvedSource, Vertices, prove};

/// A mesh with vertex numbers.
#[derive(Clone, Default)]
pub(super) struct Mesh {
    pub(super) vertices: Vec<Point>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(super) fn of(corners: &[Corners]) -> Self {
        let mut mesh = Self::default();
        let mut numbers = std::collections::HashMap::new();
        for corners in corners {
            mesh.triangles.push(corners.map(|corner| {
                *numbers.entry(key_of(corner)).or_insert_with(|| {
                    mesh.vertices.push(corner);
                    mesh.vertices.len() as u32 - 1
                })
            }));
        }
        mesh
    }

    /// Adds a triangle with vertices of its own.
    fn add(&mut self, corners: [Point; 3]) {
        let next = self.vertices.len() as u32;
        self.vertices.extend(corners);
        self.triangles.push([next, next + 1, next + 2]);
    }

    pub(super) fn corners(&self) -> Vec<Corners> {
        let corner = |v: u32| self.vertices[v as usize];
        self.triangles.iter().map(|t| t.map(corner)).collect()
    }

    /// All pairs of triangles with areas that intersect, by exact signs alone.
    pub(super) fn intersecting(&self) -> Vec<[u64; 2]> {
        let corners = self.corners();
        let mut pairs = Vec::new();
        let flat = |[a, b, c]: Corners| {
            let signs = Signs { tame: [a, b, c].iter().all(is_tame) };
            (0..3).all(|axis| signs.turn(axis, a, b, c) == 0)
        };
        let flat: Vec<bool> = corners.iter().map(|&t| flat(t)).collect();
        for i in 0..corners.len() {
            for j in i + 1..corners.len() {
                let (a, b) = (self.triangles[i], self.triangles[j]);
                let overlaps = (0..3).all(|k| {
                    let [p, q] = [corners[i], corners[j]].map(|t| t.map(|c| c[k]));
                    let low = |p: [f64; 3]| p.into_iter().fold(f64::INFINITY, f64::min);
                    let high = |p: [f64; 3]| p.into_iter().fold(f64::NEG_INFINITY, f64::max);
                    low(p) <= high(q) && low(q) <= high(p)
                });
                if flat[i] || flat[j] || !overlaps {
                    continue;
                }
                let (mut first, mut second) = (Vec::new(), Vec::new());
                for shares in [true, false] {
                    first.extend((0..3).filter(|&k| b.contains(&a[k]) == shares));
                }
                let shared = (0..3).filter(|&k| b.contains(&a[k])).count();
                for &k in &first[..shared] {
                    second.extend((0..3).find(|&m| b[m] == a[k]));
                }
                second.extend((0..3).filter(|&m| !a.contains(&b[m])));
                let p = std::array::from_fn(|k| corners[i][first[k]]);
                let q = std::array::from_fn(|k| corners[j][second[k]]);
                let tame = p.iter().chain(&q).all(is_tame);
                if meet(Signs { tame }, p, q, shared) {
                    pairs.push([i as u64, j as u64]);
                }
            }
        }
        pairs
    }
}

pub(super) fn proof(mesh: &Mesh, indexed: bool, share_bytes: u64, threads: usize) -> Proof {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let source = if indexed {
        ListedTriangles::with_indices(&mesh.vertices, mesh.triangles.clone())
    } else {
        ListedTriangles::without_indices(mesh.corners())
    };
    let mut open =
        || -> Result<ProvedSource<'_, Infallible>, Infallible> { Ok(Box::new(source.clone())) };
    let options = ProofOptions {
        share_bytes,
        outward: Outward::NotAsked,
        vertices: Vertices::Numbers,
        intersections: true,
    };
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    prove(&mut open, &scratch, &options, &pool, &Void).expect("nothing fails in memory")
}

/// Asserts that the pairs of a mesh are found, with small and large shares, alone and together.
pub(super) fn check(mesh: &Mesh) -> u64 {
    let welded = Mesh::of(&mesh.corners());
    let mut found = 0;
    for (indexed, expected) in [(true, mesh.intersecting()), (false, welded.intersecting())] {
        for (share_bytes, threads) in [(64 << 20, 1), (64 << 20, 4), (16 << 10, 1), (16 << 10, 4)] {
            let proof = proof(mesh, indexed, share_bytes, threads);
            let name = format!("indexed: {indexed}, {share_bytes} bytes, {threads} threads");
            assert_eq!(proof.intersecting_pairs, expected.len() as u64, "{name}");
            let pairs = proof.places.iter().filter_map(|defect| match defect {
                Defect::IntersectingTriangles(IntersectingTriangles { triangles, .. }) => {
                    Some(*triangles)
                }
                _ => None,
            });
            let first = &expected[..expected.len().min(8)];
            // More may follow: the first of each way to meet.
            assert_eq!(pairs.take(8).collect::<Vec<_>>(), first, "{name}");
            assert_eq!(proof.meetings.total(), proof.intersecting_pairs, "{name}");
            found = found.max(proof.intersecting_pairs);
        }
    }
    found
}

fn in_box(random: &mut Random, size: f64) -> Point {
    std::array::from_fn(|_| (random.share() - 0.5) * size)
}

/// A triangle of about a size at some place.
fn triangle(random: &mut Random, space: f64, size: f64) -> [Point; 3] {
    let at = in_box(random, space);
    std::array::from_fn(|_| {
        let by = in_box(random, size);
        std::array::from_fn(|i| at[i] + by[i])
    })
}

#[test]
fn a_sphere_has_no_intersections_and_triangles_through_it_are_found() {
    let mut mesh = Mesh::of(&sphere([0.1, 0.2, 0.3], 1.0, 30));
    assert_eq!(check(&mesh), 0);
    let mut random = Random::new(3);
    for size in [0.02, 0.1, 0.5, 3.0] {
        for _ in 0..5 {
            mesh.add(triangle(&mut random, 2.0, size));
        }
    }
    assert!(check(&mesh) > 100);
}

#[test]
fn soups_that_touch_everywhere_are_judged_like_by_all_pairs() {
    let mut random = Random::new(8);
    for most in [4.0, 9.0] {
        let mut mesh = Mesh::default();
        for z in 0..125_u32 {
            mesh.vertices.push([z % 5, z / 5 % 5, z / 25].map(|x| f64::from(x) * most / 4.0));
        }
        for _ in 0..300 {
            mesh.triangles.push(std::array::from_fn(|_| (random.share() * 125.0) as u32));
        }
        assert!(check(&mesh) > 1000);
    }
}

#[test]
fn tiny_triangles_before_huge_ones_and_huge_ones_before_tiny_ones() {
    let mut random = Random::new(13);
    for sizes in [[0.01, 5.0], [5.0, 0.01]] {
        let mut mesh = Mesh::default();
        for size in sizes {
            for _ in 0..700 {
                mesh.add(triangle(&mut random, 4.0, size));
            }
        }
        assert!(check(&mesh) > 1000);
    }
}

#[test]
fn crowds_at_one_place_and_specks_far_away_are_no_trouble() {
    let mut random = Random::new(21);
    let mut mesh = Mesh::default();
    // A fan whose triangles all share one vertex, and others that go through it.
    mesh.vertices.push([0.0, 0.0, 1.0]);
    for i in 0..1200 {
        let angle = f64::from(i) * std::f64::consts::TAU / 1200.0;
        mesh.vertices.push([angle.cos(), angle.sin(), 0.0]);
    }
    for i in 0..1200 {
        mesh.triangles.push([0, 1 + i, 1 + (i + 1) % 1200]);
    }
    for _ in 0..40 {
        let thin = triangle(&mut random, 0.001, 0.002);
        mesh.add(thin.map(|[x, y, z]| [x, y, z + 1.0]));
    }
    for place in [1e9_f64, -1e200, 1e307] {
        let far = triangle(&mut random, 1.0, place.abs() / 8.0);
        mesh.add(far.map(|p| p.map(|x| x + place)));
    }
    assert!(check(&mesh) > 100);
}

#[test]
fn a_mesh_of_any_magnitude_is_judged_alike() {
    let mut random = Random::new(34);
    let mut mesh = Mesh::of(&sphere([0.0; 3], 1.0, 8));
    for _ in 0..20 {
        mesh.add(triangle(&mut random, 2.0, 0.5));
    }
    let counts = [1.0, 1e-120, 1e100, 1e-300].map(|scale| {
        let mut scaled = mesh.clone();
        // A power of two keeps all bits.
        let scale = f64::from_bits(f64::to_bits(scale) & !((1 << 52) - 1));
        scaled.vertices.iter_mut().flatten().for_each(|x| *x *= scale);
        check(&scaled)
    });
    assert!(counts[0] > 5 && counts.iter().all(|&count| count == counts[0]), "{counts:?}");
}

#[test]
fn a_triangle_twice_and_vertices_in_one_place_intersect() {
    let tetrahedron = Mesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    assert_eq!(check(&tetrahedron), 0);
    let mut twice = tetrahedron.clone();
    twice.triangles.push([1, 0, 2]);
    assert_eq!(check(&twice), 1);
    // Another one at its tip, with a vertex of its own there: a touch, unless places are names.
    let mut tip = tetrahedron;
    tip.vertices.extend([[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]);
    tip.triangles.push([4, 5, 6]);
    assert_eq!(tip.intersecting().len(), 3);
    assert_eq!(check(&tip), 3);
    let found = proof(&tip, false, 1 << 20, 1);
    assert_eq!((found.intersecting_pairs, found.count(DefectKind::IntersectingTriangles)), (0, 0));
    let told = proof(&tip, true, 1 << 20, 1);
    let place = told.places.iter().find(|d| d.kind() == DefectKind::IntersectingTriangles);
    assert_eq!(place.and_then(Defect::place), Some([0.5, 0.0, 1.0]));
}
