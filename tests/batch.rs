//! A folder of models from outside: what is done, what is done again, and what a kill costs.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use brickmend::catalogue::Journal;
use brickmend::mesh::shapes::{cuboid, sphere, torus};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

/// A folder of models and one of results.
struct Library {
    folder: TempDir,
}

impl Library {
    /// Models in several formats and folders, one of them no model at all, one without a defect.
    fn new() -> Self {
        let library = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        let open = &cuboid([0.0; 3], [1.0, 2.0, 3.0])[2..];
        let ball = sphere([0.0; 3], 1.0, 6);
        library.write("a/open.obj".as_ref(), &obj_of(open));
        library.write("a/deep er/ball.OBJ".as_ref(), &obj_of(&ball[1..]));
        library.write(OsStr::from_bytes(b"a/na\xffme.obj").as_ref(), &obj_of(open));
        library.write("b/sound.off".as_ref(), SOUND);
        library.write("b/torn.obj".as_ref(), "v 0 0 0\nf 1 2 3\n");
        library.write("b/notes.txt".as_ref(), "no model");
        for number in 0..6 {
            let corner = [f64::from(number), 0.0, 0.0];
            let cube = cuboid(corner, [f64::from(number) + 1.0, 1.0, 1.0]);
            library.write(format!("c/{number}.obj").as_ref(), &obj_of(&cube[1..]));
        }
        library
    }

    fn models(&self) -> PathBuf {
        self.folder.path().join("models")
    }

    fn results(&self) -> PathBuf {
        self.folder.path().join("results")
    }

    fn write(&self, relative: &Path, text: &str) {
        let path = self.models().join(relative);
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::write(path, text).expect("writable");
    }

    fn command(&self, results: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("batch").arg(self.models()).arg("-o").arg(results);
        command.args(["--depth", "5", "--max-memory", "256MiB", "--jobs", "2", "--json"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs the batch; its exit code and what it tells.
    fn batch(&self, extra: &[&str]) -> (i32, serde_json::Value) {
        let run = self.command(&self.results()).args(extra).output().expect("the program starts");
        let told = String::from_utf8_lossy(&run.stderr).into_owned();
        let summary = serde_json::from_slice(&run.stdout).unwrap_or_default();
        (run.status.code().unwrap_or_else(|| panic!("{told}")), summary)
    }

    /// Number of attempts at models so far, over all runs.
    fn attempts(&self) -> usize {
        let names = ["a/open.obj", "a/deep er/ball.OBJ", "b/sound.off"];
        let numbers = (0..6).map(|number| format!("c/{number}.obj"));
        let names = names.iter().map(|&name| name.to_owned()).chain(numbers);
        names.map(|name| self.why(&name)["attempts"].as_array().map_or(0, Vec::len)).sum()
    }

    fn why(&self, model: &str) -> serde_json::Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("status").arg(self.results()).args(["--json", "--why", model]);
        let told = command.output().expect("the program starts");
        serde_json::from_slice(&told.stdout).expect("JSON")
    }
}

/// A tetrahedron, closed and outward.
const SOUND: &str = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

fn obj_of(triangles: &[[[f64; 3]; 3]]) -> String {
    let mut text = String::new();
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(text, "v {x} {y} {z}").expect("text grows");
    }
    for first in (1..=3 * triangles.len()).step_by(3) {
        writeln!(text, "f {first} {} {}", first + 1, first + 2).expect("text grows");
    }
    text
}

/// All files below a folder with their bytes, but for the catalogue's own.
fn files_in(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("listable") {
            let path = entry.expect("listable").path();
            if path.file_name() == Some(".brickmend".as_ref()) {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                let relative = path.strip_prefix(folder).expect("below").to_path_buf();
                files.insert(relative, std::fs::read(&path).expect("readable"));
            }
        }
    }
    files
}

fn count(summary: &serde_json::Value, state: &str) -> u64 {
    let states = summary["states"].as_array().expect("a list");
    let of_state = states.iter().filter(|count| count["state"] == state);
    of_state.map(|count| count["models"].as_u64().expect("a number")).sum()
}

