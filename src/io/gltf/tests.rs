//! Small glTF files that between them use everything the reader knows.

use std::path::Path;

use serde_json::{Value, json};

use crate::io::tests::{Content, read_all, read_bytes};
use crate::io::{IoError, ReadOptions, open};
use crate::mesh::{Maps, Material, OtherMaps, Texture};
use crate::store::Scratch;

/// A GLB file.
pub(crate) fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let size = 12 + 8 + text.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((size as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        if !chunk.is_empty() {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
    }
    bytes
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// A square of two triangles: 4 positions, and 6 indices in 16 bits from byte 48 on.
pub(crate) fn square() -> (Value, Vec<u8>) {
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    binary.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    let json = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 60}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "meshes": [{"name": "square", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    });
    (json, binary)
}

/// The square as a file.
pub(crate) fn gltf_square() -> Vec<u8> {
    let (json, binary) = square();
    glb(&json, &binary)
}

pub(crate) fn read(json: &Value, binary: &[u8]) -> Result<Content, IoError> {
    read_bytes("a.glb", &glb(json, binary))
}

/// Appends an object to a list of the file.
pub(crate) fn add(json: &mut Value, list: &str, object: Value) {
    json[list].as_array_mut().expect("a list").push(object);
}

/// What a change makes of the square.
fn changed(change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> Content {
    let (mut json, mut binary) = square();
    change(&mut json, &mut binary);
    read(&json, &binary).expect("readable")
}

/// Where in a text the file stands, and the error's text.
pub(crate) fn refused(change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> String {
    let (mut json, mut binary) = square();
    change(&mut json, &mut binary);
    match read(&json, &binary) {
        Err(error @ (IoError::Unreadable { .. } | IoError::TooMany { .. })) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_square_is_read_with_its_numbers() {
    let content = changed(|_, _| {});
    let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(content.batch.corners, [[a, b, c], [a, c, d]]);
    assert_eq!(content.batch.indices, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(content.batch.polygons, [0, 1]);
    assert_eq!(content.vertex_count, Some(4));
    assert_eq!(content.part_names(), ["square"]);
    assert_eq!(content.materials, [Material::default()]);
    assert!(content.batch.uvs.is_empty() && content.batch.colours.is_empty());
}

#[test]
fn nodes_are_composed_and_mirrors_turn_triangles_over() {
    let content = changed(|json, _| {
        json["nodes"] = json!([
            {"children": [2, 1], "scale": [2.0, 2.0, 2.0], "translation": [0.0, 0.0, 5.0]},
            {"mesh": 0, "name": "same", "scale": [-1.0, 1.0, 1.0]},
            {"mesh": 0, "name": "same",
             "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1]},
        ]);
    });
    assert_eq!(content.part_names(), ["same", "same"]);
    assert_eq!(content.batch.parts, [0, 0, 1, 1]);
    let first = [[20.0, 0.0, 5.0], [22.0, 0.0, 5.0], [22.0, 2.0, 5.0]];
    assert_eq!(content.batch.corners[0], first);
    let mirrored = [[0.0, 0.0, 5.0], [-2.0, 2.0, 5.0], [-2.0, 0.0, 5.0]];
    assert_eq!(content.batch.corners[2], mirrored);
    // Each node has vertices of its own.
    assert_eq!(content.batch.indices, [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]);
    assert_eq!(content.vertex_count, Some(8));
}

#[test]
fn the_default_scene_counts_else_the_first_else_all_roots() {
    let nodes = json!([{"children": [1]}, {"mesh": 0}, {"mesh": 0}]);
    let scenes = json!([{"nodes": [0, 2]}, {"nodes": [1]}]);
    let triangles = |scenes: Value, scene: Option<u32>| {
        let content = changed(|json, _| {
            (json["nodes"], json["scenes"]) = (nodes.clone(), scenes);
            if let Some(scene) = scene {
                json["scene"] = json!(scene);
            }
        });
        content.batch.len()
    };
    assert_eq!(triangles(scenes.clone(), Some(1)), 2);
    assert_eq!(triangles(scenes, None), 4);
    assert_eq!(triangles(json!([]), None), 4);
    assert_eq!(triangles(json!([{}]), None), 0);
}

#[test]
fn strips_fans_points_and_missing_indices() {
    let with = |mode: u32, has_indices: bool| {
        changed(|json, _| {
            let primitive = &mut json["meshes"][0]["primitives"][0];
            primitive["mode"] = json!(mode);
            if !has_indices {
                primitive.as_object_mut().expect("an object").remove("indices");
            }
        })
    };
    assert_eq!(with(5, false).batch.indices, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(with(6, false).batch.indices, [[1, 2, 0], [2, 3, 0]]);
    assert_eq!(with(5, true).batch.len(), 4);
    let short = with(4, false);
    assert_eq!((short.batch.len(), short.discarded.short_faces), (1, 1));
    for mode in [0, 1, 2, 3, 7] {
        assert_eq!(with(mode, true).batch.len(), 0);
    }
}

#[test]
fn wild_indices_are_counted() {
    let content = changed(|_, binary| binary[58] = 4);
    assert_eq!((content.batch.len(), content.discarded.wild_index_faces), (1, 1));
    assert_eq!(content.batch.polygons, [0]);
}

#[test]
fn whole_numbers_strides_and_sparse_values_are_positions_too() {
    // Four vertices of three bytes in eight each.
    let content = changed(|json, binary| {
        let mut bytes = Vec::new();
        for vertex in [[0_u8, 0, 0], [255, 0, 0], [255, 255, 0], [0, 255, 51]] {
            bytes.extend(vertex);
            bytes.extend([9; 5]);
        }
        binary.splice(..48, bytes);
        json["bufferViews"][0] = json!({"buffer": 0, "byteLength": 32, "byteStride": 8});
        json["bufferViews"][1]["byteOffset"] = json!(32);
        json["buffers"][0]["byteLength"] = json!(44);
        json["accessors"][0] = json!({"bufferView": 0, "componentType": 5121, "normalized": true,
            "count": 4, "type": "VEC3"});
    });
    assert_eq!(content.batch.corners[1][2], [0.0, 1.0, 0.2]);
    // The base is missing, and two of its zeros are replaced.
    let content = changed(|json, binary| {
        binary.extend([1_u8, 3, 0, 0]);
        json["buffers"][0]["byteLength"] = json!(64);
        add(json, "bufferViews", json!({"buffer": 0, "byteOffset": 60, "byteLength": 2}));
        json["accessors"][0] = json!({"componentType": 5126, "count": 4, "type": "VEC3",
            "sparse": {"count": 2, "indices": {"bufferView": 2, "componentType": 5121},
                       "values": {"bufferView": 0, "byteOffset": 12}}});
    });
    assert_eq!(content.batch.corners[0], [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]]);
    assert_eq!(content.batch.corners[1], [[0.0; 3], [0.0; 3], [1.0, 1.0, 0.0]]);
}

#[test]
fn colours_and_texture_coordinates_are_there_for_all_or_none() {
    let content = changed(|json, binary| {
        binary.extend([255_u8, 0, 51, 0].repeat(4));
        binary.extend(floats(&[0.25, 0.5].repeat(4)));
        json["buffers"][0]["byteLength"] = json!(108);
        add(
            json,
            "bufferViews",
            json!({"buffer": 0, "byteOffset": 60, "byteLength": 16, "byteStride": 4}),
        );
        add(json, "bufferViews", json!({"buffer": 0, "byteOffset": 76, "byteLength": 32}));
        add(
            json,
            "accessors",
            json!({"bufferView": 2, "componentType": 5121, "normalized": true,
            "count": 4, "type": "VEC3"}),
        );
        add(
            json,
            "accessors",
            json!({"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC2"}),
        );
        let primitives = json["meshes"][0]["primitives"].as_array_mut().expect("a list");
        let mut other = primitives[0].clone();
        other["attributes"]["COLOR_0"] = json!(2);
        other["attributes"]["TEXCOORD_0"] = json!(3);
        primitives.push(other);
    });
    assert_eq!(content.batch.colours[0], [[255; 4]; 3]);
    assert_eq!(content.batch.colours[2], [[255, 0, 51, 255]; 3]);
    assert_eq!(content.batch.uvs[1..3], [[[0.0; 2]; 3], [[0.25, 0.5]; 3]]);
    // Both primitives have the same vertices.
    assert_eq!(content.batch.indices[2], content.batch.indices[0]);
    assert_eq!(content.vertex_count, Some(4));
}

#[test]
fn materials_are_numbered_as_they_are_used_and_may_share_names() {
    let content = changed(|json, _| {
        json["materials"] = json!([
            {"name": "glass", "pbrMetallicRoughness": {"metallicFactor": 0.5},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}},
            {"name": "unused"},
            {"name": "glass", "alphaMode": "BLEND", "emissiveFactor": [0.5, 0, 0],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
             "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.125],
                 "baseColorTexture": {"index": 1}, "roughnessFactor": 0.75}},
        ]);
        json["textures"] = json!([{"source": 0}, {"source": 1}]);
        json["images"] = json!([{"bufferView": 0}, {"uri": "a%20b.png"}]);
        let primitive = json["meshes"][0]["primitives"][0].clone();
        let with = |material: u32| {
            let mut primitive = primitive.clone();
            primitive["material"] = json!(material);
            primitive
        };
        json["meshes"][0]["primitives"] = json!([with(2), primitive, with(0), with(2)]);
    });
    assert_eq!(content.batch.materials, [0, 0, 1, 1, 2, 2, 0, 0]);
    let blend = Material {
        name: "glass".to_owned(),
        transparent: true,
        diffuse: Some([0.5, 0.25, 1.0]),
        opacity: Some(0.125),
        emissive: Some([2.0, 0.0, 0.0]),
        metallic: Some(1.0),
        roughness: Some(0.75),
        alpha_cutoff: None,
        texture: Some(Texture::Beside("a b.png".to_owned())),
        maps: Maps::default(),
        other_maps: OtherMaps::default(),
    };
    let glass = Material {
        name: "glass".to_owned(),
        transparent: true,
        metallic: Some(0.5),
        roughness: Some(1.0),
        ..Material::default()
    };
    assert_eq!(content.materials, [blend, Material::default(), glass]);
}

#[test]
fn factors_of_maps_mean_nothing_without_them_and_images_are_cut_off() {
    let content = changed(|json, _| {
        json["meshes"][0]["primitives"][0]["material"] = json!(0);
        let pbr = json!({"metallicFactor": 0.5, "metallicRoughnessTexture": {"index": 0}});
        json["materials"] = json!([{"pbrMetallicRoughness": pbr, "alphaMode": "MASK",
            "emissiveFactor": [1.0, 1.0, 1.0], "emissiveTexture": {"index": 0, "texCoord": 1},
            "normalTexture": {"index": 7}, "occlusionTexture": {"index": 0, "strength": 0.5}}]);
        json["textures"] = json!([{"source": 0}]);
        json["images"] = json!([{"uri": "a.png"}]);
    });
    let material = &content.materials[0];
    // The first map says which coordinates there are; a texture that is none is no map.
    let image = Texture::Beside("a.png".to_owned());
    let kept =
        Maps { gloss: Some(image.clone()), occlusion: Some((image, 0.5)), ..Maps::default() };
    assert_eq!(material.maps, kept);
    assert_eq!(material.other_maps, OtherMaps::NORMAL.with(OtherMaps::EMISSION));
    let factors = (material.metallic, material.roughness, material.emissive);
    assert_eq!(factors, (Some(0.5), Some(1.0), None));
    assert_eq!((material.alpha_cutoff, material.transparent), (Some(0.5), false));
}

#[test]
fn copies_of_a_mesh_are_delivered_one_by_one() {
    let content = changed(|json, binary| {
        binary.extend(floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 2.0]));
        binary.extend(floats(&[1.0, 1.0, 1.0, 1.0, -1.0, 1.0]));
        json["buffers"][0]["byteLength"] = json!(108);
        add(json, "bufferViews", json!({"buffer": 0, "byteOffset": 60, "byteLength": 48}));
        for offset in [0, 24] {
            add(
                json,
                "accessors",
                json!({"bufferView": 2, "byteOffset": offset,
                "componentType": 5126, "count": 2, "type": "VEC3"}),
            );
        }
        json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
            {"attributes": {"TRANSLATION": 2, "SCALE": 3}}});
        json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    });
    assert_eq!(content.batch.parts, [0; 4]);
    let heights: Vec<_> = content.batch.corners.iter().map(|corners| corners[0][2]).collect();
    assert_eq!(heights, [1.0, 1.0, 2.0, 2.0]);
    assert_eq!(content.batch.indices[2], [4, 6, 5]);
}

#[test]
fn text_with_buffers_beside_it_or_in_it_reads_like_glb() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.gltf");
    let (mut json, binary) = square();
    let plain = read(&json, &binary).expect("readable");
    std::fs::write(folder.path().join("a b.bin"), &binary).expect("a file");
    // "+" as some programs write it, and a mark in front.
    let base64 = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8A\
                  AAAAAAAAAAAAgD8AAAAAAAABAAIAAAACAAMA";
    for uri in ["a%20b.bin", "./a b.bin", base64] {
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, format!("\u{feff}{json}")).expect("a file");
        assert!(read_file(&path, 1 << 20).expect("readable") == plain, "{uri}");
    }
    json["images"] = json!([{"uri": "data:image/png;base64,not base64 at all!"}]);
    let text = json.to_string().replace("AAAAAAAAAAAAAAAAAACAPw", "AAAAAAAAAAAAAAA\\u0041AACAPw");
    assert!(read_bytes("a", text.as_bytes()).expect("readable") == plain);
}

