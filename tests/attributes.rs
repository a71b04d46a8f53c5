//! Texture coordinates, colours and normals reach the output: without smears, split where seams and
//! creases were and nowhere else.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use brickmend::io::{Format, ReadOptions, open};
use brickmend::mesh::TriangleBatch;
use brickmend::mesh::shapes::{Corners, Random, cuboid, rotation, sphere};
use brickmend::monitor::Void;
use brickmend::repair::{
    Limits, NormalRule, Outcome, Reach, Settings, TextureRule, repair as repair_model,
    repair_levels,
};
use brickmend::sign::FillRule;
use brickmend::store::Scratch;
use glam::{DMat3, DVec2, DVec3};

use crate::support::run::{Encoding, Workshop, at_depth, unclustered};
use crate::support::surface::Surface;

/// A triangle with texture coordinates.
type Textured = (Corners, [[f64; 2]; 3]);

/// An OBJ text; with a material that shows an image.
fn text_of(workshop: &Workshop, triangles: &[Textured]) -> String {
    let library = workshop.write_text("mtl", "newmtl skin\nmap_Kd skin.png\n");
    let name = library.file_name().expect("a file").to_string_lossy();
    let mut text = format!("mtllib {name}\nusemtl skin\n");
    for (number, (corners, uvs)) in triangles.iter().enumerate() {
        for ([x, y, z], [u, v]) in corners.iter().zip(uvs) {
            writeln!(text, "v {x} {y} {z}\nvt {u} {v}").expect("strings grow");
        }
        let [a, b, c] = [1, 2, 3].map(|i| 3 * number + i);
        writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}").expect("strings grow");
    }
    text
}

/// What our own reader finds in a file.
fn read(path: &Path) -> TriangleBatch {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions::in_scene(1 << 20);
    let mut source = open(path, &Scratch::new(folder.path()), &options).expect("opens");
    let (mut batch, mut all) = (TriangleBatch::default(), TriangleBatch::default());
    while source.next_batch(&mut batch).expect("reads") {
        all.corners.extend_from_slice(&batch.corners);
        all.uvs.extend_from_slice(&batch.uvs);
        all.colours.extend_from_slice(&batch.colours);
    }
    all
}

fn repair(
    triangles: &[Textured],
    extension: &str,
    settings: &Settings,
) -> (Outcome, Vec<Textured>) {
    let workshop = Workshop::new();
    let input = workshop.write_text("obj", &text_of(&workshop, triangles));
    let repaired =
        workshop.repair(&input, extension, settings, &Limits::default()).expect("a result");
    Surface::read_proven(&repaired.path, FillRule::Solid);
    let mut work_folder = repaired.path.clone().into_os_string();
    work_folder.push(".brickmend");
    assert!(!Path::new(&work_folder).exists(), "nothing is left of the work");
    let found = read(&repaired.path);
    assert_eq!(found.uvs.len(), found.corners.len(), "every triangle has coordinates");
    let uvs = found.uvs.iter().map(|uvs| uvs.map(|uv| uv.map(f64::from)));
    (repaired.outcome, found.corners.iter().copied().zip(uvs).collect())
}

/// The six sides of a cube, each in a square of its own of the image; turned.
fn cube(turn: DMat3) -> (Vec<Textured>, impl Fn(usize, DVec3) -> DVec2) {
    let map = move |side: usize, place: DVec3| {
        let place = turn.inverse() * place;
        let (axis, tile) = (side % 3, DVec2::new((side % 3) as f64, (side / 3) as f64));
        let across = DVec2::new(place[(axis + 1) % 3], place[(axis + 2) % 3]);
        (tile + DVec2::splat(0.1) + 0.8 * across) / 3.0
    };
    let triangles = cuboid([0.0; 3], [1.0; 3]).into_iter().map(|corners| {
        let (axis, level) = side_of(corners.map(DVec3::from));
        let side = axis + if level > 0.5 { 3 } else { 0 };
        let turned = corners.map(|corner| turn * DVec3::from(corner));
        (turned.map(|c| c.to_array()), turned.map(|c| map(side, c).to_array()))
    });
    (triangles.collect(), map)
}