#[test]
fn a_folder_is_done_once_and_again_only_where_something_changed() {
    let library = Library::new();
    let (code, summary) = library.batch(&[]);
    assert_eq!(code, 3, "one model is none: {summary}");
    assert_eq!(summary["found"], 11);
    assert_eq!((count(&summary, "copied"), count(&summary, "failed")), (1, 1), "{summary}");
    assert_eq!(count(&summary, "repaired"), 9, "{summary}");
    let first = files_in(&library.results());
    assert_eq!(first.len(), 10, "{:?}", first.keys());
    assert_eq!(first[Path::new("b/sound.off")], SOUND.as_bytes());
    assert_eq!(library.why("b/torn.obj")["cause"], "input");
    let done = library.attempts();
    assert_eq!(done, 9);

    // Nothing changed; a touched model, and one with the same content in another file.
    assert_eq!(library.batch(&[]).0, 3);
    let open = library.models().join("a/open.obj");
    let content = std::fs::read(&open).expect("readable");
    std::fs::remove_file(&open).expect("removable");
    std::fs::write(&open, content).expect("writable");
    assert_eq!(library.batch(&[]).0, 3);
    assert_eq!(library.attempts(), done, "nothing is done again");

    // Another content, a lost result, a spoiled one, a model that is gone, and a new one.
    library.write("c/0.obj".as_ref(), &obj_of(&cuboid([0.0; 3], [2.0; 3])[1..]));
    std::fs::remove_file(library.results().join("c/1.obj")).expect("there");
    std::fs::write(library.results().join("c/2.obj"), "spoiled").expect("writable");
    std::fs::remove_file(library.models().join("c/3.obj")).expect("there");
    let (code, summary) = library.batch(&[]);
    assert_eq!((code, count(&summary, "gone")), (3, 1));
    assert_eq!(library.attempts(), done + 3);
    let second = files_in(&library.results());
    for name in ["c/1.obj", "c/2.obj", "c/3.obj", "a/open.obj"] {
        assert_eq!(second[Path::new(name)], first[Path::new(name)], "{name}");
    }
    assert_ne!(second[Path::new("c/0.obj")], first[Path::new("c/0.obj")]);

    // Other settings make all of it anew, and so does being asked to.
    assert_eq!(library.batch(&["--retry", "all"]).0, 3);
    assert_eq!(library.attempts(), done + 3 + 8);
}

#[test]
fn results_of_one_name_are_told_apart() {
    let library = Library::new();
    library.write("c/0.off".as_ref(), SOUND);
    let (_, summary) =
        library.batch(&["--format", "ply", "--exclude", "a/**,b/**", "--include", "c/0.*"]);
    assert_eq!(summary["found"], 2, "{summary}");
    let files = files_in(&library.results());
    let names: Vec<&Path> = files.keys().map(PathBuf::as_path).collect();
    assert_eq!(names, [Path::new("c/0.obj.ply"), Path::new("c/0.off.ply")]);
}

#[test]
fn a_list_names_the_models_by_whatever_bytes() {
    let library = Library::new();
    let list = library.folder.path().join("list");
    std::fs::write(&list, b"a/na\xffme.obj\nc/1.obj\r\n\ngone.obj\n").expect("writable");
    let list = list.to_str().expect("text");
    let (code, summary) = library.batch(&["--files-from", list]);
    assert_eq!((code, count(&summary, "repaired")), (0, 2), "{summary}");
    // What is planned only is not done.
    let (code, summary) = library.batch(&["--plan"]);
    assert_eq!((code, count(&summary, "repaired"), count(&summary, "pending")), (0, 2, 8));
}

#[test]
fn two_batches_on_one_folder_do_not_meet() {
    let library = Library::new();
    let own = library.results().join(".brickmend");
    std::fs::create_dir_all(&own).expect("a folder");
    let lock = std::fs::File::create(own.join("lock")).expect("a file");
    lock.lock().expect("nobody holds it");
    assert_eq!(library.batch(&[]).0, 6);
    lock.unlock().expect("ours");
    assert_eq!(library.batch(&[]).0, 3);
}

/// Kills a process without a warning.
fn kill(child: &mut Child) {
    child.kill().expect("it is ours");
    child.wait().expect("it is ours");
}

