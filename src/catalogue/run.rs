//! Works the pending models off: workers side by side, each given its share, every end noted.
//!
//! In:         the journal with pending models. Out: the results, the journal.
//! Invariant:  the journal knows a result only once its files are in place. The memory of all
//!             workers and of this process together stays below that of the batch.
//! Memory:     numbers of pending models; what workers say.
//! Fails:      [`CatalogueError`]: the journal, or a worker that cannot be started. What becomes of
//!             a model is never an error.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossbeam::channel::{RecvTimeoutError, Sender, unbounded};

use crate::catalogue::CatalogueError;
use crate::catalogue::attempt::{Meaning, Place, meaning};
use crate::catalogue::beside::SideFile;
use crate::catalogue::child::{Exited, Watch, Worker};
use crate::catalogue::fleet::{Ended, Fleet};
use crate::catalogue::job::{Job, Made, OutputFile, RawPath};
use crate::catalogue::journal::{Finished, Journal, ModelRow};
use crate::catalogue::options::BatchOptions;
use crate::catalogue::pace::Pace;
use crate::catalogue::stamp::Stamp;
use crate::catalogue::state::{Cause, Rung, State};
use crate::store::StoreError;

/// How often limits are looked at while nothing happens.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnding {
    /// Nothing is pending.
    Done,
    /// At a limit of time or of failures.
    Stopped,
    /// The caller wanted it.
    Interrupted,
    /// A disk is full.
    DiskFull,
}

impl RunEnding {
    /// Its name in the journal.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Stopped => "stopped",
            Self::Interrupted => "interrupted",
            Self::DiskFull => "disk_full",
        }
    }
}

/// A worker under way.
struct Attempt {
    slot: usize,
    row: ModelRow,
    rung: Rung,
    number: i64,
    started_ms: u64,
}

/// A worker that ended.
type Event = (Attempt, Result<Exited, CatalogueError>);

/// The models that are left, and what happened so far.
pub struct Workload<'b> {
    journal: &'b mut Journal,
    run: i64,
    place: &'b Place,
    options: &'b BatchOptions<'b>,
    fleet: &'b dyn Fleet,
    /// Beside others, the longest first.
    pending: VecDeque<i64>,
    /// One at a time, when nothing else is left.
    alone: VecDeque<(i64, Rung)>,
    free_slots: Vec<usize>,
    running: usize,
    is_alone: bool,
    failures: u64,
    pace: Pace,
    stopping: Option<RunEnding>,
    error: Option<CatalogueError>,
}

