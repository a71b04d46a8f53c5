//! Materials reach the output: with the area that they had, along the borders that they had.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use brickmend::io::{ReadOptions, open};
use brickmend::mesh::TriangleBatch;
use brickmend::mesh::shapes::{Corners, Random, area, cuboid, rotation, sphere, transform};
use brickmend::repair::{Limits, Reach, RepairError, Settings};
use brickmend::store::Scratch;
use glam::DVec3;

use crate::support::run::{Workshop, at_depth};

const LIBRARY: &str = "newmtl oak\nKd 0.5 0.3 0.1\nnewmtl wool\nKd 0.1 0.2 0.8\nd 1\n";

/// Formats that hold materials.
const EXTENSIONS: [&str; 4] = ["obj", "ply", "3mf", "glb"];

/// Triangles by the names of their materials.
type Painted = BTreeMap<String, Vec<Corners>>;

/// What lies above a plane and what lies below, cut along it.
fn cut(soup: &[Corners], normal: DVec3, offset: f64) -> [Vec<Corners>; 2] {
    let height = |p: [f64; 3]| normal.dot(DVec3::from(p)) - offset;
    // The same point from both sides of an edge.
    let passing = |p: [f64; 3], q: [f64; 3]| {
        let (p, q) = if p < q { (p, q) } else { (q, p) };
        let share = height(p) / (height(p) - height(q));
        (DVec3::from(p) + (DVec3::from(q) - DVec3::from(p)) * share).to_array()
    };
    [1.0, -1.0].map(|side| {
        let mut kept = Vec::new();
        for triangle in soup {
            let mut polygon = Vec::new();
            for i in 0..3 {
                let (p, q) = (triangle[i], triangle[(i + 1) % 3]);
                let (from, to) = (height(p) * side > 0.0, height(q) * side > 0.0);
                if from {
                    polygon.push(p);
                }
                if from != to {
                    polygon.push(passing(p, q));
                }
            }
            for i in 2..polygon.len() {
                kept.push([polygon[0], polygon[i - 1], polygon[i]]);
            }
        }
        kept
    })
}

/// An OBJ text whose triangles name the materials of `library`.
fn text_of(library: &Path, parts: &[(&str, &[Corners])]) -> String {
    let name = library.file_name().expect("a file").to_string_lossy();
    let mut text = format!("mtllib {name}\n");
    let mut next = 1;
    for (material, triangles) in parts {
        writeln!(text, "usemtl {material}").expect("strings grow");
        for corners in *triangles {
            for [x, y, z] in corners {
                writeln!(text, "v {x} {y} {z}").expect("strings grow");
            }
            writeln!(text, "f {next} {} {}", next + 1, next + 2).expect("strings grow");
            next += 3;
        }
    }
    text
}

/// What our own reader finds in a file.
fn read(path: &Path) -> Painted {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions::in_scene(1 << 20);
    let mut source = open(path, &Scratch::new(folder.path()), &options).expect("opens");
    let mut batch = TriangleBatch::default();
    let mut painted = Painted::new();
    while source.next_batch(&mut batch).expect("reads") {
        for (corners, &material) in batch.corners.iter().zip(&batch.materials) {
            let name = source.material(material).expect("known").name;
            painted.entry(name).or_default().push(*corners);
        }
    }
    painted
}

/// The ends of all edges between two materials.
fn border(painted: &Painted) -> Vec<DVec3> {
    let mut uses: BTreeMap<[[u64; 3]; 2], Vec<&str>> = BTreeMap::new();
    for (name, triangles) in painted {
        for triangle in triangles {
            for i in 0..3 {
                let mut ends = [triangle[i], triangle[(i + 1) % 3]].map(|p| p.map(f64::to_bits));
                ends.sort_unstable();
                uses.entry(ends).or_default().push(name);
            }
        }
    }
    let between = uses.iter().filter(|(_, names)| names.iter().any(|name| *name != names[0]));
    between.flat_map(|(ends, _)| ends.map(|p| DVec3::from(p.map(f64::from_bits)))).collect()
}