pub(crate) fn read_file(path: &Path, share_bytes: u64) -> Result<Content, IoError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    read_all(open(path, &scratch, &ReadOptions::in_scene(share_bytes))?.as_mut())
}

#[test]
fn the_share_of_memory_changes_nothing() {
    let count = 40_000_u32;
    let positions: Vec<f32> = (0..3 * count).map(|i| (i % 997) as f32).collect();
    let mut binary = floats(&positions);
    let length = binary.len();
    let indices = (0..3 * count).map(|i| i.wrapping_mul(7919) % count);
    binary.extend(indices.flat_map(u32::to_le_bytes));
    let (mut json, _) = square();
    json["buffers"][0]["byteLength"] = json!(binary.len());
    json["bufferViews"] = json!([
        {"buffer": 0, "byteLength": length},
        {"buffer": 0, "byteOffset": length, "byteLength": 12 * count},
    ]);
    json["accessors"][0]["count"] = json!(count);
    json["accessors"][1] =
        json!({"bufferView": 1, "componentType": 5125, "count": 3 * count, "type": "SCALAR"});
    let nodes: Vec<_> = (0..3000).map(|i| json!({"name": format!("node {}", i % 700)})).collect();
    json["nodes"] = json!(nodes);
    json["nodes"][2999] = json!({"mesh": 0, "name": "last"});
    json["scenes"][0]["nodes"] = json!((0..3000).collect::<Vec<u32>>());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.glb");
    std::fs::write(&path, glb(&json, &binary)).expect("a file");
    let [small, large] =
        [16 << 10, 1 << 30].map(|share| read_file(&path, share).expect("readable"));
    assert_eq!(small.batch.len(), count as usize);
    assert_eq!(small.part_names(), ["last"]);
    assert!(small == large);
}

