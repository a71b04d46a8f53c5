//! All formats: what is written comes back, and nothing that is read can bring the reader down.

use std::path::Path;

use proptest::prelude::*;

use crate::io::gltf::gltf_square;
use crate::io::{
    BATCH_TRIANGLES, CoordinateType, Format, IoError, ReadOptions, WriteOptions, create, open,
};
use crate::mesh::{Discarded, Material, MeshSource, Part, SinkTriangles, TriangleBatch};
use crate::store::Scratch;

/// Everything that a reader delivered, in one batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Content {
    pub(crate) batch: TriangleBatch,
    pub(crate) parts: Vec<Part>,
    pub(crate) materials: Vec<Material>,
    pub(crate) discarded: Discarded,
    pub(crate) vertex_count: Option<u64>,
    /// Positions of all vertices, used or not.
    pub(crate) listed: Vec<[f64; 3]>,
}

impl PartialEq for Content {
    fn eq(&self, other: &Self) -> bool {
        let bits = |content: &Self| -> Vec<u64> {
            let corners = content.batch.corners.as_flattened().as_flattened();
            corners.iter().map(|x| x.to_bits()).collect()
        };
        let rest = |content: &Self| {
            let TriangleBatch { parts, materials, polygons, indices, uvs, colours, .. } =
                content.batch.clone();
            (parts, materials, polygons, indices, uvs, colours)
        };
        bits(self) == bits(other)
            && rest(self) == rest(other)
            && (&self.parts, &self.materials, self.discarded, self.vertex_count)
                == (&other.parts, &other.materials, other.discarded, other.vertex_count)
    }
}

impl Content {
    pub(crate) fn part_names(&self) -> Vec<&str> {
        self.parts.iter().map(|part| part.name.as_str()).collect()
    }

    pub(crate) fn material_names(&self) -> Vec<&str> {
        self.materials.iter().map(|material| material.name.as_str()).collect()
    }
}

pub(crate) fn read_all(source: &mut dyn MeshSource<Error = IoError>) -> Result<Content, IoError> {
    let mut content = Content::default();
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch)? {
        let count = batch.len();
        assert!((1..=BATCH_TRIANGLES).contains(&count), "{count} triangles in a batch");
        assert!([batch.parts.len(), batch.materials.len(), batch.polygons.len()] == [count; 3]);
        for optional in [batch.indices.len(), batch.uvs.len(), batch.colours.len()] {
            assert!(optional == 0 || optional == count);
        }
        assert!(batch.parts.iter().all(|&part| u64::from(part) < source.part_count()));
        let materials = source.material_count();
        assert!(batch.materials.iter().all(|&material| u64::from(material) < materials));
        content.batch.corners.append(&mut batch.corners);
        content.batch.parts.append(&mut batch.parts);
        content.batch.materials.append(&mut batch.materials);
        content.batch.polygons.append(&mut batch.polygons);
        content.batch.indices.append(&mut batch.indices);
        content.batch.uvs.append(&mut batch.uvs);
        content.batch.colours.append(&mut batch.colours);
    }
    content.parts =
        (0..source.part_count()).map(|i| source.part(i as u32)).collect::<Result<_, _>>()?;
    content.materials = (0..source.material_count())
        .map(|i| source.material(i as u32))
        .collect::<Result<_, _>>()?;
    content.discarded = source.discarded();
    content.vertex_count = source.vertex_count();
    check_listed(source, &mut content)?;
    Ok(content)
}

/// The vertices that a source lists are as many as it says, and those that triangles name are there.
fn check_listed(
    source: &mut dyn MeshSource<Error = IoError>,
    content: &mut Content,
) -> Result<(), IoError> {
    let mut positions = Vec::new();
    // A hostile file may say that it has billions.
    if content.vertex_count.is_some_and(|count| count > 1 << 20) {
        return Ok(());
    }
    while source.next_vertices(&mut positions)? {
        assert!(!positions.is_empty());
        content.listed.append(&mut positions);
    }
    assert!(positions.is_empty() && !source.next_vertices(&mut positions)?);
    if content.listed.is_empty() {
        return Ok(());
    }
    assert_eq!(Some(content.listed.len() as u64), content.vertex_count);
    let TriangleBatch { indices, corners, .. } = &content.batch;
    let bits = |position: &[f64; 3]| position.map(f64::to_bits);
    for (vertex, corner) in indices.as_flattened().iter().zip(corners.as_flattened()) {
        assert_eq!(bits(&content.listed[*vertex as usize]), bits(corner), "vertex {vertex}");
    }
    Ok(())
}

