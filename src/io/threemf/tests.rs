//! What 3MF files say is what is delivered.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::io::input::Input;
use crate::io::packed::HARMLESS_BYTES;
use crate::io::tests::{Content, read_bytes};
use crate::io::threemf::ThreeMfReader;
use crate::io::threemf::vocabulary::{CORE, MODEL_RELATIONSHIP, RELATIONSHIPS};
use crate::io::{IoError, Place, ReadOptions};
use crate::mesh::LengthUnit;
use crate::mesh::{Material, MeshSource, TriangleBatch};
use crate::store::Scratch;

const MATERIALS: &str = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";

/// A mesh of two triangles.
pub(super) const MESH: &str = "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/>\
    <vertex x='0' y='1' z='0'/><vertex x=' 1e0 ' y='1' z='-.5'/></vertices>\
    <triangles><triangle v1='0' v2='1' v3='2'/><triangle v1='1' v2='3' v3='2'/></triangles></mesh>";

/// An archive of these members.
pub(super) fn archive(members: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in members {
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(*name, options).expect("a member");
        zip.write_all(content).expect("its content");
    }
    zip.finish().expect("an archive").into_inner()
}

pub(super) fn relationships(target: &str) -> String {
    format!(
        "<?xml version='1.0'?><Relationships xmlns='{RELATIONSHIPS}'><Relationship Id='a' \
         Type='http://example.org/other' Target='/x'/><Relationship Id='b' Target='{target}' \
         Type='{MODEL_RELATIONSHIP}'/></Relationships>"
    )
}

/// A package of a root model and of other parts.
pub(super) fn package(model: &str, others: &[(&str, &str)]) -> Vec<u8> {
    let relationships = relationships("/3D/a.model");
    let mut members =
        vec![("_rels/.rels", relationships.as_bytes()), ("3D/a.model", model.as_bytes())];
    members.extend(others.iter().map(|(name, content)| (*name, content.as_bytes())));
    archive(&members, CompressionMethod::Deflated)
}

/// The text of a model.
pub(super) fn model(resources: &str, items: &str) -> String {
    format!(
        "\u{feff}<?xml version='1.0' encoding='UTF-8'?>\n<model unit='inch' xmlns='{CORE}' \
         xmlns:m='{MATERIALS}' xmlns:p='{PRODUCTION}' requiredextensions='m p'>\n\
         <metadata name='Title'>a &amp; b</metadata><resources>{resources}</resources>\
         <build>{items}</build></model>"
    )
}

pub(super) fn read_model(resources: &str, items: &str) -> Result<Content, IoError> {
    read_bytes("a.3mf", &package(&model(resources, items), &[]))
}

fn object(id: u32, rest: &str) -> String {
    format!("<object id='{id}' {rest}>{MESH}</object>")
}

