//! Inspections: each injected defect is found, clean shapes are sound, nothing depends on memory or
//! threads, and `docs/inspect.md` names every field.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use brickmend::defect::{Defect, DefectKind};
use brickmend::mesh::shapes::{
    Corners, Random, cuboid, gear, rotation, sphere, tetrahedron, torus, transform,
};
use brickmend::monitor::Void;
use brickmend::repair::{INSPECTION_VERSION, InspectSettings, Inspection, Limits, inspect};
use glam::DVec3;
use tempfile::TempDir;

use crate::support::breakage::Breakage;
use crate::support::obj::unwelded_obj;
use crate::support::program::Ended;
use crate::support::schema::check_document;
use crate::support::testdata;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn limits(folder: &Path) -> Limits {
    Limits { work_dir: Some(folder.to_path_buf()), threads: 2, ..Limits::default() }
}

fn inspected(model: &Path) -> Inspection {
    let folder = folder();
    inspect(model, &InspectSettings::default(), &limits(folder.path()), &Void).expect("readable")
}

fn inspected_text(text: &str) -> Inspection {
    let folder = folder();
    let path = folder.path().join("model.obj");
    std::fs::write(&path, text).expect("writable");
    inspected(&path)
}

fn count(inspection: &Inspection, kind: DefectKind) -> u64 {
    let own = inspection.findings.iter().find(|finding| finding.kind == kind);
    own.map_or(0, |finding| finding.count)
}

fn program(arguments: &[&str], models: &[&Path]) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("inspect").args(arguments).args(models).current_dir(env!("CARGO_TARGET_TMPDIR"));
    command.output().expect("the program starts").into()
}

#[test]
fn clean_shapes_are_sound_in_any_pose() {
    let mut random = Random::new(31);
    let shapes = [
        sphere([0.3, -0.2, 0.1], 1.0, 7),
        torus(1.0, 0.45, 20, 10),
        cuboid([-1.0, 0.0, 2.0], [1.0, 0.5, 2.5]),
        gear(9, 0.7, 1.0, 0.4),
        tetrahedron([1.0, 2.0, 3.0], 4.0),
    ];
    for shape in &shapes {
        for _ in 0..4 {
            let turned = transform(shape, rotation(&mut random), DVec3::new(10.0, -4.0, 2.5));
            let found = inspected_text(&unwelded_obj(&turned));
            assert!(found.is_sound);
            let notes: Vec<_> = found.notes().map(|finding| finding.kind).collect();
            // Every triangle has vertices of its own.
            assert_eq!(notes, [DefectKind::CoincidentVertices]);
            let size = &found.size;
            assert_eq!(size.merged_vertices, 3 * size.triangles - size.vertices);
            let volume = size.volume.expect("it is closed");
            assert!((volume / brickmend::mesh::shapes::volume(&turned) - 1.0).abs() < 1e-9);
            assert_eq!(size.euler_characteristic, if turned.len() == 400 { 0 } else { 2 });
            assert!(found.repair.is_some());
        }
    }
}