/// The axis across a triangle of a cube, and where it lies on it.
fn side_of(corners: [DVec3; 3]) -> (usize, f64) {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).abs();
    let axis = (0..3).max_by(|&a, &b| normal[a].total_cmp(&normal[b])).expect("three");
    (axis, corners.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0)
}

#[test]
fn the_sides_of_a_cube_keep_their_squares_of_the_image() {
    let turn = rotation(&mut Random::new(5));
    let (triangles, map) = cube(turn);
    for settings in [at_depth(5), unclustered(5)] {
        for extension in ["obj", "glb", "ply"] {
            let (outcome, found) = repair(&triangles, extension, &settings);
            assert_eq!(outcome.transfer.looks, 6, "{extension}");
            assert!(!outcome.transfer.lost.contains(&"texture coordinates".to_owned()));
            for (corners, uvs) in &found {
                let corners = corners.map(DVec3::from);
                let uvs = uvs.map(DVec2::from);
                // The square that the middle lies in is that of all corners.
                let middle = uvs[0] + uvs[1] + uvs[2];
                let side = middle.x.floor() as usize + 3 * middle.y.floor() as usize;
                for (corner, uv) in corners.into_iter().zip(uvs) {
                    let off = map(side, corner).distance(uv);
                    // Vertices lie on creases within the slack of decimation.
                    assert!(off < 0.004, "{extension}: {corner} has {uv}, off by {off}");
                }
            }
        }
    }
}

#[test]
fn a_seam_across_a_flat_face_stays_where_it_was() {
    let place = |u: f64, v: f64| [u, v, 1.0];
    // Left and right of a slanted line, which the grid does not know.
    let (low, high) = (0.31, 0.64);
    let left: fn([f64; 3]) -> [f64; 2] = |[x, y, _]| [0.4 * x + 0.1 * y, 0.5 * y];
    let right: fn([f64; 3]) -> [f64; 2] = |[x, y, _]| [0.5 + 0.3 * y, 0.9 - 0.2 * x];
    let mut triangles: Vec<Textured> = cuboid([0.0; 3], [1.0; 3])
        .into_iter()
        .filter(|corners| side_of(corners.map(DVec3::from)) != (2, 1.0))
        .map(|corners| (corners, [[0.95, 0.95], [1.0, 0.95], [0.95, 1.0]]))
        .collect();
    assert_eq!(triangles.len(), 10);
    let quads = [
        ([place(0., 0.), place(low, 0.), place(high, 1.), place(0., 1.)], left),
        ([place(low, 0.), place(1., 0.), place(1., 1.), place(high, 1.)], right),
    ];
    for ([a, b, c, d], map) in quads {
        triangles.extend([[a, b, c], [a, c, d]].map(|corners| (corners, corners.map(map))));
    }
    for settings in [at_depth(5), unclustered(5)] {
        for extension in ["obj", "glb"] {
            let (_, found) = repair(&triangles, extension, &settings);
            let (mut area, mut of_left) = (0.0, 0.0);
            for (corners, uvs) in &found {
                if corners.iter().any(|corner| corner[2] < 1.0 - 1e-6) {
                    continue;
                }
                let off = |map: fn([f64; 3]) -> [f64; 2]| {
                    let off =
                        (0..3).map(|i| DVec2::from(map(corners[i])).distance(DVec2::from(uvs[i])));
                    off.fold(0.0, f64::max)
                };
                let (off_left, off_right) = (off(left), off(right));
                assert!(off_left.min(off_right) < 1e-4, "{corners:?} {uvs:?}");
                let [a, b, c] = corners.map(DVec3::from);
                let own = 0.5 * (b - a).cross(c - a).length();
                area += own;
                of_left += if off_left < off_right { own } else { 0.0 };
            }
            assert!(area > 0.8, "{area}");
            let expected = 0.5 * (low + high);
            assert!((of_left - expected * area).abs() < 0.01, "{of_left} of {area}");
        }
    }
}

