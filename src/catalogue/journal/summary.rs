//! The journal's answers to the usual questions.

use serde::Serialize;

use crate::catalogue::CatalogueError;
use crate::catalogue::journal::enrol::path_of;
use crate::catalogue::journal::{AttemptRow, Journal};

/// How many models stand where.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StateCount {
    /// Name of a [`crate::catalogue::State`].
    pub state: String,
    /// Of repaired models: pass or review.
    pub verdict: Option<String>,
    /// Of failed models: name of a [`crate::catalogue::Cause`].
    pub cause: Option<String>,
    /// How many.
    pub models: u64,
    /// Wall time of their last attempts together.
    pub seconds: f64,
}

/// A model that failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// Its path, as text.
    pub name: String,
    /// Name of a [`crate::catalogue::Cause`].
    pub cause: String,
    /// In one line.
    pub reason: String,
}

/// A model that a worker is set to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnderWay {
    /// Its path, as text.
    pub name: String,
    /// Name of a [`crate::catalogue::Rung`].
    pub rung: String,
    /// When that began.
    pub started_ms: u64,
    /// Memory of the worker.
    pub memory_bytes: u64,
}

/// Where a catalogue stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this schema.
    pub schema: u32,
    /// Number of the last run.
    pub run: i64,
    /// When it began.
    pub started_ms: u64,
    /// When it ended, if it did.
    pub ended_ms: Option<u64>,
    /// How it ended: done, stopped, interrupted, disk_full; `None` while it is under way, and where
    /// it was killed.
    pub ending: Option<String>,
    /// Models that it found.
    pub found: u64,
    /// Counts, the largest first.
    pub states: Vec<StateCount>,
    /// Seconds that pending models are expected to take, on one worker.
    pub pending_seconds: f64,
    /// Seconds that finished models took, over what was predicted for them.
    pub pace: Option<f64>,
    /// Models that workers are set to.
    pub under_way: Vec<UnderWay>,
    /// Models that failed, the first hundred by name.
    pub failures: Vec<Failure>,
}

/// Version of [`Summary`].
const SCHEMA: u32 = 1;

/// A file that a model names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToldBeside {
    /// Its path within the folder of the models, as text.
    pub name: String,
    /// Whether it was there when the model was worked on.
    pub is_there: bool,
}

/// All that the journal says of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Told {
    /// Its path, as text.
    pub name: String,
    /// Path of its result, as text.
    pub output: String,
    /// Name of a [`crate::catalogue::State`].
    pub state: String,
    /// Pass or review, of repaired ones.
    pub verdict: Option<String>,
    /// Name of a [`crate::catalogue::Cause`], of failed ones.
    pub cause: Option<String>,
    /// In one line.
    pub reason: Option<String>,
    /// Why it was asked for the last time, in one line.
    pub because: Option<String>,
    /// What it took.
    pub seconds: Option<f64>,
    /// Peak memory of its worker.
    pub peak_bytes: Option<u64>,
    /// The files that it names, by their paths within the folder of the models.
    pub beside: Vec<ToldBeside>,
    /// Every attempt.
    pub attempts: Vec<AttemptRow>,
}

impl Journal {
    /// Where the catalogue stands.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn summary(&mut self) -> Result<Summary, CatalogueError> {
        let (states, under_way, failures) = (self.states()?, self.under_way()?, self.failures()?);
        let last =
            "SELECT id, started_ms, ended_ms, ending, found FROM run ORDER BY id DESC LIMIT 1";
        let ahead = "SELECT coalesce(sum(predicted_seconds), 0) FROM model WHERE state = 'pending'";
        let pace = "SELECT sum(seconds) / sum(predicted_seconds) FROM model
            WHERE state IN ('repaired', 'degraded') AND predicted_seconds > 0";
        self.with(|connection| {
            let pending_seconds = connection.query_row(ahead, (), |row| row.get(0))?;
            let pace = connection.query_row(pace, (), |row| row.get(0))?;
            connection.query_row(last, (), |row| {
                Ok(Summary {
                    schema: SCHEMA,
                    run: row.get(0)?,
                    started_ms: row.get::<_, i64>(1)? as u64,
                    ended_ms: row.get::<_, Option<i64>>(2)?.map(|ms| ms as u64),
                    ending: row.get(3)?,
                    found: row.get::<_, i64>(4)? as u64,
                    states,
                    pending_seconds,
                    pace,
                    under_way,
                    failures,
                })
            })
        })
    }

    fn states(&mut self) -> Result<Vec<StateCount>, CatalogueError> {
        let asked = "SELECT state, verdict, cause, models, coalesce(seconds, 0) FROM states";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let rows = asked.query_map((), |row| {
                Ok(StateCount {
                    state: row.get(0)?,
                    verdict: row.get(1)?,
                    cause: row.get(2)?,
                    models: row.get::<_, i64>(3)? as u64,
                    seconds: row.get(4)?,
                })
            })?;
            rows.collect()
        })
    }

    fn under_way(&mut self) -> Result<Vec<UnderWay>, CatalogueError> {
        let asked =
            "SELECT name, rung, started_ms, memory_bytes FROM under_way ORDER BY started_ms";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let rows = asked.query_map((), |row| {
                Ok(UnderWay {
                    name: row.get(0)?,
                    rung: row.get(1)?,
                    started_ms: row.get::<_, i64>(2)? as u64,
                    memory_bytes: row.get::<_, i64>(3)? as u64,
                })
            })?;
            rows.collect()
        })
    }

    fn failures(&mut self) -> Result<Vec<Failure>, CatalogueError> {
        let asked =
            "SELECT name, coalesce(cause, ''), coalesce(reason, '') FROM failures LIMIT 100";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let rows = asked.query_map((), |row| {
                Ok(Failure { name: row.get(0)?, cause: row.get(1)?, reason: row.get(2)? })
            })?;
            rows.collect()
        })
    }

    /// All that is known of the model with this number.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn tell(&mut self, id: i64) -> Result<Told, CatalogueError> {
        let (attempts, beside) = (self.attempts(id)?, self.beside(id)?);
        let asked = "SELECT name, coalesce(result, output), state, verdict, cause, reason, seconds,
            peak_bytes, because FROM model WHERE id = ?1";
        self.with(|connection| {
            connection.query_row(asked, [id], |row| {
                Ok(Told {
                    name: row.get(0)?,
                    output: path_of(row, 1)?.to_string_lossy().into_owned(),
                    state: row.get(2)?,
                    verdict: row.get(3)?,
                    cause: row.get(4)?,
                    reason: row.get(5)?,
                    seconds: row.get(6)?,
                    peak_bytes: row.get::<_, Option<i64>>(7)?.map(|bytes| bytes as u64),
                    because: row.get(8)?,
                    beside,
                    attempts,
                })
            })
        })
    }
}