/// What each breakage brings, and that nothing else is called what it is not.
#[test]
fn every_breakage_is_found_under_its_name() {
    let mut random = Random::new(33);
    let whole = transform(&sphere([0.0; 3], 1.0, 10), rotation(&mut random), DVec3::ONE);
    let edges = whole.len() as u64 / 2 * 3;
    for breakage in Breakage::ALL {
        let mut soup = whole.clone();
        breakage.apply(&mut soup, 0.05, &mut random);
        let added = (soup.len() - whole.len().min(soup.len())) as u64;
        let found = inspected_text(&unwelded_obj(&soup));
        let counts = |kind| count(&found, kind);
        let lost = whole.len().saturating_sub(soup.len()) as u64;
        match breakage {
            Breakage::Drop => {
                assert!(lost > 10);
                let open = counts(DefectKind::BoundaryEdge);
                assert!(open <= 3 * lost && open > 2 * lost);
                assert!((1..=lost).contains(&counts(DefectKind::OpenLoop)));
                assert_eq!(counts(DefectKind::NonmanifoldEdge), 0);
            }
            Breakage::Flip => {
                assert!(counts(DefectKind::InconsistentEdge) > 20);
                assert_eq!(found.size.volume, None);
                assert_eq!(counts(DefectKind::BoundaryEdge), 0);
            }
            Breakage::Duplicate => {
                assert!(added > 10);
                assert_eq!(counts(DefectKind::DuplicateTriangle), added);
                assert_eq!(counts(DefectKind::OverlappingTriangles), 0);
            }
            Breakage::Jitter => {
                assert_eq!(counts(DefectKind::BoundaryEdge), 3 * whole.len() as u64);
                assert_eq!(counts(DefectKind::OpenShell), whole.len() as u64);
                assert!(counts(DefectKind::IntersectingTriangles) > 100);
            }
            Breakage::Split => {
                // Where both triangles at an edge are cut, both cuts lie on the other's edge.
                assert!(added > 10);
                assert_eq!(counts(DefectKind::TJunction), added);
            }
            Breakage::Fin => {
                assert!(added > 10);
                assert!(counts(DefectKind::Fin) + 3 > added && counts(DefectKind::Fin) <= added);
                assert!(counts(DefectKind::NonmanifoldEdge) >= counts(DefectKind::Fin));
            }
            Breakage::NotANumber => {
                assert_eq!(counts(DefectKind::NonfiniteTriangle), added);
                assert_eq!(counts(DefectKind::BoundaryEdge), 0);
                assert_eq!(found.size.edges, edges);
            }
            Breakage::Far | Breakage::Tiny => {
                let diagonal = found.size.diagonal;
                assert!(diagonal > 0.0);
                // A millionth of rounding far out may fold a triangle, never open the ball.
                assert_eq!(counts(DefectKind::BoundaryEdge), 0);
                assert_eq!(found.shells.count, 1);
            }
        }
    }
}

#[test]
fn pairs_are_told_by_how_they_meet() {
    let kinds = |soup: &[Corners]| {
        let found = inspected_text(&unwelded_obj(soup));
        [
            DefectKind::IntersectingTriangles,
            DefectKind::OverlappingTriangles,
            DefectKind::TouchingTriangles,
        ]
        .map(|kind| count(&found, kind))
    };
    let floor = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let at = |z: f64| [[1.0, 1.0, z], [1.0, 1.0, z + 1.0], [1.5, 1.0, z + 0.5]];
    assert_eq!(kinds(&[floor, at(-0.5)]), [1, 0, 0]);
    assert_eq!(kinds(&[floor, at(0.0)]), [0, 0, 1]);
    assert_eq!(kinds(&[floor, at(0.1)]), [0, 0, 0]);
    let flat = floor.map(|[x, y, z]| [x * 0.25 + 1.0, y * 0.25 + 1.0, z]);
    assert_eq!(kinds(&[floor, flat]), [0, 1, 0]);
}

/// A ball in a box; light passes the box or not.
fn ball_in_box(dissolve: f64) -> Inspection {
    let folder = folder();
    let mut soup = cuboid([-1.0; 3], [1.0; 3]);
    soup.extend(sphere([0.0; 3], 0.5, 4));
    let text = unwelded_obj(&soup).replacen("f 1 2 3", "usemtl wall\nf 1 2 3", 1);
    let text = text.replacen("f 37 38 39", "usemtl ball\nf 37 38 39", 1);
    let model = folder.path().join("model.obj");
    std::fs::write(&model, format!("mtllib model.mtl\n{text}")).expect("writable");
    let library = format!("newmtl wall\nd {dissolve}\nnewmtl ball\nd 1\n");
    std::fs::write(folder.path().join("model.mtl"), library).expect("writable");
    inspected(&model)
}

