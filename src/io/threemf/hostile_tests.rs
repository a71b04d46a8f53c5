//! Packages that are cut, mutated, endless or lie: a clear refusal in bounded time and memory.

use proptest::prelude::*;
use zip::CompressionMethod;

use crate::io::tests::read_bytes;
use crate::io::threemf::tests::{MESH, archive, model, package, read_model, relationships};
use crate::io::{IoError, Place};

fn small_package() -> Vec<u8> {
    let resources = format!(
        "<basematerials id='3'><base name='a' displaycolor='#102030'/></basematerials>\
         <object id='1' pid='3' pindex='0'>{MESH}</object><object id='2'><components>\
         <component objectid='1' transform='1 0 0 0 1 0 0 0 1 0 0 0'/></components></object>"
    );
    let model = model(&resources, "<item objectid='2'/>");
    let relationships = relationships("/a.model");
    let members = [("_rels/.rels", relationships.as_bytes()), ("a.model", model.as_bytes())];
    archive(&members, CompressionMethod::Stored)
}

/// Expects a refusal of the model that says `word`.
fn assert_refused(resources: &str, items: &str, word: &str) {
    match read_model(resources, items) {
        Err(error @ IoError::Unreadable { place: Place::Byte(_), .. }) => {
            assert!(error.to_string().contains(word), "{error}");
        }
        other => panic!("{word}: {other:?}"),
    }
}

#[test]
fn packages_cut_at_any_byte_are_refused() {
    let bytes = small_package();
    assert_eq!(read_bytes("a.3mf", &bytes).expect("readable").batch.len(), 2);
    for length in 0..bytes.len() {
        let error = read_bytes("a.3mf", &bytes[..length]).expect_err("refused");
        assert!(matches!(error, IoError::Unreadable { .. }), "cut at {length}: {error}");
    }
}

/// Edits of bytes: a place, a byte, and whether it replaces, comes between, or one goes.
type Edits = Vec<(prop::sample::Index, u8, u8)>;

fn edits() -> impl Strategy<Value = Edits> {
    prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..6)
}

fn edit(bytes: &mut Vec<u8>, edits: Edits) {
    for (place, byte, kind) in edits {
        let at = place.index(bytes.len());
        match kind {
            0 => bytes[at] = byte,
            1 => bytes.insert(at, byte),
            _ => drop(bytes.remove(at)),
        }
    }
}

proptest! {
    #[test]
    fn mutated_packages_never_bring_the_reader_down(edits in edits()) {
        let mut bytes = small_package();
        edit(&mut bytes, edits);
        let result = read_bytes("a.3mf", &bytes);
        prop_assert!(result.err().is_none_or(|error| error.is_input()));
    }

    #[test]
    fn mutated_models_never_bring_the_reader_down(
        edits in edits(),
        swaps in prop::collection::vec((any::<prop::sample::Index>(), 0..8_usize), 0..3),
    ) {
        let resources = format!(
            "<m:colorgroup id='1'><m:color color='#102030'/></m:colorgroup><basematerials id='2'>\
             <base name='a'/></basematerials><m:compositematerials id='3' matid='2' \
             matindices='0'><m:composite values='1'/></m:compositematerials>\
             <m:multiproperties id='4' pids='1 3'><multi pindices='0 0'/></m:multiproperties>\
             <object id='5' pid='4' pindex='0'>{MESH}</object><object id='6'><components>\
             <component objectid='5'/><component objectid='5'/></components></object>"
        );
        let mut text = model(&resources, "<item objectid='6'/>").into_bytes();
        // Digits for digits: ids and indices that lead elsewhere.
        for (place, digit) in swaps {
            let digits: Vec<_> = (0..text.len()).filter(|&i| text[i].is_ascii_digit()).collect();
            text[digits[place.index(digits.len())]] = b'0' + digit as u8;
        }
        edit(&mut text, edits);
        let relationships = relationships("/a.model");
        let members = [("_rels/.rels", relationships.as_bytes()), ("a.model", &text)];
        let result = read_bytes("a.3mf", &archive(&members, CompressionMethod::Stored));
        prop_assert!(result.err().is_none_or(|error| error.is_input()));
    }
}