fn read_path(path: &Path, share_bytes: u64) -> Result<Content, IoError> {
    let scratch = Scratch::new(path.parent().expect("a file in a folder"));
    read_all(open(path, &scratch, &ReadOptions::in_scene(share_bytes))?.as_mut())
}

pub(crate) fn read_bytes(name: &str, content: &[u8]) -> Result<Content, IoError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("a file");
    read_path(&path, 1 << 20)
}

/// Writes a mesh whose last vertices come after the first triangles.
fn write(path: &Path, format: Format, positions: &[[f64; 3]], triangles: &[[u32; 3]]) {
    let scratch = Scratch::new(path.parent().expect("a file in a folder"));
    let mut sink = create(path, format, &scratch, &WriteOptions::default()).expect("creates");
    let (early, late) = positions.split_at(positions.len() / 2);
    let is_early = |t: &&[u32; 3]| t.iter().all(|&v| (v as usize) < early.len());
    let first: Vec<_> = triangles.iter().take_while(is_early).copied().collect();
    for (vertices, triangles) in [(early, &first[..]), (late, &triangles[first.len()..])] {
        sink.vertices(vertices).expect("writes");
        let corners: Vec<_> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let triangles = SinkTriangles {
            indices: triangles,
            corners: &corners,
            surfaces: &[],
            ..SinkTriangles::default()
        };
        sink.triangles(&triangles).expect("writes");
    }
    let stats = sink.finish().expect("finishes");
    assert_eq!(stats.triangles, triangles.len() as u64);
    assert_eq!(stats.vertices, positions.len() as u64);
    assert_eq!(stats.file.bytes, std::fs::metadata(path).expect("the file").len());
}

const FORMATS: [(Format, &str); 6] = [
    (Format::Obj, "a.obj"),
    (Format::Stl, "a.stl"),
    (Format::Ply, "a.ply"),
    (Format::Off, "a.off"),
    (Format::ThreeMf, "a.3mf"),
    (Format::Glb, "a.glb"),
];

fn finite() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

proptest! {
    #[test]
    fn every_format_gives_back_what_was_written(
        positions in prop::collection::vec(prop::array::uniform3(finite()), 1..30),
        picks in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..30),
    ) {
        let triangles: Vec<[u32; 3]> =
            picks.iter().map(|t| t.map(|pick| pick.index(positions.len()) as u32)).collect();
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (format, name) in FORMATS {
            let path = folder.path().join(name);
            write(&path, format, &positions, &triangles);
            let content = read_path(&path, 1 << 20).expect("readable");
            let written = |x: f64| match format.coordinates() {
                CoordinateType::F32 => f64::from(x as f32),
                CoordinateType::F64 => x,
            };
            let expected: Vec<_> = triangles
                .iter()
                .map(|t| t.map(|v| positions[v as usize].map(written)))
                .collect();
            prop_assert_eq!(&content.batch.corners, &expected);
            if format.has_indices() {
                prop_assert_eq!(&content.batch.indices, &triangles);
                prop_assert_eq!(content.vertex_count, Some(positions.len() as u64));
                let listed: Vec<_> = positions.iter().map(|p| p.map(written)).collect();
                prop_assert_eq!(&content.listed, &listed);
            }
        }
    }
}

/// Small files that between them use everything the readers know.
pub(crate) fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let mut binary_stl = vec![0; 84];
    binary_stl[80] = 3;
    binary_stl.extend((0..150_u8).map(|i| i.wrapping_mul(37)));
    let obj = "# x\nmtllib a.mtl\no p\nv 0 0 0 1 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nvt 0 1\nusemtl m\n\
               f 1/1 2/1 3/1 \\\n4/1\ng q\nf -1 -2 -3\n";
    let off = "COFF # x\n5 3 0\n0 0 0 255 0 0 255\n4 0 0\n1 1 0\n0 4 0\n9 9 9\n4 0 1 2 3 255 0 0\n\
               3 0 1 4\n2 0 1\n";
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
               vertex 0 1e0 0\nendloop\nendfacet\nendsolid a\nsolid\nendsolid\n";
    vec![
        ("a.obj", obj.into()),
        ("a.off", off.into()),
        ("a.stl", stl.into()),
        ("b.stl", binary_stl),
        ("a.ply", ascii_ply().into()),
        ("b.ply", binary_ply(false)),
        ("c.ply", binary_ply(true)),
        ("a.glb", gltf_square()),
    ]
}

