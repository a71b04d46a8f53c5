//! GLB as it is written: what comes back, and what others would find in it.

use std::path::Path;

use serde_json::{Value, json};

use crate::io::gltf::tests::read_file;
use crate::io::tests::Content;
use crate::io::{Format, IoError, Palette, PaletteWriter, Sink, WriteOptions, create, reopen};
use crate::mesh::{Maps, Material, OtherMaps, SinkState, SinkTriangles, Surface, Texture};
use crate::store::Scratch;

fn materials() -> Vec<Material> {
    vec![
        Material { name: "unused".to_owned(), ..Material::default() },
        Material {
            name: "glass".to_owned(),
            transparent: true,
            diffuse: Some([0.25, 0.5, 1.0]),
            opacity: Some(0.125),
            emissive: Some([4.0, 0.0, 2.0]),
            metallic: Some(0.75),
            roughness: Some(0.1),
            alpha_cutoff: None,
            texture: Some(Texture::Beside("a.png".to_owned())),
            maps: Maps::default(),
            other_maps: OtherMaps::default(),
        },
        Material { name: "\"wood\"".to_owned(), ..Material::default() },
    ]
}

fn palette(scratch: &Scratch, materials: &[Material]) -> WriteOptions {
    let mut writer = PaletteWriter::create(scratch).expect("creates");
    materials.iter().for_each(|material| writer.push(material).expect("pushes"));
    let state = writer.finish().expect("finishes");
    WriteOptions { palette: Some(Palette::new(scratch, &state[0])), ..WriteOptions::default() }
}

/// Surfaces in no order, with patches.
fn surface(triangle: usize) -> Surface {
    [Surface::new(2, false), Surface::new(1, true), Surface::new(1, false), Surface::new(2, false)]
        [triangle % 4]
}

fn positions(count: u32) -> Vec<[f64; 3]> {
    (0..count).map(|i| [f64::from(i), 0.1 * f64::from(i % 7), -f64::from(i)]).collect()
}

/// Hands over triangles `i`, `i + 1`, `i + 2` of the range, and their vertices.
fn push(sink: &mut Sink, range: std::ops::Range<u32>, has_surfaces: bool) {
    let first = if range.start == 0 { 0 } else { range.start + 2 };
    let vertices = positions(range.end + 2);
    sink.vertices(&vertices[first as usize..]).expect("writes");
    let indices: Vec<_> = range.clone().map(|i| [i, i + 1, i + 2]).collect();
    let mut surfaces: Vec<_> = range.map(|i| surface(i as usize)).collect();
    surfaces.truncate(if has_surfaces { surfaces.len() } else { 0 });
    let triangles = SinkTriangles { indices: &indices, surfaces: &surfaces, ..Default::default() };
    sink.triangles(&triangles).expect("writes");
}

fn json_of(path: &Path) -> Value {
    let bytes = std::fs::read(path).expect("the file");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    assert_eq!(bytes.len() % 4, 0);
    assert_eq!(bytes[8..12], (bytes.len() as u32).to_le_bytes());
    assert_eq!(length % 4, 0);
    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON")
}

fn written(count: u32, has_surfaces: bool, stop: Option<u32>) -> (Content, Value) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let options =
        if has_surfaces { palette(&scratch, &materials()) } else { WriteOptions::default() };
    let path = folder.path().join("a.glb");
    let mut sink = create(&path, Format::Glb, &scratch, &options).expect("creates");
    let mut start = 0;
    if let Some(stop) = stop {
        push(&mut sink, 0..stop, has_surfaces);
        let state = sink.checkpoint().expect("tells");
        // What comes later is lost.
        push(&mut sink, stop..stop + 7, has_surfaces);
        drop(sink);
        let state: SinkState = serde_json::to_string(&state)
            .and_then(|text| serde_json::from_str(&text))
            .expect("states are kept as text");
        sink = reopen(&path, Format::Glb, &scratch, &options, &state).expect("goes on");
        start = stop;
    }
    push(&mut sink, start..count, has_surfaces);
    let stats = sink.finish().expect("finishes");
    assert_eq!((stats.triangles, stats.vertices), (count.into(), (count + 2).into()));
    assert_eq!(stats.file.bytes, std::fs::metadata(&path).expect("the file").len());
    let json = json_of(&path);
    (read_file(&path, 1 << 20).expect("readable"), json)
}

