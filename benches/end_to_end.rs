//! A whole repair, proof included, of binary STL into PLY on one thread: leaf cells per second.

mod support;

use std::path::Path;

use brickmend::io::{Format, WriteOptions, create};
use brickmend::mesh::SinkTriangles;
use brickmend::mesh::shapes::Corners;
use brickmend::monitor::Void;
use brickmend::repair::{Depth, Limits, Settings, repair};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{Workshop, shapes};

const DEPTH: u32 = 8;

fn write_stl(triangles: &[Corners], path: &Path, workshop: &Workshop) {
    let mut sink =
        create(path, Format::Stl, workshop.resources().scratch, &WriteOptions::default())
            .expect("the folder is writable");
    let vertices = triangles.iter().flatten().copied().collect::<Vec<_>>();
    let indices: Vec<[u32; 3]> =
        (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    sink.vertices(&vertices).expect("the folder is writable");
    let triangles = SinkTriangles {
        indices: &indices,
        corners: triangles,
        surfaces: &[],
        ..SinkTriangles::default()
    };
    sink.triangles(&triangles).expect("the folder is writable");
    sink.finish().expect("the folder is writable");
}

fn repairs(criterion: &mut Criterion) {
    let settings = Settings { depth: Depth::Levels(DEPTH), ..Settings::default() };
    let mut group = criterion.benchmark_group("end to end");
    group.sample_size(10);
    for (name, shape) in shapes() {
        let workshop = Workshop::new();
        let input = workshop.folder().join("in.stl");
        let output = workshop.folder().join("out.ply");
        write_stl(&shape, &input, &workshop);
        let run = || {
            repair(&input, &output, Format::Ply, &settings, &Limits::default(), &Void)
                .expect("a result")
        };
        group.throughput(Throughput::Elements(run().sign.leaf_cells));
        group.bench_function(name, |bencher| bencher.iter(|| black_box(run())));
    }
    group.finish();
}

criterion_group!(benches, repairs);
criterion_main!(benches);