fn ascii_ply() -> &'static str {
    "ply\nformat ascii 1.0\ncomment x\nelement camera 1\nproperty list uchar float focal\n\
     element vertex 4\nproperty float x\nproperty float y\nproperty uchar red\nproperty float z\n\
     property uchar green\nproperty uchar blue\nproperty list uint8 int16 neighbours\n\
     element face 3\nproperty uchar flags\nproperty list uchar int vertex_index\n\
     property list uchar float texcoord\nelement tristrips 1\n\
     property list int int vertex_indices\nend_header\n2 0.5 0.25\n0 0 255 0 0 0 2 1 2\n\
     4 0 255 0 0 0 0\n1 1 255 0 0 0 0\n0 4 255 0 0 0 1 7\n1 4 0 1 2 3 2 0 1\n0 3 0 1 9 0\n\
     0 2 0 1 0\n6 0 1 2 3 -1 0\n"
}

fn binary_ply(big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let header = format!(
        "ply\r\nformat binary_{order}_endian 1.0\r\nelement face 2\r\n\
         property list ushort short vertex_indices\r\nproperty double area\r\n\
         element vertex 3\r\nproperty double x\r\nproperty int y\r\nproperty float z\r\n\
         end_header\r\n"
    );
    let mut bytes = header.into_bytes();
    let mut push = |little: &[u8]| {
        let mut value = little.to_vec();
        if big_endian {
            value.reverse();
        }
        bytes.extend(value);
    };
    for face in [[0_i16, 1, 2], [2, 1, -1]] {
        push(&3_u16.to_le_bytes());
        face.iter().for_each(|index| push(&index.to_le_bytes()));
        push(&0.5_f64.to_le_bytes());
    }
    for (x, y, z) in [(0.1_f64, -7_i32, 0.5_f32), (1.0, 0, 0.0), (0.0, 1, 0.25)] {
        push(&x.to_le_bytes());
        push(&y.to_le_bytes());
        push(&z.to_le_bytes());
    }
    bytes
}

#[test]
fn all_samples_are_readable_and_say_what_they_say() {
    let expected =
        [(3, 0, 0), (3, 0, 1), (1, 0, 0), (3, 0, 0), (4, 1, 1), (1, 1, 0), (1, 1, 0), (2, 0, 0)];
    for ((name, bytes), expected) in samples().iter().zip(expected) {
        let content = read_bytes(name, bytes).expect("readable");
        let Discarded { wild_index_faces, short_faces } = content.discarded;
        assert_eq!((content.batch.len(), wild_index_faces, short_faces), expected, "{name}");
    }
}

