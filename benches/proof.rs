//! The proof of a sphere of half a million triangles: with and without indices, with and without
//! the search for intersections.

use std::convert::Infallible;
use std::hint::black_box;

use brickmend::mesh::{Discarded, MeshSource, TriangleBatch};
use brickmend::monitor::Void;
use brickmend::store::Scratch;
use brickmend::verify::{Outward, ProofOptions, ProvedSource, Vertices, prove};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const RINGS: u32 = 500;
const SIDES: u32 = 501;

struct Sphere {
    batches: Vec<TriangleBatch>,
    vertices: Option<u64>,
}

impl Sphere {
    fn new(indexed: bool) -> Self {
        let id = |ring: u32, side: u32| match ring {
            0 => 0,
            RINGS => 1,
            _ => 2 + (ring - 1) * SIDES + side % SIDES,
        };
        let position = |ring: u32, side: u32| {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(RINGS);
            let angle = std::f64::consts::TAU * f64::from(side % SIDES) / f64::from(SIDES);
            let radius = if ring.is_multiple_of(RINGS) { 0.0 } else { polar.sin() };
            [radius * angle.cos(), radius * angle.sin(), polar.cos()]
        };
        let mut batches = Vec::new();
        for ring in 0..RINGS {
            let mut batch = TriangleBatch::default();
            for side in 0..SIDES {
                let [a, b] = [(ring, side), (ring + 1, side)];
                let [c, d] = [(ring + 1, side + 1), (ring, side + 1)];
                let upper = (ring > 0).then_some([a, c, d]);
                let lower = (ring + 1 < RINGS).then_some([a, b, c]);
                for triangle in upper.into_iter().chain(lower) {
                    batch.push(triangle.map(|(r, s)| position(r, s)), 0, 0, 0);
                    if indexed {
                        batch.indices.push(triangle.map(|(r, s)| id(r, s)));
                    }
                }
            }
            batches.push(batch);
        }
        let vertices = indexed.then_some(u64::from(2 + (RINGS - 1) * SIDES));
        Self { batches, vertices }
    }
}

/// Shows a sphere from its first triangle.
struct Show<'s> {
    sphere: &'s Sphere,
    next: usize,
}

impl MeshSource for Show<'_> {
    type Error = Infallible;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, Infallible> {
        let Some(next) = self.sphere.batches.get(self.next) else { return Ok(false) };
        self.next += 1;
        batch.clone_from(next);
        Ok(true)
    }
    fn discarded(&self) -> Discarded {
        Discarded::default()
    }
    fn bytes_read(&self) -> u64 {
        0
    }
    fn vertex_count(&self) -> Option<u64> {
        self.sphere.vertices
    }
}

fn proofs(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let mut group = criterion.benchmark_group("proof");
    group.sample_size(10);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for (name, indexed, share_bytes, intersections) in [
        ("indexed in memory", true, 1 << 30, true),
        ("indexed in 8 MiB", true, 8 << 20, true),
        ("positions in memory", false, 1 << 30, true),
        ("positions in 8 MiB", false, 8 << 20, true),
        ("indexed in memory without intersections", true, 1 << 30, false),
        ("positions in memory without intersections", false, 1 << 30, false),
    ] {
        let sphere = Sphere::new(indexed);
        let triangles = sphere.batches.iter().map(TriangleBatch::len).sum::<usize>();
        group.throughput(Throughput::Elements(triangles as u64));
        let options = ProofOptions {
            share_bytes,
            outward: Outward::AllPositive,
            vertices: Vertices::Numbers,
            intersections,
        };
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let show = || Box::new(Show { sphere: &sphere, next: 0 });
                let mut open = || Ok(show() as ProvedSource<'_, Infallible>);
                let proof = prove(&mut open, &scratch, &options, &pool, &Void);
                let proof = proof.expect("the scratch folder is writable");
                assert!(proof.holds());
                black_box(proof)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, proofs);
criterion_main!(benches);
