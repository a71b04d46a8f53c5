//! Exports of an inspection: exactly the edges and triangles with a defect, the same bytes for any
//! number of threads and any memory.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use brickmend::mesh::shapes::{Corners, cuboid};

use crate::support::program::Ended;

const LIMITS: [[&str; 2]; 3] = [["1", "64MiB"], ["4", "64MiB"], ["4", "1GiB"]];

fn write_obj(path: &Path, triangles: &[Corners]) {
    let mut text = String::new();
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(text, "v {x} {y} {z}").expect("text grows");
    }
    for at in 0..triangles.len() {
        writeln!(text, "f {} {} {}", 3 * at + 1, 3 * at + 2, 3 * at + 3).expect("text grows");
    }
    std::fs::write(path, text).expect("writable");
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

/// Points of each shape, and the triangle that it is of.
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
    let (corners, lead) = if count("edge").is_some() { (2, 0) } else { (3, 1) };
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    let position = |vertex: usize, axis: usize| {
        let from = at + 24 * vertex + 8 * axis;
        f64::from_le_bytes(bytes[from..from + 8].try_into().expect("eight"))
    };
    let elements = count("edge").or(count("face")).expect("elements");
    let record = lead + 4 * corners + 4;
    assert_eq!(bytes.len(), at + 24 * vertices + record * elements);
    let shape = |element: usize| {
        let from = at + 24 * vertices + record * element;
        assert!(lead == 0 || bytes[from] == 3);
        let points = (0..corners).map(|corner| {
            let vertex = number(from + lead + 4 * corner) as usize;
            assert!(vertex < vertices);
            std::array::from_fn(|axis| position(vertex, axis))
        });
        (points.collect(), number(from + record - 4))
    };
    (0..elements).map(shape).collect()
}

/// Exports under all limits; answers the files, which are the same each time.
fn exported(model: &[Corners], expected: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.obj");
    write_obj(&path, model);
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
    let folder = exported(&model, &["boundary_edge.ply"]);
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
    let numbers = |name: &str| -> Vec<u32> {
        shapes(&out.join(name)).into_iter().map(|(_, triangle)| triangle).collect()
    };
    assert_eq!(numbers(files[0]), [24]);
    assert_eq!(numbers(files[1]), (12..24).collect::<Vec<_>>());
    assert_eq!(numbers(files[2]).len(), 3);
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