/// Two sets of texture coordinates for the square, and a material that shows image 0.
fn textured(info: &Value, images: &Value) -> Content {
    changed(|json, binary| {
        binary.extend(floats(&[0.25, 0.5].repeat(4)));
        binary.extend(floats(&[0.5, 1.0].repeat(4)));
        json["buffers"][0]["byteLength"] = json!(124);
        for (view, offset) in [(2, 60), (3, 92)] {
            let place = json!({"buffer": 0, "byteOffset": offset, "byteLength": 32});
            add(json, "bufferViews", place);
            let uvs =
                json!({"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC2"});
            add(json, "accessors", uvs);
        }
        let primitive = &mut json["meshes"][0]["primitives"][0];
        primitive["attributes"]["TEXCOORD_0"] = json!(2);
        primitive["attributes"]["TEXCOORD_1"] = json!(3);
        primitive["material"] = json!(0);
        let pbr = json!({"baseColorTexture": info, "metallicRoughnessTexture": {"index": 0}});
        json["materials"] = json!([{"pbrMetallicRoughness": pbr, "normalTexture": {"index": 0}}]);
        json["textures"] = json!([{"source": 0}]);
        json["images"] = images.clone();
    })
}

#[test]
fn texture_coordinates_are_mapped_and_turned_as_the_material_says() {
    let images = json!([{"uri": "a.png"}]);
    for (info, uv) in [
        (json!({"index": 0}), [0.25, 0.5]),
        (json!({"index": 0, "texCoord": 1}), [0.5, 0.0]),
        (
            json!({"index": 0, "extensions": {"KHR_texture_transform":
                {"offset": [0.5, 0.25], "scale": [2.0, 0.5]}}}),
            [1.0, 0.5],
        ),
        // A quarter turn takes (0.25, 0.5) to (0.5, -0.25) where v goes down.
        (
            json!({"index": 0, "extensions": {"KHR_texture_transform":
                {"rotation": std::f32::consts::FRAC_PI_2}}}),
            [0.5, 1.25],
        ),
        (json!({"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}), [0.5, 0.0]),
    ] {
        let content = textured(&info, &images);
        for found in content.batch.uvs.as_flattened().iter() {
            assert!((found[0] - uv[0]).abs() + (found[1] - uv[1]).abs() < 1e-6, "{info} {found:?}");
        }
        // Other maps lie on the coordinates as they are.
        let maps = OtherMaps::NORMAL.with(OtherMaps::GLOSS);
        let (kept, lost) = if info == json!({"index": 0}) {
            (maps, OtherMaps::default())
        } else {
            (OtherMaps::default(), maps)
        };
        let material = &content.materials[0];
        assert_eq!((material.maps.kinds(), material.other_maps), (kept, lost), "{info}");
    }
}

#[test]
fn images_inside_are_numbered_and_those_that_are_none_cost_nothing() {
    for (image, number) in [
        (json!({"bufferView": 0, "mimeType": "image/png", "name": "skin"}), 0),
        (json!({"uri": "data:image/png;base64,AAECAw==", "name": "skin"}), 0),
        (json!({"uri": "data:image/png;base64,A?", "name": "skin"}), 0),
        (json!({"uri": "data:image/png;base64,AAECA", "name": "skin"}), 0),
        (json!({"bufferView": 77, "name": "skin"}), 0),
        (json!({"uri": "data:image/png,plain", "name": "skin"}), 0),
    ] {
        let content = textured(&json!({"index": 0}), &json!([image]));
        let texture = content.materials[0].texture.clone();
        let is_plain = image["uri"] == json!("data:image/png,plain");
        match texture.expect("one") {
            Texture::Inside(image) => {
                assert_eq!((image.name.as_str(), image.number), ("skin", number));
            }
            // No file has such a name.
            Texture::Beside(path) => assert!(is_plain, "{path}"),
        }
    }
}

#[test]
fn compression_that_is_not_read_is_refused_by_its_name() {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        assert!(refused(|json, _| json["extensionsRequired"] = json!([name])).contains(name));
        let bare = refused(|json, _| {
            json["buffers"] = json!([{"byteLength": 60, "extensions": {name: {"fallback": true}}}]);
        });
        assert!(bare.contains("meshopt_compression"), "{bare}");
    }
}