#[test]
fn triangles_come_back_in_the_order_of_their_materials() {
    // More than one run of the sort.
    let count = 300_000;
    let (content, json) = written(count, true, None);
    assert_eq!(content.batch.len(), count as usize);
    let kinds = [Surface::new(1, false), Surface::new(1, true), Surface::new(2, false)];
    let expected: Vec<_> = kinds
        .iter()
        .flat_map(|kind| (0..count).filter(|&i| surface(i as usize) == *kind))
        .map(|i| [i, i + 1, i + 2])
        .collect();
    assert!(content.batch.indices == expected);
    let as_written = |i: u32| positions(i + 1)[i as usize].map(|x| f64::from(x as f32));
    assert_eq!(content.batch.corners[1], expected[1].map(as_written));
    assert_eq!(content.material_names(), ["glass", "glass.patch", "\"wood\""]);
    let glass = Material { texture: None, ..materials()[1].clone() };
    assert_eq!(content.materials[0], glass);
    assert_eq!(content.materials[1], Material { name: "glass.patch".to_owned(), ..glass });
    let wood = Material {
        diffuse: Some([1.0; 3]),
        metallic: Some(0.0),
        roughness: Some(1.0),
        ..materials()[2].clone()
    };
    assert_eq!(content.materials[2], wood);
    assert_eq!(json["extensionsUsed"], json!(["KHR_materials_emissive_strength"]));
    assert_eq!(json["accessors"][0]["max"], json!([300_001.0, f64::from(0.6_f32), 0.0]));
    assert_eq!(json["accessors"][3]["count"], json!(450_000));
}

#[test]
fn without_a_palette_there_is_one_primitive() {
    let (content, json) = written(1000, false, None);
    let expected: Vec<_> = (0..1000).map(|i| [i, i + 1, i + 2]).collect();
    assert_eq!(content.batch.indices, expected);
    assert_eq!(json["meshes"][0]["primitives"].as_array().expect("a list").len(), 1);
    assert_eq!(json["materials"], Value::Null);
    assert_eq!(content.materials, [Material::default()]);
}

#[test]
fn a_later_writer_goes_on_from_a_checkpoint() {
    for has_surfaces in [false, true] {
        let (whole, _) = written(50_000, has_surfaces, None);
        for stop in [1, 20_000, 49_999] {
            assert!(written(50_000, has_surfaces, Some(stop)).0 == whole, "{stop}");
        }
    }
}

#[test]
fn vertices_alone_are_points_and_nothing_is_a_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    for count in [0, 3] {
        let options = palette(&scratch, &materials());
        let path = folder.path().join("a.glb");
        let mut sink = create(&path, Format::Glb, &scratch, &options).expect("creates");
        sink.vertices(&positions(count)).expect("writes");
        sink.finish().expect("finishes");
        let content = read_file(&path, 1 << 20).expect("readable");
        assert_eq!((content.batch.len(), content.vertex_count), (0, Some(count.into())));
        let json = json_of(&path);
        assert_eq!(json["meshes"].is_array(), count > 0);
        assert_eq!(json["buffers"].is_array(), count > 0);
    }
}

#[test]
fn more_than_four_gigabytes_are_refused_before_they_are_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let path = folder.path().join("a.glb");
    let options = WriteOptions::default();
    let mut sink = create(&path, Format::Glb, &scratch, &options).expect("creates");
    let mut state = sink.checkpoint().expect("tells");
    state.vertices = u64::from(u32::MAX) / 12;
    let mut sink = reopen(&path, Format::Glb, &scratch, &options, &state).expect("goes on");
    let refused = sink.vertices(&[[0.0; 3]]);
    assert!(matches!(refused, Err(IoError::TooLarge { what: "bytes", .. })));
}
