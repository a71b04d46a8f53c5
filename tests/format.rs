//! `docs/format.md` says what the code writes: sizes, offsets, magics, bits.

use std::mem::offset_of;
use std::path::Path;

use brickmend::geom::morton;
use brickmend::octree::{
    AXIS_EDGES, AttributeRecord, BinEntry, BrickKey, CellBrick, Crossing, DropRecord, EdgeBrick,
    FlipRecord, HitBrick, HitEdge, LINES, MAX_HITS, NarrowTriangle, PATCH, SIDE, SignBrick,
    SoupTriangle, SourcePlane, TRANSPARENT, decode_cells, decode_edges, decode_hits, decode_signs,
    edge_index, encode, face_index,
};
use brickmend::paint::{AskedPlace, DrawnCorner, DrawnTriangle};
use brickmend::scan::HAS_ODD_FACES;
use brickmend::store::{
    Backing, BrickFile, BrickWriter, DirectoryEntry, FORMAT_VERSION, Manifest, Scratch,
    SpoolWriter, load_manifest, save_manifest,
};

fn document() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/format.md");
    std::fs::read_to_string(path).expect("docs/format.md is there")
}

/// The lines of the section whose heading begins with `title`.
fn section(title: &str) -> Vec<String> {
    let text = document();
    let is_heading = |line: &&str| line.starts_with('#');
    let mut lines = text.lines().skip_while(|line| {
        !(is_heading(line) && line.trim_start_matches('#').trim_start().starts_with(title))
    });
    let heading = lines.next().unwrap_or_else(|| panic!("docs/format.md has no section {title}"));
    let body = lines.take_while(|line| !is_heading(line));
    std::iter::once(heading).chain(body).map(str::to_owned).collect()
}

/// Offset and size of every field of the byte map in a section.
fn byte_map(title: &str) -> Vec<(usize, usize)> {
    let lines = section(title);
    let fields = lines.iter().filter_map(|line| {
        let mut words = line.split_whitespace();
        Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    });
    fields.collect()
}

/// The size in the heading of a section: `### Name, 88 bytes`.
fn stated_size(title: &str) -> usize {
    let heading = section(title).remove(0);
    let number = heading.split(", ").nth(1).and_then(|rest| rest.split(' ').next());
    number.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{heading} states no size"))
}

/// A record's byte map is without gaps, as long as its heading says and as its type is, and its
/// fields begin where the type's fields do.
fn check_record<R>(title: &str, offsets: &[usize]) {
    let map = byte_map(title);
    let starts: Vec<usize> = map.iter().map(|field| field.0).collect();
    assert_eq!(starts, offsets, "{title}: offsets");
    for pair in map.windows(2) {
        assert_eq!(pair[0].0 + pair[0].1, pair[1].0, "{title}: a gap or an overlap");
    }
    let end = map.last().map(|field| field.0 + field.1);
    assert_eq!(end, Some(size_of::<R>()), "{title}: end of the map");
    if section(title)[0].contains(", ") {
        assert_eq!(stated_size(title), size_of::<R>(), "{title}: heading");
    }
}

/// Whether the section holds `text`.
fn says(title: &str, text: &str) {
    let lines = section(title).join("\n");
    assert!(lines.contains(text), "docs/format.md, {title}: does not say {text:?}");
}

