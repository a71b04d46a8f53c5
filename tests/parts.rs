//! Parts that are kept apart: names, places, what is shared; each of them sound; hidden ones gone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use brickmend::io::{ReadOptions, open};
use brickmend::mesh::{SceneNode, TriangleBatch};
use brickmend::monitor::{Monitor, Void};
use brickmend::repair::{
    Depth, HiddenRule, Limits, Outcome, PartsOutcome, PartsRule, RepairError, Settings, Verdict,
    repair_parts,
};
use brickmend::store::Scratch;

/// A cube with side 2 about a point, as OBJ vertices and faces behind `first` others; all faces but
/// `missing`.
fn cube(at: [f64; 3], half: f64, first: usize, missing: usize) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let [x, y, z] =
            [0, 1, 2].map(|axis| at[axis] + if corner >> axis & 1 == 0 { -half } else { half });
        text += &format!("v {x} {y} {z}\n");
    }
    let faces =
        [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    for (_, face) in faces.iter().enumerate().filter(|(number, _)| *number != missing) {
        let [a, b, c, d] = face.map(|corner| corner + first);
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

/// glTF with an empty node over two places of a pyramid, one of them mirrored, and a cube within a
/// larger one.
fn scene(folder: &Path) -> PathBuf {
    let pyramid: [[f32; 3]; 5] =
        [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.3, 0.2, 2.0]];
    let pyramid_faces: [[u32; 3]; 6] =
        [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let box_vertices: Vec<[f32; 3]> = (0..8)
        .map(|corner| [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }))
        .collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let box_faces: Vec<[u32; 3]> =
        quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut bytes = Vec::new();
    for numbers in [pyramid.as_flattened(), box_vertices.as_flattened()] {
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    }
    for numbers in [pyramid_faces.as_flattened(), box_faces.as_flattened()] {
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    }
    std::fs::write(folder.join("scene.bin"), &bytes).expect("written");
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,3,4]}],
      "nodes":[{"name":"table","translation":[3,2,1],"children":[1,2]},
        {"name":"leg","mesh":0,"rotation":[0,0,0.6,0.8]},
        {"name":"other leg","mesh":0,"scale":[-1,1,1],"translation":[5,0,0]},
        {"name":"cupboard","mesh":1,"scale":[2,2,2],"translation":[-6,0,0]},
        {"name":"lost","mesh":1,"translation":[-6,0,0]}],
      "meshes":[{"name":"pyramid","primitives":[{"attributes":{"POSITION":0},"indices":2,"material":1}]},
        {"name":"box","primitives":[{"attributes":{"POSITION":1},"indices":3,"material":0}]}],
      "materials":[{"name":"oak"},{"name":"steel","pbrMetallicRoughness":{"metallicFactor":1}}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"},
        {"bufferView":1,"componentType":5126,"count":8,"type":"VEC3"},
        {"bufferView":2,"componentType":5125,"count":18,"type":"SCALAR"},
        {"bufferView":3,"componentType":5125,"count":36,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteLength":60},{"buffer":0,"byteOffset":60,"byteLength":96},
        {"buffer":0,"byteOffset":156,"byteLength":72},{"buffer":0,"byteOffset":228,"byteLength":144}],
      "buffers":[{"uri":"scene.bin","byteLength":372}]}"#;
    let path = folder.join("scene.gltf");
    std::fs::write(&path, text).expect("written");
    path
}

fn settings(depth: u32) -> Settings {
    Settings { depth: Depth::Levels(depth), parts: PartsRule::Separate, ..Settings::default() }
}

fn separate(
    input: &Path,
    output: &Path,
    settings: &Settings,
    limits: &Limits,
) -> Result<(PartsOutcome, Vec<Outcome>), RepairError> {
    let format = brickmend::io::format_of_extension(output).expect("a format");
    let mut outcomes = Vec::new();
    let mut deliver = |outcome| outcomes.push(outcome);
    let whole = repair_parts(input, output, format, settings, limits, &Void, &mut deliver)?;
    Ok((whole, outcomes))
}

/// Nodes, and by part its name, its triangles and its volume, of a file read part by part.
struct Found {
    nodes: Vec<SceneNode>,
    parts: BTreeMap<u32, (String, u64, f64)>,
}

