//! A folder of models from outside: what is done, what is done again, and what a kill costs.

use std::path::{Path, PathBuf};
use std::time::Duration;

use brickmend::mesh::shapes::cuboid;
use rustix::process::{Pid, Signal, kill_process};

use crate::support::library::{
    Library, SOUND, children_of, files_in, kill, slow_library, start_slowly,
};
use crate::support::obj::unwelded_obj;

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
    library.write("c/0.obj".as_ref(), &unwelded_obj(&cuboid([0.0; 3], [2.0; 3])[1..]));
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
