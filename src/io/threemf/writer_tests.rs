//! What is written comes back, materials and all; the archive is one that others open.

use std::io::{Cursor, Read};
use std::path::Path;

use zip::ZipArchive;

use crate::io::output::Output;
use crate::io::tests::{Content, read_all};
use crate::io::threemf::zip_file::ZipFile;
use crate::io::{
    Format, Palette, PaletteWriter, ReadOptions, Sink, WriteOptions, create, open, reopen,
};
use crate::mesh::{Material, SinkState, SinkTriangles, Surface};
use crate::store::Scratch;

const POSITIONS: [[f64; 3]; 4] =
    [[0.1, -0.0, 1e-300], [1.0, 0.0, 0.0], [0.0, 1.0, f64::MAX], [0.0, 0.0, 1.0]];
const TRIANGLES: [[u32; 3]; 4] = [[0, 1, 2], [0, 1, 3], [1, 2, 3], [3, 2, 0]];

fn options(scratch: &Scratch, materials: &[Material]) -> WriteOptions {
    let mut palette = PaletteWriter::create(scratch).expect("a spool");
    materials.iter().for_each(|material| palette.push(material).expect("written"));
    let state = palette.finish().expect("finished");
    WriteOptions { palette: Some(Palette::new(scratch, &state[0])), ..WriteOptions::default() }
}

fn read(path: &Path, scratch: &Scratch) -> Content {
    let options = ReadOptions::in_scene(1 << 20);
    read_all(open(path, scratch, &options).expect("opens").as_mut()).expect("readable")
}

/// Hands the first half of the mesh over, or the second.
fn write_half(sink: &mut Sink, half: usize, surfaces: &[Surface]) {
    let range = 2 * half..2 * half + 2;
    sink.vertices(&POSITIONS[range.clone()]).expect("written");
    let indices = &TRIANGLES[range.clone()];
    // All triangles come with the last vertices.
    if half == 1 {
        let first = surfaces.get(..2).unwrap_or_default();
        let triangles =
            SinkTriangles { indices: &TRIANGLES[..2], surfaces: first, ..Default::default() };
        sink.triangles(&triangles).expect("written");
        let surfaces = surfaces.get(range).unwrap_or_default();
        sink.triangles(&SinkTriangles { indices, surfaces, ..Default::default() })
            .expect("written");
    }
}

fn write(path: &Path, scratch: &Scratch, options: &WriteOptions, surfaces: &[Surface]) -> Vec<u8> {
    let mut sink = create(path, Format::ThreeMf, scratch, options).expect("creates");
    (0..2).for_each(|half| write_half(&mut sink, half, surfaces));
    sink.finish().expect("finishes");
    std::fs::read(path).expect("the file")
}

#[test]
fn materials_and_patches_come_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (scratch, path) = (Scratch::new(folder.path()), folder.path().join("a.3mf"));
    let named = |name: &str| Material { name: name.to_owned(), ..Material::default() };
    let materials = [
        Material { diffuse: Some([1.0, 0.2, 0.0]), ..named("a <&\">\t\u{e4}\u{1}") },
        Material { transparent: true, opacity: Some(0.4), ..named("glass") },
        named("unused"),
    ];
    let options = options(&scratch, &materials);
    let surfaces = [(0, false), (1, false), (0, true), (0, false)];
    let surfaces = surfaces.map(|(material, is_patch)| Surface::new(material, is_patch));
    write(&path, &scratch, &options, &surfaces);
    let content = read(&path, &scratch);
    assert_eq!(content.batch.indices, TRIANGLES);
    assert_eq!(content.batch.materials, [0, 1, 2, 0]);
    let name = "a <&\"> \u{e4}\u{fffd}";
    assert_eq!(content.material_names(), [name, "glass", &format!("{name}.patch")]);
    assert_eq!(content.materials[0].diffuse, Some([1.0, 0.2, 0.0]));
    assert_eq!(content.materials[1].opacity, Some(0.4));
    assert!(content.materials[1].transparent && !content.materials[0].transparent);
    // Without a patch there is no word of one.
    write(&path, &scratch, &options, &surfaces.map(|s| Surface::new(s.material(), false)));
    let text = model_text(&path);
    assert!(!text.contains("patch") && text.contains("unused"), "{text}");
    write(&path, &scratch, &WriteOptions::default(), &surfaces);
    assert!(!model_text(&path).contains("pid"));
}

fn model_text(path: &Path) -> String {
    let bytes = std::fs::read(path).expect("the file");
    let mut zip = ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let mut text = String::new();
    let mut model = zip.by_name("3D/3dmodel.model").expect("a model");
    model.read_to_string(&mut text).expect("text");
    text
}

#[test]
fn a_sink_goes_on_from_its_state_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (scratch, path) = (Scratch::new(folder.path()), folder.path().join("a.3mf"));
    let options = options(&scratch, &[Material::default()]);
    let surfaces = [Surface::default(); 4];
    let whole = write(&path, &scratch, &options, &surfaces);
    assert_eq!(whole, write(&path, &scratch, &options, &surfaces));
    let mut sink = create(&path, Format::ThreeMf, &scratch, &options).expect("creates");
    write_half(&mut sink, 0, &surfaces);
    let state: SinkState = sink.checkpoint().expect("a state");
    // What comes after the state is forgotten.
    write_half(&mut sink, 1, &surfaces);
    sink.checkpoint().expect("another state");
    drop(sink);
    let mut sink = reopen(&path, Format::ThreeMf, &scratch, &options, &state).expect("reopens");
    write_half(&mut sink, 1, &surfaces);
    let stats = sink.finish().expect("finishes");
    assert_eq!((stats.vertices, stats.triangles), (4, 4));
    assert!(whole == std::fs::read(&path).expect("the file"));
    let content = read(&path, &scratch);
    let bits = |corners: [[f64; 3]; 3]| corners.map(|corner| corner.map(f64::to_bits));
    for (found, triangle) in content.batch.corners.into_iter().zip(TRIANGLES) {
        assert_eq!(bits(found), bits(triangle.map(|vertex| POSITIONS[vertex as usize])));
    }
}

#[test]
fn archives_with_sizes_of_either_length_are_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (scratch, path) = (Scratch::new(folder.path()), folder.path().join("a.zip"));
    let content: Vec<u8> = (0..300_000_u64).map(|i| ((i * i) >> 7) as u8).collect();
    for is_large in [false, true] {
        let mut file = ZipFile::new(Output::create(&path, &scratch).expect("a file"));
        // Headers lie in the head of the file: what is long comes last.
        for (name, is_large, content) in [("empty", false, &[][..]), ("a", is_large, &content)] {
            file.start(name, is_large).expect("started");
            content.chunks(1000).for_each(|chunk| file.write(chunk).expect("written"));
            file.end().expect("ended");
        }
        file.finish().expect("a directory").finish().expect("a file");
        check_archive(&path, &[("empty", &[]), ("a", &content)]);
    }
}

/// Its checksums are looked at by the reader.
fn check_archive(path: &Path, members: &[(&str, &[u8])]) {
    let bytes = std::fs::read(path).expect("the file");
    let mut zip = ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    assert_eq!(zip.len(), members.len());
    for (name, content) in members {
        let mut found = Vec::new();
        let mut member = zip.by_name(name).expect("a member");
        member.read_to_end(&mut found).expect("whole");
        assert!(found == *content, "{name}");
    }
}
