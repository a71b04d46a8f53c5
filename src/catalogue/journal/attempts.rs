//! The rows of runs, and of attempts at models.

use rusqlite::params;

use crate::catalogue::CatalogueError;
use crate::catalogue::journal::Journal;
use crate::catalogue::state::Rung;
use crate::catalogue::walk::PassedBy;

/// An attempt as it was.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct AttemptRow {
    /// Number of the run.
    pub run: i64,
    /// How much the worker was given: a name of [`Rung`].
    pub rung: String,
    /// Memory of the worker.
    pub memory_bytes: u64,
    /// Its threads.
    pub threads: u64,
    /// When it began.
    pub started_ms: u64,
    /// When it ended; `None` while it is under way, and where the batch was killed.
    pub ended_ms: Option<u64>,
    /// Name of the state or of the cause that it ended with.
    pub ending: Option<String>,
    /// What the worker said.
    pub message: Option<String>,
}

impl Journal {
    /// Begins a run; its number.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn begin_run(&mut self, command: &str, now_ms: u64) -> Result<i64, CatalogueError> {
        let insert = "INSERT INTO run (version, command, started_ms) VALUES (?1, ?2, ?3)";
        self.with(|connection| {
            let version = env!("CARGO_PKG_VERSION");
            connection.execute(insert, params![version, command, now_ms as i64])?;
            Ok(connection.last_insert_rowid())
        })
    }

    /// Notes what a walk found.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn note_walk(
        &mut self,
        run: i64,
        found: u64,
        passed: &PassedBy,
    ) -> Result<(), CatalogueError> {
        let update = "UPDATE run SET found = ?2, passed_by = ?3 WHERE id = ?1";
        let passed = serde_json::to_string(passed).expect("plain records serialise");
        self.with(|connection| {
            connection.execute(update, params![run, found as i64, passed]).map(|_| ())
        })
    }

    /// Ends a run.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn end_run(&mut self, run: i64, ending: &str, now_ms: u64) -> Result<(), CatalogueError> {
        let update = "UPDATE run SET ending = ?2, ended_ms = ?3 WHERE id = ?1";
        self.with(|connection| {
            connection.execute(update, params![run, ending, now_ms as i64]).map(|_| ())
        })
    }

    /// Begins an attempt at a model; its number.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn begin_attempt(
        &mut self,
        (run, model): (i64, i64),
        rung: Rung,
        (memory_bytes, threads): (u64, usize),
        now_ms: u64,
    ) -> Result<i64, CatalogueError> {
        let insert =
            "INSERT INTO attempt (model_id, run_id, rung, memory_bytes, threads, started_ms)
            VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
        self.with(|connection| {
            let (memory, threads, now) = (memory_bytes as i64, threads as i64, now_ms as i64);
            let words = params![model, run, rung.name(), memory, threads, now];
            connection.prepare_cached(insert)?.execute(words)?;
            Ok(connection.last_insert_rowid())
        })
    }

    /// Ends an attempt.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn end_attempt(
        &mut self,
        attempt: i64,
        ending: &str,
        message: Option<&str>,
        now_ms: u64,
    ) -> Result<(), CatalogueError> {
        let update = "UPDATE attempt SET ending = ?2, message = ?3, ended_ms = ?4 WHERE id = ?1";
        self.with(|connection| {
            let words = params![attempt, ending, message, now_ms as i64];
            connection.prepare_cached(update)?.execute(words).map(|_| ())
        })
    }

    /// All attempts at a model, in order.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn attempts(&mut self, model: i64) -> Result<Vec<AttemptRow>, CatalogueError> {
        let asked = "SELECT run_id, rung, memory_bytes, threads, started_ms, ended_ms, ending,
            message FROM attempt WHERE model_id = ?1 ORDER BY id";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let rows = asked.query_map([model], |row| {
                Ok(AttemptRow {
                    run: row.get(0)?,
                    rung: row.get(1)?,
                    memory_bytes: row.get::<_, i64>(2)? as u64,
                    threads: row.get::<_, i64>(3)? as u64,
                    started_ms: row.get::<_, i64>(4)? as u64,
                    ended_ms: row.get::<_, Option<i64>>(5)?.map(|ms| ms as u64),
                    ending: row.get(6)?,
                    message: row.get(7)?,
                })
            })?;
            rows.collect()
        })
    }
}