#[test]
fn a_batch_that_is_killed_goes_on_and_ends_as_if_it_had_not_been() {
    let library = Library::new();
    let whole = library.folder.path().join("whole");
    let run = library.command(&whole).output().expect("the program starts");
    assert_eq!(run.status.code(), Some(3));
    for round in 0..8 {
        let mut child = library.command(&library.results()).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(15 + 25 * round));
        kill(&mut child);
    }
    assert_eq!(library.batch(&[]).0, 3);
    assert_eq!(files_in(&library.results()), files_in(&whole));
    let work = library.results().join(".brickmend/work");
    let left = std::fs::read_dir(work).map_or(0, |left| {
        left.flatten()
            .filter(|entry| !entry.file_name().to_string_lossy().starts_with("slot-"))
            .count()
    });
    assert_eq!(left, 0, "nothing is left of the work");
}

#[test]
fn what_is_not_ours_in_the_work_folder_stays() {
    let library = Library::new();
    let scratch = library.folder.path().join("scratch");
    for name in ["2024", "slot-machines"] {
        std::fs::create_dir_all(scratch.join(name)).expect("a folder");
        std::fs::write(scratch.join(name).join("photo"), "precious").expect("writable");
    }
    let work = scratch.to_str().expect("a name of ours");
    for _ in 0..2 {
        assert_eq!(library.batch(&["--work-dir", work]).0, 3);
        let left: Vec<PathBuf> = files_in(&scratch).into_keys().collect();
        assert_eq!(left, [Path::new("2024/photo"), Path::new("slot-machines/photo")]);
    }
}

/// One model that takes a while.
fn slow_library() -> Library {
    let library = Library { folder: tempfile::tempdir().expect("a temporary folder") };
    library.write("slow.obj".as_ref(), &obj_of(&torus(1.0, 0.4, 60, 30)[1..]));
    library
}

/// A run at a depth that takes a while, once a worker is set to the model.
fn start_slowly(library: &Library) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("batch").arg(library.models()).arg("-o").arg(library.results());
    command.args(["--depth", "9", "--max-memory", "256MiB", "--jobs", "1", "--quiet"]);
    let mut child = command.spawn().expect("the program starts");
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) {
        // The journal may not be there yet.
        let journal = Journal::open_to_read(&library.results());
        if let Ok(Ok(summary)) = journal.map(|mut journal| journal.summary())
            && !summary.under_way.is_empty()
        {
            return child;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    kill(&mut child);
    panic!("no worker was set to the model");
}

/// Processes whose parent is this one.
fn children_of(parent: u32) -> Vec<Pid> {
    let parent_of = |pid: i32| -> Option<u32> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
    };
    let entries = std::fs::read_dir("/proc").expect("Linux").flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok());
    pids.filter(|&pid| parent_of(pid) == Some(parent)).filter_map(Pid::from_raw).collect()
}

#[test]
fn a_worker_that_is_killed_is_an_outcome_of_its_model() {
    let library = slow_library();
    let mut batch = start_slowly(&library);
    // A worker may not have been started when the attempt is noted.
    let mut workers = children_of(batch.id());
    while workers.is_empty() && batch.try_wait().expect("it is ours").is_none() {
        workers = children_of(batch.id());
    }
    assert!(!workers.is_empty(), "the model takes longer than this");
    for worker in workers {
        kill_process(worker, Signal::KILL).expect("it is of our run");
    }
    assert_eq!(batch.wait().expect("it is ours").code(), Some(0));
    let why = library.why("slow.obj");
    assert_eq!(why["attempts"][0]["ending"], "memory", "{why}");
    assert_eq!(why["attempts"][1]["ending"], "repaired", "{why}");
}

#[test]
fn a_batch_that_is_asked_to_stop_leaves_the_model_pending() {
    let library = slow_library();
    let mut batch = start_slowly(&library);
    let pid = Pid::from_raw(i32::try_from(batch.id()).expect("small")).expect("a process");
    kill_process(pid, Signal::TERM).expect("it is ours");
    assert_eq!(batch.wait().expect("it is ours").code(), Some(143));
    let why = library.why("slow.obj");
    assert_eq!(why["state"], "pending", "{why}");
    assert_eq!(why["attempts"][0]["ending"], "stopped", "{why}");
}