/// A tube around the z axis, closed at both ends, with an image wrapped once around.
fn tube(steps: u32) -> Vec<Textured> {
    let at = |step: u32, z: f64| {
        let angle = TAU * f64::from(step % steps) / f64::from(steps);
        [angle.cos(), angle.sin(), z]
    };
    let share = |step: u32| f64::from(step) / f64::from(steps);
    let mut triangles = Vec::new();
    for step in 0..steps {
        let next = step + 1;
        let (a, b, c, d) = (at(step, 0.), at(next, 0.), at(next, 2.), at(step, 2.));
        let (u, w) = (share(step), share(next));
        triangles.push(([a, b, c], [[u, 0.], [w, 0.], [w, 1.]]));
        triangles.push(([a, c, d], [[u, 0.], [w, 1.], [u, 1.]]));
        for (z, turned) in [(0.0, true), (2.0, false)] {
            let (p, q) = (at(step, z), at(next, z));
            let corners = if turned { [[0., 0., z], q, p] } else { [[0., 0., z], p, q] };
            triangles.push((corners, corners.map(|[x, y, _]| [4.0 + x, 4.0 + y])));
        }
    }
    triangles
}

#[test]
fn an_image_wrapped_around_a_tube_is_not_smeared_at_its_seam() {
    for settings in [at_depth(6), unclustered(6)] {
        for extension in ["obj", "glb"] {
            let (_, found) = repair(&tube(48), extension, &settings);
            let mut wrapped = 0.0;
            for (corners, uvs) in &found {
                let corners = corners.map(DVec3::from);
                let spread = |values: [f64; 3]| {
                    values.iter().fold(f64::MIN, |a, b| a.max(*b))
                        - values.iter().fold(f64::MAX, |a, b| a.min(*b))
                };
                let size = corners[0].distance(corners[1]).max(corners[1].distance(corners[2]));
                let size = size.max(corners[2].distance(corners[0]));
                let is_side = uvs.iter().all(|uv| uv[0] < 1.02 && uv[1] < 1.02);
                if !is_side {
                    assert!(uvs.iter().all(|uv| uv[0] > 0.98 && uv[1] > 0.98), "{uvs:?}");
                    continue;
                }
                let (u, v) = (spread(uvs.map(|uv| uv[0])), spread(uvs.map(|uv| uv[1])));
                assert!(u < 1.2 * size / TAU + 1e-3, "{u} in a triangle of {size}: {uvs:?}");
                assert!(v < 0.6 * size + 1e-3, "{v} in a triangle of {size}");
                for (corner, uv) in corners.iter().zip(uvs) {
                    let angle = corner.y.atan2(corner.x).rem_euclid(TAU) / TAU;
                    let off = (angle - uv[0]).abs();
                    assert!(off.min(1.0 - off) < 0.01, "{corner}: {uv:?}");
                }
                wrapped += 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            }
            assert!((wrapped / (2.0 * TAU) - 1.0).abs() < 0.02, "{wrapped}");
        }
    }
}

/// A PLY text with colours of vertices.
fn coloured(soup: &[Corners], colour: impl Fn(usize, [f64; 3]) -> [u8; 4]) -> String {
    let mut text = String::from("ply\nformat ascii 1.0\n");
    writeln!(text, "element vertex {}", 3 * soup.len()).expect("strings grow");
    text.push_str("property double x\nproperty double y\nproperty double z\n");
    for channel in ["red", "green", "blue", "alpha"] {
        writeln!(text, "property uchar {channel}").expect("strings grow");
    }
    writeln!(text, "element face {}", soup.len()).expect("strings grow");
    text.push_str("property list uchar int vertex_indices\nend_header\n");
    for (number, corner) in soup.iter().flatten().enumerate() {
        let ([x, y, z], [r, g, b, a]) = (corner, colour(number / 3, *corner));
        writeln!(text, "{x} {y} {z} {r} {g} {b} {a}").expect("strings grow");
    }
    for number in 0..soup.len() {
        writeln!(text, "3 {} {} {}", 3 * number, 3 * number + 1, 3 * number + 2)
            .expect("strings grow");
    }
    text
}

