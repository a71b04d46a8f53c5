//! What a night brings: kills, calls that fail, memory and disk that run out, signals, two runs.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Stdio};

use brickmend::mesh::shapes::sphere;

use crate::support::program::{Bench, Ended, shim};
use crate::support::run::{Encoding, Workshop};
use crate::support::testdata;

/// Small, open, and with a patch: every step has work.
fn small() -> (Bench, Vec<u8>) {
    let model = testdata("models/sphere_without_cap.ply");
    let bench = Bench::new(&model, "ply", &["--depth", "5", "-j", "1"]);
    let ended = bench.run();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let bytes = bench.take_output();
    (bench, bytes)
}

/// After whatever happened, the same command ends well, with the same bytes and nothing left over.
fn assert_goes_on(bench: &Bench, expected: &[u8], what: &str) -> Ended {
    let ended = bench.run();
    assert_eq!(ended.code, Some(0), "{what}: {}", ended.stderr);
    assert!(bench.take_output() == expected, "{what}: other bytes");
    ended
}

/// The output is right. A folder that could not be removed is swept by the next run.
fn assert_done(bench: &Bench, expected: &[u8], what: &str) {
    assert!(std::fs::read(bench.output()).expect("it was said to be there") == expected, "{what}");
    if bench.work_folder().exists() {
        assert_goes_on(bench, expected, what);
    } else {
        bench.take_output();
    }
}

#[test]
fn calls_that_fail_end_in_one_line_or_the_right_result() {
    let failures = fail_calls(3);
    assert!(failures > 50, "only {failures} calls made a run fail");
}

#[test]
#[ignore = "takes minutes: the same, at all calls"]
fn every_call_that_fails_ends_in_one_line_or_the_right_result() {
    let failures = fail_calls(1);
    assert!(failures > 150, "only {failures} calls made a run fail");
}

/// Lets every `step`-th call fail, each in a run of its own; how many of these failed for it.
fn fail_calls(step: usize) -> u64 {
    let (bench, expected) = small();
    let mut failures = 0;
    for number in (1..).step_by(step) {
        let ended = bench.run_with("SHIM_FAIL_CALL", number);
        if !ended.is_struck {
            assert_eq!(ended.code, Some(0));
            bench.take_output();
            break;
        }
        let what = format!("call {number}: {:?} {}", ended.code, ended.stderr);
        match ended.code {
            Some(0) => assert_done(&bench, &expected, &what),
            Some(5 | 65) => {
                failures += 1;
                ended.assert_says_one_line();
                assert!(!bench.output().exists() || ended.code == Some(5), "{what}");
                assert_goes_on(&bench, &expected, &what);
            }
            _ => panic!("{what}"),
        }
    }
    failures
}

#[test]
fn a_disk_that_is_full_at_any_write_ends_with_5_and_a_run_that_goes_on() {
    let (bench, expected) = small();
    let mut failures = 0;
    for number in (1..).step_by(3) {
        let mut command = bench.command();
        command.env("LD_PRELOAD", shim()).env("SHIM_ONLY", "1").env("SHIM_ERRNO", "28");
        command.env("SHIM_FAIL_CALL", number.to_string());
        let ended = Ended::from(command.output().expect("the program starts"));
        if !ended.is_struck {
            break;
        }
        let what = format!("write {number}: {:?} {}", ended.code, ended.stderr);
        match ended.code {
            Some(0) => assert_done(&bench, &expected, &what),
            Some(5) => {
                failures += 1;
                assert_goes_on(&bench, &expected, &what);
            }
            _ => panic!("{what}"),
        }
    }
    assert!(failures > 10, "only {failures} writes made a run fail");
}

#[test]
fn a_kill_at_any_write_costs_work_and_nothing_else() {
    let (bench, expected) = small();
    let mut kills = 0;
    for number in (1..).step_by(3) {
        let mut command = bench.command();
        command.env("LD_PRELOAD", shim()).env("SHIM_ONLY", "1");
        command.env("SHIM_KILL_CALL", number.to_string());
        let ended = Ended::from(command.output().expect("the program starts"));
        if !ended.is_struck {
            break;
        }
        kills += 1;
        assert_eq!(ended.code, None, "killed");
        if bench.output().exists() {
            // Killed between the rename and the end.
            assert!(std::fs::read(bench.output()).expect("readable") == expected);
        }
        assert_goes_on(&bench, &expected, &format!("killed at write {number}"));
    }
    assert!(kills >= 30, "only {kills} kills");
}

