//! `brickmend worker`, hidden: one process of a batch, which works off jobs from its input.
//!
//! It ends with its parent, whatever ends that.

use std::io::{BufRead, Write};
use std::process::ExitCode;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use brickmend::catalogue::{Job, Made, Report, do_job};
use brickmend::monitor::{Monitor, Stage};
use brickmend::repair::{Outcome, PartsOutcome};
use brickmend::report::{Gallery, ModelPage, PartsPage};
use brickmend::store::Scratch;
use clap::Args;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

use crate::cli::exit_code::Exit;
use crate::cli::memory::{cpu_seconds, peak_resident_bytes, resident_bytes};
use crate::cli::progress::Chatter;
use crate::cli::signals::Stop;
use crate::cli::stage_clock::StageClock;

/// Progress is reported at most this often.
const REPORT_INTERVAL: Duration = Duration::from_millis(250);

/// Pages take this part of the budget, and readers as much again.
const PAGE_SHARE: u64 = 6;

/// Arguments of `brickmend worker`.
#[derive(Debug, Args)]
pub struct WorkerArguments {
    /// Number of the process that started this one.
    parent: i32,
}

/// Runs the command.
pub fn run(arguments: &WorkerArguments, chatter: &Chatter) -> ExitCode {
    let bound = set_parent_process_death_signal(Some(Signal::KILL));
    // A parent that died before that has no signal to send.
    if bound.is_err() || getppid().map(Pid::as_raw_pid) != Some(arguments.parent) {
        return Exit::Terminated.into();
    }
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    for line in std::io::stdin().lock().split(b'\n') {
        let job = line.and_then(|line| Ok(serde_json::from_slice::<Job>(&line)?));
        match job {
            Ok(job) => work(&job, stop.clone()),
            Err(error) => {
                chatter.error(&error);
                return Exit::Internal.into();
            }
        }
    }
    Exit::Success.into()
}

fn work(job: &Job, stop: Stop) {
    let speaker = Speaker::new(stop);
    let stamp = |outcome: &mut Outcome| {
        outcome.stages = speaker.state().clock.reports();
        outcome.memory.peak_bytes = peak_resident_bytes();
    };
    let mut ending = do_job(job, &speaker, &stamp);
    draw(job, &ending.made, &speaker);
    ending.peak_bytes = peak_resident_bytes();
    ending.cpu_seconds = cpu_seconds();
    say(&Report::Ended(Box::new(ending)));
}

/// Draws the model beside its result, which is in place. Without pictures it is as good: what stands
/// in their way is said, and no more.
fn draw(job: &Job, made: &Made, monitor: &dyn Monitor) {
    let drawing = &job.drawing;
    let gallery = Gallery::new(&drawing.report.to_path(), drawing.number);
    let (mut outcome, mut whole, mut parts) = (None, None, &[][..]);
    match made {
        Made::Repaired { figures, .. } => {
            outcome = serde_json::from_str::<Outcome>(&figures.outcome).ok();
            if outcome.is_none() {
                whole = serde_json::from_str::<PartsOutcome>(&figures.outcome).ok();
                parts = &figures.parts;
            }
        }
        Made::Copied { .. } => {}
        Made::Estimate(_) => return,
        // Of an earlier result.
        Made::Nothing { .. } => {
            let _ = gallery.clear();
            return;
        }
    }
    let output = match made {
        Made::Copied { files } => files.first().map(|file| file.path.to_path()),
        _ => None,
    };
    let (input, output) = (job.input.to_path(), output.unwrap_or_else(|| job.output.to_path()));
    let model = ModelPage {
        name: &drawing.name,
        input: &input,
        output: &output,
        outcome: outcome.as_ref(),
        parts: whole.as_ref().map(|whole| PartsPage { whole, parts }),
        back: None,
    };
    let scratch = Scratch::new(&job.work_dir.to_path());
    let share_bytes = job.max_memory_bytes / PAGE_SHARE;
    let drawn = gallery.write(&model, drawing.wanted, share_bytes, &scratch, monitor);
    if let Err(error) = drawn {
        let _ = gallery.clear();
        say(&Report::Note { text: format!("{}: no page of it: {error}", drawing.name) });
    }
}

/// A parent that hears nothing any more has ended, and so will we.
fn say(report: &Report) {
    let line = serde_json::to_string(report).expect("plain records serialise");
    let mut output = std::io::stdout().lock();
    let _ = writeln!(output, "{line}").and_then(|()| output.flush());
}

/// A monitor that reports to the parent.
struct Speaker {
    stop: Stop,
    state: Mutex<State>,
}

struct State {
    clock: StageClock,
    said: Instant,
}

impl Speaker {
    fn new(stop: Stop) -> Self {
        let state = State { clock: StageClock::default(), said: Instant::now() };
        Self { stop, state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn say(&mut self) {
        if self.said.elapsed() < REPORT_INTERVAL {
            return;
        }
        self.said = Instant::now();
        if let Some((stage, share)) = self.clock.share() {
            say(&Report::Working { stage, share, resident_bytes: resident_bytes() });
        }
    }
}

impl Monitor for Speaker {
    fn begin(&self, stage: Stage, total: u64) {
        let mut state = self.state();
        state.clock.begin(stage, total);
        state.say();
    }

    fn advance(&self, done: u64) {
        let mut state = self.state();
        state.clock.advance(done);
        state.say();
    }

    fn end(&self, stage: Stage) {
        self.state().clock.end(stage);
    }

    fn cancelled(&self) -> bool {
        self.stop.is_asked()
    }
}
