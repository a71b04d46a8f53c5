//! Stamps the seconds of stages, since the library reads no clock.

use std::collections::BTreeMap;
use std::time::Instant;

use brickmend::monitor::Stage;
use brickmend::repair::StageReport;

use crate::cli::memory::cpu_seconds;

/// Seconds of every stage so far, and how much of the current one is done.
#[derive(Debug, Default)]
pub struct StageClock {
    current: Option<(Stage, Instant, f64)>,
    reports: BTreeMap<Stage, StageReport>,
    total: u64,
    done: u64,
}

impl StageClock {
    /// A stage begins that has `total` to do; 0 where that is not known.
    pub fn begin(&mut self, stage: Stage, total: u64) {
        self.current = Some((stage, Instant::now(), cpu_seconds()));
        (self.total, self.done) = (total, 0);
    }

    /// So much more is done.
    pub fn advance(&mut self, done: u64) {
        self.done += done;
    }

    /// What is done of the current stage.
    pub fn done(&self) -> u64 {
        self.done
    }

    /// The current stage and how much of it is done, 0..1; 0 where the total is not known.
    pub fn share(&self) -> Option<(Stage, f64)> {
        let (stage, ..) = self.current?;
        let total = self.total.max(1);
        let done = if self.total == 0 { 0 } else { self.done.min(total) };
        Some((stage, done as f64 / total as f64))
    }

    /// The stage ends; its wall time, if it had begun.
    pub fn end(&mut self, stage: Stage) -> Option<f64> {
        let (_, start, cpu) = self.current.take()?;
        let seconds = start.elapsed().as_secs_f64();
        let report = self.reports.entry(stage).or_default();
        report.seconds += seconds;
        report.cpu_seconds += cpu_seconds() - cpu;
        Some(seconds)
    }

    /// What every stage took.
    pub fn reports(&self) -> BTreeMap<Stage, StageReport> {
        self.reports.clone()
    }
}
