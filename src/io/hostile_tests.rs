//! Files that are cut, mutated or lie about their size: an answer or a clear refusal, never more.

use proptest::prelude::*;

use crate::io::polygon::MOST_CORNERS;
use crate::io::tests::{read_bytes, samples};
use crate::io::{IoError, Place};

#[test]
fn files_cut_at_any_byte_end_in_an_answer() {
    for (name, bytes) in samples() {
        let whole = read_bytes(name, &bytes).expect("readable").batch.len();
        for length in 0..bytes.len() {
            if let Ok(content) = read_bytes(name, &bytes[..length]) {
                assert!(content.batch.len() <= whole, "{name} cut at {length}");
            }
        }
    }
}

#[test]
fn binary_files_that_end_too_early_are_refused_with_the_offset() {
    for name in ["b.stl", "b.ply", "c.ply", "a.glb"] {
        let (_, bytes) = samples().into_iter().find(|sample| sample.0 == name).expect("a sample");
        let length = bytes.len() - 1;
        match read_bytes(name, &bytes[..length]) {
            Err(IoError::Unreadable { place: Place::Byte(offset), .. }) => {
                assert_eq!(offset, length as u64, "{name}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn text_files_that_end_too_early_are_refused_with_the_line() {
    for (name, line) in [("a.stl", 4), ("a.off", 5), ("a.ply", 24)] {
        let (_, bytes) = samples().into_iter().find(|sample| sample.0 == name).expect("a sample");
        let text = String::from_utf8(bytes).expect("text");
        let cut: Vec<_> = text.lines().take(line).collect();
        match read_bytes(name, cut.join("\n").as_bytes()) {
            Err(IoError::Unreadable { place: Place::Line(found), .. }) => {
                assert_eq!(found, line as u64, "{name}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}

proptest! {
    #[test]
    fn mutated_files_never_bring_a_reader_down(
        sample in 0..8_usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..6),
    ) {
        let (name, mut bytes) = samples().swap_remove(sample);
        for (place, byte, kind) in edits {
            let at = place.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => { bytes.remove(at); }
            }
        }
        let result = read_bytes(name, &bytes);
        let blames_input = result.err().is_none_or(|error| error.is_input());
        prop_assert!(blames_input);
    }
}

#[test]
fn absurd_counts_without_content_are_refused_at_once() {
    let ply = |encoding: &str, elements: &str| {
        format!("ply\nformat {encoding} 1.0\n{elements}end_header\n\u{1}\u{2}\u{3}\n").into_bytes()
    };
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let vertices = format!("element vertex 4000000000\n{xyz}");
    let faces = format!(
        "element vertex 0\n{xyz}element face 18446744073709551615\n\
         property list uint int vertex_indices\n"
    );
    let others = format!("element x 18446744073709551615\nproperty double a\n{vertices}");
    let mut list = ply("binary_little_endian", &faces.replace("18446744073709551615", "1"));
    list.extend([255; 40]);
    let mut stl = vec![0; 84];
    stl[80..84].copy_from_slice(&[255; 4]);
    stl.extend([0; 60]);
    for (name, bytes) in [
        ("a.ply", ply("binary_little_endian", &vertices)),
        ("a.ply", ply("ascii", &vertices)),
        ("a.ply", ply("binary_big_endian", &faces)),
        ("a.ply", ply("binary_little_endian", &others)),
        ("a.ply", list),
        ("a.stl", stl),
        ("a.off", b"OFF 18446744073709551615 18446744073709551615 0\n0 0 0\n".to_vec()),
        ("a.off", b"OFF 1 1 0\n0 0 0\n4294967295 0 0 0\n".to_vec()),
    ] {
        assert!(matches!(read_bytes(name, &bytes), Err(IoError::Unreadable { .. })), "{name}");
    }
    let nothing = "element x 18446744073709551615\nelement face 0\n";
    assert_eq!(read_bytes("a.ply", &ply("ascii", nothing)).expect("readable").batch.len(), 0);
}

#[test]
fn headers_without_end_are_refused_before_they_fill_the_memory() {
    let elements = "element x 1\n".repeat(5000);
    let properties = format!("element x 1\n{}", "property int a\n".repeat(5000));
    for lines in [elements, properties] {
        let ply = format!("ply\nformat ascii 1.0\n{lines}end_header\n");
        assert!(matches!(read_bytes("a.ply", ply.as_bytes()), Err(IoError::TooMany { .. })));
    }
}

#[test]
fn a_polygon_beyond_the_limit_is_refused_by_name() {
    let face = " 0".repeat(MOST_CORNERS + 1);
    let off = format!("OFF 1 1 0\n0 0 0\n{}{face}\n", MOST_CORNERS + 1);
    assert!(matches!(read_bytes("a.off", off.as_bytes()), Err(IoError::TooMany { .. })));
}

#[test]
fn text_stl_with_an_open_facet_is_refused_and_not_shortened() {
    let text = "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nfacet\nendsolid\n";
    match read_bytes("a.stl", text.as_bytes()) {
        Err(IoError::Unreadable { place: Place::Line(6), .. }) => {}
        other => panic!("{other:?}"),
    }
}
