//! What befalls a batch in the night: workers that hang, get no memory or are killed, full disks,
//! signals, models that change.

use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use brickmend::mesh::shapes::torus;
use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process, prlimit};

use crate::support::library::{Library, children_of, files_in, slow_library, start_slowly};
use crate::support::obj::unwelded_obj;

/// The worker of a batch that has one, once it is bound to its parent and listens to signals.
fn worker_of(batch: &mut Child) -> Pid {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) {
        if let [worker, ..] = children_of(batch.id())[..]
            && listens(worker)
        {
            return worker;
        }
        assert!(
            batch.try_wait().expect("it is ours").is_none(),
            "the model takes longer than this"
        );
    }
    panic!("no worker was started")
}

/// Whether a process is a worker that catches SIGTERM. Until it became the program of one, it has the
/// handlers of the batch, and is not bound to that yet.
fn listens(process: Pid) -> bool {
    let words = std::fs::read(format!("/proc/{}/cmdline", process.as_raw_pid()));
    if !words.unwrap_or_default().split(|byte| *byte == 0).any(|word| word == b"worker") {
        return false;
    }
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.as_raw_pid()));
    let status = status.unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (Signal::TERM.as_raw() - 1)) != 0
}

fn send(batch: &Child, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(batch.id()).expect("small")).expect("a process");
    kill_process(pid, signal).expect("it is ours");
}

fn is_there(process: Pid) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_pid()));
    // What has ended and was not waited for yet is a Z.
    stat.is_ok_and(|stat| !stat.rsplit_once(')').is_some_and(|(_, rest)| rest.starts_with(" Z")))
}

/// The endings of all attempts at the slow model.
fn endings(library: &Library) -> Vec<String> {
    let why = library.why("slow.obj");
    let attempts = why["attempts"].as_array().expect("a list").iter();
    attempts.map(|attempt| attempt["ending"].as_str().unwrap_or("none").to_owned()).collect()
}

/// The command of [`start_slowly`], to go on with what it left.
fn again(library: &Library) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("batch").arg(library.models()).arg("-o").arg(library.results());
    command.args(["--depth", "9", "--max-memory", "256MiB", "--jobs", "1", "--quiet"]);
    command
}

fn code_of(mut command: Command) -> i32 {
    command.status().expect("the program starts").code().expect("no signal")
}

#[test]
fn a_model_that_takes_too_long_is_tried_alone_and_then_coarser() {
    let library = slow_library();
    let mut command = again(&library);
    command.args(["--model-timeout", "50ms"]);
    let code = code_of(command);
    let why = library.why("slow.obj");
    let attempts = why["attempts"].as_array().expect("a list");
    let rungs: Vec<&str> = attempts.iter().filter_map(|a| a["rung"].as_str()).collect();
    assert_eq!(rungs[..2], ["shared", "alone"], "{why}");
    assert!(rungs.len() >= 3, "{why}");
    assert!(attempts[..2].iter().all(|attempt| attempt["ending"] == "timeout"), "{why}");
    // The coarsest grid may do in that time.
    match why["state"].as_str() {
        Some("degraded") => assert_eq!(code, 0),
        _ => assert_eq!((code, &why["cause"]), (3, &"timeout".into())),
    }
}

#[test]
#[ignore = "waits for the 30 s that a worker has to save its state"]
fn a_worker_that_hangs_is_killed_when_its_time_is_up() {
    let library = slow_library();
    let mut command = again(&library);
    let mut batch = command.args(["--model-timeout", "1s"]).spawn().expect("the program starts");
    let worker = worker_of(&mut batch);
    kill_process(worker, Signal::STOP).expect("it is of our run");
    batch.wait().expect("it is ours");
    assert_eq!(endings(&library)[0], "timeout");
    assert!(!is_there(worker));
}

#[test]
fn a_worker_that_gets_no_memory_is_tried_again_with_all_of_it() {
    let library = slow_library();
    let mut batch = start_slowly(&library);
    let worker = worker_of(&mut batch);
    // All that it asks for from now on is refused.
    let none = Rlimit { current: Some(1 << 20), maximum: Some(1 << 20) };
    prlimit(Some(worker), Resource::As, none).expect("it is of our run");
    let code = batch.wait().expect("it is ours").code();
    let endings = endings(&library);
    assert_eq!(code, Some(0), "{endings:?}");
    // A thread that cannot even be started ends the worker otherwise.
    assert!(["memory", "crash"].contains(&endings[0].as_str()), "{endings:?}");
    assert_eq!(endings[1..], ["repaired"]);
}

