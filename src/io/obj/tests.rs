//! Both OBJ readers, held against each other and against what the files say.

use std::path::Path;

use proptest::prelude::*;

use crate::io::input::Input;
use crate::io::obj::stream_reader::ObjStreamReader;
use crate::io::obj::tobj_reader::{Attempt, TobjReader};
use crate::io::tests::{Content, read_all};
use crate::io::{IoError, ReadOptions};
use crate::mesh::{OtherMaps, Texture};
use crate::store::Scratch;

struct Model {
    folder: tempfile::TempDir,
}

impl Model {
    fn new(obj: &[u8]) -> Self {
        let model = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        model.add("model.obj", obj);
        model
    }

    fn add(&self, name: &str, content: &[u8]) {
        std::fs::write(self.folder.path().join(name), content).expect("a file");
    }

    fn attempt(&self, largest_bytes: u64) -> Attempt {
        let path = self.folder.path().join("model.obj");
        let input = Input::open(&path, OPTIONS.share_bytes).expect("the file is there");
        let scratch = Scratch::new(self.folder.path());
        TobjReader::open(input, largest_bytes, &scratch, &OPTIONS).expect("readable")
    }

    fn by_tobj(&self) -> Option<Content> {
        match self.attempt(u64::MAX) {
            Attempt::Read(mut reader) => {
                Some(read_all(reader.as_mut()).expect("tobj has read it already"))
            }
            Attempt::Declined(_) => None,
        }
    }

    fn by_stream(&self) -> Result<Content, IoError> {
        by_stream(&self.folder.path().join("model.obj"))
    }

    /// What both readers say, which must be the same.
    fn twins(&self) -> Content {
        let stream = self.by_stream().expect("readable");
        assert_eq!(self.by_tobj().expect("not declined"), stream);
        stream
    }
}

fn by_stream(path: &Path) -> Result<Content, IoError> {
    let scratch = Scratch::new(path.parent().expect("a file in a folder"));
    let input = Input::open(path, OPTIONS.share_bytes)?;
    read_all(&mut ObjStreamReader::new(input, &scratch, &OPTIONS))
}

const OPTIONS: ReadOptions = ReadOptions::in_scene(1 << 20);

const SQUARE: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n";

fn twins(obj: impl AsRef<[u8]>) -> Content {
    Model::new(obj.as_ref()).twins()
}

#[test]
fn groups_objects_and_materials_own_their_faces_in_file_order() {
    let faces = "f 1 2 3\no a\nusemtl m\nf 1 2 3 4\ng x\nf 1 3 4\nusemtl n\no b c\nf 2 3 4\no a\n\
                 f 4 3 2\n";
    let content = twins(format!("{SQUARE}{faces}"));
    assert_eq!(content.part_names(), ["", "a", "b c"]);
    assert_eq!(content.material_names(), ["", "m", "n"]);
    assert_eq!(content.batch.parts, [0, 1, 1, 1, 2, 1]);
    assert_eq!(content.batch.materials, [0, 1, 1, 1, 2, 2]);
    assert_eq!(content.batch.polygons, [0, 1, 1, 2, 3, 4]);
    assert_eq!(content.vertex_count, Some(4));
}

#[test]
fn groups_are_parts_where_there_is_no_object() {
    let content = twins(format!("{SQUARE}g left side\nf 1 2 3\ng\nf 1 3 4\n"));
    assert_eq!(content.part_names(), ["left side", ""]);
}

#[test]
fn negative_and_forward_indices_name_the_same_vertices() {
    let content = twins("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nf 2 3 4\nv 1 1 0\nf -1 -2 -3\n");
    assert_eq!(content.batch.indices, [[0, 1, 2], [1, 2, 3], [3, 2, 1]]);
}

#[test]
fn polygons_are_cut_at_their_reflex_corners() {
    let content = twins("v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4\n");
    assert_eq!(content.batch.len(), 2);
    assert!(content.batch.indices.iter().all(|triangle| triangle.contains(&2)));
}

#[test]
fn windows_line_ends_comments_and_continuations_change_nothing() {
    let plain = twins(format!("{SQUARE}f 1 2 3 4\n"));
    let dressed = format!("# C:\\head\\\n{SQUARE}# x\n\nf 1 2 \\\n 3 \\\n4 # tail\n");
    assert_eq!(twins(&dressed).batch.corners, plain.batch.corners);
    assert_eq!(twins(dressed.replace('\n', "\r\n")).batch.corners, plain.batch.corners);
    assert_eq!(twins(format!("{SQUARE}f 1 2 3 4")).batch.corners, plain.batch.corners);
}