#[test]
fn text_that_is_no_xml_or_no_model_is_refused_with_its_place() {
    let good = model(&format!("<object id='1'>{MESH}</object>"), "<item objectid='1'/>");
    let doctype = "<!DOCTYPE model [<!ENTITY a 'aaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;'>]>";
    let utf16: Vec<u8> = good.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for text in [
        Vec::new(),
        b"   ".to_vec(),
        good.replace("</build>", "</built>").into_bytes(),
        good.replace("</model>", "").into_bytes(),
        good.replace("x='0'", "x='0").into_bytes(),
        good.replace("x='0'", "x=0").into_bytes(),
        good.replace("x='0'", "x='&zero;'").into_bytes(),
        good.replace("x='0'", "").into_bytes(),
        good.replace("x='0'", "x='zero'").into_bytes(),
        good.replace("v1='0'", "v1='first'").into_bytes(),
        good.replace("v1='0'", "").into_bytes(),
        good.replace("id='1'>", ">").into_bytes(),
        good.replace("<model", &format!("{doctype}<model")).into_bytes(),
        good.replace("<model", "<mesh><model").into_bytes(),
        good.replace("core/2015", "core/2055").into_bytes(),
        format!("{good}{}", good.trim_start_matches('\u{feff}')).into_bytes(),
        good.replace("<build>", "<build><!-- ").into_bytes(),
        good.bytes().map(|byte| if byte == b'T' { 0xff } else { byte }).collect(),
        utf16,
    ] {
        let relationships = relationships("/a.model");
        let members = [("_rels/.rels", relationships.as_bytes()), ("a.model", &text)];
        match read_bytes("a.3mf", &archive(&members, CompressionMethod::Deflated)) {
            Err(IoError::Unreadable { place: Place::Byte(offset), .. }) => {
                assert!(offset <= text.len() as u64);
            }
            other => panic!("{}: {other:?}", String::from_utf8_lossy(&text)),
        }
    }
}

#[test]
fn references_that_lead_nowhere_are_refused() {
    let object = |rest: &str| format!("<object id='1' {rest}>{MESH}</object>");
    let item = "<item objectid='1'/>";
    assert_refused(&object(""), "<item objectid='2'/>", "resource 2");
    assert_refused(&object("pid='7' pindex='0'"), item, "resource 7");
    assert_refused(&object("pid='1' pindex='0'"), item, "group of properties");
    assert_refused(&object("pid='-1'"), item, "-1");
    let group = "<m:colorgroup id='2'><m:color color='#102030'/></m:colorgroup>";
    assert_refused(&(group.to_owned() + &object("pid='2' pindex='1'")), item, "property 1");
    assert_refused(&(object("") + &object("")), item, "second time");
    assert_refused(&object(""), "<item objectid='1' transform='1 0 0'/>", "twelve numbers");
    assert_refused(&object(""), "<item objectid='1' p:path='/b.model'/>", "b.model");
    assert_refused(group, "<item objectid='2'/>", "another resource");
    let mixed = "<m:compositematerials id='3' matid='2' matindices='1'/>";
    assert_refused(&(group.to_owned() + mixed), "", "property");
    assert_refused(mixed, "", "base materials");
    let layers = "<m:multiproperties id='3' pids='2'><multi pindices='4'/></m:multiproperties>";
    assert_refused(&(group.to_owned() + layers), "", "property");
}

#[test]
fn objects_inside_of_themselves_are_refused() {
    let holder = |id: u32, inner: u32| {
        format!(
            "<object id='{id}'><components><component objectid='{inner}'/></components></object>"
        )
    };
    assert_refused(&holder(1, 1), "<item objectid='1'/>", "themselves");
    let ring = holder(1, 2) + &holder(2, 3) + &holder(3, 1);
    assert_refused(&ring, "<item objectid='2'/>", "themselves");
    // In a ring no object is part of no other.
    assert_eq!(read_model(&ring, "").expect("readable").batch.len(), 0);
}