#[test]
fn a_mesh_is_read_with_its_numbers() {
    let content =
        read_model(&object(1, "name='a&lt;b'"), "<item objectid='1'/>").expect("readable");
    let corner = [1.0, 1.0, -0.5];
    assert_eq!(content.batch.corners[1], [[1.0, 0.0, 0.0], corner, [0.0, 1.0, 0.0]]);
    assert_eq!(content.batch.indices, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(content.batch.polygons, [0, 1]);
    assert_eq!(content.vertex_count, Some(4));
    assert_eq!(content.part_names(), ["a<b"]);
    assert_eq!(content.materials, [Material::default()]);
}

#[test]
fn every_place_of_an_object_is_a_part_with_vertices_of_its_own() {
    let resources = object(1, "name='a'")
        + "<object id='2' name='b'><components><component objectid='1'/>\
           <component objectid='1' transform='1 0 0 0 1 0 0 0 -1 0 0 10'/></components></object>";
    let items = "<item objectid='2' transform='2 0 0 0 2 0 0 0 2 100 0 0'/><item objectid='1'/>";
    let content = read_model(&resources, items).expect("readable");
    assert_eq!(content.part_names(), ["a", "a", "a"]);
    assert_eq!(content.batch.parts, [0, 0, 1, 1, 2, 2]);
    assert_eq!(content.batch.polygons, [0, 1, 2, 3, 4, 5]);
    assert_eq!(content.vertex_count, Some(12));
    assert_eq!(content.batch.corners[0], [[100.0, 0.0, 0.0], [102.0, 0.0, 0.0], [100.0, 2.0, 0.0]]);
    // A mirror turns the triangles around, so that they face where they did.
    assert_eq!(content.batch.indices[3], [5, 6, 7]);
    let mirrored = [[102.0, 0.0, 20.0], [100.0, 2.0, 20.0], [102.0, 2.0, 21.0]];
    assert_eq!(content.batch.corners[3], mirrored);
    assert_eq!(content.batch.indices[4], [8, 9, 10]);
}

#[test]
fn supports_are_left_out_and_without_items_all_objects_are_shown() {
    let resources = object(1, "name='part'")
        + &object(2, "type='support'")
        + &object(3, "type='other'")
        + &object(4, "type='surface' name='top'")
        + "<object id='5'><components><component objectid='1'/><component objectid='2'/>\
           </components></object>";
    assert_eq!(read_model(&resources, "").expect("readable").part_names(), ["top", "part"]);
    let items = "<item objectid='2'/><item objectid='5'/>";
    assert_eq!(read_model(&resources, items).expect("readable").part_names(), ["part"]);
    assert_eq!(read_model("", "").expect("readable").batch.len(), 0);
}

#[test]
fn materials_come_from_all_kinds_of_groups() {
    let triangle = |properties: &str| format!("<triangle v1='0' v2='1' v3='2' {properties}/>");
    let triangles: String = [
        "",
        "p1='1'",
        "pid='2' p1='0' p2='0'",
        "pid='2' p1='1'",
        "pid='3' p1='0'",
        "pid='4' p1='1'",
        "pid='5' p1='0'",
        "pid='6' p1='0'",
        "pid='7' p1='0'",
        "pid='8' p1='0'",
    ]
    .map(triangle)
    .concat();
    let mesh = MESH.replace("<triangles>", &format!("<triangles>{triangles}"));
    let resources = format!(
        "<basematerials id='1'><base name='A' displaycolor='#ff0000'/>\
         <base name='B' displaycolor='#00FF0080'/><base name='C' displaycolor='#0000FF00'/>\
         </basematerials><m:colorgroup id='2'><m:color color='#102030ff'/><m:color \
         color='#10203040'/></m:colorgroup><m:texture2d id='9' path='/a.png'/>\
         <m:texture2dgroup id='3' texid='9'><m:tex2coord u='0' v='0'/></m:texture2dgroup>\
         <m:compositematerials id='4' matid='1' matindices='0 2'><m:composite values='0.5 0.5'/>\
         <m:composite values='.4 .6'/></m:compositematerials>\
         <m:multiproperties id='5' pids='3 2'><multi pindices='0 1'/></m:multiproperties>\
         <m:multiproperties id='6' pids='2 3'><m:multi pindices=''/></m:multiproperties>\
         <m:multiproperties id='7' pids='3'><m:multi pindices='0'/></m:multiproperties>\
         <x:mystery xmlns:x='urn:x' id='8'/>\
         <object id='10' pid='1' pindex='0'>{mesh}</object>"
    );
    let content = read_model(&resources, "<item objectid='10'/>").expect("readable");
    // What shows an image is another material than what does not.
    let names = ["A", "B", "#102030", "#10203040", "", "C", "#10203040", "#102030", ""];
    assert_eq!(content.material_names(), names);
    assert_eq!(content.batch.materials, [0, 1, 2, 3, 4, 5, 6, 7, 4, 8, 0, 0]);
    let shown: Vec<_> = content.materials.iter().map(|m| m.texture.is_some()).collect();
    assert_eq!(shown, [false, false, false, false, true, false, true, true, false]);
    assert!(content.batch.colours.is_empty());
    let material = |number: usize| &content.materials[number];
    assert_eq!(material(0).diffuse, Some([1.0, 0.0, 0.0]));
    assert_eq!((material(0).opacity, material(0).transparent), (None, false));
    assert_eq!((material(1).opacity, material(1).transparent), (Some(128.0 / 255.0), true));
    assert!(material(3).transparent);
    // Programs write an alpha of 0 where they mean none.
    assert_eq!((material(5).opacity, material(5).transparent), (None, false));
}

#[test]
fn colours_that_differ_between_corners_are_those_of_vertices() {
    let triangle = |properties: &str| format!("<triangle v1='0' v2='1' v3='2' {properties}/>");
    let triangles = ["pid='2' p1='0' p2='1' p3='2'", "pid='2' p1='1'", "pid='2' p1='2'", "p1='0'"]
        .map(triangle)
        .concat();
    let mesh = MESH.replace("<triangles>", &format!("<triangles>{triangles}"));
    let resources = format!(
        "<basematerials id='1'><base name='A' displaycolor='#ff0000'/></basematerials>\
         <m:colorgroup id='2'><m:color color='#102030'/><m:color color='#FFFFFF'/>\
         <m:color color='#00000080'/></m:colorgroup>\
         <object id='10' pid='1' pindex='0'>{mesh}</object>"
    );
    let content = read_model(&resources, "<item objectid='10'/>").expect("readable");
    let [dark, white, glass] = [[16, 32, 48, 255], [255; 4], [0, 0, 0, 128]];
    let expected = [[dark, white, glass], [white; 3], [glass; 3], [white; 3]];
    assert_eq!(content.batch.colours[..4], expected);
    // Light passes through the third, which has to be known.
    assert_eq!(content.batch.materials[..4], [0, 0, 1, 2]);
    assert_eq!(content.material_names(), ["", "#00000080", "A"]);
    assert!(content.materials[1].transparent && content.batch.uvs.is_empty());
}

#[test]
fn parts_of_a_package_lead_to_one_another() {
    let resources = "<object id='1'><components><component objectid='7' p:path='/3d/B.MODEL'/>\
                     <component objectid='7' p:path='3D/b.model'/></components></object>";
    let items = "<item objectid='1'/><item objectid='7' p:path='/3D/./b.model'/>";
    let other = model(&object(7, "name='far'"), "<item objectid='7'/>");
    let bytes = package(&model(resources, items), &[("3D/b.model", &other)]);
    let content = read_bytes("a.3mf", &bytes).expect("readable");
    assert_eq!(content.part_names(), ["far"; 3]);
    let bytes =
        package(&model(resources, items), &[("3D/b.model", &other.replace("inch", "foot"))]);
    assert!(matches!(read_bytes("a.3mf", &bytes), Err(IoError::Unreadable { .. })));
    let nested = other.replace("</resources>", &format!("{resources}</resources>"));
    let bytes = package(&model(resources, items), &[("3D/b.model", &nested)]);
    assert!(matches!(read_bytes("a.3mf", &bytes), Err(IoError::Unreadable { .. })));
}

#[test]
fn names_of_members_are_compared_without_case_and_slash() {
    let model = model(&object(1, ""), "<item objectid='1'/>");
    for (member, target) in [
        ("3D/a.model", "3D/A.Model"),
        ("/3D/a.model", "/3d/a.model"),
        ("3D\\a b.model", "/3D/a%20b.model"),
        ("../../../tmp/a.model", "/tmp/a.model"),
    ] {
        let relationships = relationships(target);
        let members = [("_RELS/.Rels", relationships.as_bytes()), (member, model.as_bytes())];
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let content = read_bytes("a.3mf", &archive(&members, method)).expect("readable");
            assert_eq!(content.batch.len(), 2, "{member}");
        }
    }
}

