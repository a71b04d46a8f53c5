//! Primitives that Draco has compressed: the same triangles, or a refusal.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::io::IoError;
use crate::io::gltf::tests::{glb, read};
use crate::io::tests::read_bytes;

/// Corners of a grid of squares, and its triangles.
fn grid(size: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let row = size + 1;
    let corners = (0..row * row).map(|i| [(i % row) as f32, (i / row) as f32, (i % 3) as f32]);
    let squares = (0..size * size).map(|i| i / size * row + i % size);
    let triangles = squares.flat_map(|i| [[i, i + 1, i + row], [i + 1, i + row + 1, i + row]]);
    (corners.collect(), triangles.collect())
}

fn attribute(kind: GeometryAttributeType, lanes: u8, values: &[f32]) -> PointAttribute {
    let mut attribute = PointAttribute::new();
    attribute.init(kind, lanes, DataType::Float32, false, values.len() / usize::from(lanes));
    for (at, value) in values.iter().enumerate() {
        attribute.buffer_mut().write(4 * at, &value.to_le_bytes());
    }
    attribute
}

/// The grid as a stream, by the method of that number (0: sequential, 1: edge breaker).
fn stream(size: u32, method: i32) -> Vec<u8> {
    let (corners, triangles) = grid(size);
    let mut mesh = Mesh::new();
    mesh.add_attribute(attribute(GeometryAttributeType::Position, 3, corners.as_flattened()));
    let uvs: Vec<f32> = corners.iter().flat_map(|[x, y, _]| [*x, *y]).collect();
    mesh.add_attribute(attribute(GeometryAttributeType::TexCoord, 2, &uvs));
    triangles.iter().for_each(|triangle| mesh.add_face(triangle.map(PointIndex)));
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut options = EncoderOptions::new();
    options.set_global_int("encoding_method", method);
    let mut stream = EncoderBuffer::new();
    encoder.encode(&options, &mut stream).expect("encodes");
    stream.data().to_vec()
}

fn document(size: u32, length: usize) -> Value {
    let (points, triangles) = ((size + 1) * (size + 1), 2 * size * size);
    let attributes = json!({"POSITION": 0, "TEXCOORD_0": 1});
    json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "buffers": [{"byteLength": length}],
        "bufferViews": [{"buffer": 0, "byteLength": length}],
        "accessors": [
            {"componentType": 5126, "count": points, "type": "VEC3"},
            {"componentType": 5126, "count": points, "type": "VEC2"},
            {"componentType": 5125, "count": 3 * triangles, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "extensions":
            {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": attributes}}}]}],
        "nodes": [{"mesh": 0}, {"mesh": 0}],
    })
}

#[test]
fn both_methods_give_the_triangles_back() {
    let (corners, triangles) = grid(9);
    let mut expected: Vec<_> = triangles
        .iter()
        .map(|t| t.map(|v| corners[v as usize].map(|x| (1000.0 * x) as i64)))
        .collect();
    expected.iter_mut().for_each(|t| t.sort_unstable());
    expected.sort_unstable();
    for method in [0, 1] {
        let packed = stream(9, method);
        let content = read(&document(9, packed.len()), &packed).expect("readable");
        // Two nodes have the mesh; it may be quantised.
        assert_eq!(content.batch.len(), 2 * triangles.len());
        let mut found: Vec<_> = content.batch.corners[..triangles.len()]
            .iter()
            .map(|t| t.map(|p| p.map(|x| (1000.0 * x.round()) as i64)))
            .collect();
        found.iter_mut().for_each(|t| t.sort_unstable());
        found.sort_unstable();
        assert_eq!(found, expected);
        for (uvs, corners) in content.batch.uvs.iter().zip(&content.batch.corners) {
            for (uv, corner) in uvs.iter().zip(corners) {
                assert!((f64::from(uv[0]) - corner[0]).abs() < 0.1, "{uv:?} {corner:?}");
            }
        }
        let [first, last] = [content.batch.indices[0], content.batch.indices[triangles.len()]];
        assert_eq!(first.map(|vertex| vertex + 100), last);
    }
}

#[test]
fn counts_that_are_not_those_of_the_accessors_are_refused() {
    let packed = stream(4, 1);
    let told = |change: fn(&mut Value)| {
        let mut json = document(4, packed.len());
        change(&mut json);
        let error = read(&json, &packed).expect_err("refused");
        assert!(error.is_input());
        error.to_string()
    };
    for change in [
        (|json| json["accessors"][0]["count"] = json!(24)) as fn(&mut Value),
        |json| json["accessors"][0]["count"] = json!(4_000_000_000_u32),
        |json| json["accessors"][2]["count"] = json!(3),
        |json| json["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
        |json| json["bufferViews"][0]["byteLength"] = json!(20),
        |json| {
            let draco = &mut json["meshes"][0]["primitives"][0]["extensions"];
            draco["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = json!(7);
        },
    ] {
        let told = told(change);
        assert!(told.contains("buffer view 0:"), "{told}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn mutated_streams_never_bring_the_decoder_down(
        method in 0..2_i32,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut packed = stream(5, method);
        for (place, byte) in edits {
            let at = place.index(packed.len());
            packed[at] = byte;
        }
        let result = read_bytes("a.glb", &glb(&document(5, packed.len()), &packed));
        let blames_stream = result.err().is_none_or(|e| matches!(e, IoError::Unreadable { .. }));
        prop_assert!(blames_stream);
    }
}