#[test]
fn what_lies_behind_glass_is_not_hidden() {
    let opaque = ball_in_box(1.0);
    assert_eq!(count(&opaque, DefectKind::HiddenShell), 1);
    let glass = ball_in_box(0.4);
    assert_eq!(count(&glass, DefectKind::HiddenShell), 0);
    assert_eq!(glass.materials.count, 2);
    assert_eq!(glass.materials.largest[0].name, "ball");
}

/// One of every kind of defect.
fn menagerie() -> String {
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    // Hidden in the box.
    soup.extend(sphere([0.5; 3], 0.2, 3));
    // A thin plate through which another box goes.
    soup.extend(cuboid([2.0, 0.0, 0.0], [3.0, 1.0, 0.003]));
    soup.extend(cuboid([2.25, 0.25, -0.5], [2.5, 0.5, 0.5]));
    // Overlaps a face of the first box.
    soup.push([[0.2, 0.1, 1.0], [0.4, 0.1, 1.0], [0.2, 0.4, 1.0]]);
    // Inside out, with a fin, a doubled triangle, and one that is flat.
    let mut ball = sphere([5.0, 0.0, 0.0], 1.0, 4);
    ball.iter_mut().for_each(|corners| corners.swap(1, 2));
    soup.extend(&ball);
    let ball = sphere([8.0, 0.0, 0.0], 1.0, 4);
    soup.extend(&ball);
    let [p, q, _] = ball[0];
    soup.push([q, p, [8.0, 2.0, 2.0]]);
    soup.push(ball[9]);
    soup.push([[8.0, 5.0, 0.0], [8.5, 5.0, 0.0], [9.0, 5.0, 0.0]]);
    // A neighbour that faces the other way, and one that touches it in a point.
    let (o, x, y) = ([0.0, 5.0, 0.0], [1.0, 5.0, 0.0], [0.0, 6.0, 0.0]);
    soup.extend([[o, x, y], [x, y, [1.0, 6.0, 0.0]], [o, [-1.0, 5.0, 0.0], [0.0, 4.0, 0.0]]]);
    // A vertex on an edge.
    soup.extend([
        [[3.0, 5.0, 0.0], [5.0, 5.0, 0.0], [4.0, 6.0, 0.0]],
        [[4.0, 5.0, 0.0], [3.0, 5.0, 0.0], [3.5, 4.0, 0.0]],
    ]);
    soup.extend(tetrahedron([-1.0, 0.0, 0.0], 0.01));
    soup.push([[f64::NAN; 3], [0.0; 3], [1.0; 3]]);
    let vertices = 3 * soup.len();
    format!("{}v 1 2 3\nf 1 2 {}\nf 1 2\n", unwelded_obj(&soup), vertices + 100)
}

#[test]
fn the_documentation_names_every_field_and_no_other() {
    let mut all = inspected_text(&menagerie());
    let kinds: BTreeSet<_> = all.findings.iter().map(|finding| finding.kind).collect();
    let missing: Vec<_> = DefectKind::ALL.iter().filter(|kind| !kinds.contains(kind)).collect();
    assert!(missing.is_empty(), "not found: {missing:?}");
    for finding in &all.findings {
        let is_listed = finding.places.iter().all(|place| place.kind() == finding.kind);
        assert!(is_listed, "{:?} has places of another kind", finding.kind);
        let has_none = matches!(finding.kind, DefectKind::WildFace | DefectKind::ShortFace);
        assert_eq!(finding.places.is_empty(), has_none, "{:?}", finding.kind);
    }
    let ranks: Vec<_> = all.findings.iter().map(|found| (found.is_note, found.kind)).collect();
    assert!(ranks.is_sorted(), "worst first, remarks last");
    all.size.unit = None;
    let json = serde_json::to_value(&all).expect("plain data is always JSON");
    assert_eq!(json["schema"], INSPECTION_VERSION);
    check_document("docs/inspect.md", &json, &[]);
    let page = std::fs::read_to_string("docs/inspect.md").expect("the page is there");
    for kind in DefectKind::ALL {
        let name = serde_json::to_value(kind).expect("plain data is always JSON");
        let name = name.as_str().expect("kinds are words");
        let word = |c: char| !(c.is_alphanumeric() || c == '_');
        assert!(page.split(word).any(|own| own == name), "the page does not explain {name}");
    }
}

