//! One attempt at a model: what its worker is given, and what its end means.

use std::io::ErrorKind;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use crate::catalogue::CatalogueError;
use crate::catalogue::child::{Asked, Exited};
use crate::catalogue::job::{Drawing, Job, Made, RawPath, Task};
use crate::catalogue::journal::ModelRow;
use crate::catalogue::options::{BatchOptions, Pages, Wanted};
use crate::catalogue::state::{Cause, Rung};
use crate::repair::{Depth, Settings, floor_bytes};
use crate::store::{Digester, StoreError};

/// This process: the program, the journal's cache, numbers of models.
const OWN_BYTES: u64 = 40 << 20;
/// Folder of the work folders, in that of the catalogue's own files.
const WORK: &str = "work";
/// The end of a worker that the system gave no memory: it says so, and no more.
const NO_MEMORY: i32 = 75;
/// The end of a worker whose scratch file is gone.
const UNUSABLE: i32 = 5;
/// SIGKILL, which nobody but the kernel sends without being asked by us.
const KILLED: i32 = 9;

/// What a worker is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grant {
    /// Memory.
    pub memory_bytes: u64,
    /// Threads.
    pub threads: usize,
}

/// Where and with what workers work.
#[derive(Clone, Debug)]
pub struct Place {
    source: PathBuf,
    target: PathBuf,
    work: PathBuf,
    report: PathBuf,
    pages: Pages,
    max_disk_bytes: Option<u64>,
    shared: Grant,
    alone: Grant,
}

impl Place {
    /// Shares out what the batch may use; `own` is the folder of the catalogue's own files.
    ///
    /// # Errors
    /// [`CatalogueError::BudgetBelowFloor`], or the folder of the results is not there.
    pub fn new(options: &BatchOptions, own: &Path) -> Result<Self, CatalogueError> {
        let (jobs, whole) =
            (options.jobs.max(1), options.max_memory_bytes.saturating_sub(OWN_BYTES));
        let share = whole / jobs as u64;
        if share < floor_bytes(1) {
            return Err(CatalogueError::BudgetBelowFloor {
                found_bytes: options.max_memory_bytes,
                needed_bytes: OWN_BYTES + jobs as u64 * floor_bytes(1),
                jobs,
            });
        }
        let threads = options.threads.max(1);
        Ok(Self {
            source: options.source.clone(),
            target: options.target.clone(),
            work: work_folder(options, own)?,
            report: options.report.clone(),
            pages: options.pages,
            max_disk_bytes: options.max_disk_bytes,
            shared: Grant { memory_bytes: share, threads: (threads / jobs).max(1) },
            alone: Grant { memory_bytes: whole, threads },
        })
    }

    /// What a worker beside others is given.
    #[must_use]
    pub fn shared(&self) -> Grant {
        self.shared
    }

    /// What a worker is given on a rung.
    #[must_use]
    pub fn grant(&self, rung: Rung) -> Grant {
        match rung {
            Rung::Shared => self.shared,
            Rung::Alone | Rung::Coarser | Rung::Coarsest => self.alone,
        }
    }

    /// Folder of the work folders.
    #[must_use]
    pub fn work(&self) -> &Path {
        &self.work
    }

