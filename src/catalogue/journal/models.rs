//! The rows of models: what is to be done, and what came of it.

use std::path::{Path, PathBuf};

use rusqlite::{OptionalExtension, Row, params};

use crate::catalogue::CatalogueError;
use crate::catalogue::job::OutputFile;
use crate::catalogue::journal::Journal;
use crate::catalogue::journal::enrol::{bytes_of, format_of, path_of, stamp_of};
use crate::catalogue::stamp::{Stamp, Stamped};
use crate::catalogue::state::{Cause, State};
use crate::io::Format;
use crate::repair::{Estimate, Outcome, Verdict};

/// A model that is to be worked on or looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelRow {
    /// Its number in the journal.
    pub id: i64,
    /// Path within the folder of the models.
    pub relative: PathBuf,
    /// Path of its result within the folder of the results.
    pub output: PathBuf,
    /// Format of the result.
    pub format: Format,
    /// Where it stands.
    pub state: State,
    /// The file as it was when it came to that.
    pub stamp: Stamp,
    /// Digest of its content then, once it was read.
    pub digest: Option<crate::store::Digest>,
    /// What it will take, once that was estimated.
    pub predicted: Option<Predicted>,
}

/// What a model will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Expected.
    pub seconds: f64,
    /// At most.
    pub memory_bytes: u64,
    /// At most.
    pub disk_bytes: u64,
    /// Expected.
    pub leaf_cells: u64,
    /// Of the grid.
    pub depth: u32,
}

impl Predicted {
    /// What an estimate says.
    #[must_use]
    pub fn of(estimate: &Estimate) -> Self {
        Self {
            seconds: estimate.seconds,
            memory_bytes: estimate.memory_bytes,
            disk_bytes: estimate.disk_bytes,
            leaf_cells: estimate.leaf_cells,
            depth: estimate.grid.depth,
        }
    }
}

/// What a model came to.
#[derive(Clone, Debug, Default)]
pub struct Finished<'f> {
    /// The input as it was read; as it was found, where it could not be.
    pub input: Option<Stamped>,
    /// Why there is no result.
    pub cause: Option<Cause>,
    /// In one line, for people.
    pub reason: Option<String>,
    /// Of a repaired model.
    pub outcome: Option<&'f Outcome>,
    /// The files of the result.
    pub files: &'f [OutputFile],
    /// Now.
    pub now_ms: u64,
    /// Wall time of the last attempt.
    pub seconds: f64,
    /// Processor time of its worker.
    pub cpu_seconds: Option<f64>,
    /// Peak memory of its worker.
    pub peak_bytes: Option<u64>,
}

const COLUMNS: &str = "id, path, output, format, state, input_bytes, input_mtime_ns,
    input_ctime_ns, input_inode, input_digest, predicted_seconds, predicted_memory, predicted_disk,
    predicted_leaves, depth";

fn row_of(row: &Row) -> rusqlite::Result<ModelRow> {
    let predicted = match row.get::<_, Option<f64>>(10)? {
        None => None,
        Some(seconds) => Some(Predicted {
            seconds,
            memory_bytes: row.get::<_, i64>(11)? as u64,
            disk_bytes: row.get::<_, i64>(12)? as u64,
            leaf_cells: row.get::<_, i64>(13)? as u64,
            depth: row.get(14)?,
        }),
    };
    let text = |column| row.get::<_, String>(column);
    Ok(ModelRow {
        id: row.get(0)?,
        relative: path_of(row, 1)?,
        output: path_of(row, 2)?,
        format: format_of(&text(3)?).unwrap_or(Format::Ply),
        state: State::of(&text(4)?).unwrap_or(State::Pending),
        stamp: stamp_of(row, 5)?,
        digest: row.get(9)?,
        predicted,
    })
}

impl Journal {
    /// The model with this number.
    ///
    /// # Errors
    /// The journal cannot be read, or has none.
    pub fn model(&mut self, id: i64) -> Result<ModelRow, CatalogueError> {
        let asked = format!("SELECT {COLUMNS} FROM model WHERE id = ?1");
        self.with(|connection| connection.prepare_cached(&asked)?.query_row([id], row_of))
    }

