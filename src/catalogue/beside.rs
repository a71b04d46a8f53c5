//! The files that a model names, as they were when it was worked on: when one of them changes, the
//! model is done again.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::catalogue::job::RawPath;
use crate::catalogue::stamp::Stamped;
use crate::io::{MOST_NAMED, named_files};
use crate::monitor::Monitor;
use crate::repair::Limits;
use crate::store::Scratch;

/// Memory of a reader that looks for names, for each byte of the budget.
const SHARE: u64 = 16;
/// The least that readers ask for.
const LEAST_SHARE_BYTES: u64 = 512 << 10;

/// A file that a model names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SideFile {
    /// Its path: as a worker tells it from the model's folder, in the journal from the folder of all
    /// models.
    pub path: RawPath,
    /// What it was before the model was read; `None` where it was not there.
    pub stamped: Option<Stamped>,
}

impl SideFile {
    /// The files as the journal has them: by their paths from the folder in which the model lies at
    /// `relative`.
    pub(crate) fn within(files: Vec<Self>, relative: &Path) -> Vec<Self> {
        let folder = relative.parent().unwrap_or(Path::new(""));
        let within =
            |file: Self| Self { path: RawPath::new(&folder.join(file.path.to_path())), ..file };
        files.into_iter().map(within).collect()
    }
}

/// Memory for a reader that looks for names.
pub(crate) fn share_bytes(limits: &Limits) -> u64 {
    (limits.max_memory_bytes / SHARE).max(LEAST_SHARE_BYTES)
}

/// The files that the model at `input` names, as they are now; `None` where the model cannot be read.
pub(crate) fn side_files(
    input: &Path,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Option<Vec<SideFile>> {
    let folder = input.parent().unwrap_or(Path::new(""));
    let scratch = Scratch::new(limits.work_dir.as_deref().unwrap_or(folder));
    let named = named_files(input, &scratch, share_bytes(limits)).ok()?;
    if named.has_more {
        let input = input.display();
        monitor
            .note(&format!("{input} names more than {MOST_NAMED} files: the rest is not watched"));
    }
    let read = |path: &Path| Stamped::read(path, &|| monitor.cancelled()).ok();
    let files = named.files.into_iter().map(|(way, is_there)| SideFile {
        stamped: if is_there { read(&folder.join(&way)) } else { None },
        path: RawPath::new(&way),
    });
    Some(files.collect())
}
