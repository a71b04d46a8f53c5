//! glTF files that lie, point elsewhere or go in circles: refused by name, never more.

use proptest::prelude::*;
use serde_json::{Value, json};

use crate::io::gltf::tests::{add, glb, read, read_file, refused, square};
use crate::io::tests::read_bytes;
use crate::io::{IoError, Place};

#[test]
fn accessors_that_leave_their_buffers_are_refused_by_number() {
    let told = refused(|json, _| json["accessors"][0]["count"] = json!(5));
    assert!(told.contains("accessor 0: expected elements in a view of 48 bytes"), "{told}");
    let told = refused(|json, _| json["accessors"][1]["count"] = json!(4_000_000_000_u32));
    assert!(told.contains("accessor 1:"), "{told}");
    for (member, value) in [
        ("count", json!(u64::MAX)),
        ("byteOffset", json!(u64::MAX)),
        ("byteOffset", json!(1)),
        ("componentType", json!(5125)),
        ("componentType", json!(7)),
        ("type", json!("VEC2")),
        ("type", json!("MAT4")),
    ] {
        let told = refused(|json, _| json["accessors"][0][member] = value.clone());
        assert!(told.contains("accessor 0:"), "{told}");
    }
    for (member, value) in [
        ("byteOffset", json!(u64::MAX)),
        ("byteLength", json!(u64::MAX)),
        ("byteLength", json!(61)),
        ("byteStride", json!(u64::MAX)),
    ] {
        let told = refused(|json, _| json["bufferViews"][0][member] = value.clone());
        assert!(told.contains("buffer view 0:") || told.contains("accessor 0:"), "{told}");
    }
    let told = refused(|json, _| json["buffers"][0]["byteLength"] = json!(61));
    assert!(told.contains("buffer 0: expected 61 bytes, found 60"), "{told}");
}

#[test]
fn numbers_of_what_is_not_there_are_refused() {
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 8] = [
        (|json| json["scene"] = json!(7), "scene 7:"),
        (|json| json["scenes"][0]["nodes"] = json!([1]), "node 1:"),
        (|json| json["nodes"][0]["mesh"] = json!(2), "mesh 2:"),
        (|json| json["nodes"][0]["children"] = json!([u32::MAX]), "node 4294967295:"),
        (|json| json["meshes"][0]["primitives"][0]["indices"] = json!(9), "accessor 9:"),
        (|json| json["meshes"][0]["primitives"][0]["material"] = json!(0), "material 0:"),
        (|json| json["accessors"][0]["bufferView"] = json!(2), "buffer view 2:"),
        (|json| json["bufferViews"][0]["buffer"] = json!(1), "buffer 1:"),
    ];
    for (change, place) in cases {
        let told = refused(|json, _| change(json));
        assert!(told.contains(place), "{told}");
    }
}

#[test]
fn circles_and_second_parents_are_refused() {
    let circle = json!([{"children": [1], "mesh": 0}, {"children": [0]}]);
    let told = refused(|json, _| json["nodes"] = circle.clone());
    assert!(told.contains("node 0: expected a node with one parent"), "{told}");
    let told = refused(|json, _| {
        json["nodes"] = circle;
        json.as_object_mut().expect("an object").remove("scenes");
    });
    assert!(told.contains("2 in circles"), "{told}");
    let told = refused(|json, _| json["nodes"] = json!([{"children": [1, 1]}, {"mesh": 0}]));
    assert!(told.contains("node 1:"), "{told}");
    // Deep is no circle, and no stack overflows.
    let (mut json, binary) = square();
    let nodes: Vec<_> = (1..=100_000).map(|i| json!({"children": [i]})).collect();
    json["nodes"] = json!(nodes);
    add(&mut json, "nodes", json!({"mesh": 0}));
    assert_eq!(read(&json, &binary).expect("readable").batch.len(), 2);
}

#[test]
fn transforms_that_are_no_numbers_are_refused() {
    let (json, binary) = square();
    for (found, place) in [("null", "byte"), ("1e999", "byte"), ("\"nan\"", "byte")] {
        let text = json
            .to_string()
            .replace("{\"mesh\":0}", &format!("{{\"mesh\":0,\"translation\":[0,{found},0]}}"));
        assert!(text.contains(found));
        let told = read_bytes("a.gltf", text.as_bytes()).expect_err("refused").to_string();
        assert!(told.contains(place) || told.contains("line 1"), "{told}");
    }
    let huge =
        json!([{"scale": [1e300, 1, 1], "children": [1]}, {"scale": [1e300, 1, 1], "mesh": 0}]);
    let mut json = json;
    json["nodes"] = huge;
    let told = read(&json, &binary).expect_err("refused").to_string();
    assert!(told.contains("node 1: expected a finite transform"), "{told}");
}

