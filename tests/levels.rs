//! Thresholds of decimation: one file for each from one run, and the one that gives few triangles.

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use brickmend::contour::Method;
use brickmend::io::Format;
use brickmend::mesh::shapes::{Random, sphere};
use brickmend::monitor::{Counter, Monitor, Void};
use brickmend::repair::{
    Blame, Levels, Limits, Outcome, Reach, RepairError, Settings, estimate, repair, repair_levels,
};
use brickmend::store::Backing;
use tempfile::TempDir;

use crate::support::breakage::Breakage;
use crate::support::image::copy_folder;
use crate::support::run::{Encoding, Workshop, at_depth};

const DEPTH: u32 = 6;
const LEVELS: &str = "0,0.1,1cells";
const NAMES: [&str; 3] = ["out.0cells.ply", "out.0.1cells.ply", "out.1cells.ply"];

/// A broken model in a folder of its own.
struct Model {
    workshop: Workshop,
    path: PathBuf,
}

fn broken_sphere() -> Model {
    let mut random = Random::new(31);
    let mut soup = sphere([0.1, 0.2, 0.3], 1.0, 20);
    Breakage::Drop.apply(&mut soup, 0.1, &mut random);
    Breakage::Duplicate.apply(&mut soup, 0.1, &mut random);
    let workshop = Workshop::new();
    let path = workshop.write(&soup, Encoding::Obj);
    Model { workshop, path }
}

fn levels(text: &str) -> Vec<Reach> {
    text.parse::<Levels>().expect("a list").0
}

fn limits() -> Limits {
    // So little that long steps note their progress many times.
    Limits { checkpoint_bytes: 16 << 10, ..Limits::default() }
}

fn run_in(
    folder: &Path,
    input: &Path,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Vec<Outcome>, RepairError> {
    let output = folder.join("out.ply");
    let settings = at_depth(DEPTH);
    repair_levels(input, &output, Format::Ply, &settings, &levels(LEVELS), limits, monitor)
}

/// The bytes of all files by name, which must be those of the levels alone.
fn files_in(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("readable").map(|entry| {
        let path = entry.expect("readable").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, std::fs::read(&path).expect("a file"))
    });
    let files: BTreeMap<_, _> = entries.collect();
    assert_eq!(files.keys().collect::<Vec<_>>(), ["out.0.1cells.ply", NAMES[0], NAMES[2]]);
    files
}

#[test]
fn each_level_is_what_a_run_with_that_threshold_makes_and_scanning_is_done_once() {
    let model = broken_sphere();
    let whole = TempDir::new().expect("a temporary folder");
    let outcomes = run_in(whole.path(), &model.path, &limits(), &Void).expect("a result");
    let files = files_in(whole.path());
    for ((outcome, name), decimate) in outcomes.iter().zip(NAMES).zip(levels(LEVELS)) {
        let settings = Settings { decimate, ..at_depth(DEPTH) };
        let limits = Limits::default();
        let single = model.workshop.repair(&model.path, "ply", &settings, &limits).expect("one");
        assert!(files[name] == std::fs::read(&single.path).expect("a file"), "{name}");
        assert_eq!(outcome.output.path, whole.path().join(name));
        assert_eq!(outcome.settings, settings, "{name}");
        assert_eq!(outcome.output.proof, single.outcome.output.proof, "{name}");
        assert_eq!(outcome.output.contour, single.outcome.output.contour, "{name}");
        assert_eq!(outcome.counters[&Counter::TrianglesScanned], outcome.scan.triangles);
        assert_eq!(outcome.counters[&Counter::InputBytesRead], outcome.input.stats.input_bytes);
    }
    let last = outcomes.last().expect("three outcomes");
    let settings = at_depth(DEPTH);
    let foreseen = estimate(&model.path, Format::Ply, &settings, &limits(), &Void).expect("sums");
    let outputs: u64 = outcomes.iter().map(|outcome| outcome.output.bytes).sum();
    assert!((outputs..=foreseen.disk_bytes_with_levels(3)).contains(&last.disk.peak_bytes));
    let too_little = Limits { max_disk_bytes: Some(foreseen.disk_bytes), ..limits() };
    let refused = TempDir::new().expect("a temporary folder");
    let error = run_in(refused.path(), &model.path, &too_little, &Void).expect_err("no room");
    assert!(matches!(error, RepairError::DiskBelowEstimate { .. }), "{error}");
    let triangles: Vec<u64> = outcomes.iter().map(|o| o.output.proof.triangles).collect();
    assert!(triangles.is_sorted_by(|a, b| a > b), "{triangles:?}");
    let held = TempDir::new().expect("a temporary folder");
    let in_memory = Limits { backing: Backing::Memory, ..limits() };
    run_in(held.path(), &model.path, &in_memory, &Void).expect("a result");
    assert!(files_in(held.path()) == files, "other bytes in memory");
}

