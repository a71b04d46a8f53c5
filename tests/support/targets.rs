//! What is fed with arbitrary bytes, by the fuzzers (`fuzz/`) and by the replay of their corpora.
//!
//! A target ends in an answer or an error that blames the input. A panic is a find.

use std::path::Path;

use brickmend::io::{BATCH_TRIANGLES, Format, ReadOptions};
use brickmend::mesh::TriangleBatch;
use brickmend::monitor::Void;
use brickmend::octree::{decode_cells, decode_hits, decode_signs};
use brickmend::repair::{Depth, Limits, RepairError, Settings, repair};
use brickmend::store::{Scratch, load_manifest};
use tempfile::TempDir;

/// Takes arbitrary bytes.
pub type Target = fn(&[u8]);

/// All targets by the names of their corpora.
pub const TARGETS: [(&str, Target); 10] = [
    ("obj", read_obj),
    ("stl", read_stl),
    ("ply", read_ply),
    ("off", read_off),
    ("gltf", read_gltf),
    ("any", read_any),
    ("materials", read_materials),
    ("bricks", decode_bricks),
    ("manifest", decode_manifest),
    ("soup", repair_soup),
];

/// In memory where the system has such a place: a fuzzer makes many small files.
fn folder() -> TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { TempDir::new_in(memory) } else { TempDir::new() };
    made.expect("a temporary folder can be made")
}

/// Reads the model at `path` to its end or to its first error.
fn read(path: &Path, scratch: &Scratch) {
    let options = ReadOptions::in_scene(96 << 10);
    let mut source = match brickmend::io::open(path, scratch, &options) {
        Ok(source) => source,
        Err(error) => return assert!(error.is_input(), "{error}"),
    };
    let mut batch = TriangleBatch::default();
    loop {
        match source.next_batch(&mut batch) {
            Ok(true) => assert!(batch.len() <= BATCH_TRIANGLES, "a batch of {}", batch.len()),
            Ok(false) => break,
            Err(error) => return assert!(error.is_input(), "{error}"),
        }
        let parts = source.part_count();
        assert!(batch.parts.iter().all(|&part| u64::from(part) < parts));
        let vertices = source.vertex_count().unwrap_or(u64::MAX);
        assert!(batch.indices.iter().flatten().all(|&index| u64::from(index) < vertices));
    }
    // At the end of the file it stays at its end.
    assert!(matches!(source.next_batch(&mut batch), Ok(false)));
}

fn read_named(name: &str, bytes: &[u8]) {
    let folder = folder();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("writable");
    read(&path, &Scratch::new(folder.path()));
}

pub fn read_obj(bytes: &[u8]) {
    read_named("a.obj", bytes);
}

pub fn read_stl(bytes: &[u8]) {
    read_named("a.stl", bytes);
}

pub fn read_ply(bytes: &[u8]) {
    read_named("a.ply", bytes);
}

pub fn read_off(bytes: &[u8]) {
    read_named("a.off", bytes);
}

pub fn read_gltf(bytes: &[u8]) {
    read_named("a.gltf", bytes);
}

/// Whatever the content says; also packed files.
pub fn read_any(bytes: &[u8]) {
    read_named("a", bytes);
}

/// A material library beside a model that uses it.
pub fn read_materials(bytes: &[u8]) {
    let folder = folder();
    let path = folder.path().join("a.obj");
    let model = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    std::fs::write(&path, model).expect("writable");
    std::fs::write(folder.path().join("a.mtl"), bytes).expect("writable");
    read(&path, &Scratch::new(folder.path()));
}

/// Records of bricks whose digests are right and whose content is not.
pub fn decode_bricks(bytes: &[u8]) {
    let mut aligned = vec![0_u128; bytes.len().div_ceil(16)];
    let room: &mut [u8] = bytemuck::cast_slice_mut(&mut aligned);
    room[..bytes.len()].copy_from_slice(bytes);
    let record = &room[..bytes.len()];
    if let Ok(brick) = decode_hits(record) {
        let planes = brick.planes.len();
        assert!(brick.hits.iter().all(|hit| (hit.to_native() as usize) < planes));
    }
    if let Ok(brick) = decode_signs(record) {
        assert!(brick.crossings.iter().all(|crossing| crossing.edge.to_native() < 3 * 35_937));
    }
    if let Ok(brick) = decode_cells(record) {
        assert!(brick.cells.iter().all(|cell| cell.to_native() >> 24 == 0));
        let sum = brick.positions.iter().flatten().fold(0, |sum, x| sum ^ x.to_native());
        std::hint::black_box((sum, brick.offsets.len()));
    }
}

pub fn decode_manifest(bytes: &[u8]) {
    let folder = folder();
    let path = folder.path().join("manifest");
    std::fs::write(&path, bytes).expect("writable");
    drop(load_manifest(&path).expect("a lie is no error of the disk"));
}

/// Repairs the triangles whose corners the bytes are, three to a corner, on a small lattice.
pub fn repair_soup(bytes: &[u8]) {
    const MOST_TRIANGLES: usize = 64;
    let folder = folder();
    let mut text = String::new();
    for (number, corners) in bytes.chunks_exact(9).take(MOST_TRIANGLES).enumerate() {
        for corner in corners.chunks_exact(3) {
            let [x, y, z] = [0, 1, 2].map(|a| f64::from(corner[a] as i8) / 8.0);
            text += &format!("v {x} {y} {z}\n");
        }
        let first = 3 * number;
        text += &format!("f {} {} {}\n", first + 1, first + 2, first + 3);
    }
    let (input, output) = (folder.path().join("a.obj"), folder.path().join("out.ply"));
    std::fs::write(&input, text).expect("writable");
    let settings = Settings { depth: Depth::Levels(5), ..Settings::default() };
    let limits = Limits { max_memory_bytes: 64 << 20, ..Limits::default() };
    match repair(&input, &output, Format::Ply, &settings, &limits, &Void) {
        Ok(outcome) => {
            let proof = &outcome.output.proof;
            assert!(proof.holds(), "{:?}", proof.failures());
        }
        Err(RepairError::NoTriangle { .. } | RepairError::EmptyResult { .. }) => {}
        Err(RepairError::Input(error)) => assert!(error.is_input(), "{error}"),
        Err(error) => panic!("{error}"),
    }
}