#[test]
fn colours_run_on_between_vertices() {
    let ramp = |[x, y, z]: [f64; 3]| {
        [x, y, z, 1.0].map(|share| ((0.5 + 0.4 * share) * 255.0).round().clamp(0.0, 255.0) as u8)
    };
    let workshop = Workshop::new();
    let input =
        workshop.write_text("ply", &coloured(&sphere([0.0; 3], 1.0, 24), |_, place| ramp(place)));
    for settings in [at_depth(6), unclustered(6)] {
        for extension in ["ply", "obj", "glb"] {
            let repaired = workshop
                .repair(&input, extension, &settings, &Limits::default())
                .expect("a result");
            assert_eq!(repaired.outcome.transfer.looks, 1, "nothing jumps");
            let found = read(&repaired.path);
            assert_eq!(found.colours.len(), found.corners.len(), "{extension}");
            for (corners, colours) in found.corners.iter().zip(&found.colours) {
                for (corner, colour) in corners.iter().zip(colours) {
                    let expected = ramp(*corner);
                    let off = (0..3).map(|i| expected[i].abs_diff(colour[i])).max();
                    assert!(off <= Some(4), "{extension} {corner:?}: {colour:?}");
                }
            }
        }
    }
}

#[test]
fn colours_that_jump_are_not_mixed_where_vertices_can_be_split() {
    let workshop = Workshop::new();
    let mut soup = cuboid([-1.0, 0.0, 0.0], [0.0, 1.0, 1.0]);
    soup.extend(cuboid([0.0; 3], [1.0; 3]));
    let paint =
        |triangle: usize, _| if triangle < 12 { [250, 0, 0, 255] } else { [0, 0, 250, 255] };
    let text = coloured(&soup, paint);
    let input = workshop.write_text("ply", &text);
    let repaired =
        workshop.repair(&input, "glb", &at_depth(5), &Limits::default()).expect("a result");
    let found = read(&repaired.path);
    assert!(found.colours.len() > 12);
    assert!(found.colours.iter().all(|colours| colours.iter().all(|c| *c == colours[0])));
}

/// Vertices and normals of the corners of an OBJ file.
fn normals_of(path: &Path) -> Vec<([DVec3; 3], [DVec3; 3])> {
    let text = std::fs::read_to_string(path).expect("text");
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().skip(1).map(|word| word.parse().expect("a number")).collect()
    };
    let (mut vertices, mut normals, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for line in text.lines() {
        match line.split_whitespace().next() {
            Some("v") => vertices.push(DVec3::from_slice(&numbers(line))),
            Some("vn") => normals.push(DVec3::from_slice(&numbers(line))),
            Some("f") => {
                let corners: Vec<[usize; 2]> = line
                    .split_whitespace()
                    .skip(1)
                    .map(|word| {
                        let words: Vec<&str> = word.split('/').collect();
                        [0, 2].map(|i| words[i].parse::<usize>().expect("a number") - 1)
                    })
                    .collect();
                let corner = |i: usize| vertices[corners[i][0]];
                let normal = |i: usize| normals[corners[i][1]];
                found.push(([0, 1, 2].map(corner), [0, 1, 2].map(normal)));
            }
            _ => {}
        }
    }
    found
}

#[test]
fn normals_are_smooth_where_the_surface_is_round_and_hard_at_creases() {
    let workshop = Workshop::new();
    let ball = workshop.write(&sphere([0.0; 3], 1.0, 48), Encoding::Obj);
    let block = workshop.write(&cuboid([0.0; 3], [1.0; 3]), Encoding::Obj);
    for plain in [at_depth(6), unclustered(6)] {
        let settings = Settings { normals: NormalRule::Smooth, ..plain };
        let repaired =
            workshop.repair(&ball, "obj", &settings, &Limits::default()).expect("a result");
        assert!(repaired.outcome.transfer.attributes.normals);
        for (corners, normals) in normals_of(&repaired.path) {
            for (corner, normal) in corners.into_iter().zip(normals) {
                let degrees = corner.normalize().dot(normal).clamp(-1.0, 1.0).acos().to_degrees();
                // Facets of clusters are as wide as the slack of decimation allows.
                let most = if plain == unclustered(6) { 4.0 } else { 12.0 };
                assert!(degrees < most, "{corner}: off by {degrees} degrees");
            }
        }
        let repaired =
            workshop.repair(&block, "obj", &settings, &Limits::default()).expect("a result");
        for (corners, normals) in normals_of(&repaired.path) {
            let own = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            assert!(normals.iter().all(|normal| normal.dot(own) > 0.9999), "{corners:?}");
        }
    }
}