#[test]
fn the_unit_is_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.3mf");
    let text = model(&object(1, ""), "<item objectid='1'/>");
    for (name, unit) in [
        ("inch", LengthUnit::Inch),
        ("micron", LengthUnit::Micron),
        ("centimeter", LengthUnit::Centimeter),
    ] {
        let bytes = package(&text.replace("inch", name), &[]);
        std::fs::write(&path, &bytes).expect("a file");
        let input = Input::open(&path, 0).expect("opens");
        let scratch = Scratch::new(folder.path());
        let options = ReadOptions::in_scene(0);
        let mut reader = ThreeMfReader::open(input, &scratch, &options).expect("opens");
        let mut batch = TriangleBatch::default();
        assert!(reader.next_batch(&mut batch).expect("readable"));
        assert_eq!(reader.unit(), Some(unit));
        assert!(reader.bytes_read() > 0);
        assert!(!reader.next_batch(&mut batch).expect("readable"));
        assert!(!reader.next_batch(&mut batch).expect("at its end"));
    }
    let bytes = package(&text.replace("inch", "cubit"), &[]);
    assert!(matches!(read_bytes("a.3mf", &bytes), Err(IoError::Unreadable { .. })));
}

#[test]
fn packed_packages_are_unpacked_first() {
    let bytes = package(&model(&object(1, ""), "<item objectid='1'/>"), &[]);
    let packed = zstd::encode_all(bytes.as_slice(), 1).expect("packs");
    let content = read_bytes("a.3mf.zst", &packed).expect("readable");
    assert!(content == read_bytes("a.3mf", &bytes).expect("readable"));
}