#[test]
fn towers_and_avalanches_of_components_are_refused() {
    let mut tower = format!("<object id='1'>{MESH}</object>");
    let mut avalanche = tower.clone();
    for id in 2..50_000 {
        let inner = format!("<component objectid='{}'/>", id - 1);
        tower += &format!("<object id='{id}'><components>{inner}</components></object>");
        if id < 60 {
            let components = inner.repeat(2);
            avalanche +=
                &format!("<object id='{id}'><components>{components}</components></object>");
        }
    }
    let result = read_model(&tower, "<item objectid='49999'/>");
    assert!(matches!(result, Err(IoError::TooMany { what: "levels of components", .. })));
    let result = read_model(&avalanche, "<item objectid='59'/>");
    assert!(matches!(result, Err(IoError::TooMany { what: "instances of objects", .. })));
    let crowd = "<component objectid='1'/>".repeat(1 << 20);
    let crowd = format!(
        "<object id='1'><mesh/></object><object id='2'><components>{crowd}</components></object>"
    );
    let result = read_model(&crowd, "<item objectid='2'/>");
    assert!(matches!(result, Err(IoError::TooMany { what: "instances of objects", .. })));
    // More triangles than can be numbered: told before the first.
    let triangles = "<triangle v1='0' v2='1' v3='2'/>".repeat(100_000);
    let mesh = MESH.replace("<triangles>", &format!("<triangles>{triangles}"));
    let many = format!("<object id='1'>{mesh}</object>");
    let result = read_model(&many, &"<item objectid='1'/>".repeat(50_000));
    assert!(matches!(result, Err(IoError::TooMany { what: "polygons", .. })));
}

#[test]
fn endless_markup_is_refused_before_it_fills_the_memory() {
    let long = "x".repeat(2 << 20);
    let deep = "<a>".repeat(100) + &"</a>".repeat(100);
    for resources in [
        format!("<object id='1' name='{long}'/>"),
        format!("<{long}/>"),
        format!("<!--{long}-->"),
        long,
        deep,
    ] {
        assert!(matches!(read_model(&resources, ""), Err(IoError::TooMany { .. })));
    }
    let names: String = (0..1000).map(|i| format!(" xmlns:n{i}='urn:{i}'")).collect();
    assert_refused(&format!("<a{names}/>"), "", "well-formed");
    let attributes: String = (0..60_000).map(|i| format!(" a{i}=''")).collect();
    assert!(read_model(&format!("<a{attributes}/>"), "").is_ok());
}

#[test]
fn content_that_swells_is_refused() {
    // Blanks are what packs best.
    let metadata = format!("<metadata name='a'{}/>", " ".repeat(64 << 10)).repeat(1100);
    let result = read_model(&metadata, "");
    assert!(matches!(result, Err(IoError::Bomb { .. })), "{:?}", result.map(|c| c.batch.len()));
}

#[test]
fn directories_that_lie_are_refused() {
    let bytes = small_package();
    let end = bytes.len() - 22;
    let mut many = bytes.clone();
    many[end + 8..end + 12].fill(0xff);
    assert!(matches!(read_bytes("a.3mf", &many), Err(IoError::TooMany { .. })));
    // A record for large archives, with as many members as there are numbers.
    let mut large = bytes[..end].to_vec();
    let record = large.len() as u64;
    large.extend(b"PK\x06\x06");
    large.extend(44_u64.to_le_bytes());
    large.extend([45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    for number in [1_u64 << 40, 1 << 40, 1 << 50, 1 << 45] {
        large.extend(number.to_le_bytes());
    }
    large.extend(b"PK\x06\x07\0\0\0\0");
    large.extend(record.to_le_bytes());
    large.extend(1_u32.to_le_bytes());
    large.extend(&many[end..]);
    assert!(matches!(read_bytes("a.3mf", &large), Err(IoError::TooMany { .. })));
    // Encrypted, and packed in a way that nobody knows.
    let central = bytes.windows(4).position(|word| word == b"PK\x01\x02").expect("a directory");
    for (at, value) in [(8, 1), (10, 77)] {
        let mut other = bytes.clone();
        other[central + at] = value;
        let error = read_bytes("a.3mf", &other).expect_err("refused");
        assert!(matches!(error, IoError::Unreadable { .. }), "{error}");
    }
    // A byte of a model that is not what its checksum says.
    let mut other = bytes.clone();
    let at = bytes.windows(5).position(|word| word == b"x='1'").expect("a vertex");
    other[at + 3] = b'2';
    assert!(matches!(read_bytes("a.3mf", &other), Err(IoError::Unreadable { .. })));
}

#[test]
fn a_way_out_of_the_folder_is_a_name_like_any_other() {
    let text = model(&format!("<object id='1'>{MESH}</object>"), "<item objectid='1'/>");
    let bytes = package(&text, &[("../../../../etc/passwd", "x"), ("/etc/passwd", "x")]);
    assert_eq!(read_bytes("a.3mf", &bytes).expect("readable").batch.len(), 2);
}
