//! How long a batch still takes: what was predicted, corrected by what it took so far.

use crate::catalogue::journal::ModelRow;
use crate::catalogue::state::State;

/// Seconds ahead and behind.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    workers: f64,
    /// Predicted for what is not finished.
    left_seconds: f64,
    /// Predicted for what has a result now, and what that took.
    predicted_seconds: f64,
    actual_seconds: f64,
}

impl Pace {
    /// Before the first of models that are expected to take so long on one worker.
    pub fn new(left_seconds: f64, workers: usize) -> Self {
        let workers = workers.max(1) as f64;
        Self { workers, left_seconds, predicted_seconds: 0.0, actual_seconds: 0.0 }
    }

    /// Enters an attempt that ended.
    pub fn enter(&mut self, row: &ModelRow, state: State, seconds: f64) {
        let predicted = row.predicted.map_or(0.0, |predicted| predicted.seconds);
        if state != State::Pending {
            self.left_seconds = (self.left_seconds - predicted).max(0.0);
        }
        // Of a library of small sound models, what starting a worker takes is most of it.
        if state.has_result() {
            self.predicted_seconds += predicted;
            self.actual_seconds += seconds;
        }
    }

    /// Seconds that the batch still takes, expected.
    pub fn seconds_to_go(&self) -> f64 {
        let is_known = self.predicted_seconds > 0.0;
        let factor = if is_known { self.actual_seconds / self.predicted_seconds } else { 1.0 };
        self.left_seconds * factor / self.workers
    }
}
