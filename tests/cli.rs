//! The command line from outside: exit codes, messages, files, JSON.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

/// A cube of twelve triangles.
const CUBE: &str = "testdata/models/cube_binary.stl";

fn brickmend() -> Command {
    Command::cargo_bin("brickmend").expect("the program was built")
}

fn model(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("listable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Runs `brickmend repair INPUT -o OUTPUT EXTRA...` and returns exit code, stdout and stderr.
fn repair(input: &Path, output: &Path, extra: &[&str]) -> (i32, String, String) {
    let mut command = brickmend();
    command.arg("repair").arg(input).arg("-o").arg(output).args(extra);
    let run = command.output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (run.status.code().expect("no signal"), text(run.stdout), text(run.stderr))
}

/// An input that cannot be read: exit 65, one line with its path, nothing left behind.
fn check_unreadable(name: &str, content: Option<&[u8]>, says: &str) {
    let folder = folder();
    let input = folder.path().join(name);
    if let Some(content) = content {
        std::fs::write(&input, content).expect("writable");
    }
    let before = names_in(folder.path());
    let (code, out, err) = repair(&input, &folder.path().join("out.ply"), &["--json"]);
    assert_eq!(code, 65, "{name}: {err}");
    assert_eq!(out, "", "{name}");
    assert_eq!(err.trim_end().lines().count(), 1, "{name}: {err}");
    assert!(err.contains(name), "{name}: the message names the file: {err}");
    assert!(err.contains(says), "{name}: the message says {says:?}: {err}");
    assert_eq!(names_in(folder.path()), before, "{name}: something was left behind");
}

#[test]
fn unreadable_inputs_end_with_65_and_leave_nothing_behind() {
    check_unreadable("missing.stl", None, "No such file");
    check_unreadable("empty.obj", Some(b""), "empty");
    check_unreadable("garbage.bin", Some(b"\x00\x01\x02 this is no model \xff\xfe"), "expected");
    let cube = std::fs::read(model(CUBE)).expect("the cube is there");
    check_unreadable("short.stl", Some(&cube[..cube.len() - 7]), "byte");
    check_unreadable("broken.ply", Some(b"ply\nformat ascii 1.0\nelement vertex x\n"), "line");
    check_unreadable("model.glb", Some(b"glTF\x02\x00\x00\x00"), "the header of a GLB file");
    check_unreadable("model.3mf", Some(b"PK\x03\x04rest"), "a zip archive");
    check_unreadable("lines.obj", Some(b"v 0 0 0\nv 1 0 0\nl 1 2\n"), "no triangle");
    check_unreadable("points.obj", Some(b"v 0 0 0\nv 1 0 0\n"), "no triangle");
}

#[test]
fn a_folder_is_no_model() {
    let folder = folder();
    let input = folder.path().join("models.obj");
    std::fs::create_dir(&input).expect("writable");
    let (code, _, err) = repair(&input, &folder.path().join("out.ply"), &[]);
    assert_eq!(code, 65, "{err}");
    assert!(err.contains("models.obj"), "{err}");
    assert_eq!(names_in(folder.path()), ["models.obj"]);
}

#[test]
fn broken_faces_are_refused_only_when_strict() {
    let folder = folder();
    let input = model("testdata/defects/nan_vertex/model.obj");
    let output = folder.path().join("out.ply");
    let (code, _, err) = repair(&input, &output, &["--depth", "5", "--strict"]);
    assert_eq!(code, 65, "{err}");
    assert!(names_in(folder.path()).is_empty());
    let (code, _, err) = repair(&input, &output, &["--depth", "5"]);
    assert_eq!(code, 0, "{err}");
}

#[test]
fn what_the_command_line_cannot_mean_ends_with_2() {
    let folder = folder();
    let output = folder.path().join("out.ply");
    let cube = model(CUBE);
    for extra in [
        &["--depth", "3"][..],
        &["--depth", "16"],
        &["--depth", "5", "--tolerance", "1%"],
        &["--tolerance", "-1"],
        &["--tolerance", "3mm"],
        &["--max-memory", "1MiB"],
        &["--max-memory", "lots"],
        &["--crease", "200"],
        &["--method", "guess"],
        &["--max-triangles", "0"],
        &["--max-triangles", "100", "--method", "dmc"],
        &["--depth", "5", "--max-triangles", "4"],
        &["--max-triangles", "100", "--lod", "0,1cells"],
        &["--lod", "0,cells"],
        &["--lod", "0.5,0.50cells"],
        &["--lod", "0,1cells", "--decimate", "0"],
        &["--lod", "0,1cells", "--preview", "out.png"],
        &["--lod", "0,1cells", "--method", "mc"],
        &["--unheard-of"],
    ] {
        let (code, _, err) = repair(&cube, &output, extra);
        assert_eq!(code, 2, "{extra:?}: {err}");
        assert!(!err.is_empty(), "{extra:?}");
        assert!(names_in(folder.path()).is_empty(), "{extra:?}: something was left behind");
    }
    let (code, _, err) = repair(&cube, &folder.path().join("out.step"), &[]);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("out.step"), "{err}");
    brickmend().assert().code(2);
}

#[test]
fn levels_of_detail_are_files_beside_each_other_and_outcomes_in_a_list() {
    let folder = folder();
    let extra = ["--depth", "5", "--lod", "0,0.1,2cells", "--json"];
    let (code, out, err) = repair(&model(CUBE), &folder.path().join("out.ply"), &extra);
    assert_eq!(code, 0, "{err}");
    let names = ["out.0.1cells.ply", "out.0cells.ply", "out.2cells.ply"];
    assert_eq!(names_in(folder.path()), names);
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let outcomes = json.as_array().expect("a list");
    let cells = outcomes.iter().map(|outcome| outcome["settings"]["decimate"]["cells"].as_f64());
    assert_eq!(cells.collect::<Vec<_>>(), [Some(0.0), Some(0.1), Some(2.0)]);
    for outcome in outcomes {
        assert!(outcome["stages"]["verify"]["seconds"].is_number());
        assert!(Path::new(outcome["output"]["path"].as_str().expect("a path")).exists());
    }
    let extra = ["--depth", "5", "--lod", "0,50%"];
    let (code, _, err) = repair(&model(CUBE), &folder.path().join("all.stl"), &extra);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("all.0cells.stl") && err.contains("all.50pct.stl"), "{err}");
}