#[test]
fn every_large_block_of_memory_that_is_refused_ends_with_75_and_a_run_that_goes_on() {
    let (bench, expected) = small();
    let mut refusals = 0;
    for number in 1.. {
        let ended = bench.run_with("SHIM_FAIL_ALLOCATION", number);
        if !ended.is_struck {
            break;
        }
        refusals += 1;
        let what = format!("block {number}: {:?} {}", ended.code, ended.stderr);
        if ended.code == Some(0) {
            assert_done(&bench, &expected, &what);
            continue;
        }
        assert_eq!(ended.code, Some(75), "{what}");
        ended.assert_says_one_line();
        assert!(ended.stderr.contains("bytes of memory"), "{what}");
        // Not every place is worth a second run.
        if number % 5 == 0 {
            assert_goes_on(&bench, &expected, &what);
        }
    }
    assert!(refusals > 10, "only {refusals} blocks were refused");
}

#[test]
fn a_limit_of_the_file_size_is_a_full_disk() {
    let (bench, expected) = small();
    std::fs::write(bench.output(), "what was there before").expect("writable");
    // In blocks of 512 bytes: less than a window of a brick file.
    let mut command = bench.command_after("ulimit -f 300");
    let ended = Ended::from(command.output().expect("a shell starts"));
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    ended.assert_says_one_line();
    let before = std::fs::read(bench.output()).expect("still there");
    assert_eq!(before, b"what was there before");
    assert_goes_on(&bench, &expected, "after the limit was lifted");
}

#[test]
fn runs_at_the_same_time_work_one_by_one_or_not_at_all() {
    let (bench, expected) = small();
    for _ in 0..4 {
        let start = || {
            let mut command = bench.command();
            command.stdout(Stdio::null()).stderr(Stdio::piped());
            command.spawn().expect("the program starts")
        };
        let runs: Vec<Child> = (0..8).map(|_| start()).collect();
        let ended: Vec<Ended> =
            runs.into_iter().map(|run| run.wait_with_output().expect("it ends").into()).collect();
        let codes: Vec<_> = ended.iter().map(|ended| ended.code).collect();
        assert!(codes.contains(&Some(0)), "{codes:?}");
        assert!(codes.iter().all(|code| matches!(code, Some(0 | 6))), "{codes:?}");
        assert!(bench.take_output() == expected);
    }
}

#[test]
fn a_work_folder_that_is_held_ends_with_6() {
    let (bench, expected) = small();
    std::fs::create_dir(bench.work_folder()).expect("writable");
    let lock = std::fs::File::create(bench.work_folder().join("lock")).expect("writable");
    lock.lock().expect("nobody holds it");
    let ended = bench.run();
    assert_eq!(ended.code, Some(6), "{}", ended.stderr);
    ended.assert_says_one_line();
    drop(lock);
    assert_goes_on(&bench, &expected, "after the lock was given back");
}

#[test]
fn files_that_are_not_ours_survive_in_a_folder_of_our_name() {
    let (bench, expected) = small();
    std::fs::create_dir(bench.work_folder()).expect("writable");
    let foreign = bench.work_folder().join("thesis.txt");
    std::fs::write(&foreign, "years of work").expect("writable");
    let ended = bench.run();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(std::fs::read(&foreign).expect("still there"), b"years of work");
    std::fs::remove_dir_all(bench.work_folder()).expect("removable");
    assert!(bench.take_output() == expected);
}

#[test]
fn an_input_in_the_work_folder_is_refused_and_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join("out.ply");
    let work = folder.path().join("out.ply.brickmend");
    std::fs::create_dir(&work).expect("writable");
    let bytes = std::fs::read(testdata("models/sphere_without_cap.ply")).expect("readable");
    for name in ["output.part", "soup.spool", "lock", "manifest", "sort.3.tmp", "a.ply"] {
        let input = work.join(name);
        std::fs::write(&input, &bytes).expect("writable");
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("repair").arg(&input).arg("-o").arg(&output).args(["--depth", "4"]);
        let ended = Ended::from(command.output().expect("the program starts"));
        assert_eq!(ended.code, Some(2), "{name}: {}", ended.stderr);
        ended.assert_says_one_line();
        assert!(std::fs::read(&input).expect("still there") == bytes, "{name}");
        std::fs::remove_file(&input).expect("removable");
    }
}

