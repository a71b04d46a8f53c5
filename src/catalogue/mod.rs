//! Whole libraries: a folder of models to a folder of results, night after night.
//!
//! In:         [`BatchOptions`]: two folders, what is wanted of each model, limits.
//! Out:        the results, in a tree like that of the models; a [`Journal`] of all that happened.
//! Invariant:  one process per model, so whatever a model does to it is an outcome of that model.
//!             The same command again does only what is not done; killed at any point, nothing is
//!             lost but the work since the last checkpoint.
//! Memory:     [`BatchOptions::max_memory_bytes`] for all processes together.
//! Fails:      [`CatalogueError`]: folders, journal, lock. What becomes of a model is data.
//! Source:     ours; the habits of restic (idempotent runs, exit 3) and of make.

mod attempt;
mod beside;
mod child;
mod copy;
mod copy_files;
mod error;
mod fleet;
mod job;
mod journal;
mod names;
mod options;
mod pace;
mod predict;
mod prepare;
mod run;
mod stamp;
mod state;
mod walk;
mod worker;

pub use beside::SideFile;
pub use child::WORKER;
pub use copy::{Copied, CopyRequest, copy_if_sound};
pub use error::CatalogueError;
pub use fleet::{Ahead, Ended, Fleet};
pub use job::{
    Drawing, Ending, Figures, Job, MOST_PARTS, Made, OutputFile, PartLine, Predicted, RawPath,
    Report, Task,
};
pub use journal::{
    AttemptRow, CauseGroup, FOLDER, Failure, JOURNAL, Journal, ListOrder, ListedModel, ModelRow,
    OutcomeSum, StateCount, Summary, Told, ToldBeside, Totals, UnderWay,
};
pub use options::{BatchOptions, Pages, Retry, Wanted};
pub use run::RunEnding;
pub use stamp::{Stamp, Stamped};
pub use state::{Cause, Rung, State};
pub use walk::{Found, Passed, PassedBy, Selection};
pub use worker::do_job;

use std::path::Path;

use crate::catalogue::attempt::Place;
use crate::catalogue::predict::predict;
use crate::catalogue::prepare::prepare;
use crate::catalogue::run::Workload;
use crate::repair::lock_folder;
use crate::store::StoreError;

/// What came of a batch.
#[derive(Clone, Debug)]
pub struct BatchReport {
    /// How it ended; `None` where it only planned.
    pub ending: Option<RunEnding>,
    /// What there was to do.
    pub ahead: Ahead,
    /// Models of this run that have no result: they failed, or are still to be done.
    pub without_results: u64,
    /// Where the catalogue stands now.
    pub summary: Summary,
}

/// Repairs a folder of models, as far as that is not done.
///
/// # Errors
/// [`CatalogueError`]. Results that are in place stay, and the journal knows of them.
pub fn run_batch(options: &BatchOptions, fleet: &dyn Fleet) -> Result<BatchReport, CatalogueError> {
    keep_apart(options)?;
    let own = options.target.join(FOLDER);
    let place = Place::new(options, &own)?;
    let _lock = lock_folder(&own).map_err(CatalogueError::Locked)?;
    let mut journal = Journal::open(&options.target)?;
    let run = journal.begin_run(&options.command, fleet.now_ms())?;
    let done = go_through(&mut journal, run, &place, options, fleet);
    let name = match &done {
        Ok((ending, _)) => ending.map_or("planned", RunEnding::name),
        Err(CatalogueError::Store(StoreError::Cancelled)) => RunEnding::Interrupted.name(),
        Err(error) if error.is_disk_full() => RunEnding::DiskFull.name(),
        Err(_) => "error",
    };
    let noted = journal.end_run(run, name, fleet.now_ms());
    let (ending, ahead) = done?;
    noted?;
    let without_results = journal.without_results(run)?;
    Ok(BatchReport { ending, ahead, without_results, summary: journal.summary()? })
}

fn go_through(
    journal: &mut Journal,
    run: i64,
    place: &Place,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<(Option<RunEnding>, Ahead), CatalogueError> {
    let prepared = prepare(journal, run, options, fleet)?;
    sweep(place, &journal.with_work()?)?;
    let unpredicted = journal.unpredicted(run)?;
    predict(journal, &unpredicted, place, options, fleet)?;
    let pending = journal.pending(run)?.len() as u64;
    let ahead = Ahead {
        found: prepared.found,
        passed: prepared.passed,
        settled: prepared.found.saturating_sub(pending),
        pending,
        seconds: journal.pending_seconds(run)?,
    };
    if prepared.enrolled.told_apart > 0 {
        let told = prepared.enrolled.told_apart;
        fleet.note(&format!("{told} results keep the extension of their models in their names"));
    }
    if prepared.enrolled.gone > 0 {
        fleet.note(&format!("{} models are gone; their results stay", prepared.enrolled.gone));
    }
    fleet.ahead(&ahead);
    if options.only_plan {
        return Ok((None, ahead));
    }
    let ending = Workload::new(journal, run, place, options, fleet)?.work_off()?;
    Ok((Some(ending), ahead))
}

/// Refuses folders of which one would be written into the other's tree of models.
fn keep_apart(options: &BatchOptions) -> Result<(), CatalogueError> {
    let (models, target) = (&options.source, &options.target);
    std::fs::create_dir_all(target).map_err(|e| StoreError::io("create", target, e))?;
    let real = |folder: &Path| {
        folder.canonicalize().map_err(|e| StoreError::io("find the folder", folder, e))
    };
    if real(models)?.starts_with(real(target)?) {
        let (models, target) = (models.clone(), target.clone());
        return Err(CatalogueError::SameFolder { models, target });
    }
    Ok(())
}

/// Removes what is left of the work on models but those in `kept`, in ascending order.
fn sweep(place: &Place, kept: &[i64]) -> Result<(), CatalogueError> {
    let Ok(entries) = std::fs::read_dir(place.work()) else { return Ok(()) };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let model = name.to_str().and_then(|name| name.parse::<i64>().ok());
        let is_slot = name.to_str().is_some_and(|name| name.starts_with("slot-"));
        let is_over = model.is_some_and(|id| kept.binary_search(&id).is_err());
        if is_slot || is_over {
            let path = entry.path();
            std::fs::remove_dir_all(&path).map_err(|e| StoreError::io("remove", &path, e))?;
        }
    }
    Ok(())
}
