//! Estimates against what repairs took, and `docs/estimate.md` against what an estimate tells.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use brickmend::io::{Format, format_of_extension};
use brickmend::mesh::shapes::{Corners, sphere};
use brickmend::monitor::{Stage, Void};
use brickmend::octree::SnapBox;
use brickmend::repair::{
    Blame, Depth, ESTIMATE_VERSION, Estimate, Length, Limits, Outcome, RepairError, Settings,
    estimate, floor_bytes, repair,
};
use tempfile::NamedTempFile;

use crate::support::disk_watch::DiskWatch;
use crate::support::run::{Encoding, Workshop, at_depth, unclustered};
use crate::support::schema::check_document;
use crate::support::soups::closed_soups;
use crate::support::testdata;

const MODELS: [&str; 6] = [
    "models/bowl.obj",
    "models/cabinet.obj",
    "models/cube.off",
    "models/cube_ascii.stl",
    "models/cube_binary.stl",
    "models/sphere_without_cap.ply",
];
/// The smallest budget of two threads, and a plenty.
const BUDGETS: [u64; 2] = [64 << 20, 1 << 30];

fn limits(max_memory_bytes: u64) -> Limits {
    Limits { max_memory_bytes, threads: 2, ..Limits::default() }
}

fn estimated(input: &Path, settings: &Settings, limits: &Limits) -> Estimate {
    estimate(input, Format::Ply, settings, limits, &Void).expect("the input can be read")
}

/// Repairs `input` and tells the outcome with the most bytes that were needed on the disk.
fn measured(input: &Path, name: &str, settings: &Settings, limits: &Limits) -> (Outcome, u64) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let output = folder.path().join(name);
    let format = format_of_extension(&output).expect("a known ending");
    let watch = DiskWatch::new(folder.path());
    let outcome = repair(input, &output, format, settings, limits, &watch).expect("a sound result");
    (outcome, watch.peak())
}

#[test]
fn leaves_of_closed_models_are_told_to_a_tenth_and_of_others_to_a_factor_of_two() {
    for model in MODELS {
        for depth in 5..=8 {
            let settings = at_depth(depth);
            let told = estimated(&testdata(model), &settings, &limits(BUDGETS[1]));
            let (outcome, _) =
                measured(&testdata(model), "out.ply", &settings, &limits(BUDGETS[1]));
            let ratio = told.leaf_cells as f64 / outcome.scan.leaf_cells as f64;
            let closed = model.contains("cube");
            // The cabinet has doubled panels, which count once, and thin ones, which cancel out. The
            // bowl becomes a wall, which has two faces and an end.
            let range = if closed { 0.9..1.1 } else { 0.4..1.5 };
            assert!(range.contains(&ratio), "{model} at {depth}: {ratio}");
            assert_eq!(closed, told.input.rims.edges == 0.0, "{model}");
        }
    }
}

#[test]
fn disk_and_output_stay_below_their_bounds() {
    for model in MODELS {
        for (depth, budget) in [(4, BUDGETS[1]), (5, BUDGETS[0]), (6, BUDGETS[1]), (7, BUDGETS[0])]
        {
            let (settings, limits) = (at_depth(depth), limits(budget));
            let told = estimated(&testdata(model), &settings, &limits);
            let (outcome, disk) = measured(&testdata(model), "out.ply", &settings, &limits);
            let at = format!("{model} at {depth}");
            assert!(disk > 1 << 18, "{at}: the watch saw {disk} bytes only");
            assert!(disk <= told.disk_bytes, "{at}: {disk} of {}", told.disk_bytes);
            let most = &told.counts.at_most;
            assert!(outcome.output.bytes <= told.output_bytes, "{at}");
            assert!(outcome.scan.hits <= most.hits, "{at}");
            assert!(outcome.sign.crossings <= most.crossings, "{at}");
            assert!(outcome.output.contour.vertices <= most.vertices, "{at}");
            assert!(outcome.output.contour.triangles <= most.triangles, "{at}");
        }
    }
}