    /// The number of the model at this path within its folder, or with this name.
    ///
    /// # Errors
    /// [`CatalogueError::NoSuchModel`], or the journal cannot be read.
    pub fn find(&mut self, relative: &Path) -> Result<i64, CatalogueError> {
        let asked = "SELECT id FROM model WHERE path = ?1";
        let found = self.with(|connection| {
            connection.query_row(asked, [bytes_of(relative)], |row| row.get(0)).optional()
        })?;
        let model = || relative.to_string_lossy().into_owned();
        found.ok_or_else(|| CatalogueError::NoSuchModel { model: model() })
    }

    /// Numbers of the models of a run that are pending, those that take longest first: by the
    /// prediction, and by size where there is none.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn pending(&mut self, run: i64) -> Result<Vec<i64>, CatalogueError> {
        let asked = "SELECT id FROM model WHERE run_id = ?1 AND state = 'pending'
            ORDER BY predicted_seconds DESC NULLS LAST, input_bytes DESC, path";
        self.ids(asked, run)
    }

    /// Numbers of the pending models of a run of which nothing is predicted.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn unpredicted(&mut self, run: i64) -> Result<Vec<i64>, CatalogueError> {
        let asked = "SELECT id FROM model WHERE run_id = ?1 AND state = 'pending'
            AND predicted_seconds IS NULL ORDER BY path";
        self.ids(asked, run)
    }

    /// Numbers of the models of a run that have a result.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn with_results(&mut self, run: i64) -> Result<Vec<i64>, CatalogueError> {
        let asked = "SELECT id FROM model WHERE run_id = ?1
            AND state IN ('copied', 'repaired', 'degraded') ORDER BY id";
        self.ids(asked, run)
    }

    fn ids(&mut self, asked: &str, run: i64) -> Result<Vec<i64>, CatalogueError> {
        self.with(|connection| {
            connection.prepare(asked)?.query_map([run], |row| row.get(0))?.collect()
        })
    }

    /// The files of a model's result, as they were put in place.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn files(&mut self, id: i64) -> Result<Vec<(PathBuf, Stamped)>, CatalogueError> {
        let asked = "SELECT path, bytes, mtime_ns, ctime_ns, inode, digest FROM output_file
            WHERE model_id = ?1 ORDER BY path";
        self.with(|connection| {
            let mut asked = connection.prepare_cached(asked)?;
            let files = asked.query_map([id], |row| {
                let stamped = Stamped { stamp: stamp_of(row, 1)?, digest: row.get(5)? };
                Ok((path_of(row, 0)?, stamped))
            })?;
            files.collect()
        })
    }

    /// Asks for the models `ids` anew.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn ask_anew(&mut self, ids: &[i64]) -> Result<(), CatalogueError> {
        let update = "UPDATE model SET state = 'pending', verdict = NULL, cause = NULL,
            reason = NULL WHERE id = ?1";
        self.each(update, ids)
    }

    /// Asks for the models anew of which `condition` (SQL over columns of `model`) holds.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub(crate) fn ask_anew_where(
        &mut self,
        run: i64,
        condition: &str,
    ) -> Result<u64, CatalogueError> {
        let update = format!(
            "UPDATE model SET state = 'pending', verdict = NULL, cause = NULL, reason = NULL
             WHERE run_id = ?1 AND state NOT IN ('pending', 'gone') AND ({condition})"
        );
        self.with(|connection| Ok(connection.execute(&update, [run])? as u64))
    }

    fn each(&mut self, statement: &str, ids: &[i64]) -> Result<(), CatalogueError> {
        self.with(|connection| {
            let transaction = connection.transaction()?;
            for id in ids {
                transaction.prepare_cached(statement)?.execute([id])?;
            }
            transaction.commit()
        })
    }

    /// Notes what the file system says now of an input whose content is as it was.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn set_stamp(&mut self, id: i64, stamp: &Stamp) -> Result<(), CatalogueError> {
        let update = "UPDATE model SET input_bytes = ?2, input_mtime_ns = ?3, input_ctime_ns = ?4,
            input_inode = ?5 WHERE id = ?1";
        self.with(|connection| {
            let Stamp { bytes, mtime_ns, ctime_ns, inode } = *stamp;
            connection
                .prepare_cached(update)?
                .execute(params![id, bytes as i64, mtime_ns, ctime_ns, inode as i64])
                .map(|_| ())
        })
    }

    /// Notes what the file system says now of a result whose content is as it was.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn set_file_stamp(
        &mut self,
        id: i64,
        path: &Path,
        stamp: &Stamp,
    ) -> Result<(), CatalogueError> {
        let update = "UPDATE output_file SET bytes = ?3, mtime_ns = ?4, ctime_ns = ?5, inode = ?6
            WHERE model_id = ?1 AND path = ?2";
        self.with(|connection| {
            let Stamp { bytes, mtime_ns, ctime_ns, inode } = *stamp;
            let path = bytes_of(path);
            connection
                .prepare_cached(update)?
                .execute(params![id, path, bytes as i64, mtime_ns, ctime_ns, inode as i64])
                .map(|_| ())
        })
    }

    /// Notes what a model will take.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn predict(&mut self, id: i64, predicted: &Predicted) -> Result<(), CatalogueError> {
        let update = "UPDATE model SET predicted_seconds = ?2, predicted_memory = ?3,
            predicted_disk = ?4, predicted_leaves = ?5, depth = ?6 WHERE id = ?1";
        self.with(|connection| {
            let words = params![
                id,
                predicted.seconds,
                predicted.memory_bytes as i64,
                predicted.disk_bytes as i64,
                predicted.leaf_cells as i64,
                predicted.depth,
            ];
            connection.prepare_cached(update)?.execute(words).map(|_| ())
        })
    }

    /// Notes what a model came to, with its files, as one transaction.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn finish(
        &mut self,
        id: i64,
        state: State,
        finished: &Finished,
    ) -> Result<(), CatalogueError> {
        self.with(|connection| {
            let transaction = connection.transaction()?;
            write_row(&transaction, id, state, finished)?;
            transaction.execute("DELETE FROM output_file WHERE model_id = ?1", [id])?;
            for file in finished.files {
                let Stamped { stamp, digest } = file.stamped;
                transaction
                    .prepare_cached("INSERT INTO output_file VALUES (?1,?2,?3,?4,?5,?6,?7)")?
                    .execute(params![
                        id,
                        bytes_of(&file.path.to_path()),
                        stamp.bytes as i64,
                        stamp.mtime_ns,
                        stamp.ctime_ns,
                        stamp.inode as i64,
                        digest,
                    ])?;
            }
            transaction.commit()
        })
    }
}

