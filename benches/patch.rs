//! Patching: leaf cells per second, of a surface without an opening and of one with many.

mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{Workshop, shapes};

const DEPTH: u32 = 8;

fn patches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("patch");
    group.sample_size(10);
    for (name, shape) in shapes().into_iter().filter(|(name, _)| *name != "faceted") {
        let workshop = Workshop::new();
        let model = workshop.ingest(&shape, DEPTH);
        let (hits, stats) = workshop.scan(&model);
        group.throughput(Throughput::Elements(stats.leaf_cells));
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(workshop.patch(&model, &hits)));
        });
    }
    group.finish();
}

criterion_group!(benches, patches);
criterion_main!(benches);