fn assert_painted_alike(soup: &[Corners], label: &str, settings: &Settings) {
    let mut random = Random::new(17);
    for pose in 0..4 {
        let workshop = Workshop::new();
        let turned = transform(soup, rotation(&mut random), DVec3::from(random.point()));
        let normal = (rotation(&mut random) * DVec3::X).normalize();
        let centre = turned.iter().flatten().map(|p| DVec3::from(*p)).sum::<DVec3>()
            / (3 * turned.len()) as f64;
        let offset = normal.dot(centre) + random.within(-0.1, 0.1);
        let [oak, wool] = cut(&turned, normal, offset);
        let library = workshop.write_text("mtl", LIBRARY);
        let text = text_of(&library, &[("oak", &oak), ("wool", &wool)]);
        let input = workshop.write_text("obj", &text);
        let limits = Limits::default();
        let extension = EXTENSIONS[pose % EXTENSIONS.len()];
        let repaired = workshop.repair(&input, extension, settings, &limits).expect("a result");
        let cell = repaired.outcome.grid.cell_size();
        let painted = read(&repaired.path);
        assert_eq!(painted.keys().collect::<Vec<_>>(), ["oak", "wool"], "{label} {pose}");
        for (name, given) in [("oak", &oak), ("wool", &wool)] {
            let (given, found) = (area(given), area(&painted[name]));
            assert!((found / given - 1.0).abs() < 0.02, "{label} {pose}: {name} {given} {found}");
        }
        let ends = border(&painted);
        assert!(ends.len() > 8, "{label} {pose}: a border");
        let mut off: Vec<f64> =
            ends.iter().map(|end| (normal.dot(*end) - offset).abs() / cell).collect();
        off.sort_unstable_by(f64::total_cmp);
        // Where a border passes a crease in a cell that cannot hold both, it gives way.
        let (most, worst) = (off[off.len() * 9 / 10], off[off.len() - 1]);
        let slack = if settings.decimate == Reach::Cells(0.0) { 0.01 } else { 0.1 };
        assert!(most < slack && worst < 0.6, "{label} {pose}: {most} and {worst} cells off");
    }
}

#[test]
fn borders_across_faces_and_edges_of_a_cube_stay_where_they_were() {
    assert_painted_alike(&cuboid([0.0; 3], [1.0; 3]), "cube", &at_depth(6));
}

#[test]
fn borders_around_a_ball_stay_where_they_were() {
    assert_painted_alike(&sphere([0.0; 3], 0.6, 24), "ball", &at_depth(6));
}

#[test]
fn without_clusters_borders_stay_as_well() {
    let settings = crate::support::run::unclustered(6);
    assert_painted_alike(&cuboid([0.0; 3], [1.0; 3]), "cube", &settings);
}

#[test]
fn a_part_that_is_stuck_into_another_keeps_its_material() {
    let workshop = Workshop::new();
    let library = workshop.write_text("mtl", LIBRARY);
    let (seat, leg) = (cuboid([0.0; 3], [1.0, 1.0, 0.3]), cuboid([0.4, 0.4, 0.2], [0.6, 0.6, 1.0]));
    let text = text_of(&library, &[("wool", &seat), ("oak", &leg)]);
    let input = workshop.write_text("obj", &text);
    let repaired =
        workshop.repair(&input, "obj", &at_depth(6), &Limits::default()).expect("a result");
    let painted = read(&repaired.path);
    // What sticks out of the leg, and what the leg leaves of the seat.
    let (leg, seat) = (4.0 * 0.2 * 0.7 + 0.04, 2.0 + 4.0 * 0.3 - 0.04);
    assert!((area(&painted["oak"]) / leg - 1.0).abs() < 0.02, "{}", area(&painted["oak"]));
    assert!((area(&painted["wool"]) / seat - 1.0).abs() < 0.02, "{}", area(&painted["wool"]));
}