#[test]
fn faces_that_lead_nowhere_are_counted() {
    let wild = "<triangles><triangle v1='0' v2='1' v3='4'/><triangle v1='-1' v2='1' v3='2'/>\
                <triangle v1='0.5' v2='1' v3='2'/><triangle v1='99999999999' v2='1' v3='2'/>\
                <triangle v1='4294967295' v2='1' v3='2'/>";
    let mesh = MESH.replace("<triangles>", wild);
    let resources = format!("<object id='1'>{mesh}</object>");
    let content = read_model(&resources, "<item objectid='1'/>").expect("readable");
    assert_eq!(content.discarded.wild_index_faces, 5);
    assert_eq!(content.batch.polygons, [5, 6]);
}

#[test]
fn harmless_extensions_may_be_required_and_others_are_refused_by_name() {
    let text = model(&object(1, ""), "<item objectid='1'/>");
    for (prefix, namespace, is_fine) in [
        ("t", "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07", true),
        ("b", "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02", false),
        ("s", "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07", false),
    ] {
        let declared = format!("xmlns:{prefix}='{namespace}' requiredextensions='m {prefix}'");
        let text = text.replace("requiredextensions='m p'", &declared);
        match read_bytes("a.3mf", &package(&text, &[])) {
            Ok(_) => assert!(is_fine, "{prefix}"),
            Err(error) => assert!(!is_fine && error.to_string().contains(namespace), "{error}"),
        }
        let optional = text.replace(&format!("'m {prefix}'"), "''");
        assert!(read_bytes("a.3mf", &package(&optional, &[])).is_ok());
    }
    let undeclared = text.replace("'m p'", "'q'");
    assert!(read_bytes("a.3mf", &package(&undeclared, &[])).is_err());
    // An object that is another kind of body must not vanish.
    let body = "<object id='1'><b:booleanshape xmlns:b='urn:b' objectid='2'/></object>";
    let error = read_model(body, "<item objectid='1'/>").expect_err("refused");
    assert!(error.to_string().contains("b:booleanshape"), "{error}");
}

#[test]
fn what_the_share_spills_is_read_alike() {
    let vertices: String =
        (0..9000).map(|i| format!("<vertex x='{i}' y='{}.25' z='0.1'/>", i % 97)).collect();
    let triangles: String = (0..10_000_u32)
        .map(|i| {
            let [a, b, c] = [i % 9000, i * 7919 % 9000, i * 104_729 % 9000];
            format!("<triangle v1='{a}' v2='{b}' v3='{c}' p1='{}'/>", i * 31 % 500)
        })
        .collect();
    let bases: String = (0..500).map(|i| format!("<base name='n{}'/>", i / 2)).collect();
    let resources = format!(
        "<basematerials id='1'>{bases}</basematerials><object id='2' pid='1'><mesh><vertices>\
         {vertices}</vertices><triangles>{triangles}</triangles></mesh></object>"
    );
    let items = "<item objectid='2'/>".repeat(3);
    let bytes = package(&model(&resources, &items), &[]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.3mf");
    std::fs::write(&path, bytes).expect("a file");
    let scratch = Scratch::new(folder.path());
    let [small, large] = [0, 1 << 30].map(|share_bytes| {
        let options = ReadOptions::in_scene(share_bytes);
        let mut source = crate::io::open(&path, &scratch, &options).expect("opens");
        crate::io::tests::read_all(source.as_mut()).expect("readable")
    });
    assert_eq!((large.batch.len(), large.parts.len(), large.materials.len()), (30_000, 3, 250));
    assert!(small == large);
}

#[test]
fn archives_of_other_things_are_refused_as_such() {
    let text = model(&object(1, ""), "<item objectid='1'/>");
    let wrong = relationships("/3D/b.model");
    let other = relationships("x").replace(MODEL_RELATIONSHIP, "urn:x");
    for members in [
        &[("a.txt", &b"hello"[..])][..],
        &[("_rels/.rels", wrong.as_bytes()), ("3D/a.model", text.as_bytes())],
        &[("_rels/.rels", other.as_bytes()), ("3D/a.model", text.as_bytes())],
    ] {
        let error = read_bytes("a.zip", &archive(members, CompressionMethod::Deflated));
        let error = error.expect_err("refused").to_string();
        assert!(error.contains("3MF"), "{error}");
    }
    assert!(matches!(
        read_bytes("a.3mf", b"PK\x03\x04 and then nothing"),
        Err(IoError::Unreadable { place: Place::Byte(_), .. })
    ));
    assert_eq!(HARMLESS_BYTES, 64 << 20);
}