#[test]
fn normals_are_kept_where_there_were_some_and_not_made_up() {
    let workshop = Workshop::new();
    let (triangles, _) = cube(DMat3::IDENTITY);
    let text = text_of(&workshop, &triangles);
    let input = workshop.write_text("obj", &text);
    let shining = workshop.write_text("obj", &format!("{text}vn 0 0 1\n"));
    let run = |input: &Path, normals| {
        let settings = Settings { normals, ..at_depth(5) };
        let repaired = workshop.repair(input, "obj", &settings, &Limits::default());
        let repaired = repaired.expect("a result");
        let has = std::fs::read_to_string(&repaired.path).expect("text").contains("\nvn ");
        assert_eq!(has, repaired.outcome.transfer.attributes.normals);
        has
    };
    assert!(!run(&input, NormalRule::Keep));
    assert!(run(&shining, NormalRule::Keep));
    assert!(!run(&shining, NormalRule::None));
    assert!(run(&input, NormalRule::Smooth));
}

#[test]
fn a_vertex_of_glb_is_split_at_seams_and_creases_only() {
    // Along the grid, where every crease is sharp.
    let (triangles, _) = cube(DMat3::IDENTITY);
    let workshop = Workshop::new();
    let input = workshop.write_text("obj", &text_of(&workshop, &triangles));
    let settings = Settings { normals: NormalRule::Smooth, ..unclustered(5) };
    let repaired = workshop.repair(&input, "glb", &settings, &Limits::default()).expect("a result");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions::in_scene(1 << 20);
    let mut source = open(&repaired.path, &Scratch::new(folder.path()), &options).expect("opens");
    let mut uses: HashMap<[u64; 3], Vec<u32>> = HashMap::new();
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).expect("reads") {
        for (corners, indices) in batch.corners.iter().zip(&batch.indices) {
            for (corner, index) in corners.iter().zip(indices) {
                let known = uses.entry(corner.map(f64::to_bits)).or_default();
                if !known.contains(index) {
                    known.push(*index);
                }
            }
        }
    }
    let count = |splits: usize| uses.values().filter(|known| known.len() == splits).count();
    assert_eq!(count(3), 8, "the corners of the cube");
    assert!(count(2) > 12 && count(1) > 6 * count(2), "{} and {}", count(2), count(1));
    assert_eq!(count(1) + count(2) + count(3), uses.len());
    // The proof tells vertices apart by position.
    assert_eq!(repaired.outcome.output.proof.vertices, uses.len() as u64);
}

#[test]
fn coordinates_of_materials_without_images_part_nothing() {
    let (triangles, _) = cube(DMat3::IDENTITY);
    let workshop = Workshop::new();
    let text = text_of(&workshop, &triangles);
    let looks = |text: &str| {
        let input = workshop.write_text("obj", text);
        let repaired = workshop.repair(&input, "obj", &at_depth(5), &Limits::default());
        repaired.expect("a result").outcome.transfer.looks
    };
    assert_eq!(looks(&text), 6);
    // Nobody knows what shows the image: all seams stay.
    assert_eq!(looks(&text.replace("usemtl skin", "")), 6);
    // Two sides show none.
    let mut lines: Vec<&str> = text.lines().collect();
    let fourth = lines.iter().enumerate().filter(|(_, line)| line.starts_with("f ")).nth(3);
    let at = fourth.expect("twelve faces").0;
    lines.insert(at + 1, "usemtl plain");
    let plain = lines.join("\n");
    let without = looks(&plain);
    assert!((2..6).contains(&without), "{without}");
}

