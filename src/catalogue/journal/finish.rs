//! Enters what a model came to.

use rusqlite::params;

use crate::catalogue::CatalogueError;
use crate::catalogue::beside::SideFile;
use crate::catalogue::job::{Figures, OutputFile};
use crate::catalogue::journal::Journal;
use crate::catalogue::journal::enrol::bytes_of;
use crate::catalogue::journal::side_files::write_beside;
use crate::catalogue::stamp::{Stamp, Stamped};
use crate::catalogue::state::{Cause, State};
use crate::repair::Verdict;

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
    pub figures: Option<&'f Figures>,
    /// The files of the result, the model itself first.
    pub files: &'f [OutputFile],
    /// The files that the model names, by their paths within the folder of the models; where it is
    /// not known, those of before count on.
    pub beside: Option<Vec<SideFile>>,
    /// Now.
    pub now_ms: u64,
    /// Wall time of the last attempt.
    pub seconds: f64,
    /// Processor time of its worker.
    pub cpu_seconds: Option<f64>,
    /// Peak memory of its worker.
    pub peak_bytes: Option<u64>,
}

impl Journal {
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
            // What failed has left the files of its last result where they were.
            if state.has_result() {
                transaction
                    .prepare_cached("DELETE FROM output_file WHERE model_id = ?1")?
                    .execute([id])?;
                let result = finished.files.first().map(|file| file.path.to_path());
                transaction
                    .prepare_cached("UPDATE model SET result = nullif(?2, output) WHERE id = ?1")?
                    .execute(params![id, result.as_deref().map(bytes_of)])?;
            }
            if let Some(beside) = &finished.beside {
                write_beside(&transaction, id, beside)?;
            }
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
        volume = ?16, outcome = ?17, depth = coalesce(?18, depth)
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
    let figures = finished.figures;
    let verdict = figures.map(|figures| match figures.verdict {
        Verdict::Pass => "pass",
        Verdict::Review => "review",
        Verdict::Fail => "fail",
    });
    let number = |of: fn(&Figures) -> u64| figures.map(|figures| of(figures) as i64);
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
        number(|figures| figures.triangles_before),
        number(|figures| figures.triangles_after),
        number(|figures| figures.open_edges_before),
        number(|figures| figures.duplicates_before),
        number(|figures| figures.openings_before),
        figures.and_then(|figures| figures.area_ratio),
        figures.and_then(|figures| figures.volume),
        figures.map(|figures| &figures.outcome),
        figures.map(|figures| figures.depth),
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
