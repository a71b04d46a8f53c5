//! Packed files are read like their content, and nothing that is packed can bring the reader down.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;

use crate::io::detect::open_model;
use crate::io::tests::{Content, read_all, read_bytes, samples};
use crate::io::{Format, IoError, Place, ReadOptions, detect, open};
use crate::store::Scratch;

fn gzip(content: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(content).expect("in memory");
    encoder.finish().expect("in memory")
}

fn zstandard(content: &[u8]) -> Vec<u8> {
    let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 3).expect("in memory");
    encoder.include_checksum(true).expect("a checksum");
    encoder.write_all(content).expect("in memory");
    encoder.finish().expect("in memory")
}

type Pack = fn(&[u8]) -> Vec<u8>;
const PACKINGS: [(&str, Pack); 2] = [("gz", gzip), ("zst", zstandard)];

/// Zeros of any size, packed in no time.
fn zeros(packing: &str, mib: usize) -> Vec<u8> {
    let block = vec![0; 1 << 20];
    if packing == "gz" {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        (0..mib).for_each(|_| encoder.write_all(&block).expect("in memory"));
        return encoder.finish().expect("in memory");
    }
    let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 1).expect("in memory");
    (0..mib).for_each(|_| encoder.write_all(&block).expect("in memory"));
    encoder.finish().expect("in memory")
}

/// What a reader counts besides its content.
struct Counted {
    content: Content,
    bytes_read: u64,
    scratch_bytes: u64,
}

fn read_counted(path: &Path) -> Result<Counted, IoError> {
    let scratch = Scratch::new(path.parent().expect("a file in a folder"));
    let mut source = open(path, &scratch, &ReadOptions::in_scene(1 << 20))?;
    let content = read_all(source.as_mut())?;
    Ok(Counted { content, bytes_read: source.bytes_read(), scratch_bytes: scratch.written_bytes() })
}

#[test]
fn packed_files_are_read_like_their_content_whatever_they_are_called() {
    for (name, bytes) in samples() {
        let plain = read_bytes(name, &bytes).expect("readable");
        for (packing, pack) in PACKINGS {
            let named = format!("{name}.{packing}");
            for name in [named.as_str(), name] {
                assert!(read_bytes(name, &pack(&bytes)).expect("readable") == plain, "{name}");
            }
        }
    }
}

#[test]
fn members_and_frames_follow_one_another() {
    let (name, bytes) = samples().swap_remove(1);
    let plain = read_bytes(name, &bytes).expect("readable");
    for (_, pack) in PACKINGS {
        let (head, tail) = bytes.split_at(bytes.len() / 2);
        let packed = [pack(head), pack(b""), pack(tail), pack(b"")].concat();
        assert!(read_bytes("a.off", &packed).expect("readable") == plain);
    }
}

#[test]
fn bytes_read_are_those_of_the_users_file_and_the_content_lies_in_scratch() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (name, bytes) = samples().swap_remove(0);
    for (packing, pack) in PACKINGS {
        let path = folder.path().join(format!("{name}.{packing}"));
        let packed = pack(&bytes);
        std::fs::write(&path, &packed).expect("a file");
        let counted = read_counted(&path).expect("readable");
        assert_eq!(counted.content.batch.len(), 3);
        assert_eq!(counted.bytes_read, packed.len() as u64);
        assert_eq!(counted.scratch_bytes, bytes.len() as u64);
    }
}

#[test]
fn a_packed_model_finds_its_materials_beside_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("a.mtl"), "newmtl m\nd 0.5\n").expect("a file");
    let (_, obj) = samples().swap_remove(0);
    let path = folder.path().join("a.obj.gz");
    std::fs::write(&path, gzip(&obj)).expect("a file");
    let content = read_counted(&path).expect("readable").content;
    let glass = content.materials.iter().find(|material| material.name == "m").expect("named");
    assert!(glass.transparent);
}

#[test]
fn readers_judge_by_the_size_of_the_content() {
    let (name, bytes) = samples().swap_remove(0);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, gzip(&bytes)).expect("a file");
    let (input, format) = open_model(&path, &Scratch::new(folder.path()), 0).expect("opens");
    assert_eq!((input.size_bytes(), format), (bytes.len() as u64, Format::Obj));
}

#[test]
fn packed_files_cut_at_any_byte_are_refused() {
    for (name, bytes) in samples() {
        for (packing, pack) in PACKINGS {
            let packed = pack(&bytes);
            for length in 0..packed.len() {
                match read_bytes(&format!("{name}.{packing}"), &packed[..length]) {
                    Err(error) => assert!(error.is_input(), "{name}.{packing} {length}: {error}"),
                    Ok(_) => panic!("{name}.{packing} cut at {length} was read"),
                }
            }
        }
    }
}

