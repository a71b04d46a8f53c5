//! A worker process from outside: started, listened to, stopped in time.
//!
//! In:         [`Job`]s. Out: their [`Ending`]s, and [`Exited`]: how the process ended.
//! Invariant:  no process outlives its [`Worker`]. A worker that is asked to stop has time to save its
//!             state, and is killed after that. It is in a process group of its own, so that what
//!             stops the batch from the terminal does not stop it twice.
//! Memory:     the last lines of what the worker says on stderr.
//! Fails:      the process cannot be started.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;
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
    /// Hears where it is, and what memory it takes.
    pub working: &'w (dyn Fn(Stage, f64, Option<u64>) + Sync),
    /// Hears remarks.
    pub note: &'w (dyn Fn(&str) + Sync),
}

/// A worker process that waits for jobs. Dropped, it is killed.
pub struct Worker {
    child: Child,
    words: Option<ChildStdin>,
    reports: Receiver<Report>,
    last_words: Option<JoinHandle<String>>,
}

impl Worker {
    /// Starts one.
    ///
    /// # Errors
    /// [`CatalogueError::Worker`].
    pub fn start(program: &Path) -> Result<Self, CatalogueError> {
        let mut child = Command::new(program)
            .arg(WORKER)
            .arg(std::process::id().to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(|source| CatalogueError::Worker { program: program.to_path_buf(), source })?;
        let pipe = "the worker's ends are pipes";
        let (output, errors) = (child.stdout.take().expect(pipe), child.stderr.take().expect(pipe));
        let (sender, reports) = unbounded();
        std::thread::spawn(move || hand_on(output, &sender));
        let last_words = Some(std::thread::spawn(move || last_words_of(errors)));
        Ok(Self { words: child.stdin.take(), child, reports, last_words })
    }

    /// Hands over a job and waits for what comes of it; `None` if the worker ends before.
    pub fn ask(&mut self, job: &Job, watch: &Watch) -> Option<Ending> {
        self.say(job);
        self.listen(watch, true).0
    }

    /// Hands over the last job and waits for the worker's end.
    #[must_use]
    pub fn ask_last(mut self, job: &Job, watch: &Watch) -> Exited {
        self.say(job);
        self.words = None;
        let (ending, asked) = self.listen(watch, false);
        let status = self.child.wait().ok();
        let last_words = self.last_words.take().and_then(|thread| thread.join().ok());
        Exited {
            ending,
            code: status.and_then(|status| status.code()),
            signal: status.and_then(|status| status.signal()),
            asked,
            last_words: last_words.unwrap_or_default(),
        }
    }

    fn say(&mut self, job: &Job) {
        let line = serde_json::to_string(job).expect("plain records serialise");
        if let Some(words) = &mut self.words {
            // A worker that died before it read has its end told by its silence.
            let _ = writeln!(words, "{line}");
        }
    }

    /// Listens until the worker has closed its end, or up to the end of one job.
    fn listen(&self, watch: &Watch, of_one_job: bool) -> (Option<Ending>, Option<Asked>) {
        let (mut ending, mut asked) = (None, None);
        let mut killed_at_ms = u64::MAX;
        loop {
            match self.reports.recv_timeout(LOOK_INTERVAL) {
                Ok(Report::Working { stage, share, resident_bytes }) => {
                    (watch.working)(stage, share, resident_bytes);
                }
                Ok(Report::Note { text }) => (watch.note)(&text),
                Ok(Report::Ended(end)) => {
                    ending = Some(*end);
                    if of_one_job {
                        return (ending, asked);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return (ending, asked),
            }
            let now_ms = (watch.now_ms)();
            if asked.is_none() {
                asked = watch.reason_to_stop(now_ms);
                if asked.is_some() {
                    self.send(Signal::TERM);
                    killed_at_ms = now_ms + GRACE_MS;
                }
            } else if now_ms >= killed_at_ms {
                self.send(Signal::KILL);
            }
        }
    }

    /// One that is gone already hears nothing.
    fn send(&self, signal: Signal) {
        if let Some(pid) = Pid::from_raw(self.child.id() as i32) {
            let _ = kill_process(pid, signal);
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // One that is gone already cannot be killed, and has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Watch<'_> {
    fn reason_to_stop(&self, now_ms: u64) -> Option<Asked> {
        if (self.stops)() {
            Some(Asked::BatchStops)
        } else {
            self.deadline_ms.filter(|deadline| now_ms >= *deadline).map(|_| Asked::TimeUp)
        }
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