#[test]
fn ascii_ply_passes_over_strange_lists_and_keeps_colours() {
    let content = read_bytes("a.ply", ascii_ply().as_bytes()).expect("readable");
    assert!(content.batch.corners[..2].iter().all(|corners| corners.contains(&[1.0, 1.0, 0.0])));
    assert_eq!(content.batch.colours[0], [[255, 0, 0, 255]; 3]);
    assert_eq!(content.batch.indices[2..], [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(content.batch.polygons, [0, 0, 3, 4]);
}

#[test]
fn a_remark_without_its_keyword_before_the_elements_of_a_ply_is_passed_over() {
    let remark = "format ascii 1.0\nCreated by hand: with care";
    let text = ascii_ply().replacen("format ascii 1.0", remark, 1);
    let content = read_bytes("a.ply", text.as_bytes()).expect("readable");
    assert_eq!(content, read_bytes("b.ply", ascii_ply().as_bytes()).expect("readable"));
    for (from, to) in [("format ascii 1.0", "Created by hand"), ("end_header", "end header")] {
        let text = ascii_ply().replacen(from, to, 1);
        let error = read_bytes("c.ply", text.as_bytes()).expect_err("no header");
        assert!(error.to_string().contains("expected format, comment"), "{error}");
    }
}

#[test]
fn both_byte_orders_and_faces_before_vertices_read_alike() {
    let little = read_bytes("b.ply", &binary_ply(false)).expect("readable");
    assert_eq!(little, read_bytes("c.ply", &binary_ply(true)).expect("readable"));
    let expected = [[0.1, -7.0, 0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.25]];
    assert_eq!(little.batch.corners, [expected]);
}

#[test]
fn the_share_of_memory_changes_nothing() {
    let positions: Vec<[f64; 3]> =
        (0..9000).map(|i| [f64::from(i), f64::from(i % 97), 0.1]).collect();
    let triangles: Vec<[u32; 3]> =
        (0..10_000_u32).map(|i| [i % 9000, i * 7919 % 9000, i * 104_729 % 9000]).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (format, name) in FORMATS {
        let path = folder.path().join(name);
        write(&path, format, &positions, &triangles);
        let [small, large] =
            [16 << 10, 1 << 30].map(|share| read_path(&path, share).expect("readable"));
        assert_eq!(small.batch.len(), triangles.len());
        assert!(small == large, "{name}");
    }
    // Only the streaming OBJ reader has a share: with colours and texture coordinates.
    let mut obj = String::from("# longer than what tobj gets\n");
    for i in 0..60_000 {
        obj += &format!("v {i}.25 {i}.125 0.5 0.{:02} 0 1 \nvt 0.{i} {i}\n", i % 100);
    }
    for i in 0..60_000_u64 {
        let [a, b, c] = [i, i * 7919, i * 104_729].map(|i| i % 60_000 + 1);
        obj += &format!("f {a}/{a}/{a} {b}/{c}/{b} {c}/{b}/{c} # padding padding padding\n");
    }
    assert!(obj.len() > 4 << 20);
    let path = folder.path().join("large.obj");
    std::fs::write(&path, obj).expect("a file");
    let [small, large] =
        [16 << 10, 1 << 30].map(|share| read_path(&path, share).expect("readable"));
    assert!(small.batch.uvs.len() == 60_000 && small.batch.colours.len() == 60_000);
    assert!(small == large);
}

#[test]
fn content_is_read_whatever_the_file_is_called() {
    for (_, bytes) in samples().into_iter().filter(|(name, _)| *name != "b.stl") {
        let as_named = read_bytes("a.obj", &bytes).expect("readable");
        assert!(as_named == read_bytes("a.stl", &bytes).expect("readable"));
    }
}

#[test]
fn text_stl_is_taken_in_any_dress() {
    let plain = read_bytes("a.stl", &samples()[2].1).expect("readable");
    let text = String::from_utf8(samples()[2].1.clone()).expect("text");
    for dressed in [text.to_uppercase(), text.replace('\n', "\r\n"), text.replace(" a\n", "\n")] {
        assert!(read_bytes("a.stl", dressed.as_bytes()).expect("readable") == plain);
    }
    let cut = text.replace("endsolid", "");
    assert!(matches!(read_bytes("a.stl", cut.as_bytes()), Err(IoError::Unreadable { .. })));
}

#[test]
fn binary_stl_may_call_itself_solid_trail_bytes_or_lack_its_count() {
    let (_, mut bytes) = samples().swap_remove(3);
    let plain = read_bytes("a.stl", &bytes).expect("readable").batch.len();
    bytes[..6].copy_from_slice(b"solid ");
    assert_eq!(read_bytes("a.stl", &bytes).expect("readable").batch.len(), plain);
    bytes[80] = 0;
    assert_eq!(read_bytes("a.stl", &bytes).expect("readable").batch.len(), plain);
    bytes[80] = 2;
    assert_eq!(read_bytes("a.stl", &bytes).expect("readable").batch.len(), 2);
}

#[test]
fn off_is_taken_with_its_counts_anywhere() {
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for head in
        ["OFF\n3 1 0\n", "OFF 3 1\n", "OFF3 1 0\n", "# x\nOFF # y\n\n3\n1\n0\n", "NOFF 3 1 0\r\n"]
    {
        let content = read_bytes("a.off", format!("{head}{body}").as_bytes()).expect("readable");
        assert_eq!(content.batch.indices, [[0, 1, 2]], "{head}");
    }
    for head in ["4OFF 3 1 0\n", "OFF BINARY\n", "OFF 3 -1 0\n"] {
        let result = read_bytes("a.off", format!("{head}{body}").as_bytes());
        assert!(matches!(result, Err(IoError::Unreadable { .. })), "{head}");
    }
}

#[test]
fn point_clouds_deliver_no_triangle() {
    for (name, bytes) in [
        ("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"),
        ("a.off", "OFF 1 0 0\n0 0 0\n"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\n\
                   property int z\nend_header\n0 0 0\n",
        ),
    ] {
        assert_eq!(read_bytes(name, bytes.as_bytes()).expect("readable").batch.len(), 0, "{name}");
    }
}
