//! A run goes on from any moment at which it was killed, and from no byte that lies.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use brickmend::contour::Method;
use brickmend::mesh::shapes::{Random, sphere};
use brickmend::monitor::{Counter, Void};
use brickmend::repair::{Limits, Settings};

use crate::support::breakage::Breakage;
use crate::support::image::{Moment, Photographer, Place, copy_folder};
use crate::support::run::{Encoding, Workshop, at_depth};

/// So little that every long step notes its progress many times.
const CHECKPOINT_BYTES: u64 = 64 << 10;
const STEPS: [&str; 16] = [
    "read", "bin", "settle", "mend", "scan", "patch", "flood", "revise", "sign", "choose", "place",
    "separate", "draw", "write", "prove", "measure",
];

/// A broken model, what comes of it, and images of the work on the way.
struct Filmed {
    workshop: Workshop,
    input: PathBuf,
    settings: Settings,
    limits: Limits,
    expected: Vec<u8>,
    images: Vec<(Moment, Place)>,
}

fn film(depth: u32, stride: u64) -> Filmed {
    film_with(at_depth(depth), stride)
}

fn film_with(settings: Settings, stride: u64) -> Filmed {
    let mut random = Random::new(29);
    let mut soup = sphere([0.1, 0.2, 0.3], 1.0, 20);
    Breakage::Drop.apply(&mut soup, 0.1, &mut random);
    Breakage::Duplicate.apply(&mut soup, 0.1, &mut random);
    let workshop = Workshop::new();
    let input = workshop.write(&soup, Encoding::Obj);
    film_file(workshop, input, settings, stride)
}

fn film_file(workshop: Workshop, input: PathBuf, settings: Settings, stride: u64) -> Filmed {
    let limits = Limits { checkpoint_bytes: CHECKPOINT_BYTES, ..Limits::default() };
    let place = Place::new();
    let photographer = Photographer::new(&place, stride);
    place.repair(&input, &settings, &limits, &photographer).expect("a result");
    let expected = std::fs::read(place.output()).expect("the output");
    Filmed { workshop, input, settings, limits, expected, images: photographer.images() }
}

/// The position of a step that is finished at this moment; in the middle of one, of that before.
fn finished(moment: &Moment) -> Option<usize> {
    let step = STEPS.iter().position(|step| *step == moment.step)?;
    if moment.items == 0 { Some(step) } else { step.checked_sub(1) }
}

#[test]
fn a_kill_at_any_checkpoint_costs_no_finished_step() {
    let filmed = film(7, u64::MAX);
    let within = |step| filmed.images.iter().filter(|(m, _)| m.step == step && m.items > 0).count();
    for step in ["scan", "sign", "place", "write"] {
        assert!(within(step) > 2, "{step} noted its progress {} times", within(step));
    }
    for (moment, image) in &filmed.images {
        let done = finished(moment).expect("every checkpoint names a step");
        // The number of threads is no part of the work.
        let limits = Limits { threads: 1 + done % 3, ..filmed.limits.clone() };
        let (outcome, bytes) = image.resume(&filmed.input, &filmed.settings, &limits);
        assert!(bytes == filmed.expected, "{moment:?}: other bytes");
        assert_eq!(outcome.resume.resumptions, 1, "{moment:?}");
        assert!(outcome.resume.rebuilt.is_empty(), "{moment:?}: {:?}", outcome.resume.rebuilt);
        assert_eq!(outcome.counters[&Counter::InputBytesRead], 0, "{moment:?}");
        let scanned = outcome.counters[&Counter::TrianglesScanned];
        match STEPS[done] {
            "read" | "bin" | "settle" => assert_eq!(scanned, outcome.scan.triangles, "{moment:?}"),
            "mend" if moment.items > 0 => {
                assert!(scanned < outcome.scan.triangles, "{moment:?}: scanned all again");
            }
            "mend" => assert_eq!(scanned, outcome.scan.triangles, "{moment:?}"),
            _ => assert_eq!(scanned, 0, "{moment:?}"),
        }
    }
}

#[test]
fn a_kill_between_checkpoints_goes_on_from_the_last_one() {
    let filmed = film(7, 12);
    let between: Vec<_> = filmed.images.iter().filter(|(m, _)| m.step.is_empty()).collect();
    assert!(between.len() >= 30, "only {} images", between.len());
    for (_, image) in between {
        let (_, bytes) = image.resume(&filmed.input, &filmed.settings, &filmed.limits);
        assert!(bytes == filmed.expected, "other bytes");
    }
}

