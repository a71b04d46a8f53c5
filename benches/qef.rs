//! Placement of one vertex: flat, crease, corner and noisy cells, 256 of each in a round.

use brickmend::geom::qef::{Hit, QefOptions, solve};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;

const CELLS: usize = 256;

/// Cells of `count` hits whose normals are those of `planes` in turn, plus noise.
fn cells(planes: &[DVec3], count: usize, noise: f64) -> Vec<Vec<Hit>> {
    let mut state = 1_u64;
    let mut roll = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut cell = || {
        let apex = DVec3::new(roll(), roll(), roll()) * 0.5;
        let hit = |i: usize| {
            let normal = planes[i % planes.len()].normalize();
            let free = DVec3::new(roll(), roll(), roll()) * 0.5;
            let point = apex + free - normal * normal.dot(free);
            let tilt = DVec3::new(roll(), roll(), roll()) * noise;
            Hit { point, normal: (normal + tilt).normalize() }
        };
        (0..count).map(hit).collect::<Vec<_>>()
    };
    (0..CELLS).map(|_| cell()).collect()
}

fn place(criterion: &mut Criterion) {
    let [a, b, c] = [(1.0, 2.0, 3.0), (-2.0, 1.0, 0.5), (0.3, -1.0, 2.0)].map(DVec3::from);
    let sets = [
        ("flat_4", cells(&[a], 4, 0.0)),
        ("flat_axis_4", cells(&[DVec3::Z], 4, 0.0)),
        ("crease_5", cells(&[a, b], 5, 0.0)),
        ("corner_6", cells(&[a, b, c], 6, 0.0)),
        ("noisy_corner_6", cells(&[a, b, c], 6, 0.1)),
        ("noisy_crease_5", cells(&[a, b], 5, 0.05)),
        ("noisy_flat_4", cells(&[a], 4, 0.05)),
    ];
    let options = QefOptions::new(12.0, DVec3::splat(-0.499), DVec3::splat(0.499));
    let mut group = criterion.benchmark_group("qef");
    group.throughput(Throughput::Elements(CELLS as u64));
    for (name, set) in &sets {
        group.bench_function(*name, |bencher| {
            bencher.iter(|| {
                for hits in set {
                    black_box(solve(black_box(hits), &options));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, place);
criterion_main!(benches);
