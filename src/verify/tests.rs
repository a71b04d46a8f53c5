//! Each defect on the smallest solid that shows it, with and without indices, for small and large
//! shares; random soups against a brute-force count.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::defect::DefectKind;
use crate::mesh::{Discarded, MeshSource, TriangleBatch};
use crate::monitor::Void;
use crate::store::Scratch;
use crate::verify::prover::Prover;
use crate::verify::stream::prove_sound;
use crate::verify::{Failure, Outward, Proof, ProofOptions, ProvedSource, Vertices, prove};

#[derive(Clone, Default)]
struct Solid {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Solid {
    fn tetrahedron(at: [f64; 3], size: f64) -> Self {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let vertices =
            corners.map(|p: [f64; 3]| std::array::from_fn(|i| at[i] + size * p[i])).to_vec();
        Self { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    fn cube(at: [f64; 3], size: f64) -> Self {
        let corner = |i: usize| std::array::from_fn(|a| at[a] + size * ((i >> a) & 1) as f64);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2]];
        let quads = quads.into_iter().chain([[1, 3, 7, 5]]);
        let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { vertices: (0..8).map(corner).collect(), triangles }
    }

    fn torus(rings: u32, sides: u32) -> Self {
        let mut solid = Self::default();
        for i in 0..rings {
            for j in 0..sides {
                let turn = std::f64::consts::TAU;
                let u = turn * f64::from(i) / f64::from(rings);
                let v = turn * f64::from(j) / f64::from(sides);
                let r = 3.0 + v.cos();
                solid.vertices.push([r * u.cos(), r * u.sin(), v.sin()]);
                let id = |i: u32, j: u32| (i % rings) * sides + j % sides;
                let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                solid.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        solid
    }

    fn with(mut self, other: &Self) -> Self {
        let base = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|id| id + base)));
        self
    }

    /// Makes vertices at one position one vertex.
    fn welded(mut self) -> Self {
        let first = |id: u32| {
            let at = self.vertices[id as usize];
            self.vertices.iter().position(|&p| p == at).expect("it finds at least itself") as u32
        };
        self.triangles = self.triangles.iter().map(|t| t.map(first)).collect();
        self
    }

    fn shifted(mut self, by: f64) -> Self {
        self.vertices.iter_mut().for_each(|p| p[0] += by);
        self
    }

    fn flipped(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        self
    }

