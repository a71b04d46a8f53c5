//! Contouring: leaf cells per second, of placing vertices, of joining them, and of writing PLY.

mod support;

use brickmend::contour::{ContourOptions, ContourStats, Method, SurfaceDetail, write_surface};
use brickmend::io::{Format, WriteOptions, create};
use brickmend::mesh::MeshSink;
use brickmend::octree::{Domain, SignBricks};
use brickmend::store::{BrickFile, Resources};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{Nowhere, Workshop, shapes};

const DEPTH: u32 = 8;
const LEAVES: ContourOptions = ContourOptions {
    method: Method::Mdc,
    crease_deg: 12.0,
    decimate_cells: 0.0,
    surfaces: SurfaceDetail::None,
    sources: false,
};
const CLUSTERS: ContourOptions = ContourOptions { decimate_cells: 0.1, ..LEAVES };

fn write<S: MeshSink + ?Sized>(
    files: (&BrickFile, &BrickFile),
    domain: &Domain,
    sink: &mut S,
    resources: &Resources,
) -> ContourStats
where
    S::Error: Send,
{
    let placed = (&ContourStats::default(), None);
    write_surface(files, domain, &LEAVES, placed, sink, resources).expect("contour works")
}

fn contours(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("contour");
    group.sample_size(10);
    for (name, shape) in shapes() {
        let workshop = Workshop::new();
        let resources = workshop.resources();
        let model = workshop.ingest(&shape, DEPTH);
        let (hits, _) = workshop.scan(&model);
        let flips = workshop.patch(&model, &hits);
        let (signs, stats) = workshop.sign(&model, &hits, &flips);
        let signs = SignBricks::new(&signs, &hits);
        let (cells, placed) = workshop.place(&model, signs, &LEAVES);
        let surface = workshop.separate(&model, signs, &cells, &LEAVES, &placed);
        let files = (&cells, &surface);
        group.throughput(Throughput::Elements(stats.leaf_cells));
        group.bench_function(format!("{name} vertices"), |bencher| {
            bencher.iter(|| black_box(workshop.place(&model, signs, &LEAVES)));
        });
        group.bench_function(format!("{name} clusters"), |bencher| {
            bencher.iter(|| black_box(workshop.place(&model, signs, &CLUSTERS)));
        });
        group.bench_function(format!("{name} polygons"), |bencher| {
            bencher.iter(|| write(files, &model.domain, &mut Nowhere::default(), &resources));
        });
        group.bench_function(format!("{name} polygons to PLY"), |bencher| {
            let path = workshop.folder().join("out.ply");
            bencher.iter(|| {
                let sink = create(&path, Format::Ply, resources.scratch, &WriteOptions::default());
                let mut sink = sink.expect("the folder is writable");
                write(files, &model.domain, &mut *sink, &resources)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, contours);
criterion_main!(benches);
