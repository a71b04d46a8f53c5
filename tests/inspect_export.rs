//! Exports of an inspection: exactly the points, edges and triangles with a defect, the same bytes for
//! any number of threads and any memory.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use brickmend::defect::{DefectKind, Marked};
use brickmend::mesh::shapes::{Corners, Random, cuboid, sphere};
use brickmend::monitor::Void;
use brickmend::repair::{InspectSettings, Limits, inspect_exporting};

use crate::support::breakage::Breakage;
use crate::support::obj::welded_obj;
use crate::support::program::Ended;

const LIMITS: [[&str; 2]; 3] = [["1", "64MiB"], ["4", "64MiB"], ["4", "1GiB"]];

fn write_obj(path: &Path, triangles: &[Corners]) {
    std::fs::write(path, welded_obj(triangles)).expect("writable");
}

fn export(model: &Path, folder: &Path, [threads, memory]: [&str; 2]) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.args(["inspect", "-q", "-j", threads, "--max-memory", memory, "--export"]);
    command.arg(folder).arg(model).current_dir(env!("CARGO_TARGET_TMPDIR"));
    command.output().expect("the program starts").into()
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    entries.map(|e| e.expect("readable").file_name().into_string().expect("text")).collect()
}

/// Points of each shape, and the triangle or vertex that it is of.
fn shapes(path: &Path) -> Vec<(Vec<[f64; 3]>, u32)> {
    let bytes = std::fs::read(path).expect("the file is there");
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let head = std::str::from_utf8(&bytes[..at]).expect("text");
    let count = |element: &str| -> Option<usize> {
        let start = format!("element {element} ");
        let line = head.lines().find_map(|line| line.strip_prefix(&start))?;
        Some(line.parse().expect("a count"))
    };
    let vertices = count("vertex").expect("vertices");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    // The number of a face stands with it, all others with vertices.
    let (corners, is_face) = match (count("edge"), count("face")) {
        (Some(_), _) => (2, false),
        (_, Some(_)) => (3, true),
        _ => (1, false),
    };
    let vertex_bytes = if is_face { 24 } else { 28 };
    let position = |vertex: usize, axis: usize| {
        assert!(vertex < vertices);
        let from = at + vertex_bytes * vertex + 8 * axis;
        f64::from_le_bytes(bytes[from..from + 8].try_into().expect("eight"))
    };
    let record = if is_face { 17 } else { 4 * corners };
    let (elements, record) = match count("edge").or(count("face")) {
        Some(elements) => (elements, record),
        None => (vertices, 0),
    };
    assert_eq!(bytes.len(), at + vertex_bytes * vertices + record * elements);
    let shape = |element: usize| {
        let from = at + vertex_bytes * vertices + record * element + usize::from(is_face);
        assert!(!is_face || bytes[from - 1] == 3);
        let vertex = |corner: usize| match record {
            0 => element,
            _ => word(from + 4 * corner) as usize,
        };
        let points =
            (0..corners).map(|corner| std::array::from_fn(|axis| position(vertex(corner), axis)));
        let number = |vertex: usize| word(at + vertex_bytes * vertex + 24);
        let number = if is_face { word(from + 12) } else { number(vertex(0)) };
        (points.collect(), number)
    };
    (0..elements).map(shape).collect()
}

fn numbers(shapes: &[(Vec<[f64; 3]>, u32)]) -> Vec<u32> {
    shapes.iter().map(|(_, number)| *number).collect()
}

fn points(shapes: &[(Vec<[f64; 3]>, u32)]) -> Vec<[f64; 3]> {
    shapes.iter().map(|(points, _)| points[0]).collect()
}

/// Exports under all limits; answers the files, which are the same each time.
fn exported(model: &[Corners], expected: &[&str]) -> tempfile::TempDir {
    exported_text(&welded_obj(model), expected)
}

/// The same of a file with this text.
fn exported_text(text: &str, expected: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.obj");
    std::fs::write(&path, text).expect("writable");
    let mut first = None;
    for limits in LIMITS {
        let out = folder.path().join("out");
        let ended = export(&path, &out, limits);
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{limits:?}");
        assert_eq!(names(&out), expected.iter().map(|&name| name.to_owned()).collect());
        let bytes: Vec<_> =
            expected.iter().map(|name| std::fs::read(out.join(name)).expect("there")).collect();
        assert!(first.get_or_insert_with(|| bytes.clone()) == &bytes, "{limits:?} differ");
    }
    folder
}

