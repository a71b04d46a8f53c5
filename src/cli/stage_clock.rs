//! Stamps the seconds and the memory of stages, since the library reads no clock.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use brickmend::monitor::Stage;
use brickmend::repair::StageReport;

use crate::cli::memory::{cpu_seconds, resident_bytes};

/// Resident memory is looked at this often, and when a stage begins and ends.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Seconds of every stage so far, and how much of the current one is done.
#[derive(Debug, Default)]
pub struct StageClock {
    current: Option<Current>,
    reports: BTreeMap<Stage, StageReport>,
    total: u64,
    done: u64,
}

/// The stage that is under way.
#[derive(Debug)]
struct Current {
    stage: Stage,
    start: Instant,
    cpu_seconds: f64,
    resident_bytes: Option<u64>,
    looked: Instant,
}

impl Current {
    fn look(&mut self) {
        self.looked = Instant::now();
        self.resident_bytes = self.resident_bytes.max(resident_bytes());
    }
}

impl StageClock {
    /// A stage begins that has `total` to do; 0 where that is not known.
    pub fn begin(&mut self, stage: Stage, total: u64) {
        let now = Instant::now();
        let (cpu_seconds, resident_bytes) = (cpu_seconds(), resident_bytes());
        let looked = now;
        self.current = Some(Current { stage, start: now, cpu_seconds, resident_bytes, looked });
        (self.total, self.done) = (total, 0);
    }

    /// So much more is done.
    pub fn advance(&mut self, done: u64) {
        self.done += done;
        if let Some(current) = self.current.as_mut().filter(|c| c.looked.elapsed() >= LOOK_INTERVAL)
        {
            current.look();
        }
    }

    /// What is done of the current stage.
    pub fn done(&self) -> u64 {
        self.done
    }

    /// The current stage and how much of it is done, 0..1; 0 where the total is not known.
    pub fn share(&self) -> Option<(Stage, f64)> {
        let stage = self.current.as_ref()?.stage;
        let total = self.total.max(1);
        let done = if self.total == 0 { 0 } else { self.done.min(total) };
        Some((stage, done as f64 / total as f64))
    }

    /// The stage ends; its wall time, if it had begun.
    pub fn end(&mut self, stage: Stage) -> Option<f64> {
        let mut current = self.current.take()?;
        current.look();
        let seconds = current.start.elapsed().as_secs_f64();
        let report = self.reports.entry(stage).or_default();
        report.seconds += seconds;
        report.cpu_seconds += cpu_seconds() - current.cpu_seconds;
        report.resident_bytes = report.resident_bytes.max(current.resident_bytes);
        Some(seconds)
    }

    /// What every stage took.
    pub fn reports(&self) -> BTreeMap<Stage, StageReport> {
        self.reports.clone()
    }
}