#[test]
fn every_format_of_output_has_its_own_bound() {
    let input = testdata("models/bowl.obj");
    // Bounds do not reckon with clusters.
    let settings = unclustered(6);
    for name in ["out.obj", "out.stl", "out.ply", "out.off"] {
        let format = format_of_extension(Path::new(name)).expect("a known ending");
        let told = estimate(&input, format, &settings, &limits(BUDGETS[1]), &Void).expect("told");
        let (outcome, disk) = measured(&input, name, &settings, &limits(BUDGETS[1]));
        let bytes = outcome.output.bytes;
        assert!((bytes..3 * bytes).contains(&told.output_bytes), "{name}: {bytes}, {told:?}");
        assert!((disk..4 * disk).contains(&told.disk_bytes), "{name}: {disk}, {told:?}");
    }
}

#[test]
fn memory_stays_below_its_bound_and_the_bound_below_the_budget() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for model in MODELS {
        for (depth, budget) in [("5", "64MiB"), ("7", "1GiB")] {
            let run = |command: &str| -> serde_json::Value {
                let output = Command::cargo_bin("brickmend")
                    .expect("the program was built")
                    .arg(command)
                    .arg(testdata(model))
                    .args(["--depth", depth, "--max-memory", budget, "-j", "2", "--json", "-o"])
                    .arg(folder.path().join("out.ply"))
                    .output()
                    .expect("the program starts");
                serde_json::from_slice(&output.stdout).expect("stdout is JSON")
            };
            let told = run("estimate");
            let outcome = run("repair");
            let most = told["memory_bytes"].as_u64().expect("a number");
            let peak = outcome["memory"]["peak_bytes"].as_u64().expect("Linux tells it");
            assert!(peak <= most, "{model} at {depth}: {peak} of {most}");
            assert!(most <= told["budget_bytes"].as_u64().expect("a number"));
            assert_eq!(told["memory_floor_bytes"], floor_bytes(2));
        }
    }
}

#[test]
fn closed_soups_are_told_to_be_closed_and_bounded_by_their_hits() {
    let workshop = Workshop::new();
    for soup in closed_soups(6, 17) {
        let input = workshop.write(&soup.triangles, Encoding::Obj);
        let settings = at_depth(6);
        let told = estimated(&input, &settings, &limits(BUDGETS[1]));
        assert_eq!(told.input.rims.edges, 0.0, "{}", soup.name);
        assert_eq!(told.counts.at_most.odd_faces, 0, "{}", soup.name);
        let (outcome, disk) = measured(&input, "out.ply", &settings, &limits(BUDGETS[1]));
        let most = &told.counts.at_most;
        assert!(outcome.sign.crossings <= most.crossings, "{}", soup.name);
        assert!(disk <= told.disk_bytes, "{}", soup.name);
        assert!(most.crossings as f64 <= 1.2 * told.counts.hits as f64 + 400.0, "{}", soup.name);
    }
}

#[test]
fn what_a_surface_gets_besides_its_shape_is_counted() {
    let workshop = Workshop::new();
    let mut text = String::from("vn 0 0 1\n");
    for (number, [x, y, z]) in sphere([0.0; 3], 1.0, 24).iter().flatten().enumerate() {
        let u = y.atan2(*x);
        writeln!(text, "v {x} {y} {z} 0.5 0 0.25\nvt {u} {z}").expect("strings grow");
        if number % 3 == 2 {
            let [a, b, c] = [number - 1, number, number + 1];
            writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}").expect("strings grow");
        }
    }
    let input = workshop.write_text("obj", &text);
    for settings in [at_depth(6), unclustered(6)] {
        for name in ["out.obj", "out.ply", "out.3mf", "out.glb"] {
            let format = format_of_extension(Path::new(name)).expect("a known ending");
            for share_bytes in [None, Some(64 << 10)] {
                let limits = Limits { share_bytes, ..limits(BUDGETS[1]) };
                let told = estimate(&input, format, &settings, &limits, &Void).expect("told");
                let (outcome, disk) = measured(&input, name, &settings, &limits);
                assert!(outcome.transfer.attributes.uvs && told.input.attributes.normals);
                let bytes = outcome.output.bytes;
                assert!(bytes <= told.output_bytes, "{name}: {bytes} of {}", told.output_bytes);
                assert!(disk <= told.disk_bytes, "{name}: {disk} of {:?}", told.disk);
            }
        }
    }
}

