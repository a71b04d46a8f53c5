//! Verifications: clean repairs pass, each way to spoil one is told by its own reason, nothing depends
//! on memory or threads, and `docs/verify.md` names every field.

use std::path::{Path, PathBuf};
use std::process::Command;

use brickmend::io::{Format, ReadOptions, open};
use brickmend::mesh::TriangleBatch;
use brickmend::mesh::shapes::{Corners, Random, cuboid, gear, rotation, sphere, torus, transform};
use brickmend::monitor::Void;
use brickmend::repair::{
    Depth, Limits, Settings, VERIFICATION_VERSION, Verdict, Verification, VerifySettings, repair,
    verify_file,
};
use brickmend::store::Scratch;
use glam::DVec3;
use tempfile::TempDir;

use crate::support::obj::welded_obj;
use crate::support::program::Ended;
use crate::support::schema::check_document;
use crate::support::testdata;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

/// A folder with a file and its original.
struct Pair {
    folder: TempDir,
}

impl Pair {
    fn new(file: &[Corners], original: &[Corners]) -> Self {
        let pair = Self { folder: folder() };
        std::fs::write(pair.file(), welded_obj(file)).expect("writable");
        std::fs::write(pair.original(), welded_obj(original)).expect("writable");
        pair
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("file.obj")
    }

    fn original(&self) -> PathBuf {
        self.folder.path().join("original.obj")
    }

    fn verified(&self, limits: &Limits) -> Verification {
        let settings = VerifySettings { samples: 20_000, ..VerifySettings::default() };
        let limits = Limits { work_dir: Some(self.folder.path().to_path_buf()), ..limits.clone() };
        let original = self.original();
        verify_file(&self.file(), Some(&original), &settings, &limits, &Void).expect("readable")
    }
}

fn verified(file: &[Corners], original: &[Corners]) -> Verification {
    Pair::new(file, original).verified(&Limits { threads: 2, ..Limits::default() })
}

fn reasons(verification: &Verification) -> String {
    let texts = verification.reasons.iter().map(|reason| reason.text.as_str());
    texts.collect::<Vec<_>>().join("\n")
}

/// What is told, and that nothing else is but what `also` allows.
fn assert_told(found: &Verification, verdict: Verdict, words: &str, also: &[&str]) {
    let told = reasons(found);
    assert_eq!(found.verdict, verdict, "{told}");
    assert!(told.contains(words), "{words:?} is not told:\n{told}");
    for reason in &found.reasons {
        let is_expected =
            reason.text.contains(words) || also.iter().any(|w| reason.text.contains(w));
        assert!(is_expected, "told besides: {}", reason.text);
    }
}

const FAR: [&str; 2] = ["off the file", "off the original"];