#[test]
fn streams_that_end_too_early_or_are_corrupt_name_the_byte_of_the_packed_file() {
    // Large enough that the damage lies behind the head.
    let off = format!(
        "OFF 100000 0 0\n{}",
        (0..100_000).map(|i| format!("{i} {} 0\n", i * 7919 % 977)).collect::<String>()
    );
    for (packing, pack) in PACKINGS {
        let name = format!("a.off.{packing}");
        let packed = pack(off.as_bytes());
        let cut = packed.len() - 9;
        match read_bytes(&name, &packed[..cut]) {
            Err(IoError::Unreadable { place: Place::PackedByte(offset), found, .. }) => {
                assert_eq!((offset, found.as_str()), (cut as u64, "the end of the file"), "{name}");
            }
            other => panic!("{name}: {:?}", other.map(|content| content.batch.len())),
        }
        let mut corrupt = packed.clone();
        let middle = packed.len() / 2;
        corrupt[middle..middle + 64].fill(0xff);
        match read_bytes(&name, &corrupt) {
            Err(IoError::Unreadable { place: Place::PackedByte(offset), .. }) => {
                assert!(offset > 0 && offset <= packed.len() as u64, "{name}: {offset}");
            }
            other => panic!("{name}: {:?}", other.map(|content| content.batch.len())),
        }
        let trailed = [&packed[..], b"trailing"].concat();
        match read_bytes(&name, &trailed) {
            Err(IoError::Unreadable { place: Place::PackedByte(offset), .. }) => {
                assert!(offset >= packed.len() as u64, "{name}: {offset}");
            }
            other => panic!("{name}: {:?}", other.map(|content| content.batch.len())),
        }
    }
}

#[test]
fn errors_of_the_content_name_its_line() {
    for (_, pack) in PACKINGS {
        match read_bytes("a.off.gz", &pack(b"OFF 1 0 0\n0 0\nx\n")) {
            Err(IoError::Unreadable { path, place: Place::Line(3), .. }) => {
                assert!(path.ends_with("a.off.gz"));
            }
            other => panic!("{:?}", other.map(|content| content.batch.len())),
        }
    }
}

#[test]
fn bombs_are_refused_by_their_head_where_it_is_no_model() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (packing, _) in PACKINGS {
        for name in ["a", "a.obj", "a.ply", "a.off"] {
            let path = folder.path().join(format!("{name}.{packing}"));
            std::fs::write(&path, zeros(packing, 16)).expect("a file");
            assert!(matches!(detect(&path), Err(IoError::Unreadable { .. })), "{name}");
            let scratch = Scratch::new(folder.path());
            assert!(open(&path, &scratch, &ReadOptions::in_scene(1 << 20)).is_err());
            assert_eq!(scratch.written_bytes(), 0, "{name}");
        }
    }
}

#[test]
fn content_out_of_all_proportion_is_refused_on_the_way() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (packing, _) in PACKINGS {
        let path = folder.path().join(format!("a.stl.{packing}"));
        std::fs::write(&path, zeros(packing, 65)).expect("a file");
        assert_eq!(detect(&path).expect("an STL file may begin so"), Format::Stl);
        match read_counted(&path) {
            Err(IoError::Bomb { unpacked_bytes, .. }) => {
                assert!((64 << 20..66 << 20).contains(&unpacked_bytes), "{unpacked_bytes}");
            }
            other => panic!("{packing}: {:?}", other.map(|read| read.bytes_read)),
        }
    }
}

#[test]
fn what_was_packed_twice_is_refused() {
    let (_, bytes) = samples().swap_remove(0);
    for (_, outer) in PACKINGS {
        for (_, inner) in PACKINGS {
            match read_bytes("a.obj.gz", &outer(&inner(&bytes))) {
                Err(IoError::Unreadable { found, .. }) => assert!(found.contains("packed file")),
                other => panic!("{:?}", other.map(|content| content.batch.len())),
            }
        }
    }
}

#[test]
fn windows_larger_than_the_limit_are_refused() {
    let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 1).expect("in memory");
    encoder.window_log(24).expect("a parameter");
    encoder.write_all(&samples().swap_remove(0).1).expect("in memory");
    let packed = encoder.finish().expect("in memory");
    match read_bytes("a.obj.zst", &packed) {
        Err(IoError::Unreadable { expected, .. }) => assert!(expected.contains("8 MiB")),
        other => panic!("{:?}", other.map(|content| content.batch.len())),
    }
}

#[test]
fn binary_content_of_unknown_size_is_judged_when_all_of_it_is_there() {
    // Longer than a block, with a count that its size does not bear out.
    let mut stl = vec![0; 84];
    stl[80..84].copy_from_slice(&8000_u32.to_le_bytes());
    stl.extend((0..8001 * 50).map(|i| (i % 64) as u8));
    let (name, packed) = ("a.gz", gzip(&stl));
    assert!(matches!(read_bytes(name, &packed), Err(IoError::Unreadable { .. })));
    stl.truncate(84 + 8000 * 50);
    assert_eq!(read_bytes(name, &gzip(&stl)).expect("readable").batch.len(), 8000);
}

proptest! {
    #[test]
    fn mutated_packed_files_never_bring_a_reader_down(
        sample in 0..7_usize,
        packing in 0..2_usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..6),
    ) {
        let (name, bytes) = samples().swap_remove(sample);
        let mut packed = PACKINGS[packing].1(&bytes);
        for (place, byte, kind) in edits {
            let at = place.index(packed.len());
            match kind {
                0 => packed[at] = byte,
                1 => packed.insert(at, byte),
                _ => { packed.remove(at); }
            }
        }
        let result = read_bytes(name, &packed);
        let blames_input = result.err().is_none_or(|error| error.is_input());
        prop_assert!(blames_input);
    }
}
