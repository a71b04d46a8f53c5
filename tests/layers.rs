//! Layers of a repair: exactly what is gone and what is new, the same bytes for any number of threads
//! and any memory.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use brickmend::io::{ReadOptions, open};
use brickmend::mesh::TriangleBatch;
use brickmend::mesh::shapes::{Corners, area, cuboid, sphere};
use brickmend::store::Scratch;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::obj::welded_obj;
use crate::support::program::{self, Ended};

/// A model, and a folder for layers.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new(model: &[Corners]) -> Self {
        Self::of_text(&welded_obj(model))
    }

    fn of_text(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        std::fs::write(folder.path().join("in.obj"), text).expect("writable");
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs `brickmend repair in.obj` with these arguments.
    fn program(&self, arguments: &[&str]) -> Ended {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.args(["repair", "in.obj"]).args(arguments).current_dir(self.folder.path());
        command.output().expect("the program starts").into()
    }

    /// The `exports` of the outcome of a repair at depth 5.
    fn exports(&self, output: &str, arguments: &[&str]) -> Value {
        let own = ["-o", output, "--depth", "5", "--export", "layers", "--json"];
        let ended = self.program(&[&own, arguments].concat());
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
        ended.outcome()["exports"].take()
    }

    fn names(&self) -> BTreeSet<String> {
        let entries = std::fs::read_dir(self.path("layers")).expect("the folder is there");
        entries.map(|e| e.expect("listable").file_name().into_string().expect("text")).collect()
    }

    /// Triangles of a layer, which are those that the outcome tells of.
    fn layer(&self, name: &str, told: &Value) -> Vec<Corners> {
        let triangles = read(&self.path("layers").join(name));
        assert_eq!(told["file"], format!("layers/{name}"));
        assert_eq!(told["triangles"], triangles.len());
        let told = told["area"].as_f64().expect("a number");
        assert!((told - area(&triangles)).abs() < 1e-9 * told, "{told}");
        triangles
    }
}

fn read(path: &Path) -> Vec<Corners> {
    let scratch = Scratch::new(path.parent().expect("a folder"));
    let mut source = open(path, &scratch, &ReadOptions::in_scene(1 << 20)).expect("opens");
    let (mut batch, mut found) = (TriangleBatch::default(), Vec::new());
    while source.next_batch(&mut batch).expect("readable") {
        found.extend_from_slice(&batch.corners);
    }
    found
}

fn nothing() -> Value {
    serde_json::json!({ "file": null, "triangles": 0, "area": 0.0 })
}

fn names<const N: usize>(names: [&str; N]) -> BTreeSet<String> {
    names.map(str::to_owned).into()
}

fn without_lid(lo: [f64; 3], hi: [f64; 3]) -> Vec<Corners> {
    let mut model = cuboid(lo, hi);
    model.retain(|corners| corners.iter().any(|corner| corner[2] < hi[2]));
    model
}

#[test]
fn a_box_inside_of_another_one_is_removed_as_it_was() {
    let hidden = cuboid([4.0; 3], [6.0; 3]);
    let bench = Bench::new(&[cuboid([0.0; 3], [10.0; 3]), hidden.clone()].concat());
    let exports = bench.exports("out.ply", &[]);
    assert_eq!(bench.layer("removed.ply", &exports["removed"]), hidden);
    assert_eq!(exports["added"], nothing());
    assert_eq!(exports["patches"], Value::Null);
    assert_eq!(bench.names(), names(["removed.ply"]));
}

