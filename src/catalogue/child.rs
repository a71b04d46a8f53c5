//! A worker process from outside: started, listened to, stopped in time.
//!
//! In:         a [`Job`]. Out: [`Exited`]: how the process ended and what it said.
//! Invariant:  no process outlives the call. A worker that is asked to stop has time to save its
//!             state, and is killed after that. It is in a process group of its own, so that what
//!             stops the batch from the terminal does not stop it twice.
//! Memory:     the last lines of what the worker says on stderr.
//! Fails:      the process cannot be started.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use rustix::process::{Pid, Signal, kill_process};

use crate::catalogue::CatalogueError;
use crate::catalogue::job::{Ending, Job, Report};
use crate::monitor::Stage;

/// The hidden command that makes a worker of the program.
pub const WORKER: &str = "worker";
/// How often a silent worker is looked after.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// What a worker has to save its state.
const GRACE_MS: u64 = 30_000;
/// What is kept of a worker's last words.
const LAST_WORDS_BYTES: usize = 2048;

/// Why a worker was asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Its time is up.
    TimeUp,
    /// The batch stops.
    BatchStops,
}

/// A worker that is no more.
#[derive(Debug)]
pub struct Exited {
    /// What came of the job, if the worker came to say so.
    pub ending: Option<Ending>,
    /// Its exit code, if it had one.
    pub code: Option<i32>,
    /// The signal that ended it, if one did.
    pub signal: Option<i32>,
    /// Why it was asked to stop, if it was.
    pub asked: Option<Asked>,
    /// The end of what it said on stderr.
    pub last_words: String,
}

/// What watches over a worker.
pub struct Watch<'w> {
    /// Milliseconds since 1970.
    pub now_ms: &'w (dyn Fn() -> u64 + Sync),
    /// When its time is up.
    pub deadline_ms: Option<u64>,
    /// Whether the batch stops.
    pub stops: &'w (dyn Fn() -> bool + Sync),
    /// Hears where it is.
    pub working: &'w (dyn Fn(Stage, f64) + Sync),
}

/// Sets a worker to a job and waits for its end.
///
/// # Errors
/// [`CatalogueError::Worker`].
pub fn run_child(program: &Path, job: &Job, watch: &Watch) -> Result<Exited, CatalogueError> {
    let mut child = start(program)?;
    let mut words = child.stdin.take().expect("the worker's input is a pipe");
    let line = serde_json::to_string(job).expect("plain records serialise");
    // A worker that died before it read has its end told below.
    let _ = writeln!(words, "{line}");
    drop(words);
    let (sender, reports) = unbounded();
    let (output, errors) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        scope.spawn(move || output.map(|output| hand_on(output, &sender)));
        let last_words = scope.spawn(move || errors.map(last_words_of).unwrap_or_default());
        let (ending, asked) = listen(&child, &reports, watch);
        let status = child.wait();
        let last_words = last_words.join().unwrap_or_default();
        Ok(exited(status.ok(), ending, asked, last_words))
    })
}

/// Starts a worker that waits for jobs.
pub(super) fn start(program: &Path) -> Result<Child, CatalogueError> {
    Command::new(program)
        .arg(WORKER)
        .arg(std::process::id().to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
        .map_err(|source| CatalogueError::Worker { program: program.to_path_buf(), source })
}

fn exited(
    status: Option<ExitStatus>,
    ending: Option<Ending>,
    asked: Option<Asked>,
    last_words: String,
) -> Exited {
    let code = status.and_then(|status| status.code());
    let signal = status.and_then(|status| status.signal());
    Exited { ending, code, signal, asked, last_words }
}

/// Listens until the worker has closed its end.
fn listen(
    child: &Child,
    reports: &Receiver<Report>,
    watch: &Watch,
) -> (Option<Ending>, Option<Asked>) {
    let (mut ending, mut asked) = (None, None);
    let mut killed_at_ms = u64::MAX;
    loop {
        match reports.recv_timeout(LOOK_INTERVAL) {
            Ok(Report::Working { stage, share }) => (watch.working)(stage, share),
            Ok(Report::Ended(end)) => ending = Some(*end),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return (ending, asked),
        }
        let now_ms = (watch.now_ms)();
        if asked.is_none() {
            if (watch.stops)() {
                asked = Some(Asked::BatchStops);
            } else if watch.deadline_ms.is_some_and(|deadline| now_ms >= deadline) {
                asked = Some(Asked::TimeUp);
            }
            if asked.is_some() {
                send(child, Signal::TERM);
                killed_at_ms = now_ms + GRACE_MS;
            }
        } else if now_ms >= killed_at_ms {
            send(child, Signal::KILL);
        }
    }
}

/// A worker that is gone already hears nothing.
fn send(child: &Child, signal: Signal) {
    if let Some(pid) = Pid::from_raw(child.id() as i32) {
        let _ = kill_process(pid, signal);
    }
}

/// Hands on what a worker reports, line by line; lines that are none are left out.
fn hand_on(output: impl Read, sender: &Sender<Report>) {
    for line in BufReader::new(output).split(b'\n') {
        let Ok(line) = line else { return };
        if let Ok(report) = serde_json::from_slice(&line)
            && sender.send(report).is_err()
        {
            return;
        }
    }
}

/// The end of a stream, on one line.
fn last_words_of(mut stream: impl Read) -> String {
    let mut kept = Vec::new();
    let mut block = [0; LAST_WORDS_BYTES];
    while let Ok(count @ 1..) = stream.read(&mut block) {
        kept.extend_from_slice(&block[..count]);
        let surplus = kept.len().saturating_sub(LAST_WORDS_BYTES);
        kept.drain(..surplus);
    }
    let text = String::from_utf8_lossy(&kept);
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
