//! The files that models name, in a batch: a change of one is noticed, a copy takes them along, and
//! those beside a result are known again.

use std::path::Path;
use std::process::Command;

use brickmend::mesh::shapes::cuboid;

use crate::support::library::{Library, files_in};

/// What an image begins with; no more of it is looked at.
const IMAGE: &[u8] = b"\x89PNG\r\n\x1a\n wood";
const OTHER_IMAGE: &[u8] = b"\x89PNG\r\n\x1a\n oak!";

fn empty_library() -> Library {
    Library { folder: tempfile::tempdir().expect("a temporary folder") }
}

/// A box as OBJ with texture coordinates, of which the first faces may be missing.
fn textured_box(library: &str, missing: usize) -> String {
    let mut text = format!("mtllib {library}\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl wood\n");
    let triangles = &cuboid([0.0; 3], [1.0, 2.0, 3.0])[missing..];
    for [x, y, z] in triangles.iter().flatten() {
        text.push_str(&format!("v {x} {y} {z}\n"));
    }
    for first in (1..=3 * triangles.len()).step_by(3) {
        text.push_str(&format!("f {first}/1 {}/2 {}/3\n", first + 1, first + 2));
    }
    text
}

const WOOD: &str = "newmtl wood\nKd 1 1 1\nmap_Kd tex/wood.png\n";

fn write_image(library: &Library, relative: &str, bytes: &[u8]) {
    library.write(relative.as_ref(), "");
    std::fs::write(library.models().join(relative), bytes).expect("writable");
}

/// A box with a hole, its library and its image.
fn broken_library() -> Library {
    let library = empty_library();
    library.write("a/box.obj".as_ref(), &textured_box("box.mtl", 2));
    library.write("a/box.mtl".as_ref(), WOOD);
    write_image(&library, "a/tex/wood.png", IMAGE);
    library
}

/// A box without a defect whose library has another's name.
fn sound_library() -> Library {
    let library = empty_library();
    library.write("a/box.obj".as_ref(), &textured_box("kit.mtl", 0));
    library.write("a/kit.mtl".as_ref(), WOOD);
    write_image(&library, "a/tex/wood.png", IMAGE);
    library
}

fn attempts(library: &Library, model: &str) -> usize {
    library.why(model)["attempts"].as_array().map_or(0, Vec::len)
}

#[test]
fn a_change_of_a_file_that_a_model_names_does_it_again() {
    let library = broken_library();
    assert_eq!(library.batch(&[]).0, 0);
    let first = files_in(&library.results());
    let why = library.why("a/box.obj");
    assert_eq!(why["because"], "it is new", "{why}");
    let names: Vec<&str> = why["beside"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|f| f["name"].as_str())
        .collect();
    assert_eq!(names, ["a/box.mtl", "a/tex/wood.png"], "{why}");

    // Touched, and with the same content.
    let image = library.models().join("a/tex/wood.png");
    std::fs::remove_file(&image).expect("removable");
    std::fs::write(&image, IMAGE).expect("writable");
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(attempts(&library, "a/box.obj"), 1);

    std::fs::write(&image, OTHER_IMAGE).expect("writable");
    assert_eq!(library.batch(&["--plan"]).0, 0);
    let why = library.why("a/box.obj");
    assert_eq!(why["state"], "pending", "{why}");
    assert_eq!(why["because"], "its file a/tex/wood.png changed", "{why}");
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(attempts(&library, "a/box.obj"), 2);
    let second = files_in(&library.results());
    let shown = Path::new("a/box.texture-0.png");
    assert_eq!(first[shown], IMAGE);
    assert_eq!(second[shown], OTHER_IMAGE);

    std::fs::remove_file(library.models().join("a/box.mtl")).expect("there");
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(library.why("a/box.obj")["because"], "its file a/box.mtl is gone");
    assert!(!files_in(&library.results()).contains_key(shown), "nothing shows it any more");
    library.write("a/box.mtl".as_ref(), WOOD);
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(library.why("a/box.obj")["because"], "its file a/box.mtl is there now");
    assert_eq!(files_in(&library.results()), second);
}

#[test]
fn a_buffer_that_comes_to_be_makes_a_failed_model_one_to_be_done() {
    let library = empty_library();
    library.write("box.gltf".as_ref(), &gltf_of("box.bin"));
    let (code, _) = library.batch(&[]);
    assert_eq!(code, 3);
    assert_eq!(library.why("box.gltf")["cause"], "input");
    std::fs::write(library.models().join("box.bin"), tetrahedron()).expect("writable");
    assert_eq!(library.batch(&[]).0, 0);
    let why = library.why("box.gltf");
    assert_eq!(why["because"], "its file box.bin is there now", "{why}");
    // JSON is not written, but may be copied.
    assert_eq!((&why["state"], &why["output"]), (&"copied".into(), &"box.gltf".into()), "{why}");
    assert_eq!(files_in(&library.results()), files_in(&library.models()));
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(attempts(&library, "box.gltf"), 1, "nothing is done again");
}

#[test]
fn a_file_beside_a_result_that_is_lost_or_spoiled_does_the_model_again() {
    let library = broken_library();
    assert_eq!(library.batch(&[]).0, 0);
    let first = files_in(&library.results());
    let names: Vec<&Path> = first.keys().map(|path| path.as_path()).collect();
    assert_eq!(names, ["a/box.mtl", "a/box.obj", "a/box.texture-0.png"].map(Path::new));
    for (done, name) in ["a/box.mtl", "a/box.texture-0.png"].iter().enumerate() {
        let path = library.results().join(name);
        std::fs::remove_file(&path).expect("there");
        assert_eq!(library.batch(&[]).0, 0);
        assert_eq!(files_in(&library.results()), first, "{name}");
        std::fs::write(&path, "spoiled").expect("writable");
        assert_eq!(library.batch(&[]).0, 0);
        assert_eq!(files_in(&library.results()), first, "{name}");
        assert_eq!(attempts(&library, "a/box.obj"), 1 + 2 * (done + 1));
    }
    let because = "a file of its result is not what was put there";
    assert_eq!(library.why("a/box.obj")["because"], because);
}