#[test]
fn a_budget_below_the_floor_is_refused_with_the_number_needed() {
    let folder = folder();
    let extra = ["--max-memory", "1MiB"];
    let (_, _, err) = repair(&model(CUBE), &folder.path().join("out.ply"), &extra);
    let needed = brickmend::repair::floor_bytes(1).to_string();
    assert!(err.contains(&needed), "{err}");
}

#[test]
fn a_model_thinner_than_a_cell_ends_with_4_and_a_reason() {
    let folder = folder();
    let input = model("testdata/defects/thin_plate/model.obj");
    let (code, out, err) =
        repair(&input, &folder.path().join("out.ply"), &["--depth", "5", "--thin", "drop"]);
    assert_eq!(code, 4, "{err}");
    assert_eq!(out, "");
    assert!(err.contains("thinner than a cell"), "{err}");
    assert!(names_in(folder.path()).is_empty(), "something was left behind");
}

#[test]
fn an_output_folder_that_is_no_folder_ends_with_5() {
    let folder = folder();
    // A file in the place of the folder: root may write anywhere else.
    std::fs::write(folder.path().join("file"), "no folder").expect("writable");
    let output = folder.path().join("file").join("out.ply");
    let (code, _, err) = repair(&model(CUBE), &output, &["--depth", "4"]);
    assert_eq!(code, 5, "{err}");
    assert_eq!(names_in(folder.path()), ["file"]);
}

#[test]
fn all_formats_are_written_and_read_again() {
    let folder = folder();
    for ending in ["obj", "stl", "ply", "off", "glb"] {
        let output = folder.path().join(format!("out.{ending}"));
        let (code, _, err) = repair(&model(CUBE), &output, &["--depth", "4"]);
        assert_eq!(code, 0, "{ending}: {err}");
        let again = folder.path().join(format!("again-{ending}.ply"));
        let (code, _, err) = repair(&output, &again, &["--depth", "4"]);
        assert_eq!(code, 0, "{ending} again: {err}");
    }
    assert_eq!(names_in(folder.path()).len(), 10, "outputs and nothing else");
}