#[test]
fn patches_have_the_material_around_them_and_can_be_told_apart() {
    let workshop = Workshop::new();
    let library = workshop.write_text("mtl", LIBRARY);
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    let hole = soup.pop().expect("twelve triangles");
    let input = workshop.write_text("obj", &text_of(&library, &[("oak", &soup)]));
    for tag_patches in [false, true] {
        let settings = Settings { tag_patches, ..at_depth(6) };
        let repaired =
            workshop.repair(&input, "obj", &settings, &Limits::default()).expect("a result");
        let painted = read(&repaired.path);
        if tag_patches {
            let (given, found) = (area(&[hole]), area(&painted["oak.patch"]));
            assert!((found / given - 1.0).abs() < 0.05, "{given} {found}");
            assert!((area(&painted["oak"]) / 5.5 - 1.0).abs() < 0.02);
        } else {
            assert_eq!(painted.len(), 1);
            assert!((area(&painted["oak"]) / 6.0 - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn the_library_beside_an_obj_holds_the_materials_and_replaces_none_of_another() {
    let workshop = Workshop::new();
    let library = workshop.write_text("mtl", LIBRARY);
    let soup = cuboid([0.0; 3], [1.0; 3]);
    let [oak, wool] = cut(&soup, DVec3::X, 0.3);
    let input = workshop.write_text("obj", &text_of(&library, &[("oak", &oak), ("wool", &wool)]));
    let settings = at_depth(5);
    let repaired = workshop.repair(&input, "obj", &settings, &Limits::default()).expect("a result");
    let beside = repaired.path.with_extension("mtl");
    let text = std::fs::read_to_string(&beside).expect("it is there");
    assert!(text.contains("newmtl oak\nKd 0.5 0.3 0.1\n"), "{text}");
    assert!(text.contains("newmtl wool\nKd 0.1 0.2 0.8\nd 1\n"), "{text}");
    // The input's own library has the name that the output's would have.
    let output = library.with_extension("obj");
    let format = brickmend::io::Format::Obj;
    let monitor = brickmend::monitor::Void;
    let refused =
        brickmend::repair::repair(&input, &output, format, &settings, &Limits::default(), &monitor);
    assert!(matches!(refused, Err(RepairError::ForeignLibrary { .. })));
    assert_eq!(std::fs::read_to_string(&library).expect("untouched"), LIBRARY);
}

#[test]
fn images_that_are_missing_and_further_maps_are_told() {
    let workshop = Workshop::new();
    let library = "newmtl oak\nmap_Kd ../secret.png\nmap_Bump b.png\n";
    let library = workshop.write_text("mtl", library);
    let soup = cuboid([0.0; 3], [1.0; 3]);
    let input = workshop.write_text("obj", &text_of(&library, &[("oak", &soup)]));
    for extension in EXTENSIONS {
        let settings = at_depth(5);
        let repaired = workshop.repair(&input, extension, &settings, &Limits::default());
        let lost = repaired.expect("a result").outcome.transfer.lost;
        assert!(lost.contains(&"the texture ../secret.png".to_owned()), "{extension}: {lost:?}");
        assert!(lost.contains(&"normal maps".to_owned()), "{extension}: {lost:?}");
    }
}

#[test]
fn limits_change_no_byte_of_painted_files() {
    let workshop = Workshop::new();
    let library = workshop.write_text("mtl", LIBRARY);
    let [oak, wool] = cut(&sphere([0.0; 3], 0.6, 24), DVec3::new(0.6, 0.0, 0.8), 0.1);
    let input =
        workshop.write_text("obj", &text_of(&library, &[("oak", &oak[7..]), ("wool", &wool)]));
    let settings = Settings { tag_patches: true, ..at_depth(6) };
    for extension in ["ply", "obj"] {
        let all = [
            Limits::default(),
            Limits { share_bytes: Some(16 << 10), ..Limits::default() },
            Limits { threads: 8, ..Limits::default() },
        ];
        let files = all.map(|limits| {
            let repaired =
                workshop.repair(&input, extension, &settings, &limits).expect("a result");
            let text = std::fs::read(&repaired.path).expect("it is there");
            let lines = text.split(|byte| *byte == b'\n');
            // The library's name is that of the output.
            lines
                .filter(|line| !line.starts_with(b"mtllib"))
                .map(<[u8]>::to_vec)
                .collect::<Vec<_>>()
        });
        assert!(files.iter().all(|other| *other == files[0]), "{extension}");
    }
}