#[test]
fn a_box_without_a_lid_has_its_four_edges() {
    let mut model = cuboid([0.0; 3], [1.0, 2.0, 3.0]);
    model.retain(|corners| corners.iter().any(|corner| corner[2] < 3.0));
    assert_eq!(model.len(), 10);
    let folder = exported(&model, &["boundary_edge.ply", "open_shell.ply"]);
    let shell = shapes(&folder.path().join("out/open_shell.ply"));
    assert_eq!(numbers(&shell), (0..10).collect::<Vec<_>>());
    let edges = shapes(&folder.path().join("out/boundary_edge.ply"));
    let mut found = BTreeSet::new();
    for (ends, triangle) in &edges {
        let own = model[*triangle as usize];
        assert!(ends.iter().all(|end| own.contains(end)), "an edge of its triangle");
        let mut ends: Vec<_> = ends.iter().map(|end| end.map(|x| x as i64)).collect();
        ends.sort_unstable();
        found.insert(ends);
    }
    let rim = [[[0, 0], [0, 2]], [[0, 0], [1, 0]], [[0, 2], [1, 2]], [[1, 0], [1, 2]]];
    let rim = rim.map(|ends| ends.map(|[x, y]| [x, y, 3]).to_vec());
    assert_eq!(edges.len(), 4);
    assert_eq!(found, BTreeSet::from(rim));
}

#[test]
fn a_bar_through_a_cube_has_the_triangles_that_cross_and_no_others() {
    // The bar goes through the sides at z = 0 and z = 4, off their diagonals: one triangle of each.
    let mut model = cuboid([0.0; 3], [4.0; 3]);
    model.extend(cuboid([2.5, 0.5, -1.0], [3.5, 1.0, 5.0]));
    let folder = exported(&model, &["intersecting_triangles.ply"]);
    let found = shapes(&folder.path().join("out/intersecting_triangles.ply"));
    for (points, triangle) in &found {
        assert_eq!(points[..], model[*triangle as usize]);
    }
    let through = |triangle: &Corners, z: f64| triangle.iter().all(|corner| corner[2] == z);
    let covers = |triangle: &Corners| {
        let (x, y) = (3.0, 0.75);
        let side = |a: [f64; 3], b: [f64; 3]| {
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0.0
        };
        let [a, b, c] = *triangle;
        side(a, b) == side(b, c) && side(b, c) == side(c, a)
    };
    let pierced = |t: &Corners| (through(t, 0.0) || through(t, 4.0)) && covers(t);
    let mut expected: BTreeSet<u32> =
        (0..).zip(&model[..12]).filter(|(_, t)| pierced(t)).map(|(number, _)| number).collect();
    assert_eq!(expected.len(), 2);
    // The eight triangles along the bar, not those at its ends.
    let along = |t: &Corners| !through(t, -1.0) && !through(t, 5.0);
    expected.extend((12..).zip(&model[12..]).filter(|(_, t)| along(t)).map(|(number, _)| number));
    assert_eq!(expected.len(), 10);
    assert_eq!(found.len(), 10, "each once");
    assert_eq!(found.iter().map(|(_, triangle)| *triangle).collect::<BTreeSet<_>>(), expected);
}

#[test]
fn copies_and_what_they_hide_are_told_by_kind_and_old_files_go() {
    let mut model = cuboid([0.0; 3], [4.0; 3]);
    model.extend(cuboid([1.0; 3], [2.0; 3]));
    model.push(model[3]);
    let files = ["duplicate_triangle.ply", "hidden_shell.ply", "nonmanifold_edge.ply"];
    let folder = exported(&model, &files);
    let out = folder.path().join("out");
    let numbers_of = |name: &str| numbers(&shapes(&out.join(name)));
    assert_eq!(numbers_of(files[0]), [24]);
    assert_eq!(numbers_of(files[1]), (12..24).collect::<Vec<_>>());
    assert_eq!(numbers_of(files[2]).len(), 3);
    let sound = folder.path().join("sound.obj");
    write_obj(&sound, &cuboid([0.0; 3], [4.0; 3]));
    std::fs::write(out.join("mine.ply"), "mine").expect("writable");
    assert_eq!(export(&sound, &out, LIMITS[0]).code, Some(0));
    assert_eq!(names(&out), BTreeSet::from(["mine.ply".to_owned()]));
}