#[test]
fn json_stands_alone_on_stdout() {
    let folder = folder();
    let output = folder.path().join("out.ply");
    let input = model("testdata/models/sphere_without_cap.ply");
    let (code, out, err) = repair(&input, &output, &["--depth", "5", "--json"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let json: serde_json::Value = serde_json::from_str(&out).expect("stdout is JSON");
    assert_eq!(json["schema"], 1);
    assert_eq!(json["output"]["proof"]["boundary_edges"], 0);
    assert_eq!(json["mend"]["filled_holes"], 1);
    let size = std::fs::metadata(&output).expect("the output is there").len();
    assert_eq!(json["output"]["bytes"], size);
    assert!(json["memory"]["peak_bytes"].as_u64().is_some_and(|bytes| bytes > 1 << 20));
    for stage in ["ingest", "bridge", "scan", "patch", "sign", "contour", "verify"] {
        assert!(json["stages"][stage]["seconds"].is_f64(), "{stage}");
    }
}

#[test]
fn quiet_says_nothing_and_the_default_says_one_line() {
    let folder = folder();
    let output = folder.path().join("out.ply");
    let quiet = repair(&model(CUBE), &output, &["--depth", "4", "-q"]);
    assert_eq!(quiet, (0, String::new(), String::new()));
    let (code, out, err) = repair(&model(CUBE), &output, &["--depth", "4"]);
    assert_eq!((code, out.as_str(), err.lines().count()), (0, "", 1), "{err}");
    let (_, _, err) = repair(&model(CUBE), &output, &["--depth", "4", "-v"]);
    assert!(err.lines().count() > 6, "a line per stage: {err}");
}

#[test]
fn an_output_that_is_the_input_is_refused_under_any_name() {
    let folder = folder();
    let input = folder.path().join("cube.stl");
    std::fs::copy(model(CUBE), &input).expect("a copy");
    let link = folder.path().join("link.stl");
    std::os::unix::fs::symlink(&input, &link).expect("a link");
    let before = std::fs::read(&input).expect("the copy");
    for output in [&input, &link] {
        let (code, _, message) = repair(&input, output, &["--depth", "5"]);
        assert_eq!(code, 2, "{message}");
        assert!(message.contains("is the input itself"), "{message}");
    }
    assert_eq!(std::fs::read(&input).expect("the copy"), before);
}

#[test]
fn the_input_is_never_touched() {
    let folder = folder();
    let input = folder.path().join("cube.stl");
    std::fs::copy(model(CUBE), &input).expect("writable");
    let before = std::fs::metadata(&input).expect("there");
    let (code, _, err) = repair(&input, &folder.path().join("out.ply"), &["--depth", "4"]);
    assert_eq!(code, 0, "{err}");
    let after = std::fs::metadata(&input).expect("there");
    assert_eq!(before.modified().expect("known"), after.modified().expect("known"));
    assert_eq!(std::fs::read(&input).expect("there"), std::fs::read(model(CUBE)).expect("there"));
}

#[test]
fn an_old_output_stays_until_a_new_one_is_proved() {
    let folder = folder();
    let output = folder.path().join("out.ply");
    std::fs::write(&output, "what was there before").expect("writable");
    let thin = model("testdata/defects/thin_plate/model.obj");
    let (code, ..) = repair(&thin, &output, &["--depth", "5", "--thin", "drop"]);
    assert_eq!(code, 4);
    assert_eq!(std::fs::read(&output).expect("there"), b"what was there before");
    let (code, _, err) = repair(&model(CUBE), &output, &["--depth", "4"]);
    assert_eq!(code, 0, "{err}");
    assert!(std::fs::read(&output).expect("there").starts_with(b"ply\n"));
}

#[test]
fn threads_and_budgets_do_not_change_a_byte() {
    let folder = folder();
    let input = model("testdata/models/bowl.obj");
    let mut outputs = Vec::new();
    for extra in [&["-j", "1"][..], &["-j", "3"], &["-j", "2", "--max-memory", "64MiB"]] {
        let output = folder.path().join(format!("out{}.ply", outputs.len()));
        let extra = [&["--depth", "6"], extra].concat();
        let (code, _, err) = repair(&input, &output, &extra);
        assert_eq!(code, 0, "{err}");
        outputs.push(std::fs::read(&output).expect("there"));
    }
    assert!(outputs.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn a_preview_is_a_png_and_a_work_folder_elsewhere_is_left_empty() {
    let folder = folder();
    let work = folder.path().join("work");
    std::fs::create_dir(&work).expect("writable");
    let picture = folder.path().join("out.png");
    let picture_text = picture.to_string_lossy().into_owned();
    let work_text = work.to_string_lossy().into_owned();
    let extra = ["--depth", "4", "--preview", &picture_text, "--work-dir", &work_text];
    let (code, _, err) = repair(&model(CUBE), &folder.path().join("out.stl"), &extra);
    assert_eq!(code, 0, "{err}");
    let bytes = std::fs::read(&picture).expect("the picture is there");
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
    let width = |bytes: &[u8]| u32::from_be_bytes(bytes[16..20].try_into().expect("four bytes"));
    let with_map = width(&bytes);
    let (code, ..) = repair(
        &model(CUBE),
        &folder.path().join("out.stl"),
        &[&extra[..], &["--no-deviation"]].concat(),
    );
    assert_eq!(code, 0);
    let plain = width(&std::fs::read(&picture).expect("the picture is there"));
    assert!(with_map > plain + 900 && plain == 1804, "{with_map} {plain}");
    assert!(names_in(&work).is_empty());
    assert_eq!(names_in(folder.path()), ["out.png", "out.stl", "work"]);
}

#[test]
fn a_png_has_as_many_views_as_are_asked_for() {
    let folder = folder();
    let picture = folder.path().join("out.png");
    let picture_text = picture.to_string_lossy().into_owned();
    let size_of = |more: &[&str]| {
        let extra = [&["--depth", "4", "--no-deviation", "--preview", &picture_text], more];
        let output = folder.path().join("out.stl");
        let (code, _, err) = repair(&model(CUBE), &output, &extra.concat());
        assert_eq!(code, 0, "{more:?}: {err}");
        let bytes = std::fs::read(&picture).expect("the picture is there");
        [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
    };
    // Two panels with a line between them; each has its views in two rows.
    for (more, size) in [
        (&[][..], [2 * 900 + 4, 900]),
        (&["--preview-views", "6"], [2 * 3 * 512 + 4, 2 * 512]),
        (&["--preview-views", "14"], [2 * 7 * 512 + 4, 2 * 512]),
        (&["--preview-views", "14", "--max-memory", "64MiB"], [2 * 7 * 512 + 4, 2 * 512]),
    ] {
        assert_eq!(size_of(more), size, "{more:?}");
    }
}

#[test]
fn the_help_names_every_exit_code() {
    let run = brickmend().args(["repair", "--help"]).output().expect("the program starts");
    let text = String::from_utf8(run.stdout).expect("text");
    for code in ["0 ", "1 ", "2 ", "4 ", "5 ", "6 ", "65 ", "130 "] {
        assert!(text.contains(&format!("\n  {code}")), "exit code {code}is not in the help");
    }
}

#[test]
fn a_method_is_chosen_by_name_and_tells_what_it_cannot_promise() {
    let folder = folder();
    let output = folder.path().join("out.ply");
    let json = |extra: &[&str]| -> serde_json::Value {
        let extra = [&["--depth", "5", "--json"], extra].concat();
        let (code, out, err) = repair(&model(CUBE), &output, &extra);
        assert_eq!((code, err.as_str()), (0, ""), "{extra:?}");
        serde_json::from_str(&out).expect("stdout is JSON")
    };
    let default = json(&[]);
    assert_eq!(default["settings"]["method"], "mdc");
    assert!(default["output"]["caveat"].is_null());
    let dual = std::fs::read(&output).expect("the output is there");
    assert_eq!(json(&["--method", "mdc"])["settings"], default["settings"]);
    let cubes = json(&["--method", "mc"]);
    assert_eq!(cubes["settings"]["method"], "mc");
    assert_eq!(cubes["verdict"], "pass", "{}", cubes["reasons"]);
    let caveat = cubes["output"]["caveat"].as_str().expect("a caveat").to_owned();
    assert!(caveat.contains("creases and corners"), "{caveat}");
    assert_ne!(std::fs::read(&output).expect("the output is there"), dual);
    let (code, _, err) = repair(&model(CUBE), &output, &["--depth", "5", "--method", "mc"]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains(&format!("note: {caveat}")), "{err}");
    let run = brickmend().args(["repair", "--help"]).output().expect("the program starts");
    let help = String::from_utf8(run.stdout).expect("text");
    for words in ["--method", "- mdc:", "- mc:", "cuts creases and corners off"] {
        assert!(help.contains(words), "{words} is not in the help");
    }
}

/// Runs `brickmend estimate INPUT EXTRA...` in a folder and returns exit code, stdout and stderr.
fn estimate(input: &Path, within: &Path, extra: &[&str]) -> (i32, String, String) {
    let mut command = brickmend();
    command.current_dir(within).arg("estimate").arg(input).args(extra);
    let run = command.output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (run.status.code().expect("no signal"), text(run.stdout), text(run.stderr))
}

#[test]
fn an_estimate_tells_in_lines_or_json_and_writes_nothing() {
    let folder = folder();
    let cube = model(CUBE);
    let (code, out, err) = estimate(&cube, folder.path(), &["--depth", "6"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for word in ["leaf cells", "memory: at most", "disk: at most", "time: about", "from: 12 tri"] {
        assert!(out.contains(word), "{word}: {out}");
    }
    assert_eq!(estimate(&cube, folder.path(), &["-q"]), (0, String::new(), String::new()));
    let output = folder.path().join("out.stl").to_string_lossy().into_owned();
    let json = |extra: &[&str]| -> serde_json::Value {
        let (code, out, err) = estimate(&cube, folder.path(), extra);
        assert_eq!((code, err.as_str()), (0, ""), "{extra:?}");
        serde_json::from_str(&out).expect("stdout is JSON")
    };
    let named = json(&["--json", "--depth", "6", "-o", &output]);
    assert_eq!(named["schema"], 1);
    assert_eq!(named, json(&["--json", "--depth", "6", "--format", "stl"]));
    let ply = json(&["--json", "--depth", "6", "--fill-rule", "evenodd", "--crease", "5"]);
    assert!(ply["output_bytes"].as_u64() < named["output_bytes"].as_u64());
    assert!(names_in(folder.path()).is_empty(), "an estimate writes nothing");
}

#[test]
fn estimates_end_with_the_codes_of_repairs() {
    let folder = folder();
    let cube = model(CUBE);
    for extra in [
        &["--max-memory", "1MiB"][..],
        &["--depth", "3"],
        &["--tolerance", "3mm"],
        &["-o", "out.step"],
        &["--format", "step"],
        &["--format", "ply", "-o", "out.ply"],
    ] {
        let (code, out, err) = estimate(&cube, folder.path(), extra);
        assert_eq!((code, out.as_str()), (2, ""), "{extra:?}: {err}");
        assert!(!err.is_empty(), "{extra:?}");
    }
    let garbage = folder.path().join("garbage.bin");
    std::fs::write(&garbage, b"\x00\x01 this is no model").expect("writable");
    let (code, out, err) = estimate(&garbage, folder.path(), &[]);
    assert_eq!((code, out.as_str()), (65, ""), "{err}");
    assert!(err.contains("garbage.bin"), "{err}");
    let broken = model("testdata/defects/nan_vertex/model.obj");
    assert_eq!(estimate(&broken, folder.path(), &["--strict"]).0, 65);
    assert_eq!(estimate(&broken, folder.path(), &[]).0, 0);
}