#[test]
fn the_report_of_the_cabinet_is_what_it_was() {
    let model = testdata("models/cabinet.obj");
    let golden = |name: &str| -> PathBuf { testdata("inspect").join(name) };
    let text = program(&[], &[&model]);
    assert_eq!(text.code, Some(0), "{}", text.stderr);
    // Without the path, and without the estimate, which has tests of its own.
    let told = text.stdout.replace(&*model.to_string_lossy(), "cabinet.obj");
    let told: String = told
        .lines()
        .filter(|line| !line.contains(" would take "))
        .map(|l| format!("{l}\n"))
        .collect();
    let expected =
        std::fs::read_to_string(golden("cabinet.txt")).expect("the golden text is there");
    assert_eq!(told, expected);
    let json = program(&["--json"], &[&model]);
    assert_eq!(json.stdout.lines().count(), 1);
    let mut told: serde_json::Value = serde_json::from_str(&json.stdout).expect("JSON");
    for field in ["path", "version", "repair"] {
        told.as_object_mut().expect("an object").remove(field).expect("the field is there");
    }
    let expected =
        std::fs::read_to_string(golden("cabinet.json")).expect("the golden JSON is there");
    let expected: serde_json::Value = serde_json::from_str(&expected).expect("JSON");
    assert_eq!(told, expected, "{told:#}");
}

#[test]
fn check_ends_with_4_where_there_are_defects_and_a_bad_file_is_one_line() {
    let folder = folder();
    let [sound, open] = ["models/cube.off", "models/bowl.obj"].map(testdata);
    let dusty = testdata("defects/isolated_vertices/model.obj");
    assert_eq!(program(&["--check"], &[&sound]).code, Some(0));
    assert_eq!(program(&["--check"], &[&dusty]).code, Some(0), "a remark is no defect");
    assert_eq!(program(&["--check"], &[&sound, &open]).code, Some(4));
    assert_eq!(program(&[], &[&open]).code, Some(0));
    let bad = folder.path().join("bad.ply");
    std::fs::write(&bad, "ply\nformat ascii 1.0\nelement vertex 3\n").expect("writable");
    let empty = folder.path().join("empty.obj");
    std::fs::write(&empty, "v 0 0 0\n").expect("writable");
    let ended = program(&["--check", "--json"], &[&bad, &open, &empty, &sound]);
    assert_eq!(ended.code, Some(65));
    assert_eq!(ended.stdout.lines().count(), 2, "the others are told");
    assert_eq!(ended.stderr.lines().count(), 2, "{}", ended.stderr);
    assert!(ended.stderr.contains("bad.ply") && ended.stderr.contains("empty.obj"));
    assert_eq!(program(&["--thin", "1mm"], &[&open]).code, Some(2), "the file states no unit");
    assert_eq!(program(&["--thin", "1mm", "--units", "mm"], &[&open]).code, Some(0));
    assert_eq!(program(&["--max-memory", "8MiB"], &[&open]).code, Some(2));
    assert_eq!(program(&["-q"], &[&open]).stdout, "");
    let told = program(&["-v"], &[&open]).stdout;
    assert!(told.contains("has one triangle only") && told.contains("repair: "), "{told}");
}

/// Many solids, some of them broken.
fn heap(random: &mut Random) -> Vec<Corners> {
    let mut soup = Vec::new();
    for number in 0..40 {
        let at = DVec3::from(random.point()) * 3.0;
        let mut solid = transform(&sphere([0.0; 3], 0.6, 6), rotation(random), at);
        Breakage::ALL[number % 7].apply(&mut solid, 0.03, random);
        soup.extend(solid);
    }
    soup
}