#[test]
fn weights_divide_and_colours_are_kept() {
    let content = twins("v 2 4 6 2\nv 1 0 0 1 0.5 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(content.batch.corners[0][0], [1.0, 2.0, 3.0]);
    assert_eq!(content.batch.colours, [[[255; 4], [255, 128, 0, 255], [255; 4]]]);
}

#[test]
fn texture_coordinates_are_delivered_and_missing_ones_are_zero() {
    let faces = "vt 0.5 0.25\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3//1\nf 1/-2 2/-1 3/0\nf 1 3 4\n";
    let content = twins(format!("{SQUARE}{faces}"));
    assert_eq!(content.batch.uvs[0], [[0.5, 0.25], [1.0, 1.0], [0.0, 0.0]]);
    assert_eq!(content.batch.uvs[1], [[0.5, 0.25], [1.0, 1.0], [0.0, 0.0]]);
    assert_eq!(content.batch.uvs[2], [[0.0; 2]; 3]);
}

#[test]
fn a_texture_coordinate_from_further_down_is_for_the_streaming_reader() {
    let model = Model::new(format!("{SQUARE}f 1/1 2/1 3/1\nvt 0.5 0.25\n").as_bytes());
    assert!(model.by_tobj().is_none());
    assert_eq!(model.by_stream().expect("readable").batch.uvs, [[[0.5, 0.25]; 3]]);
}

#[test]
fn non_finite_coordinates_pass() {
    let model = Model::new(b"v nan 0 0\nv inf 1e999 -1.#INF\nv 0 1 0\nf 1 2 3\n");
    let [tobj, stream] = [model.by_tobj().expect("read"), model.by_stream().expect("read")];
    assert!(tobj.batch.corners[0][0][0].is_nan() && stream.batch.corners[0][0][0].is_nan());
    let infinite = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    assert_eq!((tobj.batch.corners[0][1], stream.batch.corners[0][1]), (infinite, infinite));
}

#[test]
fn short_faces_lines_and_points_are_no_faces() {
    let content = twins(format!("{SQUARE}l 1 2 3\np 1\nf 1 2\nf\nf 1\nf 1 2 3\ns off\n"));
    assert_eq!((content.batch.len(), content.discarded.short_faces), (1, 3));
    assert_eq!(content.batch.polygons, [3]);
}

#[test]
fn wild_indices_drop_their_face_and_no_other() {
    let faces = "f 1 2 9\nf 0 1 2\nf 1 2 -9\nf 1 2 3\nf 99999999999999999999 1 2\n";
    let model = Model::new(format!("{SQUARE}{faces}").as_bytes());
    assert!(model.by_tobj().is_none());
    let content = model.by_stream().expect("readable");
    assert_eq!(content.discarded.wild_index_faces, 4);
    assert_eq!(content.batch.indices, [[0, 1, 2]]);
}

#[test]
fn what_does_not_parse_is_refused_with_line_and_word() {
    for (line, word) in [("v 1 x 2", "x"), ("f 1 2 a/b", "a/b"), ("v 1 2\u{a0}3 4", "2\u{a0}3")] {
        let model = Model::new(format!("{SQUARE}{line}\nf 1 2 3\n").as_bytes());
        assert!(model.by_tobj().is_none());
        let text = model.by_stream().expect_err("refused").to_string();
        assert!(
            text.contains("line 5") && text.contains(&word.escape_debug().to_string()),
            "{text}"
        );
    }
    let garbage = Model::new(&[7, 200, 10, 0, 0, 255]);
    assert!(garbage.by_tobj().is_none());
    assert!(matches!(garbage.by_stream(), Err(IoError::Unreadable { .. })));
}

#[test]
fn images_are_found_behind_options_and_in_the_folder_of_their_library() {
    for (line, name) in [
        ("map_Kd my skin.png", "my skin.png"),
        (
            "map_Kd -s 1 1 1 -o 0.5 0 -bm 0.2 -clamp on -imfchan r -mm 0 1 my skin.png",
            "my skin.png",
        ),
        ("map_Kd -blendu off -texres 512 7.png", "7.png"),
        ("map_Kd a.png\nmap_Kd own.png", "sub/own.png"),
        ("map_Kd C:\\Users\\x\\a.png", "C:\\Users\\x\\a.png"),
    ] {
        let head = format!("mtllib sub/a.mtl\n{SQUARE}usemtl m\nf 1 2 3\n");
        let model = Model::new(head.as_bytes());
        std::fs::create_dir(model.folder.path().join("sub")).expect("a folder");
        model.add("sub/own.png", b"own");
        let text = format!("newmtl m\nmap_Bump -bm 1 b.png\nmap_d d.png\n{line}\nnewmtl n\n");
        model.add("sub/a.mtl", text.as_bytes());
        let materials = model.twins().materials;
        assert_eq!(materials[0].texture, Some(Texture::Beside(name.to_owned())), "{line}");
        assert_eq!(materials[0].other_maps, OtherMaps::NORMAL.with(OtherMaps::OPACITY));
    }
}

#[test]
fn materials_come_from_the_folder_and_say_whether_they_are_transparent() {
    let model = Model::new(
        format!(
            "mtllib my lib.mtl\n{SQUARE}usemtl glass\nf 1 2 3\nusemtl wood\nf 1 2 3\nusemtl tr\n\
                 f 1 2 3\nusemtl none\nf 1 2 3\n"
        )
        .as_bytes(),
    );
    model.add(
        "my lib.mtl",
        b"newmtl glass\nd 0.25\nKd 0.5 0 x\nnewmtl wood\nKd 0.5 0.25 1\nd 1\nnewmtl tr\n\
          Tr 0.5\nKd 1\nillum x\n",
    );
    let materials = model.twins().materials;
    assert_eq!(
        materials.iter().map(|m| m.transparent).collect::<Vec<_>>(),
        [true, false, true, false]
    );
    assert_eq!(materials[1].diffuse, Some([0.5, 0.25, 1.0]));
    assert_eq!(materials[0].diffuse, None);
    assert_eq!(materials[3].name, "none");
}

#[test]
fn materials_outside_of_the_folder_are_never_read() {
    let outer = tempfile::tempdir().expect("a temporary folder");
    let secret = outer.path().join("secret.mtl");
    std::fs::write(&secret, "newmtl m\nd 0.5\n").expect("a file");
    let folder = outer.path().join("inner");
    std::fs::create_dir(&folder).expect("a folder");
    let absolute = secret.to_str().expect("a plain path");
    for (name, seen) in [
        ("../secret.mtl", false),
        (absolute, false),
        ("..\\secret.mtl", false),
        ("./here.mtl", true),
    ] {
        let path = folder.join("model.obj");
        std::fs::copy(&secret, folder.join("here.mtl")).expect("a file");
        std::fs::write(&path, format!("mtllib {name}\n{SQUARE}usemtl m\nf 1 2 3\n"))
            .expect("a file");
        let content = by_stream(&path).expect("readable");
        assert_eq!(content.materials[0].transparent, seen, "{name}");
    }
}

#[test]
fn links_out_of_the_folder_are_not_followed_and_links_within_it_are() {
    let outer = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(outer.path().join("secret.mtl"), "newmtl m\nd 0.5\n").expect("a file");
    let folder = outer.path().join("inner");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::copy(outer.path().join("secret.mtl"), folder.join("here.mtl")).expect("a file");
    for (link, target) in
        [("out.mtl", "../secret.mtl"), ("up", ".."), ("in.mtl", "here.mtl"), ("loop", "loop")]
    {
        std::os::unix::fs::symlink(target, folder.join(link)).expect("a link");
    }
    for (name, seen) in
        [("out.mtl", false), ("up/secret.mtl", false), ("loop", false), ("in.mtl", true)]
    {
        let path = folder.join("model.obj");
        std::fs::write(&path, format!("mtllib {name}\n{SQUARE}usemtl m\nf 1 2 3\n"))
            .expect("a file");
        let content = by_stream(&path).expect("readable");
        assert_eq!(content.materials[0].transparent, seen, "{name}");
    }
}

#[test]
fn a_library_is_read_once_by_whatever_names() {
    let model = Model::new(
        format!("mtllib a.mtl\nmtllib b.mtl ./a.mtl\n{SQUARE}usemtl m\nf 1 2 3\n").as_bytes(),
    );
    model.add("a.mtl", b"newmtl m\nd 0.5\n");
    model.add("b.mtl", b"newmtl m\nd 1\n");
    assert!(!model.twins().materials[0].transparent);
}

#[test]
fn names_of_libraries_without_end_are_refused() {
    let line = format!("mtllib{}\n", " x".repeat(2000));
    let other = format!("mtllib{}\n", " y".repeat(2000));
    let model = Model::new(format!("{SQUARE}{}", format!("{line}{other}").repeat(17)).as_bytes());
    assert!(matches!(model.by_stream(), Err(IoError::TooMany { .. })));
    let model = Model::new(format!("{SQUARE}{}f 1 2 3\n", line.repeat(40)).as_bytes());
    assert_eq!(model.twins().batch.len(), 1);
}

#[test]
fn a_byte_order_mark_hides_no_vertex() {
    let content = twins(format!("\u{feff}{SQUARE}f 1 2 3\n"));
    assert_eq!(content.batch.corners, [[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]]]);
}