#[test]
fn an_estimate_takes_the_depth_of_the_repair() {
    let input = testdata("models/cube.off");
    let tolerance = |length, max_depth| Settings {
        depth: Depth::Tolerance { length, max_depth },
        ..Settings::default()
    };
    for settings in [
        tolerance(Length::Percent(2.0), 10),
        tolerance(Length::Percent(0.001), 6),
        tolerance(Length::Model(0.05), 10),
    ] {
        let told = estimated(&input, &settings, &limits(BUDGETS[1]));
        let (outcome, _) = measured(&input, "out.ply", &settings, &limits(BUDGETS[1]));
        assert_eq!((told.grid, told.cell_size), (outcome.grid, outcome.cell_size));
        assert_eq!(told.settings, outcome.settings);
    }
}

#[test]
fn deeper_grids_have_four_times_the_leaves_and_take_more_of_everything() {
    for model in MODELS {
        let at = |depth| estimated(&testdata(model), &at_depth(depth), &limits(BUDGETS[1]));
        for depth in 6..13 {
            let (coarse, fine) = (at(depth), at(depth + 1));
            let ratio = fine.leaf_cells as f64 / coarse.leaf_cells as f64;
            assert!((3.9..4.2).contains(&ratio), "{model} at {depth}: {ratio}");
            assert!(fine.disk_bytes > coarse.disk_bytes, "{model} at {depth}");
            assert!(fine.memory_bytes >= coarse.memory_bytes, "{model} at {depth}");
            assert!(fine.seconds > coarse.seconds, "{model} at {depth}");
        }
    }
}

/// A file whose reader keeps its vertices in a table: three for each triangle.
fn off_file(soup: &[Corners]) -> NamedTempFile {
    let mut text = format!("OFF\n{} {} 0\n", 3 * soup.len(), soup.len());
    for [x, y, z] in soup.iter().flatten() {
        writeln!(text, "{x} {y} {z}").expect("strings grow");
    }
    for first in (0..3 * soup.len()).step_by(3) {
        writeln!(text, "3 {first} {} {}", first + 1, first + 2).expect("strings grow");
    }
    let file = NamedTempFile::new().expect("a temporary file can be made");
    std::fs::write(file.path(), text).expect("writable");
    file
}

#[test]
fn counts_depend_on_the_file_alone_and_readers_that_spill_leave_nothing_behind() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let input = off_file(&sphere([0.0; 3], 1.0, 24));
    let small = Limits {
        share_bytes: Some(16 << 10),
        threads: 1,
        work_dir: Some(folder.path().to_path_buf()),
        ..Limits::default()
    };
    let told = estimated(input.path(), &at_depth(6), &small);
    let other = estimated(input.path(), &at_depth(6), &limits(BUDGETS[1]));
    assert_eq!((told.input, told.counts), (other.input, other.counts));
    let left: Vec<PathBuf> = std::fs::read_dir(folder.path())
        .expect("readable")
        .map(|entry| entry.expect("readable").path())
        .collect();
    assert!(left.is_empty(), "{left:?}");
    // What spills takes room on the disk.
    assert!(told.disk.read > other.disk.read);
    assert!(told.disk_bytes >= other.disk_bytes);
}

