//! Scan conversion: triangles per second where they are small, leaf cells where they are large.

mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{Workshop, shapes};

const DEPTH: u32 = 8;

fn scans(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("scan");
    group.sample_size(10);
    for (name, shape) in shapes() {
        let workshop = Workshop::new();
        let model = workshop.ingest(&shape, DEPTH);
        let (_, stats) = workshop.scan(&model);
        group.throughput(Throughput::Elements(match name {
            "smooth" => stats.triangles,
            _ => stats.leaf_cells,
        }));
        group.bench_function(name, |bencher| bencher.iter(|| black_box(workshop.scan(&model))));
    }
    group.finish();
}

criterion_group!(benches, scans);
criterion_main!(benches);