#[test]
fn libraries_are_found_by_names_of_any_bytes() {
    let model =
        Model::new(&[b"mtllib K\xfcche.mtl\nusemtl m\n", SQUARE.as_bytes(), b"f 1 2 3\n"].concat());
    let name = std::os::unix::ffi::OsStrExt::from_bytes(&b"K\xfcche.mtl"[..]);
    let path = model.folder.path().join::<&std::ffi::OsStr>(name);
    std::fs::write(path, "newmtl m\nd 0.5\n").expect("a file");
    assert!(model.twins().materials[0].transparent);
}

#[test]
fn what_tobj_would_hold_is_limited_and_the_streaming_reader_goes_on() {
    let mut many = SQUARE.to_owned();
    for i in 0..30_000 {
        many += &format!("o {i}\nf 1 2 3\n");
    }
    let model = Model::new(many.as_bytes());
    assert!(model.by_tobj().is_none());
    let content = model.by_stream().expect("readable");
    assert_eq!((content.batch.len(), content.parts.len()), (30_000, 30_000));
    assert!(
        Model::new(format!("{SQUARE}{}", "f\n".repeat(300_000)).as_bytes()).by_tobj().is_none()
    );
}

#[test]
fn names_beyond_their_share_are_kept() {
    let mut obj = SQUARE.to_owned();
    for i in 0..5_000 {
        obj += &format!("usemtl {i:0100}\no {i:0300}\nf 1 2 3\n");
    }
    let content = by_stream_of(&obj);
    let expected: Vec<String> = (0..5_000).map(|i| format!("{i:0300}")).collect();
    assert_eq!(content.part_names(), expected);
    assert_eq!(content.material_names()[4_321], format!("{:0100}", 4_321));
}