#[test]
fn clean_repairs_pass() {
    let mut random = Random::new(61);
    let shapes = [
        sphere([0.3, -0.2, 0.1], 1.0, 12),
        torus(1.0, 0.45, 30, 16),
        cuboid([-1.0, 0.0, 2.0], [1.0, 1.5, 2.5]),
        gear(9, 0.7, 1.0, 0.4),
        cuboid([0.0; 3], [0.3, 2.0, 2.0]),
    ];
    for (number, shape) in shapes.iter().enumerate() {
        let turned = transform(shape, rotation(&mut random), DVec3::new(10.0, -4.0, 2.5));
        let pair = Pair::new(&[], &turned);
        let output = pair.folder.path().join("out.ply");
        let settings = Settings { depth: Depth::Levels(7), ..Settings::default() };
        let limits = Limits { threads: 2, ..Limits::default() };
        let outcome = repair(&pair.original(), &output, Format::Ply, &settings, &limits, &Void);
        let outcome = outcome.expect("it is sound");
        let measured = outcome.deviation.expect("it is measured");
        assert_eq!(outcome.verdict, Verdict::Pass, "{number}: {:?}", outcome.reasons);
        assert_eq!((measured.lost.share, measured.invented_share), (0.0, 0.0), "{number}");
        let largest = measured.file_to_original.in_cells.expect("cells are known")[3];
        assert!(largest < 1.0, "{number}: {largest} cells");
        let kept = measured.creases.expect("they are followed").kept_share;
        // Facets of what is round meet at less than 30 degrees.
        assert!(kept.is_none_or(|kept| kept > 0.98), "{number}: {kept:?}");
        assert_eq!(kept.is_some(), number >= 2, "{number}");
        std::fs::rename(&output, pair.file()).expect("beside it");
        let found = pair.verified(&limits);
        assert_eq!(found.verdict, Verdict::Pass, "{number}: {}", reasons(&found));
        assert_eq!(found.file.genus, Some(i64::from(number == 1)));
        assert_eq!(found.file.genus, found.original.expect("it was compared").genus);
        // Both ways of measuring see the same.
        let found = found.deviation.expect("it was measured");
        let ratio = found.original_to_file.rms / measured.original_to_file.rms.max(1e-12);
        assert!(measured.original_to_file.rms < 1e-6 || (0.5..2.0).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_shifted_part_is_told() {
    let (one, other) = (cuboid([0.0; 3], [1.0; 3]), sphere([2.5, 0.5, 0.5], 0.6, 12));
    let original = [one.clone(), other.clone()].concat();
    let by = DVec3::new(0.0, 0.0, 0.1);
    let shifted = [one, transform(&other, glam::DMat3::IDENTITY, by)].concat();
    let found = verified(&shifted, &original);
    // The whole part is off, by a tenth; its normals too, by the slope of the ball.
    let words = "of what is seen of the original is lost";
    assert_told(&found, Verdict::Fail, words, &[&FAR[..], &["is invented", "normals"]].concat());
    let deviation = found.deviation.expect("it was measured");
    let largest = deviation.original_to_file.largest.expect("there are samples");
    assert!((0.09..=0.1001).contains(&largest.distance), "{}", largest.distance);
    assert!(largest.position[0] > 1.9, "it lies on the ball");
}

#[test]
fn a_lost_panel_is_told() {
    let body = cuboid([0.0; 3], [2.0, 1.0, 2.0]);
    let panel = cuboid([0.2, 1.1, 0.2], [1.0, 1.2, 1.0]);
    let original = [body.clone(), panel].concat();
    let found = verified(&body, &original);
    let also = [&FAR[..], &["components", "sharp edges", "volume"]].concat();
    assert_told(&found, Verdict::Review, "of what is seen of the original is lost", &also);
    let lost = found.deviation.expect("it was measured").lost;
    // Its back is seen as well, through the gap; what lies nearer than the tolerance is not.
    let share = 1.6 / (16.0 + 1.6);
    assert!((lost.share - share).abs() < 0.02, "{}", lost.share);
    assert!(lost.largest.expect("it is seen").position[1] > 1.19);
    // The other way around it is invented.
    let found = verified(&original, &body);
    assert!(reasons(&found).contains("is invented"), "{}", reasons(&found));
    assert_eq!(found.deviation.expect("it was measured").lost.share, 0.0);
}

/// A square frame with a square tunnel along z.
fn frame(hole: f64) -> Vec<Corners> {
    let ring = |half: f64, z: f64| {
        [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]
    };
    let (outer, inner) = ([ring(2.0, 0.0), ring(2.0, 1.0)], [ring(hole, 0.0), ring(hole, 1.0)]);
    let mut triangles = Vec::new();
    let mut quad = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| {
        triangles.extend([[a, b, c], [a, c, d]]);
    };
    for i in 0..4 {
        let j = (i + 1) % 4;
        quad(outer[0][i], outer[0][j], outer[1][j], outer[1][i]);
        quad(inner[0][j], inner[0][i], inner[1][i], inner[1][j]);
        quad(outer[1][i], outer[1][j], inner[1][j], inner[1][i]);
        quad(outer[0][j], outer[0][i], inner[0][i], inner[0][j]);
    }
    triangles
}

fn filled_tunnel() -> Pair {
    Pair::new(&cuboid([-2.0, -2.0, 0.0], [2.0, 2.0, 1.0]), &frame(0.25))
}

#[test]
fn a_filled_tunnel_is_told() {
    let found = filled_tunnel().verified(&Limits::default());
    let words = "The genus is 0, that of the original 1: tunnels were filled";
    let also = [&FAR[..], &["is lost", "is invented", "sharp edges"]].concat();
    assert_told(&found, Verdict::Review, words, &also);
    assert_eq!(found.original.expect("it was compared").genus, Some(1));
}

#[test]
fn an_inverted_shell_is_told() {
    let (one, mut other) = (cuboid([0.0; 3], [1.0; 3]), cuboid([2.0; 3], [3.0; 3]));
    let original = [one.clone(), other.clone()].concat();
    other.iter_mut().for_each(|corners| corners.swap(0, 1));
    let found = verified(&[one, other].concat(), &original);
    assert_told(
        &found,
        Verdict::Fail,
        "The file is not sound: 1 component oriented inward",
        &["volume"],
    );
    // Distances do not ask how triangles face.
    let deviation = found.deviation.expect("it was measured");
    assert_eq!((deviation.lost.share, deviation.invented_share), (0.0, 0.0));
    assert!(deviation.original_to_file.normals.p99_deg < 1e-3);
}

/// A beam along z with rounded edges, each in so many steps.
fn rounded_beam(radius: f64, steps: u32) -> Vec<Corners> {
    let mut profile = Vec::new();
    for (corner, [x, y]) in (0..4).zip([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) {
        for step in 0..=steps {
            let share = f64::from(corner) + f64::from(step) / f64::from(steps);
            let (sine, cosine) = (share * std::f64::consts::FRAC_PI_2).sin_cos();
            let inner = 1.0 - radius;
            profile.push([x * inner + radius * cosine, y * inner + radius * sine]);
        }
    }
    let mut triangles = Vec::new();
    for (at, &[x, y]) in profile.iter().enumerate() {
        let [next_x, next_y] = profile[(at + 1) % profile.len()];
        let at = |x: f64, y: f64, z: f64| [x, y, z];
        let (low, high) = (at(x, y, -4.0), at(x, y, 4.0));
        let (next_low, next_high) = (at(next_x, next_y, -4.0), at(next_x, next_y, 4.0));
        triangles.extend([[low, next_low, next_high], [low, next_high, high]]);
        triangles.push([at(0.0, 0.0, 4.0), high, next_high]);
        triangles.push([at(0.0, 0.0, -4.0), next_low, low]);
    }
    triangles
}

#[test]
fn a_smoothed_crease_is_told() {
    let original = cuboid([-1.0, -1.0, -4.0], [1.0, 1.0, 4.0]);
    let found = verified(&rounded_beam(0.2, 6), &original);
    assert_told(
        &found,
        Verdict::Review,
        "of the length of visible sharp edges is kept",
        &["is lost", "is invented"],
    );
    let creases = found.deviation.expect("it was measured").creases.expect("they were sought");
    assert!((creases.length - 48.0).abs() < 1e-9);
    // The four long ones are gone, and what is rounded of the others.
    let kept = creases.kept_share.expect("some are seen");
    assert!((0.28..0.34).contains(&kept), "{kept}");
    let place = creases.largest.expect("some are seen").position;
    assert!(place[0].abs() == 1.0 && place[1].abs() == 1.0, "{place:?}");
}

#[test]
fn originals_may_be_open_inverted_and_in_pieces() {
    let sound = [cuboid([0.0; 3], [1.0; 3]), sphere([3.0, 0.0, 0.0], 0.8, 12)].concat();
    let mut broken = sound.clone();
    broken.iter_mut().for_each(|corners| corners.swap(1, 2));
    broken.iter_mut().step_by(3).for_each(|corners| corners.swap(1, 2));
    broken.remove(100);
    broken.push(broken[40]);
    broken.push([[0.0; 3], [f64::NAN; 3], [1.0; 3]]);
    let found = verified(&sound, &broken);
    assert_eq!(found.verdict, Verdict::Pass, "{}", reasons(&found));
    let original = found.original.expect("it was compared");
    assert_eq!((original.genus, original.volume), (None, None));
    // As a file it fails, and is measured all the same.
    let found = verified(&broken, &sound);
    assert_eq!(found.verdict, Verdict::Fail);
    assert!(found.deviation.expect("it was measured").lost.share < 0.01);
}

#[test]
fn a_file_alone_is_proved_and_nothing_else() {
    let pair = Pair::new(&sphere([0.0; 3], 1.0, 5), &[]);
    let prove = || {
        let limits = Limits { work_dir: Some(pair.folder.path().into()), ..Limits::default() };
        verify_file(&pair.file(), None, &VerifySettings::default(), &limits, &Void)
    };
    let found = prove().expect("readable");
    assert_eq!((found.verdict, found.original, found.deviation), (Verdict::Pass, None, None));
    std::fs::write(pair.file(), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").expect("writable");
    let found = prove().expect("readable");
    assert_eq!(found.verdict, Verdict::Fail);
    assert!(reasons(&found).starts_with("The file is not sound: no triangle"));
}

#[test]
fn nothing_depends_on_threads_and_memory() {
    let mut random = Random::new(62);
    let shape = [torus(1.0, 0.4, 40, 20), sphere([0.0, 0.0, 0.2], 0.3, 8)].concat();
    let moved: Vec<Corners> = transform(&shape, rotation(&mut random), DVec3::splat(0.05));
    let pair = Pair::new(&moved, &shape);
    let found = |threads, share_bytes| {
        let found = pair.verified(&Limits { threads, share_bytes, ..Limits::default() });
        serde_json::to_string(&found).expect("plain data is always JSON")
    };
    let expected = found(1, None);
    for (threads, share_bytes) in [(8, None), (1, Some(16 << 10)), (8, Some(16 << 10))] {
        assert_eq!(found(threads, share_bytes), expected, "{threads} {share_bytes:?}");
    }
}

fn program(arguments: &[&str], pair: &Pair) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("verify").args(arguments).current_dir(pair.folder.path());
    command.output().expect("the program starts").into()
}

#[test]
fn the_program_ends_with_0_unless_the_verdict_is_fail() {
    let ball = sphere([0.0; 3], 1.0, 6);
    let pair = Pair::new(&ball, &sphere([0.0; 3], 1.03, 6));
    let against = |more: &[&'static str]| {
        let mut all = vec!["file.obj", "--against", "original.obj", "--samples", "2000"];
        all.extend(more);
        program(&all, &pair)
    };
    assert_eq!(program(&["file.obj"], &pair).code, Some(0));
    let ended = against(&["--max-lost", "5%", "--max-invented", "5%"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(ended.stdout.starts_with("file.obj: review\n"), "{}", ended.stdout);
    assert_eq!(against(&["--tolerance", "0.1"]).code, Some(0));
    assert_eq!(against(&["--max-deviation", "0.001,0.01"]).code, Some(4));
    assert_eq!(against(&["-q"]).stdout, "");
    for wrong in [
        &["--max-lost", "many"][..],
        &["--tolerance", "3mm"],
        &["--max-deviation", "3mm"],
        &["--samples", "0"],
        &["--max-memory", "1MiB"],
        &["--max-genus", "-1"],
    ] {
        let ended = against(wrong);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{wrong:?}");
    }
    assert_eq!(against(&["--tolerance", "3mm", "--units", "cm"]).code, Some(0));
    assert_eq!(program(&["file.obj", "--max-lost", "5%"], &pair).code, Some(2), "of what");
    let holes = Pair::new(&ball[3..], &ball);
    assert_eq!(program(&["file.obj"], &holes).code, Some(4));
}

#[test]
fn what_cannot_be_read_ends_with_65_and_one_line() {
    let pair = Pair::new(&sphere([0.0; 3], 1.0, 3), &[]);
    let path = |name: &str| pair.folder.path().join(name);
    std::fs::write(path("bad.ply"), "ply\nformat ascii 1.0\nelement vertex x\n").expect("writable");
    std::fs::write(path("flat.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").expect("writable");
    for arguments in [
        &["bad.ply"][..],
        &["missing.obj"],
        &["file.obj", "--against", "bad.ply"],
        &["file.obj", "--against", "missing.obj"],
        &["file.obj", "--against", "flat.obj"],
        &["bad.ply", "--against", "file.obj"],
    ] {
        let ended = program(arguments, &pair);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(65), ""), "{arguments:?}");
        ended.assert_says_one_line();
    }
    let names = std::fs::read_dir(pair.folder.path()).expect("listable").count();
    assert_eq!(names, 4, "something was left behind");
}

#[test]
fn the_report_of_a_filled_tunnel_is_what_it_was() {
    let pair = filled_tunnel();
    let arguments =
        ["file.obj", "--against", "original.obj", "--samples", "20000", "--cell", "0.01"];
    let told = program(&arguments, &pair);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    let expected = std::fs::read_to_string(testdata("verify/tunnel.txt")).unwrap_or_default();
    assert_eq!(told.stdout, expected, "{}", told.stdout);
    let json = program(&[&arguments[..], &["--json"]].concat(), &pair);
    let json: Verification = serde_json::from_str(&json.stdout).expect("JSON");
    let lines = told.stdout.lines().filter(|line| line.starts_with("  review: "));
    assert_eq!(lines.count(), json.reasons.len());
}

/// Fields that only some verifications have; their documentation says when.
const CONDITIONAL: [&str; 9] = [
    "proof.places[].ends",
    "proof.places[].vertices",
    "proof.places[].position",
    "proof.places[].vertex",
    "proof.places[].triangle",
    "proof.places[].corners",
    "proof.places[].triangles",
    "proof.places[].fans",
    "proof.places[].meeting",
];

#[test]
fn the_documentation_names_every_field_and_no_other() {
    let ball = sphere([0.0; 3], 1.0, 6);
    let pair = Pair::new(&ball[2..], &cuboid([-1.0; 3], [1.0; 3]));
    std::fs::write(pair.original(), welded_obj(&cuboid([-1.0; 3], [1.0; 3]))).expect("writable");
    let found = pair.verified(&Limits::default());
    let mut json = serde_json::to_value(&found).expect("plain data is always JSON");
    assert_eq!(json["schema"], VERIFICATION_VERSION);
    // The ball has no sharp edges, so none is far away.
    let creases = &json["deviation"]["creases"]["largest"];
    assert!(creases.is_null());
    json["deviation"]["creases"]["largest"] = json["deviation"]["lost"]["largest"].clone();
    check_document("docs/verify.md", &json, &CONDITIONAL);
}

#[test]
fn the_documented_defaults_are_those_of_the_program() {
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/verify.md"));
    let page = page.expect("the page is there");
    let settings = VerifySettings::default();
    for (flag, value) in [
        ("--tolerance", settings.tolerance.to_string()),
        ("--max-deviation", settings.max_deviation.to_string()),
        ("--max-lost", settings.max_lost.to_string()),
        ("--max-invented", settings.max_invented.to_string()),
        ("--max-normal", settings.max_normal.to_string()),
        ("--min-creases", settings.min_creases.to_string()),
        ("--max-volume", settings.max_volume.to_string()),
        ("--max-components", settings.max_components.to_string()),
        ("--max-genus", settings.max_genus.to_string()),
    ] {
        assert!(page.contains(&format!("| {flag} | `{value}` |")), "{flag} {value}");
    }
}

/// Corners of a coloured file, and what is red of a colour.
fn coloured(path: &Path) -> Vec<([f64; 3], u8)> {
    let scratch = Scratch::new(path.parent().expect("a folder"));
    let mut source = open(path, &scratch, &ReadOptions::in_scene(1 << 20)).expect("opens");
    let (mut batch, mut found) = (TriangleBatch::default(), Vec::new());
    while source.next_batch(&mut batch).expect("readable") {
        let colours = batch.colours.as_flattened().iter().map(|colour| colour[0]);
        found.extend(batch.corners.as_flattened().iter().copied().zip(colours));
    }
    found
}

#[test]
fn coloured_surfaces_show_what_was_lost_and_invented_and_where() {
    let (plate, ball) = (cuboid([0.0; 3], [4.0, 4.0, 1.0]), sphere([1.0, 1.0, 3.0], 0.5, 12));
    let block = cuboid([2.0, 2.0, 1.0], [3.0, 3.0, 2.0]);
    let pair = Pair::new(&[plate.clone(), block].concat(), &[plate, ball].concat());
    let export = |name: &str, more: &[&str]| {
        let out = pair.folder.path().join(name);
        let ended = program(
            &[&["file.obj", "--against", "original.obj", "--export", name], more].concat(),
            &pair,
        );
        assert!([Some(0), Some(4)].contains(&ended.code), "{}", ended.stderr);
        out
    };
    let out = export("out", &[]);
    // Grey is where both are the same; all that is hot is the ball or the block.
    for (name, is_part) in [
        ("original.ply", (|[_, _, z]: [f64; 3]| z > 2.0) as fn([f64; 3]) -> bool),
        ("file.ply", |[x, y, z]| {
            z > 1.0 || z == 1.0 && [x, y].iter().all(|c| (2.0..=3.0).contains(c))
        }),
    ] {
        let corners = coloured(&out.join(name));
        let grey = corners.iter().filter(|(_, red)| *red == 214).count();
        assert!(corners.len() > 1000 && grey > 0, "{name}: large faces are cut");
        for (corner, red) in corners {
            // The foot of the block lies on the plate.
            assert!(is_part(corner) || red == 214, "{name}: {corner:?} {red}");
            assert!(corner[2] <= 1.9 || red != 214, "{name}: {corner:?} {red}");
        }
    }
    let entries = std::fs::read_dir(&out).expect("listable");
    let mut names: Vec<_> = entries.map(|entry| entry.expect("listable").file_name()).collect();
    names.sort();
    assert_eq!(names, ["file.ply", "original.ply"], "nothing else is left");
    let again = export("again", &["--threads", "3", "--max-memory", "64MiB"]);
    for name in ["original.ply", "file.ply"] {
        let bytes = |folder: &Path| std::fs::read(folder.join(name)).expect("there");
        assert_eq!(bytes(&out), bytes(&again), "{name}");
    }
}

#[test]
fn an_export_never_replaces_what_is_compared() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let pair = Pair::new(&cube, &cube);
    let path = pair.folder.path().join("file.ply");
    std::os::unix::fs::symlink(pair.file(), &path).expect("linked");
    let ended = program(&["file.obj", "--against", "original.obj", "--export", "."], &pair);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("choose another folder"), "{}", ended.stderr);
    assert_eq!(std::fs::read_to_string(pair.file()).expect("there"), welded_obj(&cube));
}

#[test]
fn an_export_without_anything_to_measure_says_so_and_leaves_no_file() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let flat = [[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]];
    let pair = Pair::new(&flat, &cube);
    let ended = program(&["file.obj", "--against", "original.obj", "--export", "out"], &pair);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    ended.assert_says_one_line();
    assert!(ended.stderr.contains("has no area"), "{}", ended.stderr);
    let out = pair.folder.path().join("out");
    assert!(std::fs::read_dir(out).map_or(0, Iterator::count) == 0);
}