const FINISH: &str = "
    UPDATE model SET state = ?2, verdict = ?3, cause = ?4, reason = ?5, ended_ms = ?6, seconds = ?7,
        cpu_seconds = ?8, peak_bytes = ?9, triangles_before = ?10, triangles_after = ?11,
        open_edges_before = ?12, duplicates_before = ?13, openings_before = ?14, area_ratio = ?15,
        volume = ?16, outcome = ?17, depth = coalesce(?18, depth), attempts = attempts + 1
    WHERE id = ?1";

const FINISH_INPUT: &str = "
    UPDATE model SET input_bytes = ?2, input_mtime_ns = ?3, input_ctime_ns = ?4, input_inode = ?5,
        input_digest = ?6 WHERE id = ?1";

fn write_row(
    connection: &rusqlite::Connection,
    id: i64,
    state: State,
    finished: &Finished,
) -> rusqlite::Result<()> {
    let outcome = finished.outcome;
    let verdict = outcome.map(|outcome| match outcome.verdict {
        Verdict::Pass => "pass",
        Verdict::Review => "review",
        Verdict::Fail => "fail",
    });
    let number = |of: fn(&Outcome) -> u64| outcome.map(|outcome| of(outcome) as i64);
    connection.prepare_cached(FINISH)?.execute(params![
        id,
        state.name(),
        verdict,
        finished.cause.map(Cause::name),
        finished.reason,
        finished.now_ms as i64,
        finished.seconds,
        finished.cpu_seconds,
        finished.peak_bytes.map(|bytes| bytes as i64),
        number(|outcome| outcome.input.stats.triangles),
        number(|outcome| outcome.output.proof.triangles),
        number(|outcome| outcome.found.settle.rim_edges),
        number(|outcome| outcome.found.settle.duplicate_triangles),
        number(|outcome| outcome.found.openings),
        outcome.map(|outcome| outcome.output.area_ratio),
        outcome.map(|outcome| outcome.output.proof.volume),
        outcome.map(|outcome| serde_json::to_string(outcome).expect("plain records serialise")),
        outcome.map(|outcome| outcome.grid.depth),
    ])?;
    if let Some(Stamped { stamp, digest }) = finished.input {
        let Stamp { bytes, mtime_ns, ctime_ns, inode } = stamp;
        connection.prepare_cached(FINISH_INPUT)?.execute(params![
            id,
            bytes as i64,
            mtime_ns,
            ctime_ns,
            inode as i64,
            digest,
        ])?;
    }
    Ok(())
}