#[test]
fn textured_surfaces_go_on_from_any_moment() {
    let mut text = String::new();
    for (number, [x, y, z]) in sphere([0.0; 3], 1.0, 20)[7..].iter().flatten().enumerate() {
        let u = y.atan2(*x);
        writeln!(text, "v {x} {y} {z} {} 0 0.5\nvt {u} {z}", 0.5 + 0.4 * x).expect("strings grow");
        if number % 3 == 2 {
            let [a, b, c] = [number - 1, number, number + 1];
            writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}").expect("strings grow");
        }
    }
    let workshop = Workshop::new();
    let input = workshop.write_text("obj", &text);
    let filmed = film_file(workshop, input, at_depth(6), 9);
    for step in ["draw", "write", "prove"] {
        assert!(filmed.images.iter().any(|(moment, _)| moment.step == step), "{step}");
    }
    let late = filmed.images.iter().rposition(|(moment, _)| moment.step == "separate");
    let late = late.expect("a step before");
    let early = filmed.images[..late].iter().step_by(5);
    for (moment, image) in early.chain(&filmed.images[late..]) {
        let limits = Limits { threads: 3, ..filmed.limits.clone() };
        let (outcome, bytes) = image.resume(&filmed.input, &filmed.settings, &limits);
        assert!(bytes == filmed.expected, "{moment:?}: other bytes");
        assert!(outcome.transfer.attributes.uvs && outcome.transfer.attributes.colours);
    }
}

#[test]
fn marching_cubes_go_on_from_any_checkpoint() {
    let filmed = film_with(Settings { method: Method::Mc, ..at_depth(7) }, u64::MAX);
    for step in ["place", "write"] {
        let within = filmed.images.iter().filter(|(m, _)| m.step == step && m.items > 0);
        assert!(within.count() > 2, "{step}");
    }
    let images =
        filmed.images.iter().filter(|(m, _)| ["sign", "place", "write"].contains(&&*m.step));
    for (moment, image) in images {
        let limits = Limits { threads: 1 + moment.items as usize % 3, ..filmed.limits.clone() };
        let (outcome, bytes) = image.resume(&filmed.input, &filmed.settings, &limits);
        assert!(bytes == filmed.expected, "{moment:?}: other bytes");
        assert_eq!(outcome.resume.resumptions, 1, "{moment:?}");
        assert_eq!(outcome.counters[&Counter::TrianglesScanned], 0, "{moment:?}");
    }
}

/// Files of an image that a later run reads.
fn files_of(image: &Place) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(image.work_folder()).expect("readable");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.retain(|file| {
        !file.ends_with("lock") && std::fs::metadata(file).is_ok_and(|m| m.len() > 0)
    });
    files.sort();
    files
}

/// A way to damage bytes; how many of them are left.
type Lie = fn(&mut [u8], &mut Random) -> usize;

fn flip_a_bit(bytes: &mut [u8], random: &mut Random) -> usize {
    let at = random.below(bytes.len());
    bytes[at] ^= 1 << random.below(8);
    bytes.len()
}

fn cut_off(bytes: &mut [u8], random: &mut Random) -> usize {
    random.below(bytes.len())
}

fn zero_a_page(bytes: &mut [u8], random: &mut Random) -> usize {
    let page = random.below(bytes.len().div_ceil(4096));
    let end = bytes.len().min((page + 1) * 4096);
    bytes[page * 4096..end].fill(0);
    bytes.len()
}

fn swap_two_stretches(bytes: &mut [u8], random: &mut Random) -> usize {
    let half = bytes.len() / 2;
    let length = 1 + random.below(half.clamp(1, 2000));
    for i in 0..length.min(half) {
        bytes.swap(i, half + i);
    }
    bytes.len()
}

fn another_version(bytes: &mut [u8], _: &mut Random) -> usize {
    if let Some(version) = bytes.get_mut(8) {
        *version ^= 0x40;
    }
    bytes.len()
}

const LIES: [Lie; 5] = [flip_a_bit, cut_off, zero_a_page, swap_two_stretches, another_version];

