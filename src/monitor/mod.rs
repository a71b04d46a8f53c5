//! How the library talks to its caller: stages, work done, counters, notes and cancellation.
//!
//! The library never prints; it reports here. [`Void`] ignores everything, [`Recording`] keeps
//! counters for tests and for the outcome. Times are stamped by the caller, never by the library.

mod recording;
mod resident;

pub use recording::Recording;
pub use resident::{Held, Resident};

use serde::{Deserialize, Serialize};

/// The stages of a repair, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// File to snapped triangles in brick bins.
    Ingest,
    /// Rims of open sheets to walls and fills.
    Bridge,
    /// Bins to bricks of crossings.
    Scan,
    /// Odd faces to flipped edges.
    Patch,
    /// Bricks to inside and outside at every corner.
    Sign,
    /// Signs to vertices and polygons, written to the output file.
    Contour,
    /// The proof on the written file.
    Verify,
    /// The written file beside the input.
    Deviate,
}

impl Stage {
    /// All stages in running order.
    pub const ALL: [Self; 8] = [
        Self::Ingest,
        Self::Bridge,
        Self::Scan,
        Self::Patch,
        Self::Sign,
        Self::Contour,
        Self::Verify,
        Self::Deviate,
    ];

    /// The name used in the outcome and in the work folder.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ingest => "ingest",
            Self::Bridge => "bridge",
            Self::Scan => "scan",
            Self::Patch => "patch",
            Self::Sign => "sign",
            Self::Contour => "contour",
            Self::Verify => "verify",
            Self::Deviate => "deviate",
        }
    }
}

/// What is counted on the way; the names stand in the outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counter {
    /// Bytes read from the user's input file.
    InputBytesRead,
    /// Triangles that went through scan conversion, once per brick that they touch.
    TrianglesScanned,
    /// Bytes read from the work folder.
    ScratchBytesRead,
    /// Bytes written to the work folder.
    ScratchBytesWritten,
    /// Bytes of the output file.
    OutputBytesWritten,
    /// Sort runs that left memory because their share was full.
    SpilledRuns,
}

impl Counter {
    /// All counters, in the order of the outcome.
    pub const ALL: [Self; 6] = [
        Self::InputBytesRead,
        Self::TrianglesScanned,
        Self::ScratchBytesRead,
        Self::ScratchBytesWritten,
        Self::OutputBytesWritten,
        Self::SpilledRuns,
    ];
}

/// What must be resident at one time; the largest value is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gauge {
    /// Triangles in memory at one time.
    ResidentTriangles,
    /// Bricks in memory or mapped at one time.
    ResidentBricks,
    /// Output vertices in memory at one time.
    ResidentVertices,
    /// Bytes that the accountant had granted at one time.
    GrantedBytes,
}

impl Gauge {
    /// All gauges, in the order of the outcome.
    pub const ALL: [Self; 4] =
        [Self::ResidentTriangles, Self::ResidentBricks, Self::ResidentVertices, Self::GrantedBytes];
}

/// The caller's ear and its brake.
///
/// All methods may be called from any thread.
pub trait Monitor: Sync {
    /// A stage starts; `total` is the work that it expects, in its own unit (0 = unknown).
    fn begin(&self, stage: Stage, total: u64) {
        let _ = (stage, total);
    }
    /// `done` more units of the running stage's work are finished.
    fn advance(&self, done: u64) {
        let _ = done;
    }
    /// The stage is over.
    fn end(&self, stage: Stage) {
        let _ = stage;
    }
    /// Adds to a counter.
    fn count(&self, counter: Counter, amount: u64) {
        let _ = (counter, amount);
    }
    /// Tells how much of something is resident now.
    fn gauge(&self, gauge: Gauge, now: u64) {
        let _ = (gauge, now);
    }
    /// A run that is killed from now on goes on from here: behind a step that is finished, or
    /// behind `items` of it.
    fn checkpoint(&self, step: &str, items: u64) {
        let _ = (step, items);
    }
    /// A remark for the log.
    fn note(&self, text: &str) {
        let _ = text;
    }
    /// Whether the caller wants the work to stop at the next safe point.
    fn cancelled(&self) -> bool {
        false
    }
}

/// A monitor that hears nothing and never stops the work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Void;

impl Monitor for Void {}
