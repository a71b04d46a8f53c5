//! Sign generation: leaf cells per second, of closed surfaces and of one with many patches.

mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{Workshop, shapes};

const DEPTH: u32 = 8;

fn signs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sign");
    group.sample_size(10);
    for (name, shape) in shapes() {
        let workshop = Workshop::new();
        let model = workshop.ingest(&shape, DEPTH);
        let (hits, _) = workshop.scan(&model);
        let flips = workshop.patch(&model, &hits);
        let (_, stats) = workshop.sign(&model, &hits, &flips);
        group.throughput(Throughput::Elements(stats.leaf_cells));
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(workshop.sign(&model, &hits, &flips)));
        });
    }
    group.finish();
}

criterion_group!(benches, signs);
criterion_main!(benches);