    fn changed(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

struct Memory<'s> {
    solid: &'s Solid,
    indexed: bool,
    next: usize,
}

impl MeshSource for Memory<'_> {
    type Error = std::convert::Infallible;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, Self::Error> {
        batch.clear();
        let end = (self.next + 1000).min(self.solid.triangles.len());
        for &ids in &self.solid.triangles[self.next..end] {
            batch.push(ids.map(|id| self.solid.vertices[id as usize]), 0, 0, 0);
            if self.indexed {
                batch.indices.push(ids);
            }
        }
        self.next = end;
        Ok(!batch.is_empty())
    }
    fn discarded(&self) -> Discarded {
        Discarded::default()
    }
    fn bytes_read(&self) -> u64 {
        0
    }
    fn vertex_count(&self) -> Option<u64> {
        self.indexed.then_some(self.solid.vertices.len() as u64)
    }
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn proof(solid: &Solid, indexed: bool, outward: Outward, share_bytes: u64) -> (Proof, u64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let mut open = || Ok(Box::new(Memory { solid, indexed, next: 0 }) as ProvedSource<'_, _>);
    let options =
        ProofOptions { share_bytes, outward, vertices: Vertices::Numbers, intersections: false };
    let proof =
        prove(&mut open, &scratch, &options, &pool(1), &Void).expect("nothing fails in memory");
    (proof, scratch.written_bytes())
}

/// The proof with indices, after it was found the same for a small share, and in its counts the
/// same without indices (where no two vertices coincide).
fn prove_all_ways(solid: &Solid, outward: Outward) -> Proof {
    let mut proofs = [true, false].map(|indexed| {
        let (large, _) = proof(solid, indexed, outward, 64 << 20);
        let (small, _) = proof(solid, indexed, outward, 16 << 10);
        let text = |proof: &Proof| serde_json::to_string(proof).expect("plain data is JSON");
        assert_eq!(text(&large), text(&small), "indexed: {indexed}");
        large
    });
    if proofs[0].coincident_vertices == 0 {
        for kind in DefectKind::ALL {
            assert_eq!(proofs[0].count(kind), proofs[1].count(kind), "{kind:?}");
        }
        assert_eq!(proofs[0].components, proofs[1].components);
        assert_eq!(proofs[0].euler_characteristic, proofs[1].euler_characteristic);
        assert_eq!(proofs[0].edges, proofs[1].edges);
    }
    std::mem::take(&mut proofs[0])
}

/// Asserts that exactly these defects are found, and that each is shown at some place.
fn check(solid: &Solid, expected: &[(DefectKind, u64)]) -> Proof {
    let proof = prove_all_ways(solid, Outward::AllPositive);
    let failures: Vec<Failure> =
        expected.iter().map(|&(kind, count)| Failure::Defects(kind, count)).collect();
    assert_eq!(proof.failures(), failures);
    for &(kind, count) in expected {
        let shown = proof.places.iter().filter(|defect| defect.kind() == kind).count();
        assert_eq!(shown as u64, count.min(8), "{kind:?}");
    }
    proof
}

fn unit_cube() -> Solid {
    Solid::cube([0.0; 3], 1.0)
}

#[test]
fn a_cube_and_a_tetrahedron_hold() {
    let proof = check(&unit_cube(), &[]);
    assert_eq!((proof.vertices, proof.triangles, proof.edges), (8, 12, 18));
    assert_eq!((proof.components, proof.euler_characteristic), (1, 2));
    assert!((proof.volume - 1.0).abs() < 1e-12 && (proof.area - 6.0).abs() < 1e-12);
    assert_eq!(proof.bounds, Some([[0.0; 3], [1.0; 3]]));
    check(&Solid::tetrahedron([0.1, -7.3, 1e5], 0.37), &[]);
}

#[test]
fn a_torus_holds_with_euler_characteristic_zero() {
    let proof = check(&Solid::torus(60, 40), &[]);
    assert_eq!((proof.components, proof.euler_characteristic), (1, 0));
}

#[test]
fn an_empty_file_does_not_hold() {
    let proof = prove_all_ways(&Solid::default(), Outward::AllPositive);
    assert_eq!(proof.failures(), [Failure::Empty]);
}

#[test]
fn a_missing_triangle_leaves_three_boundary_edges() {
    let open = unit_cube().changed(|s| s.triangles.truncate(11));
    check(&open, &[(DefectKind::BoundaryEdge, 3)]);
}

#[test]
fn a_flipped_triangle_makes_three_edges_inconsistent() {
    let turned = unit_cube().changed(|s| s.triangles[4].swap(0, 1));
    check(&turned, &[(DefectKind::InconsistentEdge, 3)]);
}

#[test]
fn a_doubled_triangle_makes_three_edges_nonmanifold() {
    let doubled = unit_cube().changed(|s| s.triangles.push(s.triangles[0]));
    check(&doubled, &[(DefectKind::NonmanifoldEdge, 3)]);
}

#[test]
fn cubes_that_share_an_edge_are_nonmanifold_there() {
    let pair = unit_cube().with(&Solid::cube([1.0, 1.0, 0.0], 1.0)).welded();
    let proof = check(&pair, &[(DefectKind::NonmanifoldEdge, 1)]);
    assert_eq!(proof.places[0].place(), Some([1.0, 1.0, 0.5]));
    assert_eq!((proof.components, proof.unused_vertices), (1, 2));
}

#[test]
fn cubes_that_share_a_vertex_are_nonmanifold_there() {
    let pair = unit_cube().with(&Solid::cube([1.0; 3], 1.0)).welded();
    let proof = check(&pair, &[(DefectKind::NonmanifoldVertex, 1)]);
    assert_eq!(proof.places[0].place(), Some([1.0; 3]));
}

#[test]
fn vertices_in_one_place_are_found_whatever_the_sign_of_zero() {
    let apart =
        Solid::tetrahedron([0.0; 3], 1.0).with(&Solid::tetrahedron([0.0; 3], -1.0).flipped());
    let apart = apart.changed(|s| s.vertices[4] = [-0.0; 3]);
    check(&apart, &[(DefectKind::CoincidentVertices, 1)]);
    let soup = proof(&apart, false, Outward::AllPositive, 1 << 20).0;
    assert_eq!((soup.vertices, soup.nonmanifold_vertices), (7, 1));
}

#[test]
fn triangles_without_area_are_found_exactly() {
    let flat = unit_cube().changed(|s| {
        // A vertex on the diagonal 0-3, which both triangles of a face share.
        s.vertices.push([0.5, 0.5, 0.0]);
        s.triangles.push([0, 3, 8]);
        s.triangles[0] = [0, 2, 3];
        s.triangles[1] = [0, 8, 1];
        s.triangles.push([8, 3, 1]);
    });
    check(&flat, &[(DefectKind::DegenerateTriangle, 1)]);
    let nearly = flat.changed(|s| s.vertices[8][2] = 1e-300);
    check(&nearly, &[]);
    let twice = unit_cube().changed(|s| s.triangles.push([0, 0, 1]));
    check(&twice, &[(DefectKind::DegenerateTriangle, 1)]);
}

#[test]
fn a_corner_at_infinity_is_counted_and_left_out() {
    let wild = unit_cube().changed(|s| {
        s.vertices.push([f64::NAN, 0.0, f64::INFINITY]);
        s.triangles.push([0, 1, 8]);
    });
    let proof = check(&wild, &[(DefectKind::NonfiniteTriangle, 1)]);
    assert_eq!((proof.unused_vertices, proof.euler_characteristic), (1, 2));
}

#[test]
fn a_cube_inside_out_faces_inward() {
    check(&unit_cube().flipped(), &[(DefectKind::InwardComponent, 1)]);
}

#[test]
fn a_flat_pillow_encloses_nothing() {
    let vertices = vec![[0.1, 0.2, 0.3], [0.7, 0.3, 0.11], [0.4, 0.9, 0.77]];
    let pillow = Solid { vertices, triangles: vec![[0, 1, 2], [0, 2, 1]] };
    check(&pillow, &[(DefectKind::InwardComponent, 1)]);
}

#[test]
fn nested_cubes_must_alternate_where_that_is_asked() {
    let outer = Solid::cube([0.0; 3], 4.0);
    let middle = Solid::cube([0.5; 3], 3.0);
    let inner = unit_cube().changed(|s| s.vertices.iter_mut().for_each(|p| p[0] += 1.0));
    let inner = inner
        .changed(|s| s.vertices.iter_mut().for_each(|p| p.iter_mut().for_each(|x| *x += 0.75)));
    let inward = |solid: &Solid, outward| prove_all_ways(solid, outward).inward_components;
    let hollow = outer.clone().with(&middle.clone().flipped()).with(&inner);
    assert_eq!(inward(&hollow, Outward::AlternatesWithNesting), 0);
    assert_eq!(inward(&hollow, Outward::AllPositive), 1);
    assert_eq!(inward(&hollow, Outward::NotAsked), 0);
    let full = outer.with(&middle).with(&inner.flipped());
    assert_eq!(inward(&full, Outward::AlternatesWithNesting), 2);
}

#[test]
fn many_components_and_a_crowded_vertex_give_the_same_proof_on_disk() {
    let mut many = Solid::torus(3, 3);
    for i in 0..700 {
        let at = [f64::from(i) * 10.0 + 10.0, f64::from(i % 7), 0.0];
        let next = if i % 5 == 0 { Solid::cube(at, 1.0).flipped() } else { Solid::cube(at, 1.0) };
        many = many.with(&next);
    }
    // One side of which is open.
    let mut hub = bipyramid(1500);
    hub.triangles.pop();
    let all = many.with(&hub);
    let expected = [(DefectKind::BoundaryEdge, 3), (DefectKind::InwardComponent, 140)];
    let found = check(&all, &expected);
    assert_eq!(found.components, 702);
    let (_, written) = proof(&all, true, Outward::AllPositive, 16 << 10);
    assert!(written > 1 << 20, "the small share must spill, wrote {written}");
    assert_eq!(proof(&all, true, Outward::AllPositive, 64 << 20).1, 0);
}

/// A bipyramid with `sides` sides.
fn bipyramid(sides: u32) -> Solid {
    let mut hub = Solid { vertices: vec![[-9.0, 0.0, 1.0], [-9.0, 0.0, -1.0]], triangles: vec![] };
    for i in 0..sides {
        let angle = f64::from(i) * std::f64::consts::TAU / f64::from(sides);
        hub.vertices.push([-9.0 + angle.cos(), angle.sin(), 0.0]);
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        hub.triangles.extend([[0, a, b], [1, b, a]]);
    }
    hub
}

#[test]
fn a_sound_surface_has_the_same_proof_in_one_pass_and_from_the_tape() {
    let mut many = Solid::torus(30, 20).with(&bipyramid(1500));
    many = many.with(&Solid::cube([20.0, 1.0, 7.0], 0.1)).with(&bipyramid(20).shifted(30.0));
    // Neighbours in the file are neighbours no more.
    many.triangles.sort_unstable_by_key(|t| t.map(|id| id.wrapping_mul(0x9E37_79B9)));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let options = ProofOptions {
        share_bytes: 8 << 20,
        outward: Outward::AllPositive,
        vertices: Vertices::Numbers,
        intersections: false,
    };
    for indexed in [true, false] {
        let source = || Memory { solid: &many, indexed, next: 0 };
        let at_once =
            prove_sound(&mut source(), &scratch, &options, None, None, &Void).expect("no failure");
        let mut prover = Prover::new(&scratch, &options, None, &Void);
        prover.read(&mut source(), None).expect("no failure");
        let taped = prover.judge().expect("no failure");
        assert_eq!(taped.components, 4);
        assert_eq!(at_once, Some(taped));
    }
    let tight = ProofOptions { share_bytes: 64 << 10, ..options };
    let mut source = Memory { solid: &many, indexed: true, next: 0 };
    assert_eq!(
        prove_sound(&mut source, &scratch, &tight, None, None, &Void).expect("no failure"),
        None
    );
}

#[test]
fn a_request_to_stop_is_heard() {
    struct Impatient;
    impl crate::monitor::Monitor for Impatient {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let solid = unit_cube();
    let source = || Box::new(Memory { solid: &solid, indexed: true, next: 0 });
    let mut open = || Ok(source() as ProvedSource<'_, _>);
    let options = ProofOptions {
        share_bytes: 1 << 20,
        outward: Outward::NotAsked,
        vertices: Vertices::Numbers,
        intersections: true,
    };
    let answer = prove(&mut open, &Scratch::new(folder.path()), &options, &pool(1), &Impatient);
    assert!(matches!(
        answer,
        Err(crate::verify::VerifyError::Store(crate::store::StoreError::Cancelled))
    ));
}

/// Boundary, non-manifold and inconsistent edges, non-manifold vertices, edges, components.
fn brute_force(triangles: &[[u32; 3]]) -> [u64; 6] {
    let whole: Vec<[u32; 3]> =
        triangles.iter().copied().filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let mut edges: BTreeMap<[u32; 2], Vec<bool>> = BTreeMap::new();
    for &[a, b, c] in &whole {
        for [u, v] in [[a, b], [b, c], [c, a]] {
            edges.entry([u.min(v), u.max(v)]).or_default().push(u < v);
        }
    }
    let count = |test: &dyn Fn(&Vec<bool>) -> bool| edges.values().filter(|&e| test(e)).count();
    let boundary = count(&|e| e.len() == 1);
    let crowded = count(&|e| e.len() > 2);
    let inconsistent = count(&|e| e.len() == 2 && e[0] == e[1]);
    let vertices: BTreeSet<u32> = whole.iter().flatten().copied().collect();
    let groups = |items: Vec<Vec<u32>>| {
        let mut groups: Vec<BTreeSet<u32>> = Vec::new();
        for item in items {
            let mut merged: BTreeSet<u32> = item.into_iter().collect();
            groups.retain(|group| {
                let apart = group.is_disjoint(&merged);
                if !apart {
                    merged.extend(group);
                }
                apart
            });
            groups.push(merged);
        }
        groups.len()
    };
    let touched = vertices.iter().filter(|&&vertex| {
        let around = whole.iter().filter(|t| t.contains(&vertex));
        groups(around.map(|t| t.iter().copied().filter(|&v| v != vertex).collect()).collect()) > 1
    });
    let touched = touched.count();
    let components = groups(whole.iter().map(|t| t.to_vec()).collect());
    [boundary, crowded, inconsistent, touched, edges.len(), components].map(|n| n as u64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn random_soups_are_judged_like_by_brute_force(
        triangles in proptest::collection::vec(proptest::array::uniform3(0..9_u32), 0..40),
        turns in any::<bool>(),
    ) {
        let vertices: Vec<[f64; 3]> = (0..9_u32)
            .map(|i| { let t = f64::from(i); [t, t * t, t * t * t] })
            .collect();
        let mut triangles = triangles;
        if turns {
            // Every triangle from both sides: closed, and mostly crowded.
            triangles.extend_from_within(..);
            let half = triangles.len() / 2;
            triangles[half..].iter_mut().for_each(|t| t.swap(0, 2));
        }
        let expected = brute_force(&triangles);
        let found = prove_all_ways(&Solid { vertices, triangles }, Outward::AlternatesWithNesting);
        prop_assert_eq!(
            [
                found.boundary_edges, found.nonmanifold_edges, found.inconsistent_edges,
                found.nonmanifold_vertices, found.edges, found.components,
            ],
            expected
        );
    }
}