#[test]
fn the_input_is_never_replaced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("fin.ply");
    write_obj(&model, &cuboid([0.0; 3], [4.0; 3]));
    let before = std::fs::read(&model).expect("there");
    let ended = export(&model, folder.path(), LIMITS[0]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("input itself"), "{}", ended.stderr);
    assert_eq!(std::fs::read(&model).expect("there"), before);
}

#[test]
fn vertices_are_points_with_their_triangles_or_numbers() {
    // Two tetrahedra that touch in the origin; vertex 1 is listed twice, and two more are unused.
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -1 0 0\nv 0 -1 0\nv 0 0 -1\nv 0 0 0\n\
                v 8 8 8\nf 2 4 3\nf 2 3 5\nf 2 5 4\nf 3 4 5\nf 9 6 7\nf 9 8 6\nf 9 7 8\nf 6 8 7\n";
    let files = ["coincident_vertices.ply", "isolated_vertex.ply", "nonmanifold_vertex.ply"];
    let folder = exported_text(text, &files);
    let of = |name: &str| shapes(&folder.path().join("out").join(name));
    // The copy, by the first triangle that names it; and by the first of both what touches.
    assert_eq!((points(&of(files[0])), numbers(&of(files[0]))), (vec![[0.0; 3]], vec![4]));
    assert_eq!((points(&of(files[2])), numbers(&of(files[2]))), (vec![[0.0; 3]], vec![0]));
    let lonely = of(files[1]);
    assert_eq!((points(&lonely), numbers(&lonely)), (vec![[9.0; 3], [8.0; 3]], vec![0, 9]));
}

#[test]
fn a_vertex_on_an_edge_is_a_point() {
    // Two triangles meet a longer one in the middle of its edge.
    let model = [
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 2.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, -1.0, 0.0]],
        [[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, -1.0, 0.0]],
    ];
    let files = [
        "boundary_edge.ply",
        "nonmanifold_vertex.ply",
        "open_shell.ply",
        "t_junction.ply",
        "touching_triangles.ply",
    ];
    let folder = exported(&model, &files);
    let found = shapes(&folder.path().join("out/t_junction.ply"));
    assert_eq!((points(&found), numbers(&found)), (vec![[1.0, 0.0, 0.0]], vec![1]));
}

#[test]
fn shells_and_walls_are_all_of_their_triangles() {
    // A cube, a small one inside out beside it, a plate, and a triangle without an area.
    let mut model = cuboid([0.0; 3], [100.0; 3]);
    let mut inverted = cuboid([200.0, 0.0, 0.0], [200.1, 0.1, 0.1]);
    inverted.iter_mut().for_each(|corners| corners.swap(1, 2));
    model.extend(inverted);
    model.extend(cuboid([300.0, 0.0, 0.0], [400.0, 100.0, 0.1]));
    model.push([[500.0, 0.0, 0.0], [501.0, 0.0, 0.0], [502.0, 0.0, 0.0]]);
    let files = [
        "boundary_edge.ply",
        "degenerate_triangle.ply",
        "inward_component.ply",
        "open_shell.ply",
        "t_junction.ply",
        "thin_wall.ply",
        "tiny_shell.ply",
    ];
    let folder = exported(&model, &files);
    let of = |name: &str| numbers(&shapes(&folder.path().join("out").join(name)));
    assert_eq!(of("degenerate_triangle.ply"), [36]);
    assert_eq!((of("open_shell.ply"), of("t_junction.ply")), (vec![36], vec![36]));
    assert_eq!(of("inward_component.ply"), (12..24).collect::<Vec<_>>());
    let small = of("tiny_shell.ply");
    assert_eq!(small, (12..24).chain([36]).collect::<Vec<_>>());
    let plate: Vec<u32> =
        (24..).zip(&model[24..36]).filter(|(_, t)| flat(t)).map(|(number, _)| number).collect();
    assert_eq!((of("thin_wall.ply"), plate.len()), (plate, 4));
}

