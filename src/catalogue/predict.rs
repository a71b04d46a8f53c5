//! Asks workers what the pending models will take.
//!
//! In:         numbers of models. Out: their predictions in the journal; models that cannot be read
//!             at all are settled there.
//! Invariant:  a model on which a worker dies stays without prediction, and the others are told.
//! Memory:     as many workers as in the run, each with its share.
//! Fails:      [`CatalogueError`].

use std::sync::atomic::{AtomicUsize, Ordering};

use crossbeam::channel::{Sender, bounded};

use crate::catalogue::CatalogueError;
use crate::catalogue::attempt::Place;
use crate::catalogue::child::{Watch, run_child};
use crate::catalogue::fleet::Fleet;
use crate::catalogue::job::{Job, Made, Task};
use crate::catalogue::journal::{Finished, Journal, ModelRow, Predicted};
use crate::catalogue::options::BatchOptions;
use crate::catalogue::state::{Cause, State};
use crate::store::StoreError;

/// A model that stands still while it is read longer than this is told by its repair.
const PATIENCE_MS: u64 = 600_000;

/// Predicts what the models `ids` will take, and settles those that cannot be read.
///
/// # Errors
/// The journal cannot be written, no worker can be started, or the caller wants to stop.
pub fn predict(
    journal: &mut Journal,
    ids: &[i64],
    place: &Place,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    let mut rows = Vec::with_capacity(ids.len());
    for &id in ids {
        rows.push(journal.model(id)?);
    }
    let next = AtomicUsize::new(0);
    let (sender, answers) = bounded(64);
    std::thread::scope(|scope| {
        for slot in 0..options.jobs {
            let (sender, next, rows) = (sender.clone(), &next, &rows);
            scope.spawn(move || ask(slot, rows, next, place, options, fleet, &sender));
        }
        drop(sender);
        let mut entered = Ok(());
        for (done, answer) in answers.iter().enumerate() {
            fleet.looking(done as u64, rows.len() as u64);
            if entered.is_ok() {
                entered = answer.and_then(|(id, made)| enter(journal, id, &made, fleet));
                if entered.is_err() {
                    // The workers' threads find nothing more to do.
                    next.store(rows.len(), Ordering::Relaxed);
                }
            }
        }
        entered
    })?;
    if fleet.cancelled() { Err(StoreError::Cancelled.into()) } else { Ok(()) }
}

type Answer = Result<(i64, Option<Made>), CatalogueError>;

/// Sets one worker after another to the models that are left.
fn ask(
    slot: usize,
    rows: &[ModelRow],
    next: &AtomicUsize,
    place: &Place,
    options: &BatchOptions,
    fleet: &dyn Fleet,
    answers: &Sender<Answer>,
) {
    while !fleet.cancelled() {
        let Some(row) = rows.get(next.fetch_add(1, Ordering::Relaxed)) else { return };
        let answer = predict_one(slot, row, place, options, fleet);
        if answers.send(answer.map(|made| (row.id, made))).is_err() {
            return;
        }
    }
}

fn predict_one(
    slot: usize,
    row: &ModelRow,
    place: &Place,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<Option<Made>, CatalogueError> {
    let wanted = (options.wanted)(&row.relative);
    let task = Task::Estimate;
    let folder = place.folder_of_slot(slot)?;
    let job = Job { task, ..place.job(row, &wanted.settings, &folder, place.shared()) };
    let limit_ms = options.model_timeout_ms.unwrap_or(u64::MAX).min(PATIENCE_MS);
    let watch = Watch {
        now_ms: &|| fleet.now_ms(),
        deadline_ms: Some(fleet.now_ms().saturating_add(limit_ms)),
        stops: &|| fleet.cancelled(),
        working: &|_, _| {},
    };
    Ok(run_child(&options.program, &job, &watch)?.ending.map(|ending| ending.made))
}

fn enter(
    journal: &mut Journal,
    id: i64,
    made: &Option<Made>,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    match made {
        Some(Made::Estimate(estimate)) => journal.predict(id, &Predicted::of(estimate)),
        Some(Made::Nothing { blame, message, .. }) if Cause::from(*blame) == Cause::Input => {
            let finished = Finished {
                cause: Some(Cause::Input),
                reason: Some(message.clone()),
                now_ms: fleet.now_ms(),
                ..Finished::default()
            };
            journal.finish(id, State::Failed, &finished)
        }
        // The repair will tell.
        _ => Ok(()),
    }
}
