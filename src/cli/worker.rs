//! `brickmend worker`, hidden: what `batch` starts for each model. Jobs come in as lines, reports
//! go out as lines.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use brickmend::catalogue::{Job, Made, Report, do_job};
use brickmend::monitor::{Monitor, Stage};
use brickmend::repair::StageReport;
use clap::Args;
use rustix::process::{Signal, getppid, set_parent_process_death_signal};

use crate::cli::exit_code::Exit;
use crate::cli::memory::{cpu_seconds, peak_resident_bytes};
use crate::cli::signals::Stop;

/// Progress is told this often.
const TOLD_EVERY: Duration = Duration::from_millis(250);

/// Arguments of `brickmend worker`.
#[derive(Debug, Args)]
pub struct WorkerArguments {
    /// The process of the batch: its end is the worker's.
    parent: u32,
}

/// Runs the command.
pub fn run(arguments: &WorkerArguments) -> ExitCode {
    // The system ends us with the batch, unless that is over already.
    let dies_with_it = set_parent_process_death_signal(Some(Signal::KILL));
    let parent = getppid().map(|pid| pid.as_raw_nonzero().get().unsigned_abs());
    if dies_with_it.is_err() || parent != Some(arguments.parent) {
        return Exit::Internal.into();
    }
    let Ok(stop) = Stop::listen() else { return Exit::Internal.into() };
    for line in std::io::stdin().lock().lines() {
        let Ok(line) = line else { break };
        let Ok(job) = serde_json::from_str::<Job>(&line) else { return Exit::Usage.into() };
        let talk = Talk::new(stop.clone());
        let mut ending = do_job(&job, &talk);
        ending.peak_bytes = peak_resident_bytes();
        ending.cpu_seconds = cpu_seconds();
        if let Made::Repaired { outcome, .. } = &mut ending.made {
            outcome.stages = talk.stages();
            outcome.memory.peak_bytes = ending.peak_bytes;
        }
        say(&Report::Ended(Box::new(ending)));
    }
    Exit::Success.into()
}

/// A batch that is gone hears nothing, and the system ends us.
fn say(report: &Report) {
    let line = serde_json::to_string(report).expect("plain records serialise");
    let mut output = std::io::stdout().lock();
    let _ = writeln!(output, "{line}").and_then(|()| output.flush());
}

/// A monitor that tells the batch.
struct Talk {
    stop: Stop,
    state: Mutex<State>,
}

struct State {
    stage: Option<(Stage, Instant, f64)>,
    reports: BTreeMap<Stage, StageReport>,
    total: u64,
    done: u64,
    told: Instant,
}

impl Talk {
    fn new(stop: Stop) -> Self {
        let (stage, reports, told) = (None, BTreeMap::new(), Instant::now());
        Self { stop, state: Mutex::new(State { stage, reports, total: 0, done: 0, told }) }
    }

    fn stages(&self) -> BTreeMap<Stage, StageReport> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).reports.clone()
    }
}

impl Monitor for Talk {
    fn begin(&self, stage: Stage, total: u64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.stage = Some((stage, Instant::now(), cpu_seconds()));
        (state.total, state.done) = (total, 0);
    }

    fn advance(&self, done: u64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += done;
        if let Some((stage, ..)) = state.stage
            && state.told.elapsed() >= TOLD_EVERY
        {
            state.told = Instant::now();
            let share = state.done.min(state.total) as f64 / state.total.max(1) as f64;
            say(&Report::Working { stage, share });
        }
    }

    fn end(&self, stage: Stage) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, start, cpu)) = state.stage.take() {
            let report = state.reports.entry(stage).or_default();
            report.seconds += start.elapsed().as_secs_f64();
            report.cpu_seconds += cpu_seconds() - cpu;
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.is_asked()
    }
}