#[test]
fn the_lid_that_closes_a_box_is_added() {
    let bench = Bench::new(&without_lid([0.0; 3], [10.0, 10.0, 10.0]));
    let own = ["-o", "out.ply", "--depth", "5", "--max-hole", "all", "--json"];
    let ended = bench.program(&[&own[..], &["--export", "layers", "--tag-patches"]].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let outcome = ended.outcome();
    let (exports, cell) = (&outcome["exports"], outcome["cell_size"].as_f64().expect("a cell"));
    assert_eq!(exports["removed"], nothing());
    assert_eq!(exports["tolerance"].as_f64(), Some(1.5 * cell));
    let lid = bench.layer("added.ply", &exports["added"]);
    assert!(lid.iter().flatten().all(|corner| (corner[2] - 10.0).abs() < 0.5 * cell));
    // What lies within the tolerance of the rim is near the input.
    let side = 10.0 - 2.0 * 1.5 * cell;
    let (found, expected) = (area(&lid), side * side);
    assert!((found - expected).abs() < 4.0 * side * 0.5 * cell, "{found} {expected}");
    // Patches are whole triangles of the output.
    let patches = bench.layer("patches.ply", &exports["patches"]);
    assert!((area(&patches) - 100.0).abs() < 40.0 * cell, "{}", area(&patches));
    let output = read(&bench.path("out.ply"));
    assert!(patches.iter().all(|triangle| output.contains(triangle)));
    assert_eq!(bench.names(), names(["added.ply", "patches.ply"]));
}

#[test]
fn walls_of_a_sheet_are_added_where_they_are_thicker_than_the_tolerance() {
    let sheet = [[0.0; 3], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 0.0]];
    let sheet = [[sheet[0], sheet[1], sheet[2]], [sheet[0], sheet[2], sheet[3]]];
    let bench = Bench::new(&sheet);
    let thick = ["--sheet-thickness", "6cells", "--tolerance", "2%"];
    let own = ["-o", "out.ply", "--export", "layers", "--json"];
    let exports = |more: &[&str]| {
        let ended = bench.program(&[&own, &thick[..], more].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.outcome()["exports"].take()
    };
    let found = exports(&[]);
    assert!(area(&bench.layer("added.ply", &found["added"])) > 200.0, "both sides");
    // The sheet is within its wall, but for where that ends flat at its rim.
    let removed = area(&bench.layer("removed.ply", &found["removed"]));
    assert!((70.0..100.0).contains(&removed), "{removed}");
    // Of a wide tolerance nothing is left, also not the files.
    let found = exports(&["--export-tolerance", "6cells"]);
    assert_eq!((&found["removed"], &found["added"]), (&nothing(), &nothing()));
    assert!(bench.names().is_empty());
}

#[test]
fn a_model_that_needs_nothing_has_no_layer_and_loses_those_of_an_earlier_run() {
    let bench = Bench::new(&sphere([0.0; 3], 5.0, 12));
    std::fs::create_dir(bench.path("layers")).expect("a folder");
    for name in ["removed.ply", "added.ply", "patches.ply", "mine.ply"] {
        std::fs::write(bench.path("layers").join(name), "old").expect("writable");
    }
    let exports = bench.exports("out.obj", &["--tag-patches"]);
    assert_eq!((&exports["removed"], &exports["added"]), (&nothing(), &nothing()));
    assert_eq!(exports["patches"], nothing());
    assert_eq!(bench.names(), names(["mine.ply"]));
    // A copy has changed nothing.
    std::fs::write(bench.path("layers/added.ply"), "old").expect("writable");
    let ended = bench.program(&["-o", "copy.obj", "--only-broken", "--export", "layers"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(bench.path("copy.obj").exists());
    assert_eq!(bench.names(), names(["mine.ply"]));
}

#[test]
fn layers_are_the_same_whatever_the_limits_and_the_format() {
    let ball = sphere([5.0, 5.0, 4.0], 2.0, 40);
    let open = without_lid([20.0, 0.0, 0.0], [30.0, 10.0, 10.0]);
    let model = [cuboid([0.0; 3], [10.0; 3]), ball.clone(), open].concat();
    let bench = Bench::new(&model);
    let all = ["removed.ply", "added.ply", "patches.ply"];
    let bytes = |more: &[&str]| {
        let own = ["--tag-patches", "--max-hole", "all"];
        let output = if more.contains(&"glb") { "out.glb" } else { "out.ply" };
        let more: Vec<_> = more.iter().copied().filter(|&word| word != "glb").collect();
        bench.exports(output, &[&own, &more[..]].concat());
        assert_eq!(bench.names(), names(all));
        all.map(|name| std::fs::read(bench.path("layers").join(name)).expect("there"))
    };
    let first = bytes(&["-j", "1", "--max-memory", "1GiB"]);
    for more in [["-j", "2", "--max-memory", "1GiB"], ["-j", "2", "--max-memory", "64MiB"]] {
        assert!(bytes(&more) == first, "{more:?}");
    }
    let ended = bench.program(&["-o", "out.ply", "--depth", "5", "--export", "layers"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    for told in ["\n  removed: ", "layers/removed.ply", "\n  added: ", "layers/added.ply"] {
        assert!(ended.stderr.contains(told), "{told}: {}", ended.stderr);
    }
    assert!(!ended.stderr.contains("patches"), "{}", ended.stderr);
    // The grid of a GLB is another one, since it holds single precision; the ball is what it was.
    bytes(&["glb", "-j", "2"]);
    assert_eq!(read(&bench.path("layers/removed.ply")), ball);
}

#[test]
fn wherever_a_run_is_stopped_the_next_one_writes_the_same_layers() {
    let hidden = cuboid([4.0; 3], [6.0; 3]);
    let open = without_lid([20.0, 0.0, 0.0], [30.0, 10.0, 10.0]);
    let bench = Bench::new(&[cuboid([0.0; 3], [10.0; 3]), hidden, open].concat());
    let arguments =
        ["in.obj", "-o", "out.ply", "--depth", "4", "--max-hole", "all", "-q", "-j", "1"];
    let run = |shim: Option<(&str, u64)>| -> Ended {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("repair").args(arguments).args(["--export", "layers"]);
        command.current_dir(bench.folder.path());
        if let Some((setting, call)) = shim {
            command.env("LD_PRELOAD", program::shim()).env("SHIM_ONLY", "1");
            command.env(setting, call.to_string());
        }
        command.output().expect("the program starts").into()
    };
    let layers = || {
        assert_eq!(bench.names(), names(["added.ply", "removed.ply"]));
        ["added.ply", "removed.ply"]
            .map(|name| std::fs::read(bench.path("layers").join(name)))
            .map(|bytes| bytes.expect("there"))
    };
    assert_eq!(run(None).code, Some(0));
    let expected = layers();
    let mut in_layers = 0;
    for setting in ["SHIM_KILL_CALL", "SHIM_FAIL_CALL"] {
        let mut call = 5;
        loop {
            let _ = std::fs::remove_dir_all(bench.path("layers"));
            let _ = std::fs::remove_file(bench.path("out.ply"));
            let ended = run(Some((setting, call)));
            if !ended.is_struck {
                break;
            }
            let is_in_place = bench.path("out.ply").exists();
            in_layers += u32::from(is_in_place);
            call += if is_in_place { 5 } else { 60 };
            if setting == "SHIM_FAIL_CALL" && ended.code != Some(0) {
                assert_eq!(ended.code, Some(5), "{call}: {}", ended.stderr);
                ended.assert_says_one_line();
                assert!(!is_in_place || bench.names().iter().all(|name| !name.starts_with('.')));
            }
            assert_eq!(run(None).code, Some(0), "{setting} {call}");
            assert!(layers() == expected, "{setting} {call}");
        }
    }
    assert!(in_layers > 0, "nothing struck while layers were written");
}

#[test]
fn lengths_are_in_the_unit_of_the_output() {
    let hidden = cuboid([4.0; 3], [6.0; 3]);
    let bench = Bench::new(&[cuboid([0.0; 3], [10.0; 3]), hidden].concat());
    for output in ["out.ply", "out.glb", "out.3mf"] {
        let exports = bench.exports(output, &["--units", "cm", "--to-units", "mm"]);
        let removed = bench.layer("removed.ply", &exports["removed"]);
        assert_eq!(removed.len(), 12, "{output}");
        assert!((area(&removed) - 2400.0).abs() < 1e-9, "{output}");
        assert_eq!(exports["added"], nothing(), "{output}");
    }
    // The inner box is 4 cm away from the outer one, all over.
    let far = ["--units", "cm", "--export-tolerance", "41mm"];
    assert_eq!(bench.exports("out.ply", &far)["removed"], nothing());
    let near = ["--units", "cm", "--export-tolerance", "39mm"];
    let exports = bench.exports("out.ply", &near);
    assert_eq!(exports["tolerance"].as_f64(), Some(3.9));
    assert_eq!(exports["removed"]["triangles"], 12);
}

#[test]
fn what_cannot_be_is_refused_before_the_work_begins() {
    let bench = Bench::new(&cuboid([0.0; 3], [1.0; 3]));
    for (arguments, told) in [
        (&["--lod", "0,1cells"][..], "--lod"),
        (&["--parts", "separate"], "--export is for one solid"),
        (&["--export-tolerance", "0"], "more than 0"),
        (&["--export-tolerance", "-1"], "-1"),
        (&["--export-tolerance", "3mm"], "states no unit"),
    ] {
        let own = ["-o", "out.ply", "--depth", "5", "--export", "layers"];
        let ended = bench.program(&[&own, arguments].concat());
        assert_eq!(ended.code, Some(2), "{arguments:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(told), "{arguments:?}: {}", ended.stderr);
        assert!(!bench.path("out.ply").exists() && !bench.path("layers").exists());
    }
    let ended = bench.program(&["-o", "out.ply", "--export-tolerance", "1"]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    for output in ["./added.ply", "added.ply"] {
        let ended = bench.program(&["-o", output, "--export", "."]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        ended.assert_says_one_line();
        assert!(ended.stderr.contains("choose another folder"), "{}", ended.stderr);
        assert!(!bench.path("added.ply").exists());
    }
    std::os::unix::fs::symlink(bench.path("in.obj"), bench.path("removed.ply")).expect("linked");
    let ended = bench.program(&["-o", "out.ply", "--export", "."]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(bench.path("in.obj").exists() && !bench.path("out.ply").exists());
}

#[test]
fn a_folder_that_cannot_be_made_is_told_before_the_work_begins() {
    let bench = Bench::new(&cuboid([0.0; 3], [1.0; 3]));
    std::fs::write(bench.path("layers"), "a file").expect("writable");
    let ended = bench.program(&["-o", "out.ply", "--export", "layers"]);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    ended.assert_says_one_line();
    assert!(!bench.path("out.ply").exists());
}

#[test]
fn the_documented_default_is_that_of_the_program() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/layers.md");
    let page = std::fs::read_to_string(page).expect("the page is there");
    let default = brickmend::report::DEFAULT_TOLERANCE;
    assert!(page.contains(&format!("`--export-tolerance`, `{default}` by default")));
}