impl<'b> Workload<'b> {
    /// The pending models of a run.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn new(
        journal: &'b mut Journal,
        run: i64,
        place: &'b Place,
        options: &'b BatchOptions<'b>,
        fleet: &'b dyn Fleet,
    ) -> Result<Self, CatalogueError> {
        let pending: VecDeque<i64> = journal.pending(run)?.into();
        let pace = Pace::new(journal.pending_seconds(run)?, options.jobs);
        Ok(Self {
            journal,
            run,
            place,
            options,
            fleet,
            pending,
            alone: VecDeque::new(),
            free_slots: (0..options.jobs.max(1)).rev().collect(),
            running: 0,
            is_alone: false,
            failures: 0,
            pace,
            stopping: None,
            error: None,
        })
    }

    /// Works all of it off, or stops on the way.
    ///
    /// # Errors
    /// The journal cannot be written, or no worker can be started.
    pub fn work_off(mut self) -> Result<RunEnding, CatalogueError> {
        let (sender, events) = unbounded::<Event>();
        let stops = AtomicBool::new(false);
        let (options, fleet) = (self.options, self.fleet);
        std::thread::scope(|scope| {
            loop {
                self.look_at_limits();
                stops.store(self.stopping.is_some(), Ordering::Relaxed);
                while let Some((attempt, job)) = self.next() {
                    let (sender, stops) = (Sender::clone(&sender), &stops);
                    scope.spawn(move || watch_over(attempt, &job, options, fleet, stops, &sender));
                }
                if self.running == 0 {
                    break;
                }
                match events.recv_timeout(LOOK_INTERVAL) {
                    Ok((attempt, exited)) => self.end(attempt, exited),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => unreachable!("we hold a sender"),
                }
            }
        });
        match self.error {
            Some(error) => Err(error),
            None => Ok(self.stopping.unwrap_or(RunEnding::Done)),
        }
    }

    fn look_at_limits(&mut self) {
        if self.stopping.is_some() {
            return;
        }
        if self.fleet.cancelled() {
            self.stopping = Some(RunEnding::Interrupted);
        } else if self.options.stop_at_ms.is_some_and(|at| self.fleet.now_ms() >= at) {
            self.stopping = Some(RunEnding::Stopped);
            self.fleet.note("the time is up: stopping");
        } else if self.options.max_failures.is_some_and(|most| self.failures > most) {
            self.stopping = Some(RunEnding::Stopped);
            self.fleet.note("too many models failed: stopping");
        }
    }

    /// The next attempt, if one may begin now.
    fn next(&mut self) -> Option<(Attempt, Job)> {
        if self.stopping.is_some() || self.is_alone {
            return None;
        }
        let (id, rung) = if let Some(&id) = self.pending.front() {
            (id, Rung::Shared)
        } else if self.running == 0 {
            *self.alone.front()?
        } else {
            return None;
        };
        let slot = self.free_slots.pop()?;
        if rung == Rung::Shared {
            self.pending.pop_front()
        } else {
            self.alone.pop_front().map(|_| 0)
        };
        match self.begin(slot, id, rung) {
            Ok(begun) => {
                self.is_alone = rung != Rung::Shared;
                self.running += 1;
                Some(begun)
            }
            Err(error) => {
                self.give_up(error);
                None
            }
        }
    }

    fn begin(
        &mut self,
        slot: usize,
        id: i64,
        rung: Rung,
    ) -> Result<(Attempt, Job), CatalogueError> {
        let row = self.journal.model(id)?;
        let wanted = (self.options.wanted)(&row.relative);
        let earlier: Vec<PathBuf> =
            self.journal.files(id)?.into_iter().map(|(file, _)| file).collect();
        let job = self.place.attempt(&row, &wanted, rung, &earlier)?;
        let grant = self.place.grant(rung);
        let started_ms = self.fleet.now_ms();
        let number = self.journal.begin_attempt(
            (self.run, id),
            rung,
            (grant.memory_bytes, grant.threads),
            started_ms,
        )?;
        self.fleet.started(slot, &row.relative.to_string_lossy());
        Ok((Attempt { slot, row, rung, number, started_ms }, job))
    }

    /// Stops for an error that is none of a model's.
    fn give_up(&mut self, error: CatalogueError) {
        if error.is_disk_full() {
            self.fleet.note(&format!("{error}: stopping"));
            self.stopping = Some(RunEnding::DiskFull);
        } else {
            self.stopping.get_or_insert(RunEnding::Interrupted);
            self.error.get_or_insert(error);
        }
    }

    fn end(&mut self, attempt: Attempt, exited: Result<Exited, CatalogueError>) {
        self.running -= 1;
        self.is_alone = false;
        self.free_slots.push(attempt.slot);
        let concluded = exited.and_then(|mut exited| self.conclude(&attempt, &mut exited));
        if let Err(error) = concluded {
            self.give_up(error);
        }
    }

    fn conclude(&mut self, attempt: &Attempt, exited: &mut Exited) -> Result<(), CatalogueError> {
        let now_ms = self.fleet.now_ms();
        let seconds = now_ms.saturating_sub(attempt.started_ms) as f64 / 1000.0;
        let meaning = meaning(exited);
        let ending = exited.ending.as_mut();
        let beside = ending.and_then(|ending| ending.beside.take());
        let ending = exited.ending.as_ref();
        let finished = Finished {
            beside: beside.map(|files| SideFile::within(files, &attempt.row.relative)),
            input: ending.and_then(|ending| ending.input),
            now_ms,
            seconds,
            cpu_seconds: ending.map(|ending| ending.cpu_seconds),
            peak_bytes: ending.and_then(|ending| ending.peak_bytes),
            ..Finished::default()
        };
        match meaning {
            Meaning::Made(made) => self.settle(attempt, &made, finished),
            Meaning::Failed(cause, reason) => self.fail(attempt, cause, reason, finished),
            Meaning::Stopped => {
                self.journal.end_attempt(attempt.number, Cause::Stopped.name(), None, now_ms)
            }
            Meaning::DiskFull(reason) => {
                self.stopping = Some(RunEnding::DiskFull);
                self.fleet.note(&format!("{reason}: stopping"));
                let ending = Cause::Disk.name();
                self.journal.end_attempt(attempt.number, ending, Some(&reason), now_ms)
            }
        }
    }

    /// Notes a result.
    fn settle(
        &mut self,
        attempt: &Attempt,
        made: &Made,
        finished: Finished,
    ) -> Result<(), CatalogueError> {
        let (state, figures, files, not_copied) = match made {
            Made::Repaired { figures, files, not_copied } => {
                let is_coarser = attempt.rung.coarser_levels() > 0;
                let state = if is_coarser { State::Degraded } else { State::Repaired };
                (state, Some(&**figures), files, not_copied.as_ref())
            }
            Made::Copied { files } => (State::Copied, None, files, None),
            // A worker that answers what it was not asked.
            Made::Estimate(_) | Made::Nothing { .. } => {
                let reason = "the worker answered something else".to_owned();
                return self.fail(attempt, Cause::Internal, reason, finished);
            }
        };
        let files: Vec<OutputFile> = files.iter().map(|file| self.within(file)).collect();
        let reasons = figures.into_iter().flat_map(|figures| &figures.reasons);
        let reasons: Vec<&str> =
            not_copied.into_iter().chain(reasons).map(String::as_str).collect();
        let reason = (!reasons.is_empty()).then(|| reasons.join("; "));
        self.remove_earlier(attempt.row.id, &files)?;
        let finished = Finished { figures, files: &files, reason, ..finished };
        self.journal.finish(attempt.row.id, state, &finished)?;
        let (now_ms, seconds) = (finished.now_ms, finished.seconds);
        self.journal.end_attempt(attempt.number, state.name(), None, now_ms)?;
        self.remove_work(attempt.row.id);
        self.tell(attempt, state, None, finished.reason.as_deref(), seconds);
        Ok(())
    }

    /// Notes that an attempt came to nothing: the next one, or the end of it.
    fn fail(
        &mut self,
        attempt: &Attempt,
        cause: Cause,
        reason: String,
        finished: Finished,
    ) -> Result<(), CatalogueError> {
        let (now_ms, seconds) = (finished.now_ms, finished.seconds);
        self.journal.end_attempt(attempt.number, cause.name(), Some(&reason), now_ms)?;
        let id = attempt.row.id;
        if let Some(rung) = attempt.rung.next(cause) {
            self.alone.push_back((id, rung));
            self.tell(attempt, State::Pending, Some(cause), Some(&reason), seconds);
            return Ok(());
        }
        let finished = Finished { cause: Some(cause), reason: Some(reason), ..finished };
        // What is nobody's fault is tried again by the next run.
        let is_passing = matches!(cause, Cause::Lock | Cause::Temporary | Cause::Stopped);
        if !is_passing {
            self.journal.finish(id, State::Failed, &finished)?;
        }
        if cause != Cause::Internal && !is_passing {
            self.remove_work(id);
        }
        self.failures += 1;
        self.tell(attempt, State::Failed, Some(cause), finished.reason.as_deref(), seconds);
        Ok(())
    }

    fn tell(
        &mut self,
        attempt: &Attempt,
        state: State,
        cause: Option<Cause>,
        reason: Option<&str>,
        seconds: f64,
    ) {
        self.pace.enter(&attempt.row, state, seconds);
        let left_seconds = self.pace.seconds_to_go();
        let model = &attempt.row.relative.to_string_lossy();
        self.fleet
            .ended(attempt.slot, &Ended { model, state, cause, reason, seconds, left_seconds });
    }

    /// A file as the journal has it: within the folder of the results.
    fn within(&self, file: &OutputFile) -> OutputFile {
        let path = file.path.to_path();
        let within = path.strip_prefix(&self.options.target).map_or(path.clone(), PathBuf::from);
        OutputFile { path: RawPath::new(&within), stamped: file.stamped }
    }

    /// Removes what an earlier result had and this one has not, as far as it is still as it was put
    /// there and no part of the result of another model.
    fn remove_earlier(&mut self, model: i64, files: &[OutputFile]) -> Result<(), CatalogueError> {
        for (file, put) in self.journal.files(model)? {
            let path = self.options.target.join(&file);
            if files.iter().all(|now| now.path.to_path() != file)
                && Stamp::at(&path) == Some(put.stamp)
                && !self.journal.is_file_of_another(model, &file)?
            {
                std::fs::remove_file(&path).map_err(|e| StoreError::io("remove", &path, e))?;
            }
        }
        Ok(())
    }

    /// What is left of a model's work is of no use; that it cannot be removed changes nothing.
    fn remove_work(&self, model: i64) {
        let _ = std::fs::remove_dir_all(self.place.work().join(model.to_string()));
    }
}

/// Sets a worker to a job, and tells its end.
fn watch_over(
    attempt: Attempt,
    job: &Job,
    options: &BatchOptions,
    fleet: &dyn Fleet,
    stops: &AtomicBool,
    events: &Sender<Event>,
) {
    let slot = attempt.slot;
    let watch = Watch {
        now_ms: &|| fleet.now_ms(),
        deadline_ms: options.model_timeout_ms.map(|ms| attempt.started_ms.saturating_add(ms)),
        stops: &|| stops.load(Ordering::Relaxed),
        working: &|stage, share, bytes| fleet.working(slot, stage, share, bytes),
        note: &|text| fleet.note(text),
    };
    let exited = Worker::start(&options.program).map(|worker| worker.ask_last(job, &watch));
    // The one who listens outlives us.
    let _ = events.send((attempt, exited));
}