/// Whether a triangle lies across the third axis.
fn flat(triangle: &Corners) -> bool {
    triangle.iter().all(|corner| corner[2] == triangle[0][2])
}

/// A ball in scattered pieces, with holes, fins, copies and flat triangles.
fn broken(steps: u32) -> Vec<Corners> {
    let mut random = Random::new(77);
    let mut soup = sphere([0.0; 3], 1.0, steps);
    for breakage in [Breakage::Drop, Breakage::Split, Breakage::Duplicate, Breakage::Fin] {
        breakage.apply(&mut soup, 0.2, &mut random);
    }
    Breakage::Flip.apply(&mut soup, 0.1, &mut random);
    soup.extend(soup.clone().iter().step_by(9).map(|&[a, b, _]| [a, b, b.map(|x| 2.0 * x)]));
    soup.extend(soup.clone().iter().step_by(11).map(|&[a, b, _]| [a, b, a]));
    soup
}

#[test]
fn every_kind_that_is_told_is_exported_as_often_as_it_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (path, out) = (folder.path().join("model.obj"), folder.path().join("out"));
    let lonely = "v 7 7 7\nv 7 7 7.5\n";
    std::fs::write(&path, welded_obj(&broken(24)) + lonely).expect("writable");
    let limits = Limits { work_dir: Some(folder.path().to_path_buf()), ..Limits::default() };
    let settings = InspectSettings::default();
    let found = inspect_exporting(&path, &settings, Some(&out), &limits, &Void).expect("readable");
    let mut told = BTreeSet::new();
    for finding in &found.findings {
        let Some(marked) = Marked::with(finding.kind) else { continue };
        let word = serde_json::to_value(finding.kind).expect("a kind is a word");
        let name = format!("{}.ply", word.as_str().expect("a kind is a word"));
        let shapes = shapes(&out.join(&name)).len() as u64;
        match finding.kind {
            // Shells and fins have several triangles, pairs share some.
            DefectKind::OpenShell
            | DefectKind::TinyShell
            | DefectKind::HiddenShell
            | DefectKind::InwardComponent
            | DefectKind::Fin => assert!(shapes >= finding.count, "{name}"),
            DefectKind::IntersectingTriangles
            | DefectKind::OverlappingTriangles
            | DefectKind::TouchingTriangles => assert!(shapes >= 2, "{name}"),
            _ => assert_eq!(shapes, finding.count, "{name} {marked:?}"),
        }
        told.insert(name);
    }
    assert!(told.len() > 10, "{told:?}");
    assert_eq!(names(&out), told);
}

#[test]
fn exports_that_outgrow_memory_are_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.obj");
    let lonely: String = (0..4000).map(|i| format!("v 3 3 {i}\n")).collect();
    std::fs::write(&path, welded_obj(&broken(48)) + &lonely).expect("writable");
    let export = |name: &str, share_bytes: Option<u64>, threads: usize| {
        let out = folder.path().join(name);
        let work_dir = Some(folder.path().to_path_buf());
        let limits = Limits { share_bytes, threads, work_dir, ..Limits::default() };
        let settings = InspectSettings::default();
        inspect_exporting(&path, &settings, Some(&out), &limits, &Void).expect("readable");
        out
    };
    let tiny_bytes = 128 << 10;
    let ample = export("ample", None, 2);
    let tiny = export("tiny", Some(tiny_bytes), 2);
    let floor = folder.path().join("floor");
    let ended = self::export(&path, &floor, ["1", "38MiB"]);
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    let mut most = 0;
    for name in names(&ample) {
        let bytes = std::fs::read(ample.join(&name)).expect("there");
        most = most.max(shapes(&ample.join(&name)).len() as u64);
        for other in [&tiny, &floor] {
            assert!(std::fs::read(other.join(&name)).expect("there") == bytes, "{name}");
        }
    }
    assert_eq!((names(&tiny), names(&floor)), (names(&ample), names(&ample)));
    // A shape takes 80 bytes of a sixteenth, a mark 12 of a thirty-second.
    assert!(most * 80 > 4 * tiny_bytes / 16 && most * 12 > 4 * tiny_bytes / 32, "{most}");
}