#[test]
fn sparse_indices_ascend_within_their_accessor() {
    for indices in [[3_u8, 1], [1, 1], [1, 4]] {
        let told = refused(|json, binary| {
            binary.extend(indices);
            json["buffers"][0]["byteLength"] = json!(62);
            add(json, "bufferViews", json!({"buffer": 0, "byteOffset": 60, "byteLength": 2}));
            json["accessors"][0]["sparse"] = json!({"count": 2,
                "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 0}});
        });
        assert!(told.contains("ascending sparse indices"), "{told}");
    }
}

#[test]
fn required_extensions_are_known_or_named() {
    let told = refused(|json, _| {
        json["extensionsRequired"] = json!(["KHR_materials_unlit", "EXT_meshopt_compression"]);
    });
    assert!(told.ends_with("expected one that is known, found EXT_meshopt_compression"), "{told}");
    let (mut json, binary) = square();
    json["extensionsUsed"] = json!(["EXT_meshopt_compression", "FOO_bar"]);
    json["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_texture_transform"]);
    assert_eq!(read(&json, &binary).expect("readable").batch.len(), 2);
}

#[test]
fn containers_that_lie_are_refused_with_the_byte() {
    let (json, binary) = square();
    let whole = glb(&json, &binary);
    let place = |bytes: &[u8]| match read_bytes("a.glb", bytes) {
        Err(IoError::Unreadable { place: Place::Byte(offset), .. }) => offset,
        other => panic!("{other:?}"),
    };
    let with = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    assert_eq!(place(&whole[..whole.len() - 1]), whole.len() as u64 - 1);
    assert_eq!(place(&with(4, 1)), 4);
    assert_eq!(place(&with(11, 1)), whole.len() as u64);
    assert_eq!(place(&with(15, 1)), 12);
    assert_eq!(place(&with(16, b'X')), 12);
    // Bytes behind the end do no harm.
    let longer = [&whole[..], b"tail"].concat();
    assert_eq!(read_bytes("a.glb", &longer).expect("readable").batch.len(), 2);
}

#[test]
fn files_elsewhere_are_not_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).expect("a folder");
    let (mut json, binary) = square();
    let outside = folder.path().join("out.bin");
    std::fs::write(&outside, &binary).expect("a file");
    std::os::unix::fs::symlink(&outside, inner.join("link.bin")).expect("a link");
    std::fs::write(inner.join("short.bin"), &binary[..59]).expect("a file");
    let path = inner.join("a.gltf");
    let absolute = outside.to_str().expect("text").to_owned();
    for uri in [
        "../out.bin",
        "..%2fout.bin",
        "..\\out.bin",
        "link.bin",
        &absolute,
        "none.bin",
        "",
        "data:1",
        "short.bin",
        "http://example.org/a.bin",
    ] {
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, json.to_string()).expect("a file");
        let told = read_file(&path, 1 << 20).expect_err("refused").to_string();
        assert!(told.contains("buffer 0:"), "{uri}: {told}");
    }
}

#[test]
fn json_that_is_none_or_another_is_refused() {
    let with = |text: &str| match read_bytes("a.gltf", text.as_bytes()) {
        Err(error @ IoError::Unreadable { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(with("{").contains("line 1"));
    assert!(with("{}").contains("an asset with a version"));
    assert!(with("{\"asset\": {\"version\": \"1.0\"}}").contains("version 1.0"));
    assert!(with("{\"asset\": {\"version\": \"2.0\"}}\n x").contains("line 2"));
    with(&"{\"a\":[".repeat(10_000));
    with(&format!("{{\"a\": {}}}", "1".repeat(5000)));
    with(&format!("{{\"a\": \"{}\"}}", "x".repeat(9 << 20)));
    with(
        "{\"asset\": {\"version\": \"2.0\"}, \"buffers\": [{\"byteLength\": 1, \"uri\": \
          \"data:;base64,A\"}]}",
    );
}

#[test]
fn absurd_counts_of_nothing_cost_nothing() {
    // Zeros without a view, and copies of no triangle.
    let (mut json, binary) = square();
    json["accessors"][0] =
        json!({"componentType": 5126, "count": 4_000_000_000_u32, "type": "VEC3"});
    assert_eq!(read(&json, &binary).expect("readable").batch.corners, [[[0.0; 3]; 3]; 2]);
    json["accessors"][1]["count"] = json!(0);
    json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    assert_eq!(read(&json, &binary).expect("readable").batch.len(), 0);
    let told = refused(|json, _| {
        json["accessors"][0] = json!({"componentType": 5126, "count": 1_u64 << 33, "type": "VEC3"});
    });
    assert!(told.contains("vertices"), "{told}");
}

proptest! {
    #[test]
    fn mutated_glb_never_brings_the_reader_down(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..6),
    ) {
        let (mut json, binary) = square();
        json["nodes"] = json!([{"children": [1]}, {"mesh": 0, "scale": [1, 2, -3]}]);
        let mut bytes = glb(&json, &binary);
        for (place, byte, kind) in edits {
            let at = place.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => { bytes.remove(at); }
            }
        }
        let result = read_bytes("a.glb", &bytes);
        let blames_input = result.err().is_none_or(|error| error.is_input());
        prop_assert!(blames_input);
    }
}