#[test]
fn a_sound_model_is_copied_with_the_files_that_it_names() {
    let library = sound_library();
    let (code, summary) = library.batch(&[]);
    assert_eq!((code, &summary["states"][0]["state"]), (0, &"copied".into()), "{summary}");
    let models = files_in(&library.models());
    assert_eq!(files_in(&library.results()), models);
    // A copied file counts as much as the model.
    std::fs::write(library.results().join("a/tex/wood.png"), "spoiled").expect("writable");
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(files_in(&library.results()), models);
    assert_eq!(attempts(&library, "a/box.obj"), 2);
    // What is repaired from now on leaves nothing of the copy behind.
    library.write("a/box.obj".as_ref(), &textured_box("kit.mtl", 2));
    assert_eq!(library.batch(&[]).0, 0);
    let files = files_in(&library.results());
    let names: Vec<&Path> = files.keys().map(|path| path.as_path()).collect();
    assert_eq!(names, ["a/box.mtl", "a/box.obj", "a/box.texture-0.png"].map(Path::new));
}

#[test]
fn a_sound_model_that_cannot_be_copied_whole_is_repaired_and_says_why() {
    let reason_of = |library: &Library, extra: &[&str]| {
        assert_eq!(library.batch(extra).0, 0);
        let why = library.why("a/box.obj");
        assert_eq!(why["state"], "repaired", "{why}");
        why["reason"].as_str().unwrap_or_default().to_owned()
    };
    let library = sound_library();
    library.write("a/kit.mtl".as_ref(), "newmtl wood\nmap_Kd ../wood.png\n");
    assert!(reason_of(&library, &[]).contains("names ../wood.png, outside of its folder"));

    let library = sound_library();
    assert!(reason_of(&library, &["--format", "ply"]).contains("another format"));

    // The result of another model has a library of this name.
    let library = sound_library();
    library.write("a/kit.obj".as_ref(), &textured_box("kit.mtl", 2));
    assert!(reason_of(&library, &[]).contains("kit.obj may have a kit.mtl of its own"));

    // Somebody else's file, which nobody replaces.
    let library = sound_library();
    std::fs::create_dir_all(library.results().join("a")).expect("a folder");
    std::fs::write(library.results().join("a/kit.mtl"), "precious").expect("writable");
    assert!(reason_of(&library, &[]).contains("another kit.mtl beside the output"));
    assert_eq!(files_in(&library.results())[Path::new("a/kit.mtl")], b"precious");
}

#[test]
fn models_that_share_an_image_share_its_copy() {
    let library = sound_library();
    library.write("a/second.obj".as_ref(), &textured_box("kit.mtl", 0));
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(files_in(&library.results()), files_in(&library.models()));
    std::fs::write(library.models().join("a/tex/wood.png"), OTHER_IMAGE).expect("writable");
    assert_eq!(library.batch(&[]).0, 0);
    assert_eq!(files_in(&library.results()), files_in(&library.models()));
    // One of them is repaired from now on: the other one's files stay.
    library.write("a/second.obj".as_ref(), &textured_box("kit.mtl", 2));
    assert_eq!(library.batch(&[]).0, 0);
    let files = files_in(&library.results());
    assert_eq!(files[Path::new("a/tex/wood.png")], OTHER_IMAGE);
    assert!(files.contains_key(Path::new("a/second.texture-0.png")));
}

#[test]
fn one_sound_model_is_copied_if_only_broken_ones_are_to_be_repaired() {
    let library = sound_library();
    let repair = |output: &str, extra: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("repair").arg(library.models().join("a/box.obj"));
        command.arg("-o").arg(library.results().join(output)).args(["--depth", "5", "--json"]);
        let run = command.args(extra).output().expect("the program starts");
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).expect("JSON")
    };
    std::fs::create_dir(library.results()).expect("a folder");
    let told = repair("box.obj", &["--only-broken"]);
    assert_eq!((&told["copied"], &told["schema"]), (&true.into(), &1.into()), "{told}");
    assert_eq!(told["files"].as_array().map(Vec::len), Some(3), "{told}");
    let (models, results) = (files_in(&library.models()), files_in(&library.results()));
    assert_eq!(results.len(), 3);
    for (path, bytes) in results {
        assert_eq!(models[&Path::new("a").join(&path)], bytes, "{}", path.display());
    }
    // Another format, and what repair does unless it is told otherwise.
    assert_eq!(repair("box.ply", &["--only-broken"])["verdict"], "pass");
    assert_eq!(repair("other.obj", &[])["verdict"], "pass");
}

/// A tetrahedron, outward: places, then corners.
fn tetrahedron() -> Vec<u8> {
    let places: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
    let corners: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let places = places.iter().flat_map(|value| value.to_le_bytes());
    places.chain(corners.iter().flat_map(|value| value.to_le_bytes())).collect()
}

fn gltf_of(buffer: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "buffers":[{{"uri":"{buffer}","byteLength":72}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",
                      "min":[0,0,0],"max":[1,1,1]}},
                     {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}]}}"#
    )
}