#[test]
fn a_first_signal_stops_in_order_and_a_second_one_at_once() {
    let library = slow_library();
    let mut batch = start_slowly(&library);
    worker_of(&mut batch);
    send(&batch, Signal::INT);
    assert_eq!(batch.wait().expect("it is ours").code(), Some(130));
    assert_eq!(library.why("slow.obj")["state"], "pending");
    assert_eq!(endings(&library), ["stopped"]);

    // A worker that hears nothing: the batch waits for it, until it is told again.
    let mut batch = start_slowly(&library);
    let worker = worker_of(&mut batch);
    kill_process(worker, Signal::STOP).expect("it is of our run");
    send(&batch, Signal::INT);
    std::thread::sleep(Duration::from_millis(500));
    assert!(batch.try_wait().expect("it is ours").is_none(), "it waits for its worker");
    send(&batch, Signal::INT);
    assert_eq!(batch.wait().expect("it is ours").code(), Some(130));
    let begun = Instant::now();
    while is_there(worker) && begun.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(!is_there(worker), "workers end with their batch");
    assert_eq!(code_of(again(&library)), 0);
    assert_eq!(endings(&library)[2..], ["repaired"]);
}

#[test]
fn a_batch_stops_when_its_time_is_up_and_goes_on_the_next_night() {
    let library = slow_library();
    let mut command = again(&library);
    command.args(["--for", "100ms"]);
    assert_eq!(code_of(command), 7);
    assert_eq!(library.why("slow.obj")["state"], "pending");
    assert_eq!(code_of(again(&library)), 0);
    assert_eq!(library.why("slow.obj")["state"], "repaired");
}

#[test]
fn a_file_that_may_not_grow_is_a_full_disk_and_the_next_night_goes_on() {
    let library = slow_library();
    let mut shell = Command::new("sh");
    // In blocks of 512 bytes: more than the journal takes, less than the model.
    shell.args(["-c", "ulimit -f 2000; exec \"$@\"", "sh"]);
    let command = again(&library);
    shell.arg(command.get_program()).args(command.get_args());
    assert_eq!(code_of(shell), 5);
    let why = library.why("slow.obj");
    assert_eq!(why["state"], "pending", "{why}");
    assert_eq!(endings(&library), ["disk"]);
    assert!(files_in(&library.results()).is_empty(), "nothing half done is in place");
    assert_eq!(code_of(again(&library)), 0);
    assert_eq!(endings(&library), ["disk", "repaired"]);
}

#[test]
fn a_disk_that_is_full_stops_the_batch_until_there_is_room() {
    let library = slow_library();
    let command = again(&library);
    std::fs::create_dir(library.results()).expect("a folder");
    // A file system of our own, that nobody else sees and that is gone with the shell.
    let script = "mount -t tmpfs -o size=3m none \"$0\" 2>/dev/null || exit 99
        \"$@\"; full=$?
        mount -o remount,size=500m \"$0\"
        \"$@\"; echo $full $?; ls \"$0\"";
    let mut shell = Command::new("unshare");
    shell.args(["-m", "sh", "-c", script]).arg(library.results());
    shell.arg(command.get_program()).args(command.get_args());
    let Ok(run) = shell.output() else {
        println!("skipped: there is no unshare");
        return;
    };
    let said = String::from_utf8_lossy(&run.stdout);
    if said.is_empty() {
        println!("skipped: nothing can be mounted here");
        return;
    }
    assert_eq!(said, "5 0\nslow.obj\n", "{}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn a_model_that_changes_while_it_is_worked_on_ends_as_it_is_in_the_end() {
    let library = slow_library();
    let mut batch = start_slowly(&library);
    let other = unwelded_obj(&torus(1.0, 0.3, 30, 20)[2..]);
    // In place and in two parts, as an editor does that saves.
    library.write(Path::new("slow.obj"), &other[..other.len() / 2]);
    library.write(Path::new("slow.obj"), &other);
    batch.wait().expect("it is ours");
    assert_eq!(code_of(again(&library)), 0);
    let fresh = Library { folder: tempfile::tempdir().expect("a temporary folder") };
    fresh.write(Path::new("slow.obj"), &other);
    assert_eq!(code_of(again(&fresh)), 0);
    assert!(files_in(&library.results()) == files_in(&fresh.results()), "the last one counts");
}