#[test]
fn triangles_with_squares_of_their_own_are_bounded_as_all_others() {
    let soup = sphere([0.0; 3], 1.0, 16);
    let triangles: Vec<Textured> = soup
        .iter()
        .enumerate()
        .map(|(number, corners)| {
            let [x, y] = [number % 32, number / 32].map(|i| i as f64 / 32.0);
            (*corners, [[x, y], [x + 0.02, y], [x, y + 0.02]])
        })
        .collect();
    let (outcome, found) = repair(&triangles, "obj", &at_depth(5));
    assert_eq!(outcome.transfer.looks, soup.len() as u64);
    for (_, uvs) in &found {
        // A square and a cell around it.
        for axis in 0..2 {
            let values = uvs.map(|uv| uv[axis]);
            let spread = values.iter().fold(0.0, |most: f64, x| most.max((x - values[0]).abs()));
            assert!(spread < 1.5 / 32.0, "{uvs:?}");
        }
    }
}

#[test]
fn holes_and_walls_have_coordinates_of_what_is_around() {
    // A tube without ends becomes a wall; one without a triangle is patched.
    let mut open_tube = tube(48);
    open_tube.retain(|(_, uvs)| uvs.iter().all(|uv| uv[0] <= 1.0));
    let mut holed = tube(48);
    holed.remove(40);
    for triangles in [open_tube, holed] {
        let (outcome, found) = repair(&triangles, "glb", &at_depth(6));
        assert!(outcome.mend.added_triangles + outcome.invented.patch_polygons > 0);
        for (corners, uvs) in &found {
            for (corner, uv) in corners.iter().zip(uvs) {
                if uv[0] > 1.5 {
                    continue;
                }
                let angle = corner[1].atan2(corner[0]).rem_euclid(TAU) / TAU;
                let off = (angle - uv[0]).abs();
                assert!(off.min((1.0 - off).abs()) < 0.05, "{corner:?}: {uv:?}");
            }
        }
    }
}

#[test]
fn limits_change_no_byte_of_textured_files() {
    let workshop = Workshop::new();
    let mut triangles = tube(96);
    triangles.truncate(triangles.len() - 9);
    let input = workshop.write_text("obj", &text_of(&workshop, &triangles));
    let settings = Settings { normals: NormalRule::Smooth, ..at_depth(6) };
    for extension in ["obj", "glb", "ply"] {
        let all = [
            Limits::default(),
            Limits { share_bytes: Some(16 << 10), ..Limits::default() },
            Limits { threads: 8, ..Limits::default() },
        ];
        let bytes = all.map(|limits| {
            let repaired = workshop.repair(&input, extension, &settings, &limits);
            // The library beside an OBJ file has its name.
            let text = std::fs::read(repaired.expect("a result").path).expect("it is there");
            let is_name = |line: &&[u8]| !line.starts_with(b"mtllib");
            text.split(|byte| *byte == b'\n').filter(is_name).collect::<Vec<_>>().concat()
        });
        assert!(bytes.iter().all(|other| *other == bytes[0]), "{extension}");
    }
}

#[test]
fn without_attributes_nothing_is_drawn_twice() {
    let workshop = Workshop::new();
    let input = workshop.write(&sphere([0.0; 3], 1.0, 24), Encoding::Obj);
    let settings = Settings { decimate: Reach::Cells(0.0), ..at_depth(6) };
    let plain = workshop.repair(&input, "obj", &settings, &Limits::default()).expect("a result");
    let (triangles, _) = cube(DMat3::IDENTITY);
    let textured = workshop.write_text("obj", &text_of(&workshop, &triangles));
    let stl = workshop.repair(&textured, "stl", &settings, &Limits::default()).expect("a result");
    for repaired in [plain, stl] {
        assert_eq!(repaired.outcome.transfer.looks, 0);
        assert!(!repaired.outcome.transfer.attributes.any());
    }
}

