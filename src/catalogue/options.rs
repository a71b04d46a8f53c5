//! What a batch is asked to do.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::catalogue::state::{Cause, State};
use crate::catalogue::walk::Selection;
use crate::io::Format;
use crate::repair::Settings;

/// What is wanted of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Everything that changes the result.
    pub settings: Settings,
    /// Format of the result; the model's own when `None`.
    pub format: Option<Format>,
    /// Copy models with which nothing is wrong.
    pub only_broken: bool,
}

/// What is drawn of each model, for people.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pages {
    /// Nothing.
    None,
    /// Small pictures, before and after.
    Thumbnails,
    /// These, and a page.
    #[default]
    All,
}

/// Which settled models are done again though nothing has changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Retry {
    /// All.
    pub all: bool,
    /// Those that a person should look at.
    pub review: bool,
    /// Those that were done on a coarser grid.
    pub degraded: bool,
    /// Those that failed.
    pub failed: bool,
    /// Those that failed for one of these.
    pub causes: Vec<Cause>,
}

impl Retry {
    /// What they have in common, in SQL; `None` where none are meant.
    pub(super) fn condition(&self) -> Option<String> {
        let state = |state: State| format!("state = '{}'", state.name());
        let mut conditions = Vec::new();
        conditions.extend(self.all.then(|| "true".to_owned()));
        conditions.extend(self.review.then(|| "verdict = 'review'".to_owned()));
        conditions.extend(self.degraded.then(|| state(State::Degraded)));
        conditions.extend(self.failed.then(|| state(State::Failed)));
        conditions.extend(self.causes.iter().map(|cause| format!("cause = '{}'", cause.name())));
        (!conditions.is_empty()).then(|| conditions.join(" OR "))
    }
}

/// A batch.
pub struct BatchOptions<'o> {
    /// Folder of the models; never written to.
    pub source: PathBuf,
    /// Folder of the results.
    pub target: PathBuf,
    /// What is wanted of the model at a path within the folder.
    pub wanted: &'o (dyn Fn(&std::path::Path) -> Wanted + Sync),
    /// Which files are models.
    pub selection: Selection,
    /// These files and no others, if there is a list.
    pub listed: Option<Vec<PathBuf>>,
    /// Peak resident memory of all processes together.
    pub max_memory_bytes: u64,
    /// Most that scratch files and the output of one model may take.
    pub max_disk_bytes: Option<u64>,
    /// Workers at one time.
    pub jobs: usize,
    /// Threads of all workers together.
    pub threads: usize,
    /// Folder of the work folders; within that of the results when `None`.
    pub work_dir: Option<PathBuf>,
    /// Time of one attempt at one model.
    pub model_timeout_ms: Option<u64>,
    /// The batch stops when more models have failed in this run.
    pub max_failures: Option<u64>,
    /// What is drawn of each model that is done.
    pub pages: Pages,
    /// Folder of what is drawn.
    pub report: PathBuf,
    /// When the batch stops, milliseconds since 1970.
    pub stop_at_ms: Option<u64>,
    /// What is done again.
    pub retry: Retry,
    /// Read all files again, however the file system says that they have not changed.
    pub rehash: bool,
    /// Stop when it is known what is to be done.
    pub only_plan: bool,
    /// The program, for its workers.
    pub program: PathBuf,
    /// The command, for the journal.
    pub command: String,
}