#[test]
fn records_of_spools_are_as_documented() {
    check_record::<SoupTriangle>(
        "SoupTriangle",
        &[
            offset_of!(SoupTriangle, corners),
            offset_of!(SoupTriangle, source),
            offset_of!(SoupTriangle, part),
            offset_of!(SoupTriangle, material),
            offset_of!(SoupTriangle, stands_for),
        ],
    );
    assert_eq!(TRANSPARENT, 1 << 31);
    says("SoupTriangle", "(bits 0..30), light passes (bit 31)");
    check_record::<NarrowTriangle>(
        "NarrowTriangle",
        &[
            offset_of!(NarrowTriangle, corners),
            offset_of!(NarrowTriangle, source),
            offset_of!(NarrowTriangle, part),
            offset_of!(NarrowTriangle, material),
        ],
    );
    check_record::<AttributeRecord>(
        "AttributeRecord",
        &[
            offset_of!(AttributeRecord, corners),
            offset_of!(AttributeRecord, uvs),
            offset_of!(AttributeRecord, colours),
            offset_of!(AttributeRecord, unused),
        ],
    );
    check_record::<DrawnTriangle>(
        "DrawnTriangle",
        &[offset_of!(DrawnTriangle, indices), offset_of!(DrawnTriangle, surface)],
    );
    check_record::<DrawnCorner>(
        "DrawnCorner",
        &[
            offset_of!(DrawnCorner, vertex),
            offset_of!(DrawnCorner, triangle),
            offset_of!(DrawnCorner, corner),
            offset_of!(DrawnCorner, look),
            offset_of!(DrawnCorner, others),
            offset_of!(DrawnCorner, normal),
            offset_of!(DrawnCorner, angle),
            offset_of!(DrawnCorner, height),
        ],
    );
    check_record::<AskedPlace>(
        "AskedPlace",
        &[
            offset_of!(AskedPlace, position),
            offset_of!(AskedPlace, vertex),
            offset_of!(AskedPlace, look),
            offset_of!(AskedPlace, source),
            offset_of!(AskedPlace, unused),
        ],
    );
    check_record::<BinEntry>(
        "BinEntry",
        &[offset_of!(BinEntry, brick), offset_of!(BinEntry, first), offset_of!(BinEntry, count)],
    );
    check_record::<DropRecord>(
        "DropRecord",
        &[
            offset_of!(DropRecord, brick),
            offset_of!(DropRecord, source),
            offset_of!(DropRecord, unused),
        ],
    );
    check_record::<FlipRecord>(
        "FlipRecord",
        &[
            offset_of!(FlipRecord, brick),
            offset_of!(FlipRecord, edge),
            offset_of!(FlipRecord, offset),
            offset_of!(FlipRecord, unused),
        ],
    );
}

#[test]
fn directory_entries_are_as_documented() {
    check_record::<DirectoryEntry>(
        "Entry",
        &[
            offset_of!(DirectoryEntry, key),
            offset_of!(DirectoryEntry, offset),
            offset_of!(DirectoryEntry, len_bytes),
            offset_of!(DirectoryEntry, flags),
            offset_of!(DirectoryEntry, hash),
        ],
    );
    assert_eq!(HAS_ODD_FACES, 1);
    says("Entry", "in hits.bricks bit 0: the brick sees an odd face");
}

fn scratch() -> (tempfile::TempDir, Scratch) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let scratch = Scratch::new(folder.path());
    (folder, scratch)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

#[test]
fn a_spool_lies_on_disk_as_documented() {
    let (_folder, scratch) = scratch();
    let mut writer = SpoolWriter::create(&scratch, "soup.spool").expect("writable");
    let corners = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.5]];
    let triangle =
        SoupTriangle { corners, source: 11, part: 12, material: TRANSPARENT, stands_for: 0 };
    writer.push(triangle).expect("writable");
    writer.push(SoupTriangle { source: 13, ..triangle }).expect("writable");
    let spool = writer.finish().expect("writable");
    let bytes = std::fs::read(scratch.path("soup.spool")).expect("readable");
    let map = byte_map("Spool");
    assert_eq!(map, [(0, 8), (8, 4), (12, 4), (16, 8), (24, 16), (40, 24)]);
    says("Spool", "\"BRMDSPOL\"");
    says("Spool", "65536 / record size records");
    says("Spool", "    64        records");
    assert_eq!(&bytes[..8], b"BRMDSPOL");
    assert_eq!(u32_at(&bytes, 8), FORMAT_VERSION);
    assert_eq!(u32_at(&bytes, 12), 88);
    assert_eq!(u64_at(&bytes, 16), 2);
    let digests = &bytes[64 + 2 * 88..];
    assert_eq!(digests, &xxh3_of(&bytes[64..64 + 2 * 88])[..], "one block");
    assert_eq!(bytes[24..40], blake3_of(digests)[..16]);
    assert_eq!(spool.state().root, bytes[24..40]);
    assert!(bytes[40..64].iter().all(|&byte| byte == 0));
    assert_eq!(bytes[64 + 64..64 + 72], 9.5_f64.to_le_bytes(), "the last coordinate");
    assert_eq!(u32_at(&bytes, 64 + 72), 11);
    assert_eq!(u32_at(&bytes, 64 + 76), 12);
    assert_eq!(u32_at(&bytes, 64 + 80), 1 << 31);
    assert_eq!(u32_at(&bytes, 64 + 88 + 72), 13);
}

#[test]
fn the_version_is_the_documented_one() {
    says("Files in the work folder", &format!("Version: {FORMAT_VERSION}, in every header"));
}