    /// The work folder of a model, made if need be. A coarser attempt starts anew in it.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn folder_of(&self, model: i64) -> Result<PathBuf, CatalogueError> {
        make_folder(self.work.join(model.to_string()))
    }

    /// A folder for what readers spill while they predict.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn folder_of_slot(&self, slot: usize) -> Result<PathBuf, CatalogueError> {
        make_folder(self.work.join(format!("slot-{slot}")))
    }

    /// Removes the folders that readers spilled into.
    ///
    /// # Errors
    /// One cannot be removed.
    pub fn remove_slots(&self, slots: usize) -> Result<(), CatalogueError> {
        for slot in 0..slots {
            let folder = self.work.join(format!("slot-{slot}"));
            match std::fs::remove_dir_all(&folder) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(StoreError::io("remove", &folder, error).into());
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// A job to repair a model.
    #[must_use]
    pub fn job(&self, row: &ModelRow, settings: &Settings, folder: &Path, grant: Grant) -> Job {
        Job {
            task: Task::Repair,
            input: RawPath::new(&self.source.join(&row.relative)),
            output: RawPath::new(&self.target.join(&row.output)),
            format: row.format,
            settings: *settings,
            max_memory_bytes: grant.memory_bytes,
            threads: grant.threads,
            max_disk_bytes: self.max_disk_bytes,
            work_dir: RawPath::new(folder),
            as_is: None,
            replaces: Vec::new(),
            drawing: Drawing {
                wanted: self.pages,
                report: RawPath::new(&self.report),
                number: row.id,
                name: row.relative.to_string_lossy().into_owned(),
            },
        }
    }

    /// The job of an attempt at a model; `earlier` are the files of its last result, within the
    /// folder of the results.
    ///
    /// # Errors
    /// A folder cannot be made.
    pub fn attempt(
        &self,
        row: &ModelRow,
        wanted: &Wanted,
        rung: Rung,
        earlier: &[PathBuf],
    ) -> Result<Job, CatalogueError> {
        let folder = self.folder_of(row.id)?;
        if let Some(parent) = self.target.join(&row.output).parent() {
            make_folder(parent.to_path_buf())?;
        }
        let task = if wanted.only_broken { Task::RepairBroken } else { Task::Repair };
        let settings = coarser(&wanted.settings, row, rung.coarser_levels());
        let as_is = as_is(row, wanted).map(|result| RawPath::new(&self.target.join(result)));
        let beside = earlier.iter().filter(|file| **file != row.output);
        let replaces = beside.map(|file| RawPath::new(&self.target.join(file))).collect();
        let job = self.job(row, &settings, &folder, self.grant(rung));
        Ok(Job { task, as_is, replaces, ..job })
    }
}

/// The folder of the work folders. In one that the user names it has a name of its own: what is not
/// ours is never swept, and two catalogues may share that folder.
fn work_folder(options: &BatchOptions, own: &Path) -> Result<PathBuf, CatalogueError> {
    let Some(named) = &options.work_dir else { return Ok(own.join(WORK)) };
    let target = &options.target;
    let real = target.canonicalize().map_err(|e| StoreError::io("find the folder", target, e))?;
    let mut digester = Digester::default();
    digester.update(real.as_os_str().as_bytes());
    let name: String = digester.digest().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(named.join(format!("brickmend-batch-{name}")))
}

/// Where a copy of the model as it is would be its result, within the folder of the results: JSON is
/// not written, but may be copied.
fn as_is(row: &ModelRow, wanted: &Wanted) -> Option<PathBuf> {
    let extension = row.relative.extension()?;
    if row.output.extension() == Some(extension) {
        return Some(row.output.clone());
    }
    let is_json = wanted.format.is_none() && extension.eq_ignore_ascii_case("gltf");
    is_json.then(|| row.relative.clone())
}

fn make_folder(folder: PathBuf) -> Result<PathBuf, CatalogueError> {
    std::fs::create_dir_all(&folder).map_err(|e| StoreError::io("create", &folder, e))?;
    Ok(folder)
}

/// The settings for a grid so many levels coarser than predicted.
fn coarser(settings: &Settings, row: &ModelRow, levels: u32) -> Settings {
    if levels == 0 {
        return *settings;
    }
    let asked = match settings.depth {
        Depth::Levels(depth) => depth,
        Depth::Auto { max_depth } | Depth::Tolerance { max_depth, .. } => max_depth,
    };
    let depth = row.predicted.map_or(asked, |predicted| predicted.depth.min(asked));
    let depth = depth.saturating_sub(levels).max(*Depth::RANGE.start());
    Settings { depth: Depth::Levels(depth), ..*settings }
}

/// What the end of a worker means.
#[derive(Debug)]
pub enum Meaning {
    /// There is a result.
    Made(Made),
    /// There is none, because of this; in one line.
    Failed(Cause, String),
    /// The batch stopped it.
    Stopped,
    /// A disk is full.
    DiskFull(String),
}

/// Reads the end of a worker.
#[must_use]
pub fn meaning(exited: &mut Exited) -> Meaning {
    let asked = exited.asked;
    match exited.ending.as_mut().map(|ending| &mut ending.made) {
        Some(Made::Nothing { is_disk_full: true, message, .. }) => {
            Meaning::DiskFull(std::mem::take(message))
        }
        Some(Made::Nothing { blame, message, .. }) => match (Cause::from(*blame), asked) {
            (Cause::Stopped, Some(Asked::TimeUp)) => time_up(),
            (Cause::Stopped, Some(Asked::BatchStops)) => Meaning::Stopped,
            (cause, _) => Meaning::Failed(cause, std::mem::take(message)),
        },
        Some(made) => Meaning::Made(std::mem::replace(made, Made::Copied { files: Vec::new() })),
        None => without_ending(exited),
    }
}

fn time_up() -> Meaning {
    Meaning::Failed(Cause::Timeout, "the time for one model was up".to_owned())
}

/// A worker that came to say nothing.
fn without_ending(exited: &Exited) -> Meaning {
    let said = |what: String| {
        let words = &exited.last_words;
        if words.is_empty() { what } else { format!("{what}: {words}") }
    };
    match (exited.asked, exited.signal, exited.code) {
        (Some(Asked::TimeUp), ..) => time_up(),
        (Some(Asked::BatchStops), ..) => Meaning::Stopped,
        (_, Some(KILLED), _) => {
            let text = "the worker was killed, most likely because memory was short";
            Meaning::Failed(Cause::Memory, said(text.to_owned()))
        }
        (_, Some(signal), _) => {
            Meaning::Failed(Cause::Crash, said(format!("the worker died of signal {signal}")))
        }
        (_, _, Some(NO_MEMORY)) => {
            Meaning::Failed(Cause::Memory, said("the worker got no memory".to_owned()))
        }
        (_, _, Some(UNUSABLE)) => {
            Meaning::Failed(Cause::Disk, said("the worker lost a file".to_owned()))
        }
        (_, _, code) => {
            let code = code.map_or_else(String::new, |code| format!(" with code {code}"));
            Meaning::Failed(Cause::Crash, said(format!("the worker ended{code} without a word")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(signal: Option<i32>, code: Option<i32>, asked: Option<Asked>) -> Meaning {
        let last_words = "a b".to_owned();
        meaning(&mut Exited { ending: None, code, signal, asked, last_words })
    }

    #[test]
    fn the_end_of_a_worker_without_a_word_is_told_apart() {
        let cause = |meaning| match meaning {
            Meaning::Failed(cause, _) => Some(cause),
            _ => None,
        };
        assert_eq!(cause(ended(Some(9), None, None)), Some(Cause::Memory));
        assert_eq!(cause(ended(Some(11), None, None)), Some(Cause::Crash));
        assert_eq!(cause(ended(None, Some(101), None)), Some(Cause::Crash));
        assert_eq!(cause(ended(None, Some(75), None)), Some(Cause::Memory));
        assert_eq!(cause(ended(Some(9), None, Some(Asked::TimeUp))), Some(Cause::Timeout));
        assert!(matches!(ended(Some(9), None, Some(Asked::BatchStops)), Meaning::Stopped));
        let Meaning::Failed(_, reason) = ended(Some(6), None, None) else { panic!("it failed") };
        assert_eq!(reason, "the worker died of signal 6: a b");
    }
}
