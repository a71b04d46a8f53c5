//! The rows of models: what is to be done.

use std::path::{Path, PathBuf};

use rusqlite::{OptionalExtension, Row, params};

use crate::catalogue::CatalogueError;
use crate::catalogue::job::Predicted;
use crate::catalogue::journal::Journal;
use crate::catalogue::journal::enrol::{bytes_of, format_of, path_of, stamp_of};
use crate::catalogue::stamp::{Stamp, Stamped};
use crate::catalogue::state::State;
use crate::io::Format;
use crate::store::Digest;

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
    pub digest: Option<Digest>,
    /// What it will take, once that was estimated.
    pub predicted: Option<Predicted>,
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

    /// Seconds that the pending models of a run are expected to take on one worker.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn pending_seconds(&mut self, run: i64) -> Result<f64, CatalogueError> {
        let asked = "SELECT coalesce(sum(predicted_seconds), 0.0) FROM model
            WHERE run_id = ?1 AND state = 'pending'";
        self.with(|connection| connection.query_row(asked, [run], |row| row.get(0)))
    }

    /// How many models of a run have no result: failed, or still to be done.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn without_results(&mut self, run: i64) -> Result<u64, CatalogueError> {
        let asked = "SELECT count(*) FROM model WHERE run_id = ?1
            AND (state IN ('failed', 'pending') OR verdict = 'fail')";
        let count: i64 =
            self.with(|connection| connection.query_row(asked, [run], |row| row.get(0)))?;
        Ok(count as u64)
    }

    /// Numbers, ascending, of the models whose work folders are of use: it goes on in them, or they
    /// show a bug of ours.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn with_work(&mut self) -> Result<Vec<i64>, CatalogueError> {
        let asked =
            "SELECT id FROM model WHERE state = 'pending' OR cause = 'internal' ORDER BY id";
        self.with(|connection| {
            connection.prepare(asked)?.query_map((), |row| row.get(0))?.collect()
        })
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

    /// Whether a file is one of the result of another model too.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn is_file_of_another(&mut self, id: i64, file: &Path) -> Result<bool, CatalogueError> {
        let asked = "SELECT EXISTS (SELECT 1 FROM output_file WHERE path = ?1 AND model_id <> ?2)";
        self.with(|connection| {
            let words = params![bytes_of(file), id];
            connection.prepare_cached(asked)?.query_row(words, |row| row.get(0))
        })
    }

    /// Asks for the models `ids` anew, because of what is told in one line.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn ask_anew(&mut self, ids: &[i64], because: &str) -> Result<(), CatalogueError> {
        let update = "UPDATE model SET state = 'pending', verdict = NULL, cause = NULL,
            reason = NULL, because = ?2 WHERE id = ?1";
        self.with(|connection| {
            let transaction = connection.transaction()?;
            for id in ids {
                transaction.prepare_cached(update)?.execute(params![id, because])?;
            }
            transaction.commit()
        })
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
            "UPDATE model SET state = 'pending', verdict = NULL, cause = NULL, reason = NULL,
             because = 'it was asked for by --retry' WHERE run_id = ?1 AND state NOT IN ('pending', 'gone') AND ({condition})"
        );
        self.with(|connection| Ok(connection.execute(&update, [run])? as u64))
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
}