/// A run long enough to be spoken to.
fn long() -> (Workshop, Bench) {
    let workshop = Workshop::new();
    let model = workshop.write(&sphere([0.1, 0.2, 0.3], 1.0, 40), Encoding::BinaryStl);
    let bench = Bench::new(&model, "ply", &["--depth", "9", "-v"]);
    (workshop, bench)
}

/// Starts a run and waits until it says `line`.
fn start_until(bench: &Bench, line: &str) -> (Child, BufReader<ChildStderr>) {
    let mut command = bench.command();
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.starts_with(line) {
        said.clear();
        let count = stderr.read_line(&mut said).expect("readable");
        assert!(count > 0, "it ended before it said {line:?}");
    }
    (child, stderr)
}

fn send(child: &Child, signal: &str) {
    let mut command = std::process::Command::new("kill");
    let sent = command.arg(signal).arg(child.id().to_string()).status().expect("kill starts");
    assert!(sent.success());
}

#[test]
fn signals_save_the_state_and_the_run_goes_on_without_the_input() {
    let (_workshop, bench) = long();
    let mut resumptions = 0;
    for (signal, code, line) in
        [("-INT", 130, "checkpoint: read"), ("-TERM", 143, "checkpoint: scan")]
    {
        let (mut child, stderr) = start_until(&bench, line);
        send(&child, signal);
        let status = child.wait().expect("it ends");
        let last = stderr.lines().last().expect("a line").expect("text");
        assert_eq!(status.code(), Some(code), "{last}");
        assert!(last.starts_with("brickmend: "), "{last}");
        assert!(bench.work_folder().join("manifest").exists());
        assert!(!bench.output().exists());
        resumptions += 1;
    }
    let ended = bench.run();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let outcome = ended.outcome();
    assert_eq!(outcome["counters"]["input_bytes_read"], 0);
    assert_eq!(outcome["counters"]["triangles_scanned"], 0);
    assert_eq!(outcome["resume"]["resumptions"], resumptions);
    let resumed = bench.take_output();
    assert_eq!(bench.run().code, Some(0));
    assert!(bench.take_output() == resumed, "other bytes without the stops");
}

#[test]
fn a_second_signal_ends_at_once() {
    let (_workshop, bench) = long();
    let (mut child, _stderr) = start_until(&bench, "checkpoint: read");
    // Both arrive before the run comes to a place where it could stop.
    send(&child, "-STOP");
    send(&child, "-INT");
    send(&child, "-TERM");
    send(&child, "-CONT");
    let status = child.wait().expect("it ends");
    assert!(matches!(status.code(), Some(130 | 143)), "{status}");
}

#[test]
fn a_lost_page_ends_with_one_line_and_5() {
    let (_workshop, bench) = long();
    let (mut child, mut stderr) = start_until(&bench, "checkpoint: read");
    send(&child, "-BUS");
    assert_eq!(child.wait().expect("it ends").code(), Some(5));
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut stderr, &mut rest).expect("text");
    let last = rest.lines().last().expect("a line");
    assert!(last.starts_with("brickmend: ") && last.contains("SIGBUS"), "{rest}");
    assert_eq!(bench.run().code, Some(0));
}

#[test]
fn a_disk_limit_below_the_estimate_is_refused_before_work_with_the_number_needed() {
    let (bench, expected) = small();
    let mut command = bench.command();
    let ended = Ended::from(command.args(["--max-disk", "100kB"]).output().expect("it starts"));
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    ended.assert_says_one_line();
    bench.assert_tidy();
    let needed = ended.stderr.split(' ').filter_map(|word| word.parse::<u64>().ok()).max();
    let needed = needed.expect("the number needed").to_string();
    let mut command = bench.command();
    let ended = Ended::from(command.args(["--max-disk", &needed]).output().expect("it starts"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(bench.take_output() == expected);
}

#[test]
fn fresh_starts_anew() {
    let (_workshop, bench) = long();
    let (mut child, _stderr) = start_until(&bench, "checkpoint: bin");
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let mut command = bench.command();
    let ended = Ended::from(command.arg("--fresh").output().expect("the program starts"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let outcome = ended.outcome();
    assert_eq!(outcome["resume"]["resumptions"], 0);
    assert!(outcome["counters"]["input_bytes_read"].as_u64() > Some(0));
}