#[test]
fn neither_memory_nor_threads_change_anything() {
    let folder = folder();
    let model = folder.path().join("heap.obj");
    std::fs::write(&model, unwelded_obj(&heap(&mut Random::new(35)))).expect("writable");
    let look = |share_bytes: Option<u64>, threads: usize| {
        let limits = Limits { share_bytes, threads, ..limits(folder.path()) };
        let found = inspect(&model, &InspectSettings::default(), &limits, &Void);
        // What a repair would take depends on what it may take.
        Inspection { repair: None, ..found.expect("readable") }
    };
    let ample = look(None, 1);
    assert!(!ample.is_sound && ample.defects().count() > 8);
    for (share_bytes, threads) in [(None, 4), (Some(128 << 10), 1), (Some(128 << 10), 3)] {
        assert_eq!(ample, look(share_bytes, threads), "{share_bytes:?}, {threads} threads");
    }
    let names = std::fs::read_dir(folder.path()).expect("listable").count();
    assert_eq!(names, 1, "nothing is left behind");
}

#[test]
fn memory_stays_within_the_budget() {
    const BUDGET: u64 = 64 << 20;
    let folder = folder();
    let model = folder.path().join("ball.obj");
    // Its triangles alone, with what is noted of each, are larger than the budget.
    let ball = sphere([0.0; 3], 1.0, 200);
    std::fs::write(&model, unwelded_obj(&ball)).expect("writable");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.args(["inspect", "-q", "--max-memory", "64MiB", "-j", "2", "--work-dir"]);
    let mut child = command.arg(folder.path()).arg(&model).spawn().expect("the program starts");
    let status = PathBuf::from(format!("/proc/{}/status", child.id()));
    let mut peak = 0;
    let code = loop {
        // The kernel keeps the peak, so that what is between two looks counts.
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse().ok());
        peak = peak.max(kib.unwrap_or(0_u64) << 10);
        if let Some(ended) = child.try_wait().expect("a child of ours") {
            break ended.code();
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    };
    assert_eq!(code, Some(0));
    assert!(peak > 8 << 20 && peak <= BUDGET, "{peak} bytes");
    assert_eq!(std::fs::read_dir(folder.path()).expect("listable").count(), 1);
}

#[test]
fn files_that_lie_are_one_clear_line() {
    let folder = folder();
    let cube = std::fs::read(testdata("models/cube_binary.stl")).expect("the cube is there");
    let mut many = cube.clone();
    many[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let cases: [(&str, &[u8]); 5] = [
        ("nothing.obj", b""),
        ("text.stl", b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0"),
        ("cut.stl", &cube[..cube.len() - 7]),
        ("many.stl", &many),
        ("zip.3mf", b"PK\x03\x04 no archive"),
    ];
    for (name, content) in cases {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("writable");
        let ended = program(&["--json"], &[&path]);
        assert_eq!(ended.code, Some(65), "{name}: {}", ended.stderr);
        ended.assert_says_one_line();
        assert!(ended.stderr.contains(name) && ended.stdout.is_empty());
    }
    // Far apart, tiny, huge and infinite: a report each.
    for scale in [1e-300, 1e-30, 1e30, 1e150, 1e300] {
        let soup: Vec<Corners> =
            cuboid([0.0; 3], [1.0; 3]).iter().map(|t| t.map(|p| p.map(|x| x * scale))).collect();
        let found = inspected_text(&unwelded_obj(&soup));
        assert_eq!((found.shells.closed, found.shells.count), (1, 1), "{scale}");
        let harmful: Vec<_> = found.defects().map(|finding| finding.kind).collect();
        assert_eq!(harmful, [], "{scale}");
    }
    let nan = inspected_text(&unwelded_obj(&[[[f64::NAN; 3]; 3]]));
    assert!(!nan.is_sound && nan.repair.is_none() && nan.size.bounds.is_none());
    assert!(matches!(nan.findings[0].places[0], Defect::NonfiniteTriangle(_)));
}