/// Keeps a copy of the folder of every checkpoint and every note.
struct Photographer<'f> {
    folder: &'f Path,
    images: Mutex<Vec<(String, TempDir)>>,
}

impl Photographer<'_> {
    fn take(&self, moment: String) {
        let image = TempDir::new().expect("a temporary folder");
        for entry in std::fs::read_dir(self.folder).expect("readable") {
            let path = entry.expect("readable").path();
            let to = image.path().join(path.file_name().expect("a name"));
            if path.is_dir() {
                copy_folder(&path, &to);
            } else {
                std::fs::copy(&path, &to).expect("a copy");
            }
        }
        self.images.lock().expect("no test panicked").push((moment, image));
    }
}

impl Monitor for Photographer<'_> {
    fn checkpoint(&self, step: &str, items: u64) {
        self.take(format!("{step} {items}"));
    }

    fn note(&self, text: &str) {
        self.take(text.to_owned());
    }
}

fn inode(path: &Path) -> Option<u64> {
    std::fs::metadata(path).ok().map(|file| file.ino())
}

#[test]
fn a_kill_at_any_moment_ends_with_the_same_files_and_leaves_finished_ones_alone() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let photographer = Photographer { folder: folder.path(), images: Mutex::default() };
    run_in(folder.path(), &model.path, &limits(), &photographer).expect("a result");
    let expected = files_in(folder.path());
    let images = photographer.images.into_inner().expect("no test panicked");
    let placed = images.iter().position(|(moment, _)| moment == "sign 0").expect("signs");
    let in_place = images.iter().filter(|(moment, _)| moment.ends_with("is in place")).count();
    assert_eq!(in_place, NAMES.len());
    assert!(images.len() > placed + 4 * NAMES.len());
    for (number, (moment, image)) in images.iter().enumerate().skip(placed) {
        let before = NAMES.map(|name| inode(&image.path().join(name)));
        let limits = Limits { threads: 1 + number % 3, ..limits() };
        let outcomes = run_in(image.path(), &model.path, &limits, &Void).expect("it goes on");
        assert!(files_in(image.path()) == expected, "{moment}: other bytes");
        assert_eq!(outcomes.len(), NAMES.len());
        for (name, before) in NAMES.into_iter().zip(before) {
            let now = inode(&image.path().join(name));
            assert!(before.is_none() || before == now, "{moment}: {name} was made again");
        }
        let last = outcomes.last().expect("three outcomes");
        assert_eq!(last.counters[&Counter::TrianglesScanned], 0, "{moment}");
        assert_eq!(last.resume.resumptions, 1, "{moment}");
        assert!(last.resume.rebuilt.is_empty(), "{moment}: {:?}", last.resume.rebuilt);
    }
}

#[test]
fn a_level_that_was_changed_after_it_was_finished_is_made_again() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let photographer = Photographer { folder: folder.path(), images: Mutex::default() };
    run_in(folder.path(), &model.path, &limits(), &photographer).expect("a result");
    let expected = files_in(folder.path());
    let images = photographer.images.into_inner().expect("no test panicked");
    let (_, image) = images.iter().rfind(|(moment, _)| moment == "place 0").expect("an image");
    let (first, second) = (image.path().join(NAMES[0]), image.path().join(NAMES[1]));
    std::fs::remove_file(&second).expect("removable");
    let untouched = inode(&first);
    run_in(image.path(), &model.path, &limits(), &Void).expect("it goes on");
    assert!(files_in(image.path()) == expected);
    assert_eq!(inode(&first), untouched);
    let (_, image) = images.last().expect("an image");
    let mut bytes = std::fs::read(image.path().join(NAMES[0])).expect("readable");
    bytes[1000] ^= 1;
    std::fs::write(image.path().join(NAMES[0]), bytes).expect("writable");
    run_in(image.path(), &model.path, &limits(), &Void).expect("it goes on");
    assert!(files_in(image.path()) == expected);
}

