//! How a batch talks to its caller: the clock, the wish to stop, and what happens to models.

use crate::catalogue::state::{Cause, State};
use crate::catalogue::walk::PassedBy;
use crate::monitor::Stage;

/// What there is to do, once that is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ahead {
    /// Models that were found.
    pub found: u64,
    /// Files that are none.
    pub passed: PassedBy,
    /// Of the models: nothing is to be done.
    pub settled: u64,
    /// To be done.
    pub pending: u64,
    /// Seconds that these are expected to take on one worker.
    pub seconds: f64,
}

/// The caller's ear, its brake and its clock. All methods may be called from any thread.
pub trait Fleet: Sync {
    /// Milliseconds since 1970.
    fn now_ms(&self) -> u64;
    /// Whether the caller wants the batch to stop at the next safe point.
    fn cancelled(&self) -> bool {
        false
    }
    /// The models are looked through, `done` of them so far.
    fn looking(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// The work begins.
    fn ahead(&self, ahead: &Ahead) {
        let _ = ahead;
    }
    /// Worker `slot` is set to a model.
    fn started(&self, slot: usize, model: &str) {
        let _ = (slot, model);
    }
    /// Worker `slot` is at a stage, `share` of it done, 0..1, and takes so much memory, as far as that
    /// is known.
    fn working(&self, slot: usize, stage: Stage, share: f64, resident_bytes: Option<u64>) {
        let _ = (slot, stage, share, resident_bytes);
    }
    /// Worker `slot` is done. `left_seconds`: what the whole batch still takes, expected.
    fn ended(&self, slot: usize, ended: &Ended) {
        let _ = (slot, ended);
    }
    /// A remark for the log.
    fn note(&self, text: &str) {
        let _ = text;
    }
}

/// The end of an attempt at a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended<'e> {
    /// The model.
    pub model: &'e str,
    /// Where it stands now; pending if another attempt follows.
    pub state: State,
    /// Why there is no result, if there is none.
    pub cause: Option<Cause>,
    /// In one line.
    pub reason: Option<&'e str>,
    /// Wall time.
    pub seconds: f64,
    /// What the whole batch still takes, expected.
    pub left_seconds: f64,
}