/// The right bytes come out, whatever a file of the work folder holds.
fn assert_lie_is_found(filmed: &Filmed, image: &Place, file: &Path, lie: Lie, random: &mut Random) {
    let copy = Place::new();
    copy_folder(&image.work_folder(), &copy.work_folder());
    let target = copy.work_folder().join(file.file_name().expect("a name"));
    let mut bytes = std::fs::read(&target).expect("readable");
    let left = lie(&mut bytes, random);
    bytes.truncate(left);
    std::fs::write(&target, &bytes).expect("writable");
    let result = copy.repair(&filmed.input, &filmed.settings, &filmed.limits, &Void);
    let outcome = result.unwrap_or_else(|error| panic!("{}: {error}", target.display()));
    let output = std::fs::read(copy.output()).expect("the output is there");
    assert!(output == filmed.expected, "{}: wrong bytes", target.display());
    assert!(outcome.resume.rebuilt.len() <= 1, "{:?}", outcome.resume.rebuilt);
    assert!(!copy.work_folder().exists());
}

#[test]
fn a_file_that_lies_is_made_again_and_never_believed() {
    let filmed = film(6, u64::MAX);
    let mut random = Random::new(61);
    let mut lies = 0;
    for (number, (_, image)) in filmed.images.iter().enumerate() {
        for file in files_of(image) {
            let lie = LIES[(number + lies) % LIES.len()];
            assert_lie_is_found(&filmed, image, &file, lie, &mut random);
            lies += 1;
        }
    }
    assert!(lies > 100, "only {lies} lies");
    let is_proved = |moment: &Moment| moment.step == "prove" && moment.items == 0;
    let (_, image) = filmed.images.iter().find(|(moment, _)| is_proved(moment)).expect("a proof");
    let proved = image.work_folder().join("output.part");
    for lie in LIES {
        assert_lie_is_found(&filmed, image, &proved, lie, &mut random);
    }
}

#[test]
fn a_file_that_is_gone_is_made_again() {
    let filmed = film(6, u64::MAX);
    for (moment, image) in filmed.images.iter().step_by(3) {
        for file in files_of(image) {
            let copy = Place::new();
            copy_folder(&image.work_folder(), &copy.work_folder());
            let target = copy.work_folder().join(file.file_name().expect("a name"));
            std::fs::remove_file(target).expect("removable");
            let (_, bytes) = copy.resume(&filmed.input, &filmed.settings, &filmed.limits);
            assert!(bytes == filmed.expected, "{moment:?} without {}", file.display());
        }
    }
}

#[test]
fn another_input_or_setting_starts_anew() {
    let filmed = film(6, u64::MAX);
    let (_, image) = filmed.images.iter().rfind(|(m, _)| m.step == "sign").expect("an image");
    let settings = filmed.settings;
    for settings in
        [Settings { crease_deg: 30.0, ..settings }, Settings { method: Method::Mc, ..settings }]
    {
        let copy = Place::new();
        copy_folder(&image.work_folder(), &copy.work_folder());
        let outcome =
            copy.repair(&filmed.input, &settings, &filmed.limits, &Void).expect("a result");
        assert_eq!(outcome.resume.resumptions, 0);
        assert!(outcome.counters[&Counter::InputBytesRead] > 0);
    }
    let other = filmed.workshop.write(&sphere([0.0; 3], 1.0, 9), Encoding::Obj);
    let outcome = image.repair(&other, &filmed.settings, &filmed.limits, &Void).expect("a result");
    assert_eq!(outcome.resume.resumptions, 0);
}

#[test]
fn a_disk_limit_stops_on_the_way_and_more_room_goes_on() {
    let filmed = film(6, u64::MAX);
    let (_, image) = filmed.images.iter().find(|(m, _)| m.step == "read").expect("an image");
    let tight = Limits { max_disk_bytes: Some(600 << 10), ..filmed.limits.clone() };
    let error = image.repair(&filmed.input, &filmed.settings, &tight, &Void).expect_err("no room");
    assert_eq!(error.blame(), brickmend::repair::Blame::Limit, "{error}");
    assert!(image.work_folder().exists());
    let (outcome, bytes) = image.resume(&filmed.input, &filmed.settings, &filmed.limits);
    assert!(bytes == filmed.expected);
    assert!(outcome.disk.peak_bytes > 600 << 10);
    assert_eq!(outcome.counters[&Counter::InputBytesRead], 0);
}