fn read(path: &Path) -> Found {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let mut source = open(path, &scratch, &ReadOptions::by_itself(16 << 20)).expect("opens");
    let mut parts = BTreeMap::<u32, (String, u64, f64)>::new();
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).expect("readable") {
        for (part, [a, b, c]) in batch.parts.iter().zip(&batch.corners) {
            let [a, b, c] = [a, b, c].map(|corner| glam::DVec3::from_array(*corner));
            let entry = parts.entry(*part).or_default();
            entry.1 += 1;
            entry.2 += a.dot(b.cross(c)) / 6.0;
        }
    }
    for (&number, entry) in &mut parts {
        entry.0 = source.part(number).expect("named").name;
    }
    let count = source.node_count() as u32;
    let nodes = (0..count).filter_map(|number| source.node(number).expect("a node")).collect();
    Found { nodes, parts }
}

#[test]
fn nodes_names_and_what_is_shared_survive_and_what_nobody_sees_goes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = scene(folder.path());
    let before = read(&input);
    for name in ["out.glb", "out.3mf"] {
        let output = folder.path().join(name);
        let (whole, outcomes) =
            separate(&input, &output, &settings(6), &Limits::default()).expect("repaired");
        assert_eq!((whole.parts, whole.places, whole.hidden_places), (2, 3, 1), "{name}");
        assert_eq!(whole.verdict, Verdict::Review);
        assert_eq!(whole.left_out[0].name, "lost");
        let names: Vec<_> =
            outcomes.iter().map(|o| o.part.as_ref().expect("a part").name.clone()).collect();
        assert_eq!(names, ["pyramid", "box"]);
        assert!(outcomes.iter().all(|outcome| outcome.output.proof.failures().is_empty()));
        let lost = |outcome: &Outcome| outcome.deviation.as_ref().expect("measured").lost.share;
        assert!(outcomes.iter().all(|outcome| lost(outcome) < 0.01), "{name}");
        let after = read(&output);
        let volumes: Vec<_> = after.parts.values().map(|part| part.2).collect();
        assert!((volumes[0] - 8.0 / 3.0).abs() < 0.02, "{volumes:?}");
        assert!((volumes[1] - 8.0).abs() < 0.02, "{volumes:?}");
        for (name, map) in before.nodes.iter().take(4).map(|node| (&node.name, node.map)) {
            let node = after.nodes.iter().find(|node| node.name == *name).expect("kept");
            let same = node.map.as_flattened().iter().zip(map.as_flattened());
            assert!(same.into_iter().all(|(a, b)| (a - b).abs() < 1e-6), "{name}");
        }
        if name == "out.glb" {
            let parts: Vec<_> = after.nodes.iter().map(|node| node.part).collect();
            assert_eq!(parts, [None, Some(0), Some(0), Some(1), None]);
            assert_eq!(after.nodes[2].parent, Some(0));
        }
        assert!(!folder.path().join(format!("{name}.brickmend")).exists());
    }
}

#[test]
fn formats_without_scenes_get_every_place_for_itself() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = scene(folder.path());
    let keep = Settings { hidden: HiddenRule::Keep, ..settings(5) };
    for (name, lost) in [("out.obj", false), ("out.ply", true), ("out.stl", true)] {
        let output = folder.path().join(name);
        let (whole, outcomes) =
            separate(&input, &output, &keep, &Limits::default()).expect("repaired");
        assert_eq!((whole.parts, whole.places), (4, 4));
        let has_lost = outcomes[0].transfer.lost.iter().any(|what| what == "names of parts");
        assert_eq!(has_lost, lost, "{name}");
        let found = read(&output);
        let volume: f64 = found.parts.values().map(|part| part.2).sum();
        assert!((volume - (2.0 * 8.0 / 3.0 + 64.0 + 8.0)).abs() < 0.3, "{name}: {volume}");
    }
    let names: Vec<_> =
        read(&folder.path().join("out.obj")).parts.into_values().map(|part| part.0).collect();
    assert_eq!(names, ["leg", "other leg", "cupboard", "lost"]);
}