#[test]
fn a_brick_file_lies_on_disk_as_documented() {
    const WINDOW: usize = 262_144;
    let (_folder, scratch) = scratch();
    let mut writer = BrickWriter::create(&scratch, "a", Backing::Mapped).expect("writable");
    let long = vec![3; WINDOW + 5];
    let records: [(u64, u32, &[u8]); 4] =
        [(2, 7, &[1; 5]), (5, 0, &[2; 33]), (8, 1, &long), (9, 0, &[4; 16])];
    for (key, flags, bytes) in records {
        writer.append(key, flags, bytes).expect("writable");
    }
    let file: BrickFile = writer.finish(2).expect("writable");
    let bytes = std::fs::read(scratch.path("a")).expect("readable");
    let map = byte_map("Brick file");
    assert_eq!(map, [(0, 8), (8, 4), (12, 4), (16, 48)]);
    says("Brick file", "\"BRMDBRIK\"");
    says("Brick file", "window size: 262144");
    says("Brick file", "starts at a multiple of 16");
    assert_eq!(&bytes[..8], b"BRMDBRIK");
    assert_eq!(u32_at(&bytes, 8), FORMAT_VERSION);
    assert_eq!(u32_at(&bytes, 12) as usize, WINDOW);
    assert!(bytes[16..64].iter().all(|&byte| byte == 0));
    let offsets: Vec<u64> = file.directory().iter().map(|entry| entry.offset).collect();
    assert_eq!(offsets[0], 64);
    assert_eq!(offsets[1], 80, "the next multiple of 16");
    assert_eq!(offsets[2] as usize, WINDOW, "longer than a window: begins at one");
    assert_eq!(offsets[3] as usize, WINDOW + (WINDOW + 5).next_multiple_of(16));
    assert_eq!(bytes.len() % WINDOW, 0, "whole windows");
    let directory = std::fs::read(scratch.path("a.directory")).expect("readable");
    let header = &directory[..64];
    assert_eq!(byte_map("Directory, 40"), [(0, 8), (8, 4), (12, 4), (16, 48)]);
    assert_eq!(&header[..8], b"BRMDDIRY");
    says("Directory, 40", "\"BRMDDIRY\"");
    assert_eq!((u32_at(header, 8), u32_at(header, 12)), (FORMAT_VERSION, 40));
    let directory = &directory[64..];
    assert_eq!(directory.len(), 4 * 40);
    assert_eq!(file.state().expect("on disk").root, blake3_of(directory)[..16]);
    let second = &directory[40..80];
    assert_eq!(u64_at(second, 0), 5);
    assert_eq!(u64_at(second, 8), 80);
    assert_eq!(u32_at(second, 16), 33);
    assert_eq!(u32_at(directory, 20), 7);
    assert_eq!(second[24..40], xxh3_of(&[2; 33]));
}

/// What stands for a part of a file.
fn xxh3_of(bytes: &[u8]) -> [u8; 16] {
    twox_hash::XxHash3_128::oneshot(bytes).to_le_bytes()
}

/// The manifest stores a hash of its body; of a body of ours through the public door.
fn blake3_of(bytes: &[u8]) -> [u8; 32] {
    *blake3::hash(bytes).as_bytes()
}

#[test]
fn a_manifest_lies_on_disk_as_documented() {
    let (_folder, scratch) = scratch();
    let path = scratch.path("manifest");
    let steps = vec!["read".to_owned()];
    let manifest = Manifest { key: [9; 32], steps, ..Manifest::default() };
    save_manifest(&path, &manifest).expect("writable");
    let bytes = std::fs::read(&path).expect("readable");
    assert_eq!(byte_map("Manifest"), [(0, 8), (8, 4), (12, 4), (16, 32)]);
    says("Manifest", "\"BRMDMANI\"");
    says("Manifest", "    48        body");
    assert_eq!(&bytes[..8], b"BRMDMANI");
    assert_eq!(u32_at(&bytes, 8), FORMAT_VERSION);
    assert_eq!(u32_at(&bytes, 12) as usize, bytes.len() - 48);
    assert_eq!(bytes[16..48], blake3_of(&bytes[48..]));
    assert_eq!(load_manifest(&path).expect("readable"), Some(manifest));
}

#[test]
fn numbers_within_a_brick_are_as_documented() {
    assert_eq!((SIDE, LINES, LINES * LINES), (32, 33, 1089));
    assert_eq!(AXIS_EDGES, 35_937);
    says("Records of bricks", "x + 33 y + 1089 z, each 0..32");
    says("Records of bricks", "axis x 35937");
    says("Records of bricks", "0..107810");
    assert_eq!(edge_index(2, [32, 32, 32]), 107_810);
    assert_eq!(edge_index(1, [1, 2, 3]), 35_937 + 1 + 33 * 2 + 1089 * 3);
    // Bit 3i + a of a key is bit i of coordinate a.
    assert_eq!(BrickKey::new([0b10, 0b01, 0b11]).0, 0b101_110);
    assert_eq!(morton::decode(0b101_110), [0b10, 0b01, 0b11]);
}

