//! The store: bytes per second through brick files, spools and sorts.

mod support;

use brickmend::mesh::shapes::Random;
use brickmend::octree::{BinTriangle, SoupTriangle};
use brickmend::store::{Backing, BrickWriter, Sorter, SpoolWriter};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use crate::support::{CACHED_WINDOWS, Workshop};

const BRICKS: u64 = 1000;
/// About that of a brick with a flat surface.
const BRICK_BYTES: usize = 20 << 10;
const TRIANGLES: u64 = 200_000;

fn triangle(source: u64) -> SoupTriangle {
    let source = source as u32;
    SoupTriangle { corners: [[0.5; 3]; 3], source, part: 0, material: 0, stands_for: 0 }
}

fn brick_files(criterion: &mut Criterion) {
    let workshop = Workshop::new();
    let scratch = workshop.resources().scratch;
    let record: Vec<u8> = (0..BRICK_BYTES).map(|i| (i * i) as u8).collect();
    let write = || {
        let mut writer =
            BrickWriter::create(scratch, "bricks", Backing::Mapped).expect("create works");
        for key in 0..BRICKS {
            writer.append(key, 0, &record).expect("append works");
        }
        writer.finish(CACHED_WINDOWS).expect("finish works")
    };
    let mut group = criterion.benchmark_group("store/bricks");
    group.throughput(Throughput::Bytes(BRICKS * BRICK_BYTES as u64));
    group.bench_function("write", |bencher| bencher.iter(write));
    group.bench_function("write, then read once", |bencher| {
        bencher.iter(|| {
            let file = write();
            for number in 0..file.len() {
                black_box(file.view(number).expect("the record is whole")[0]);
            }
        });
    });
    group.finish();
}

fn sorts(criterion: &mut Criterion) {
    let workshop = Workshop::new();
    let scratch = workshop.resources().scratch;
    let mut random = Random::new(3);
    let binned: Vec<BinTriangle> = (0..TRIANGLES)
        .map(|source| BinTriangle { brick: random.bits() % 500, triangle: triangle(source) })
        .collect();
    let mut group = criterion.benchmark_group("store/sort");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(TRIANGLES * size_of::<BinTriangle>() as u64));
    for (name, share_bytes) in [("in memory", 1 << 30), ("in 1 MiB", 1 << 20)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut sorter = Sorter::new(scratch, share_bytes);
                sorter.extend(&binned).expect("pushing works");
                let mut sorted = sorter.finish().expect("finishing works");
                while let Some(record) = sorted.next().expect("reading works") {
                    black_box(record.brick);
                }
            });
        });
    }
    group.finish();
}

fn spools(criterion: &mut Criterion) {
    let workshop = Workshop::new();
    let scratch = workshop.resources().scratch;
    let mut group = criterion.benchmark_group("store/spool");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(TRIANGLES * size_of::<SoupTriangle>() as u64));
    group.bench_function("write, then read", |bencher| {
        bencher.iter(|| {
            let mut writer = SpoolWriter::create(scratch, "spool").expect("create works");
            for source in 0..TRIANGLES {
                writer.push(triangle(source)).expect("push works");
            }
            let spool = writer.finish().expect("finish works");
            let mut reader = spool.reader(0, spool.len());
            while let Some(block) = reader.next_block().expect("read works") {
                black_box(block.len());
            }
        });
    });
    group.finish();
}

criterion_group!(benches, brick_files, sorts, spools);
criterion_main!(benches);