#[test]
fn images_come_along_on_request() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (inputs, results) = (folder.path().join("inputs"), folder.path().join("results"));
    for folder in [&inputs, &results] {
        std::fs::create_dir(folder).expect("a folder");
    }
    let (triangles, _) = cube(DMat3::IDENTITY);
    let workshop = Workshop::new();
    let model = text_of(&workshop, &triangles).replacen("mtllib ", "mtllib cube.mtl\n#", 1);
    std::fs::write(inputs.join("cube.obj"), model).expect("written");
    std::fs::write(inputs.join("cube.mtl"), "newmtl skin\nmap_Kd oak.png\n").expect("written");
    let image = b"\x89PNG\r\n\x1a\n and what follows";
    std::fs::write(inputs.join("oak.png"), image).expect("written");
    for textures in [TextureRule::Refer, TextureRule::Copy] {
        let settings = Settings { textures, ..at_depth(5) };
        let output = results.join(format!("{textures:?}.obj"));
        let (input, limits) = (inputs.join("cube.obj"), Limits::default());
        repair_model(&input, &output, Format::Obj, &settings, &limits, &Void).expect("a result");
        let library = std::fs::read_to_string(output.with_extension("mtl")).expect("a library");
        let way = library.lines().find_map(|line| line.strip_prefix("map_Kd ")).expect("an image");
        let is_copied = textures == TextureRule::Copy;
        assert_eq!(way.starts_with("../inputs/"), !is_copied, "{way}");
        assert_eq!(std::fs::read(results.join(way)).expect("it is there"), image);
    }
}

#[test]
fn images_folded_along_an_edge_part_looks_there() {
    // Both halves of the upper side show the same half of the image.
    let fold = 0.43;
    let map = |[x, y, _]: [f64; 3]| [(x - fold).abs(), y];
    let mut triangles: Vec<Textured> = cuboid([0.0; 3], [1.0; 3])
        .into_iter()
        .filter(|corners| side_of(corners.map(DVec3::from)) != (2, 1.0))
        .map(|corners| (corners, corners.map(|[x, y, z]| [3.0 + x - y, 3.0 + z + y])))
        .collect();
    for (low, high) in [(0.0, fold), (fold, 1.0)] {
        let [a, b, c, d] = [(low, 0.), (high, 0.), (high, 1.), (low, 1.)].map(|(x, y)| [x, y, 1.]);
        triangles.extend([[a, b, c], [a, c, d]].map(|corners| (corners, corners.map(map))));
    }
    let (_, found) = repair(&triangles, "obj", &at_depth(5));
    let upper = found.iter().filter(|(corners, _)| corners.iter().all(|p| p[2] > 1.0 - 1e-6));
    let (mut lower_area, mut count) = (0.0, 0);
    for (corners, uvs) in upper {
        let off = corners.map(|[x, ..]| x - fold);
        // Where the border passes a crease it gives way by .6 cells.
        let spans = off.iter().any(|x| *x > 0.01) && off.iter().any(|x| *x < -0.01);
        assert!(!spans, "{corners:?} lies across the fold");
        for (corner, uv) in corners.iter().zip(uvs) {
            let off = DVec2::from(map(*corner)).distance(DVec2::from(*uv));
            assert!(off < 0.02, "{corner:?}: {uv:?}");
        }
        let [a, b, c] = corners.map(DVec3::from);
        lower_area +=
            if off.iter().sum::<f64>() < 0.0 { 0.5 * (b - a).cross(c - a).z } else { 0.0 };
        count += 1;
    }
    assert!(count > 4 && (lower_area - fold).abs() < 0.05, "{lower_area}");
}

#[test]
fn levels_have_the_attributes_that_a_run_for_each_gives() {
    let workshop = Workshop::new();
    let input = workshop.write_text("obj", &text_of(&workshop, &tube(48)));
    let levels = [Reach::Cells(0.05), Reach::Cells(0.4)];
    let settings = Settings { normals: NormalRule::Smooth, ..at_depth(6) };
    let output = input.with_file_name("levels.glb");
    let limits = Limits::default();
    let format = Format::Glb;
    let outcomes =
        repair_levels(&input, &output, format, &settings, &levels, &limits, &Void).expect("files");
    for (outcome, decimate) in outcomes.iter().zip(levels) {
        let settings = Settings { decimate, ..settings };
        let alone = workshop.repair(&input, "glb", &settings, &limits).expect("a result");
        let same = std::fs::read(&outcome.output.path).expect("there")
            == std::fs::read(&alone.path).expect("there");
        assert!(same, "{decimate}");
        assert!(outcome.transfer.attributes.uvs && outcome.transfer.attributes.normals);
    }
}