#[test]
fn hit_bricks_are_as_documented() {
    let plane = SourcePlane { normal: [0.0, 0.0, 1.0], ..SourcePlane::default() };
    let edge = HitEdge::new(107_810, 3, MAX_HITS, -2);
    assert_eq!(edge.bits, 107_810 | 3 << 17 | 3 << 19 | 0x7fe << 21);
    assert_eq!((edge.edge(), edge.class(), edge.kept(), edge.signed_sum()), (107_810, 3, 3, -2));
    for (sum, kept) in [(1, 1), (-1, -1), (1023, 1023), (-1024, -1023), (i16::MAX, 1023)] {
        assert_eq!(HitEdge::new(0, 1, 1, sum).signed_sum(), kept);
    }
    says("HitBrick", "from -1023 to 1023, in two's complement");
    says("HitBrick", "bits  0..16  edge number");
    says("HitBrick", "bits 17..18  count class");
    says("HitBrick", "bits 19..20  kept hits, at most 3");
    let classes = (0..4).scan(0, |class, _| {
        *class = HitEdge::next_class(*class);
        Some(*class)
    });
    assert_eq!(classes.collect::<Vec<_>>(), [1, 2, 3, 2]);
    let brick = HitBrick { edges: vec![edge], hits: vec![0, 0, 0], planes: vec![plane] };
    let bytes = encode(&brick);
    let archived = decode_hits(&bytes).expect("what was written validates");
    assert_eq!(size_of_val(&archived.edges[0]), 4);
    assert_eq!(size_of_val(&archived.hits[0]), 4);
    assert_eq!(size_of_val(&archived.planes[0]), stated_size("SourcePlane"));
    check_record::<SourcePlane>("SourcePlane", &[0, 8, 20, 24, 28]);
}

#[test]
fn sign_and_cell_bricks_are_as_documented() {
    assert_eq!(PATCH, 1 << 31);
    says("SignBrick", "bit 31 = 1: a patch; bits 0..15 are the offset");
    let crossings = vec![Crossing { edge: 5, plane: PATCH | 0xffff }];
    let bytes = encode(&SignBrick {
        base_inside: true,
        crossings,
        planes: Vec::new(),
        borders: Vec::new(),
        walls: vec![face_index(1, [2, 3, 4])],
    });
    let signs = decode_signs(&bytes).expect("what was written validates");
    assert_eq!((size_of_val(&signs.base_inside), size_of_val(&signs.crossings[0])), (1, 8));
    says("SignBrick", "32768 * axis + x + 32 y + 1024 z");
    assert_eq!(signs.walls[0].to_native(), 32768 + 2 + 32 * 3 + 1024 * 4);
    let beyond = SignBrick { walls: vec![3 * 32768], ..SignBrick::default() };
    assert!(decode_signs(&encode(&beyond)).is_err(), "there are three axes");
    says("CellBrick", "bits  0..14  cell number");
    says("CellBrick", "bits 15..22  corner mask");
    says("CellBrick", "bits 23..28  a bit for each face");
    says("CellBrick", "bit      29  one vertex for all components");
    let brick = CellBrick {
        cells: vec![1 << 23],
        positions: vec![[1, 2, 3]],
        offsets: vec![4],
        ..CellBrick::default()
    };
    let bytes = encode(&brick);
    let cells = decode_cells(&bytes).expect("what was written validates");
    assert_eq!(size_of_val(&cells.cells[0]), 4);
    assert_eq!(size_of_val(&cells.positions[0]), 12);
    assert_eq!(size_of_val(&cells.offsets[0]), 2);
    let beyond = CellBrick { cells: vec![1 << 30], ..CellBrick::default() };
    assert!(decode_cells(&encode(&beyond)).is_err(), "bits 30..31 are zero");
}

#[test]
fn edge_bricks_are_as_documented() {
    says("EdgeBrick", "bits  0..14  cell number");
    says("EdgeBrick", "bits 15..22  corner mask");
    says("EdgeBrick", "u32 per crossing on the three edges that leave the min corner");
    // The last cell of a brick, its min corner alone inside: crossed along all axes.
    let brick = EdgeBrick { cells: vec![0x7fff | 1 << 15], places: vec![1, 2, 3] };
    let bytes = encode(&brick);
    let edges = decode_edges(&bytes).expect("what was written validates");
    assert_eq!((size_of_val(&edges.cells[0]), size_of_val(&edges.places[0])), (4, 4));
    let beyond = EdgeBrick { cells: vec![1 << 23], ..EdgeBrick::default() };
    assert!(decode_edges(&encode(&beyond)).is_err(), "bits 23..31 are zero");
}