#[test]
fn a_part_becomes_what_it_becomes_alone_whatever_the_limits() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (a, b) = (cube([0.0; 3], 1.0, 0, 6), cube([5.0, 1.0, 0.5], 1.5, 8, 1));
    let both = folder.path().join("both.obj");
    std::fs::write(&both, format!("o drawer\n{a}o chest\n{b}o empty\n")).expect("written");
    let settings = Settings { max_hole: brickmend::repair::MaxHole::All, ..settings(5) };
    let mut files = Vec::new();
    for (number, limits) in [
        Limits::default(),
        Limits { threads: 8, share_bytes: Some(16 << 10), ..Limits::default() },
        Limits { backing: brickmend::store::Backing::Memory, ..Limits::default() },
    ]
    .into_iter()
    .enumerate()
    {
        let output = folder.path().join(format!("out-{number}.obj"));
        separate(&both, &output, &settings, &limits).expect("repaired");
        let text = std::fs::read_to_string(&output).expect("text");
        files.push(text.replace(&format!("out-{number}.mtl"), ""));
    }
    assert_eq!(files[0], files[1]);
    assert_eq!(files[0], files[2]);
    let found = read(&folder.path().join("out-0.obj"));
    let sizes: Vec<_> = found.parts.values().map(|part| (part.0.as_str(), part.2)).collect();
    assert_eq!((sizes[0].0, sizes[1].0), ("drawer", "chest"));
    assert!((sizes[0].1 - 8.0).abs() < 0.01 && (sizes[1].1 - 27.0).abs() < 0.5, "{sizes:?}");
}

/// Asks to stop when it was asked so often whether to.
struct StopsAfter(AtomicU64);

impl Monitor for StopsAfter {
    fn cancelled(&self) -> bool {
        let left = |left: u64| Some(left.saturating_sub(1));
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, left) == Ok(0)
    }
}

#[test]
fn a_run_that_was_stopped_anywhere_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = scene(folder.path());
    let (settings, limits) = (settings(5), Limits::default());
    let whole = folder.path().join("whole.glb");
    separate(&input, &whole, &settings, &limits).expect("repaired");
    let whole = std::fs::read(&whole).expect("it is there");
    let output = folder.path().join("out.glb");
    let mut stopped = 0;
    for after in [0, 3, 20, 60, 120, 200, 300, 500] {
        let monitor = StopsAfter(AtomicU64::new(after));
        let format = brickmend::io::Format::Glb;
        let ended =
            repair_parts(&input, &output, format, &settings, &limits, &monitor, &mut |_| {});
        if let Err(error) = ended {
            assert!(error.keeps_work(), "{error}");
            assert!(!output.exists());
            stopped += 1;
        }
    }
    assert!(stopped >= 3, "{stopped}");
    separate(&input, &output, &settings, &limits).expect("goes on");
    assert_eq!(std::fs::read(&output).expect("it is there"), whole);
    assert!(!folder.path().join("out.glb.brickmend").exists(), "nothing is left of the work");
}

#[test]
fn the_documentation_names_every_field_of_the_whole() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join("out.glb");
    let (mut whole, _) =
        separate(&scene(folder.path()), &output, &settings(5), &Limits::default()).expect("sound");
    whole.peak_bytes = Some(0);
    let json = serde_json::to_value(&whole).expect("plain data is always JSON");
    crate::support::schema::check_document("docs/parts.md", &json, &["left_out[]"]);
}

#[test]
fn a_part_beyond_all_numbers_is_left_out_and_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join("vast.obj");
    let text =
        format!("o near\n{}o far\n{}", cube([0.0; 3], 1.0, 0, 6), cube([0.0; 3], 1e120, 8, 6));
    std::fs::write(&input, text).expect("written");
    let output = folder.path().join("out.obj");
    let (whole, outcomes) =
        separate(&input, &output, &settings(5), &Limits::default()).expect("the other is there");
    assert_eq!((whole.parts, whole.empty_parts, whole.hidden_places), (1, 1, 0));
    assert_eq!((whole.left_out[0].name.as_str(), whole.verdict), ("far", Verdict::Review));
    assert!((outcomes[0].output.proof.volume - 8.0).abs() < 1e-6);
}

#[test]
fn what_is_for_one_solid_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = scene(folder.path());
    let few = Settings { max_triangles: Some(100), ..settings(5) };
    let refused = separate(&input, &folder.path().join("out.glb"), &few, &Limits::default());
    assert!(matches!(refused, Err(RepairError::OnlyAsUnion { .. })));
    assert!(!folder.path().join("out.glb.brickmend").exists());
}