fn by_stream_of(obj: &str) -> Content {
    Model::new(obj.as_bytes()).by_stream().expect("readable")
}

#[test]
fn names_that_are_no_utf8_are_replaced_alike() {
    let content =
        twins([b"o K\xfcche\n", SQUARE.as_bytes(), b"usemtl Gl\xe4s\nf 1 2 3\n"].concat());
    assert_eq!(content.part_names(), ["K\u{fffd}che"]);
}

#[test]
fn a_polygon_line_may_be_longer_than_any_buffer() {
    let count = 40_000_u32;
    let mut obj = String::new();
    for i in 0..count {
        let angle = f64::from(i) / f64::from(count) * std::f64::consts::TAU;
        obj += &format!("v {} {} 0\n", angle.cos(), angle.sin());
    }
    obj += "f";
    for i in 1..=count {
        obj += &format!(" {i}");
    }
    let content = twins(&obj);
    assert_eq!(content.batch.len() as u32, count - 2);
}

#[test]
fn only_files_up_to_the_limit_go_to_tobj() {
    let model = Model::new(format!("{SQUARE}f 1 2 3\n").as_bytes());
    let path = model.folder.path().join("model.obj");
    let size = std::fs::metadata(&path).expect("a file").len();
    assert!(matches!(model.attempt(size), Attempt::Read(_)));
    assert!(matches!(model.attempt(size - 1), Attempt::Declined(_)));
}

fn statement() -> impl Strategy<Value = String> {
    let number = prop_oneof![(-4_i8..4).prop_map(f64::from), -1e3..1e3_f64];
    let corner = (-6_i8..8, prop::option::of(-3_i8..4)).prop_map(|(v, t)| match t {
        Some(t) => format!("{v}/{t}"),
        None => v.to_string(),
    });
    prop_oneof![
        6 => prop::array::uniform3(number.clone()).prop_map(|[x, y, z]| format!("v {x} {y} {z}")),
        1 => prop::collection::vec(number.clone(), 3..8).prop_map(|numbers| {
            let numbers: Vec<_> = numbers.iter().map(f64::to_string).collect();
            format!("v {}", numbers.join(" "))
        }),
        2 => prop::array::uniform2(number).prop_map(|[u, v]| format!("vt {u} {v}")),
        6 => prop::collection::vec(corner, 0..7).prop_map(|c| format!("f {}", c.join(" "))),
        1 => "[ogl] [a-c]?", 1 => "usemtl [a-c]", 1 => "# .{0,9}", 1 => "[a-z]{1,3} 1 2 3",
    ]
}

proptest! {
    #[test]
    fn whatever_tobj_accepts_is_what_the_streaming_reader_says(
        statements in prop::collection::vec(statement(), 0..40)
    ) {
        let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{}\n", statements.join("\n"));
        let model = Model::new(obj.as_bytes());
        if let Some(tobj) = model.by_tobj() {
            prop_assert_eq!(Some(tobj), model.by_stream().ok());
        }
    }
}
