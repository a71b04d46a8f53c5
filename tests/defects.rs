//! Every defect that the tool is for, as a smallest case: what must come out of it.
//!
//! The cases lie in `testdata/defects/<name>/`; the second line of `about.txt` says what is
//! expected. The cases of overlapping and abutting boxes are rotated here as well.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use brickmend::repair::{Outcome, RepairError};
use brickmend::sign::FillRule;

use crate::support::{repair_at, testdata};

const DEPTH: u32 = 6;

/// One line of expectations: `empty`, or pairs such as `volume 1 0.002; components 1`.
struct Expected {
    fill_rule: FillRule,
    text: String,
}

fn expectations(folder: &Path) -> Vec<Expected> {
    let about = std::fs::read_to_string(folder.join("about.txt")).expect("about.txt is there");
    let lines: Vec<_> = about.lines().skip(1).map(expectation).collect();
    assert!(!lines.is_empty(), "{}: about.txt expects nothing", folder.display());
    lines
}

fn expectation(line: &str) -> Expected {
    match line.strip_prefix("evenodd ") {
        Some(text) => Expected { fill_rule: FillRule::Evenodd, text: text.to_owned() },
        None => Expected { fill_rule: FillRule::Solid, text: line.to_owned() },
    }
}

fn check(name: &str, expected: &str, result: Result<Outcome, RepairError>, failures: &mut String) {
    let mut fail = |what: String| writeln!(failures, "{name}: {what}").expect("text grows");
    let outcome = match (expected, result) {
        ("empty", Err(RepairError::EmptyResult { .. })) => return,
        ("empty", other) => {
            return fail(format!(
                "expected no triangle, found {:?}",
                other.map(|o| o.output.bytes)
            ));
        }
        (_, Err(error)) => return fail(format!("{error} ({error:?})")),
        (_, Ok(outcome)) => outcome,
    };
    let proof = &outcome.output.proof;
    if !proof.holds() {
        fail(format!("the proof fails: {:?}", proof.failures()));
    }
    for pair in expected.split(';') {
        let words: Vec<&str> = pair.split_whitespace().collect();
        let number = |i: usize| words[i].parse::<f64>().expect("about.txt has numbers");
        let found = found_of(&outcome, words[0]);
        let tolerance = if words.len() > 2 { number(2) } else { 0.0 };
        if (found - number(1)).abs() > tolerance {
            fail(format!("expected {pair}, found {found}"));
        }
    }
}

fn found_of(outcome: &Outcome, word: &str) -> f64 {
    let proof = &outcome.output.proof;
    match word {
        "volume" => proof.volume,
        "components" => proof.components as f64,
        "euler" => proof.euler_characteristic as f64,
        "duplicates" => outcome.found.settle.duplicate_triangles as f64,
        "interfaces" => outcome.found.settle.interface_triangles as f64,
        "degenerate" => outcome.found.settle.degenerate_triangles as f64,
        "nonfinite" => outcome.input.stats.nonfinite_triangles as f64,
        "wild" => outcome.input.stats.discarded.wild_index_faces as f64,
        _ => panic!("about.txt expects {word}, which is not known"),
    }
}

fn cases() -> Vec<PathBuf> {
    let folders = std::fs::read_dir(testdata("defects")).expect("testdata/defects is there");
    let mut folders: Vec<_> = folders.map(|entry| entry.expect("listable").path()).collect();
    folders.sort();
    folders
}

#[test]
fn every_defect_is_repaired_as_its_case_says() {
    let mut failures = String::new();
    let cases = cases();
    assert!(cases.len() >= 20, "{} cases only", cases.len());
    for folder in &cases {
        let name = folder.file_name().expect("a case has a name").to_string_lossy();
        for expected in expectations(folder) {
            let result = repair_at(&folder.join("model.obj"), DEPTH, expected.fill_rule);
            check(&name, &expected.text, result, &mut failures);
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// The vertices of a model turned about two axes; faces stay as they are.
fn turned(model: &str, a: f64, b: f64) -> String {
    let mut text = String::new();
    for line in model.lines() {
        let Some(numbers) = line.strip_prefix("v ") else {
            writeln!(text, "{line}").expect("text grows");
            continue;
        };
        let p: Vec<f64> =
            numbers.split_whitespace().map(|n| n.parse().expect("a coordinate")).collect();
        let (x, y) = (p[0] * a.cos() - p[1] * a.sin(), p[0] * a.sin() + p[1] * a.cos());
        let (y, z) = (y * b.cos() - p[2] * b.sin(), y * b.sin() + p[2] * b.cos());
        writeln!(text, "v {x} {y} {z}").expect("text grows");
    }
    text
}

/// Twenty poses of a case, each with the same expectations.
fn check_turned(case: &str, expected: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let model = std::fs::read_to_string(testdata("defects").join(case).join("model.obj"));
    let model = model.expect("the case is there");
    let mut failures = String::new();
    for pose in 0..20 {
        let path = folder.path().join("turned.obj");
        let (a, b) = (0.13 + 0.31 * f64::from(pose), 0.07 + 0.47 * f64::from(pose));
        std::fs::write(&path, turned(&model, a, b)).expect("the folder is writable");
        let result = repair_at(&path, DEPTH, FillRule::Solid);
        check(&format!("{case}, pose {pose}"), expected, result, &mut failures);
    }
    assert!(failures.is_empty(), "\n{failures}");
}

#[test]
fn overlapping_boxes_unite_in_every_pose() {
    check_turned("overlapping_boxes", "volume 1.5 0.01; components 1; euler 2");
}

#[test]
fn overlapping_boxes_with_one_lid_missing_leave_no_hollow_in_any_pose() {
    check_turned("overlapping_boxes_one_lid", "volume 1.5 0.03");
}

#[test]
fn abutting_boxes_have_no_wall_between_them_in_any_pose() {
    check_turned("abutting_boxes", "volume 2 0.01; components 1; interfaces 2");
    check_turned("abutting_boxes_partly", "volume 2 0.01; components 1; interfaces 2");
}

#[test]
fn doubled_faces_count_once_in_every_pose() {
    check_turned("doubled_faces_opposite", "volume 1 0.01; components 1; interfaces 0");
}

#[test]
fn a_hanging_fin_leaves_a_sound_solid_in_every_pose() {
    check_turned("hanging_triangle", "volume 1 0.03");
}