#[test]
fn what_cannot_be_repaired_is_not_estimated() {
    let ends_with = |input: &Path, settings: &Settings, limits: &Limits, blame: Blame| {
        let error = estimate(input, Format::Stl, settings, limits, &Void).expect_err("refused");
        assert_eq!(error.blame(), blame, "{error}");
        error
    };
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let cube = testdata("models/cube.off");
    let settings = at_depth(6);
    let plenty = limits(BUDGETS[1]);
    ends_with(&folder.path().join("missing.stl"), &settings, &plenty, Blame::Input);
    ends_with(folder.path(), &settings, &plenty, Blame::Input);
    let lines = folder.path().join("lines.obj");
    std::fs::write(&lines, "v 0 0 0\nv 1 0 0\nl 1 2\n").expect("writable");
    let error = ends_with(&lines, &settings, &plenty, Blame::Input);
    assert!(matches!(error, RepairError::NoTriangle { .. }), "{error}");
    let flat = folder.path().join("flat.obj");
    std::fs::write(&flat, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").expect("writable");
    ends_with(&flat, &settings, &plenty, Blame::Input);
    let strict = Settings { strict: true, ..settings };
    ends_with(&testdata("defects/nan_vertex/model.obj"), &strict, &plenty, Blame::Input);
    let error = ends_with(&cube, &settings, &limits(1 << 20), Blame::Usage);
    assert!(matches!(error, RepairError::BudgetBelowFloor { .. }), "{error}");
    let metres = Depth::Tolerance { length: Length::Metres(0.1), max_depth: 8 };
    ends_with(&cube, &Settings { depth: metres, ..settings }, &plenty, Blame::Usage);
    let far = folder.path().join("far.obj");
    std::fs::write(&far, "v 1e6 0 0\nv 1000100 0 0\nv 1e6 100 0\nf 1 2 3\n").expect("writable");
    let error = ends_with(&far, &at_depth(12), &plenty, Blame::Usage);
    assert!(matches!(error, RepairError::OutputTooCoarse { .. }), "{error}");
}

#[test]
fn numbers_without_end_give_an_estimate_all_the_same() {
    let workshop = Workshop::new();
    for size in [1e308, 1e150, 1e-150] {
        let soup = [[[0.0; 3], [size, 0.0, 0.0], [0.0, size, size]]];
        let input = workshop.write(&soup, Encoding::Obj);
        match estimate(&input, Format::Ply, &at_depth(8), &limits(BUDGETS[1]), &Void) {
            Ok(told) => {
                assert!(told.leaf_cells > 0 && told.disk_bytes > 0, "{size}: {told:?}");
                assert!(told.seconds.is_finite(), "{size}");
            }
            Err(error) => assert!(matches!(error, RepairError::NoTriangle { .. }), "{error}"),
        }
    }
}

#[test]
fn the_documentation_names_every_field_and_no_other() {
    let mut told = estimated(&testdata("models/bowl.obj"), &at_depth(5), &limits(BUDGETS[1]));
    assert_eq!(told.schema, ESTIMATE_VERSION);
    assert_eq!(told.stages.len(), Stage::ALL.len());
    assert!(told.input.bounds != SnapBox::EMPTY);
    let check = |told: &Estimate| {
        let json = serde_json::to_value(told).expect("plain data is always JSON");
        let conditional = [
            "settings.depth.levels",
            "settings.depth.tolerance",
            "settings.depth.auto",
            "settings.depth.auto.max_depth",
            "settings.decimate.length",
            "settings.max_gap.length",
            "settings.sheet_thickness.length",
        ];
        let lengths = ["model", "percent", "metres"]
            .map(|unit| format!("settings.depth.tolerance.length.{unit}"));
        let inner = ["settings.depth.tolerance.length", "settings.depth.tolerance.max_depth"];
        let all: Vec<&str> = conditional
            .into_iter()
            .chain(inner)
            .chain(lengths.iter().map(String::as_str))
            .collect();
        check_document("docs/estimate.md", &json, &all);
    };
    check(&told);
    told.settings.depth = Depth::DEFAULT;
    check(&told);
}