/// Asks to stop after one checkpoint more than the last time.
#[derive(Default)]
struct Impatient {
    patience: AtomicUsize,
    seen: AtomicUsize,
    stop: AtomicBool,
}

impl Monitor for Impatient {
    fn checkpoint(&self, _: &str, _: u64) {
        let seen = self.seen.fetch_add(1, Ordering::Relaxed) + 1;
        self.stop.fetch_or(seen >= self.patience.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

#[test]
fn a_run_that_is_stopped_again_and_again_ends_with_the_same_files() {
    let model = broken_sphere();
    let whole = TempDir::new().expect("a temporary folder");
    run_in(whole.path(), &model.path, &limits(), &Void).expect("a result");
    let stopped = TempDir::new().expect("a temporary folder");
    let mut stops = 0;
    let outcomes = loop {
        let monitor = Impatient { patience: AtomicUsize::new(2), ..Impatient::default() };
        match run_in(stopped.path(), &model.path, &limits(), &monitor) {
            Ok(outcomes) => break outcomes,
            Err(error) => assert_eq!(error.blame(), Blame::Interrupted, "{error}"),
        }
        stops += 1;
        assert!(stops < 200, "it does not come to an end");
    };
    assert!(stops > 8, "only {stops} stops");
    assert_eq!(outcomes.last().map(|last| last.resume.resumptions), Some(stops));
    assert!(files_in(stopped.path()) == files_in(whole.path()));
}

#[test]
fn levels_that_cannot_be_are_refused_before_work() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let output = folder.path().join("out.ply");
    let try_with = |input: &Path, settings: &Settings, text: &str| {
        let levels = levels(text);
        repair_levels(input, &output, Format::Ply, settings, &levels, &limits(), &Void)
    };
    let settings = at_depth(DEPTH);
    let error = try_with(&model.path, &settings, "0,0.5,0.50cells").expect_err("the same file");
    assert!(matches!(error, RepairError::SameLevel { .. }), "{error}");
    let dmc = Settings { method: Method::Dmc, ..settings };
    let error = try_with(&model.path, &dmc, LEVELS).expect_err("nothing to merge");
    assert!(matches!(error, RepairError::NothingToMerge { .. }), "{error}");
    let error = try_with(&model.path, &settings, "0.1cells,3mm").expect_err("no unit");
    assert!(matches!(error, RepairError::NoUnit { .. }), "{error}");
    let input = folder.path().join(NAMES[1]);
    let made = repair(&model.path, &input, Format::Ply, &settings, &limits(), &Void);
    made.expect("a result");
    let error = try_with(&input, &settings, LEVELS).expect_err("the input itself");
    assert!(matches!(error, RepairError::OutputIsInput { .. }), "{error}");
    assert_eq!(error.blame(), Blame::Usage);
}

/// Repairs into `out.ply` in `folder` with at most so many triangles.
fn run_at_most(
    folder: &Path,
    input: &Path,
    triangles: u64,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<(Outcome, Vec<u8>), RepairError> {
    let settings = Settings { max_triangles: Some(triangles), ..at_depth(DEPTH) };
    let output = folder.join("out.ply");
    let outcome = repair(input, &output, Format::Ply, &settings, limits, monitor)?;
    assert_eq!(std::fs::read_dir(folder).expect("readable").count(), 1, "something is left over");
    Ok((outcome, std::fs::read(output).expect("the output")))
}

#[test]
fn a_surface_has_no_more_triangles_than_asked_for_and_the_next_finer_threshold_gives_more() {
    let model = broken_sphere();
    let at = |cells| {
        let settings = Settings { decimate: Reach::Cells(cells), ..at_depth(DEPTH) };
        let limits = Limits::default();
        model.workshop.repair(&model.path, "ply", &settings, &limits).expect("a result")
    };
    let usual = at(0.1).outcome.output.proof.triangles;
    let fewest = at(900.0).outcome.output.proof.triangles;
    assert!(3 * fewest < usual, "{fewest} of {usual}");
    for limit in [usual - 1, (usual + fewest) / 2, fewest + 10] {
        let folder = TempDir::new().expect("a temporary folder");
        let result = run_at_most(folder.path(), &model.path, limit, &limits(), &Void);
        let (outcome, bytes) = result.expect("a result");
        let cells = outcome.output.decimate_cells;
        assert!(outcome.output.proof.triangles <= limit, "{limit}: {cells}");
        assert!(cells > 0.1, "{limit}: {cells}");
        assert!(bytes == std::fs::read(at(cells).path).expect("a file"), "{limit}: other bytes");
        let finer = at(cells / 2_f64.powf(0.25)).outcome.output.proof.triangles;
        assert!(finer > limit, "{limit}: {finer} triangles at the next finer threshold");
        let settings = Settings { max_triangles: Some(limit), ..at_depth(DEPTH) };
        let told = estimate(&model.path, Format::Ply, &settings, &limits(), &Void).expect("sums");
        assert!(outcome.disk.peak_bytes <= told.disk_bytes, "{limit}: {:?}", outcome.disk);
        assert!(told.disk.choose > told.disk.place.max(told.disk.separate));
    }
    let folder = TempDir::new().expect("a temporary folder");
    let result = run_at_most(folder.path(), &model.path, usual, &limits(), &Void);
    let (outcome, bytes) = result.expect("a result");
    assert_eq!(outcome.output.decimate_cells, 0.1, "what fits is left as it is");
    assert!(bytes == std::fs::read(at(0.1).path).expect("a file"));
}

#[test]
fn a_choice_that_is_killed_ends_with_the_same_file_and_one_that_is_made_is_kept() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let photographer = Photographer { folder: folder.path(), images: Mutex::default() };
    let result = run_at_most(folder.path(), &model.path, 4000, &limits(), &photographer);
    let (whole, expected) = result.expect("a result");
    let images = photographer.images.into_inner().expect("no test panicked");
    let trials = images.iter().filter(|(moment, _)| moment.contains("triangles at"));
    assert!((3..=9).contains(&trials.count()));
    let chosen = images.iter().position(|(moment, _)| moment == "choose 0").expect("a choice");
    for (number, (moment, image)) in images.iter().enumerate().skip(chosen.saturating_sub(12)) {
        let notes = Photographer { folder: folder.path(), images: Mutex::default() };
        let limits = Limits { threads: 1 + number % 3, ..limits() };
        let result = run_at_most(image.path(), &model.path, 4000, &limits, &notes);
        let (outcome, bytes) = result.expect("it goes on");
        assert!(bytes == expected, "{moment}: other bytes");
        assert_eq!(outcome.output.decimate_cells, whole.output.decimate_cells, "{moment}");
        assert_eq!(outcome.resume.resumptions, 1, "{moment}");
        let notes = notes.images.into_inner().expect("no test panicked");
        let tried = notes.iter().any(|(moment, _)| moment.contains("triangles at"));
        assert_eq!(tried, number < chosen, "{moment}: a choice that is made is made once");
    }
}

#[test]
fn more_triangles_than_any_threshold_leaves_are_refused_with_the_fewest() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let error = run_at_most(folder.path(), &model.path, 4, &limits(), &Void).expect_err("refused");
    assert_eq!(error.blame(), Blame::Usage);
    let RepairError::TooManyTriangles { limit: 4, fewest } = error else { panic!("{error}") };
    let left = std::fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(left, 0, "something is left over");
    let least = Settings { max_triangles: Some(fewest), ..at_depth(DEPTH) };
    let limits = Limits::default();
    let least = model.workshop.repair(&model.path, "ply", &least, &limits).expect("a result");
    assert!(least.outcome.output.proof.triangles <= fewest);
    let mc = Settings { method: Method::Mc, max_triangles: Some(fewest), ..at_depth(DEPTH) };
    let error = model.workshop.repair(&model.path, "ply", &mc, &limits).err().expect("refused");
    assert!(matches!(error, RepairError::NothingToMerge { .. }), "{error}");
}

#[test]
fn every_level_has_no_more_triangles_than_asked_for() {
    let model = broken_sphere();
    let folder = TempDir::new().expect("a temporary folder");
    let output = folder.path().join("out.ply");
    let settings = Settings { max_triangles: Some(4000), ..at_depth(DEPTH) };
    let levels = levels("0,4cells");
    let outcomes =
        repair_levels(&model.path, &output, Format::Ply, &settings, &levels, &limits(), &Void);
    let outcomes = outcomes.expect("a result");
    assert!(outcomes.iter().all(|outcome| outcome.output.proof.triangles <= 4000));
    let cells: Vec<f64> = outcomes.iter().map(|outcome| outcome.output.decimate_cells).collect();
    assert!(cells[0] > 0.0 && cells[0] < 4.0 && cells[1] == 4.0, "{cells:?}");
}
