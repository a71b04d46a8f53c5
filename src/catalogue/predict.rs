//! Asks workers what the pending models will take.
//!
//! In:         numbers of models. Out: their predictions in the journal; models that cannot be read
//!             at all are settled there.
//! Invariant:  a model on which a worker dies stays without prediction, and the others are told.
//! Memory:     as many workers as in the run, each with its share; rows of a few models.
//! Fails:      [`CatalogueError`].

use crossbeam::channel::{Receiver, Sender, bounded, unbounded};

use crate::catalogue::CatalogueError;
use crate::catalogue::attempt::Place;
use crate::catalogue::beside::SideFile;
use crate::catalogue::child::{Watch, Worker};
use crate::catalogue::fleet::Fleet;
use crate::catalogue::job::{Ending, Job, Made, Task};
use crate::catalogue::journal::{Finished, Journal, ModelRow};
use crate::catalogue::options::BatchOptions;
use crate::catalogue::state::{Cause, State};
use crate::store::StoreError;

/// A model that stands still while it is read longer than this is told by its repair.
const PATIENCE_MS: u64 = 600_000;
/// Models that wait for a worker.
const AHEAD: usize = 16;

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
    let stops = || fleet.cancelled() || options.stop_at_ms.is_some_and(|at| fleet.now_ms() >= at);
    let (rows, questions) = bounded(AHEAD);
    let (answers, answered) = unbounded();
    std::thread::scope(|scope| {
        for slot in 0..options.jobs.min(ids.len()) {
            let asking = Asking { slot, place, options, fleet, stops: &stops };
            let (questions, answers) = (questions.clone(), answers.clone());
            scope.spawn(move || asking.ask_all(&questions, &answers));
        }
        drop((questions, answers));
        let mut left = ids.iter();
        let mut rows = Some(rows);
        let mut done = 0;
        loop {
            // As many questions are under way as there is room for.
            while let Some(sender) = rows.as_ref().filter(|sender| !sender.is_full()) {
                match left.next().filter(|_| !stops()) {
                    Some(&id) => {
                        // Where all workers' threads ended, their answers say why.
                        let _ = sender.send(journal.model(id)?);
                    }
                    None => rows = None,
                }
            }
            let Ok(answer) = answered.recv() else { return Ok::<(), CatalogueError>(()) };
            let (row, ending) = answer?;
            enter(journal, &row, ending, fleet)?;
            done += 1;
            fleet.looking(done, ids.len() as u64);
        }
    })?;
    place.remove_slots(options.jobs)?;
    if fleet.cancelled() { Err(StoreError::Cancelled.into()) } else { Ok(()) }
}

type Answer = Result<(ModelRow, Option<Ending>), CatalogueError>;

/// One worker after another that is asked.
struct Asking<'a> {
    slot: usize,
    place: &'a Place,
    options: &'a BatchOptions<'a>,
    fleet: &'a dyn Fleet,
    stops: &'a (dyn Fn() -> bool + Sync),
}

impl Asking<'_> {
    fn ask_all(&self, questions: &Receiver<ModelRow>, answers: &Sender<Answer>) {
        let mut worker = None;
        for row in questions {
            let answer = self.ask(&mut worker, &row).map(|ending| (row, ending));
            if answers.send(answer).is_err() {
                return;
            }
        }
    }

    /// What a model will take; `None` where its worker died or had to be stopped.
    fn ask(
        &self,
        worker: &mut Option<Worker>,
        row: &ModelRow,
    ) -> Result<Option<Ending>, CatalogueError> {
        let wanted = (self.options.wanted)(&row.relative);
        let folder = self.place.folder_of_slot(self.slot)?;
        let job = self.place.job(row, &wanted.settings, &folder, self.place.shared());
        let job = Job { task: Task::Estimate, ..job };
        let limit_ms = self.options.model_timeout_ms.unwrap_or(u64::MAX).min(PATIENCE_MS);
        let watch = Watch {
            now_ms: &|| self.fleet.now_ms(),
            deadline_ms: Some(self.fleet.now_ms().saturating_add(limit_ms)),
            stops: self.stops,
            working: &|_, _, _| {},
            note: &|text| self.fleet.note(text),
        };
        let mut asked = match worker.take() {
            Some(worker) => worker,
            None => Worker::start(&self.options.program)?,
        };
        let ending = asked.ask(&job, &watch);
        // One that was stopped, or ended, is of no more use.
        let is_whole = ending.as_ref().is_some_and(|ending| !ending.made.is_stopped());
        *worker = is_whole.then_some(asked);
        Ok(ending)
    }
}

fn enter(
    journal: &mut Journal,
    row: &ModelRow,
    ending: Option<Ending>,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    let Some(Ending { made, beside, .. }) = ending else { return Ok(()) };
    match made {
        Made::Estimate(predicted) => journal.predict(row.id, &predicted),
        Made::Nothing { blame, message, .. } if Cause::from(blame) == Cause::Input => {
            let finished = Finished {
                cause: Some(Cause::Input),
                reason: Some(message),
                beside: beside.map(|files| SideFile::within(files, &row.relative)),
                now_ms: fleet.now_ms(),
                ..Finished::default()
            };
            journal.finish(row.id, State::Failed, &finished)
        }
        // The repair will tell.
        _ => Ok(()),
    }
}
