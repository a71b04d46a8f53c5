//! What the batch asks of a worker process, and what that answers: lines of JSON.
//!
//! The worker reads jobs from its input, one a line, and answers each with reports, one a line, of
//! which the last is [`Report::Ended`]. Both ends are the same binary, so there is no version.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::catalogue::beside::SideFile;
use crate::catalogue::options::Pages;
use crate::catalogue::stamp::Stamped;
use crate::io::Format;
use crate::monitor::Stage;
use crate::repair::{Blame, Estimate, LeftOut, Outcome, PartsOutcome, Settings, Verdict};

/// A path with any bytes; JSON alone would lose those that are no text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct RawPath(Vec<u8>);

impl RawPath {
    /// The bytes of a path.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self(path.as_os_str().as_bytes().to_vec())
    }

    /// The path.
    #[must_use]
    pub fn to_path(&self) -> PathBuf {
        OsString::from_vec(self.0.clone()).into()
    }
}

/// What is to be done with a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Tell what a repair would take.
    Estimate,
    /// Repair it.
    Repair,
    /// Copy it if nothing is wrong with it, else repair it.
    RepairBroken,
}

/// A model for a worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// What to do.
    pub task: Task,
    /// The model.
    pub input: RawPath,
    /// Where the result goes.
    pub output: RawPath,
    /// Its format.
    pub format: Format,
    /// Everything that changes the result.
    pub settings: Settings,
    /// Peak resident memory of the worker.
    pub max_memory_bytes: u64,
    /// Threads of the worker.
    pub threads: usize,
    /// Most that scratch files and the output may take.
    pub max_disk_bytes: Option<u64>,
    /// Folder for the work folder of the model.
    pub work_dir: RawPath,
    /// Where the model goes if it is copied; nowhere where a copy would be no result.
    pub as_is: Option<RawPath>,
    /// Files of an earlier result beside the output, which may be replaced.
    pub replaces: Vec<RawPath>,
    /// What of it is drawn.
    pub drawing: Drawing,
}

/// What of a model is drawn, once its result is in place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawing {
    /// How much.
    pub wanted: Pages,
    /// Folder of all that is drawn.
    pub report: RawPath,
    /// Number of the model in the journal.
    pub number: i64,
    /// Its path within the folder of the models, as text.
    pub name: String,
}

/// A line of a worker.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Report {
    /// A stage is under way.
    Working {
        /// Which.
        stage: Stage,
        /// How much of it is done, 0..1.
        share: f64,
        /// Resident memory of the worker, where the kernel tells it.
        resident_bytes: Option<u64>,
    },
    /// A remark for the log.
    Note {
        /// In one line.
        text: String,
    },
    /// The job is done, well or not; nothing follows.
    Ended(Box<Ending>),
}

/// What came of a job.
#[derive(Debug, Serialize, Deserialize)]
pub struct Ending {
    /// The result.
    pub made: Made,
    /// The input as it was read, if it could be.
    pub input: Option<Stamped>,
    /// The files that it names, if they could be found.
    pub beside: Option<Vec<SideFile>>,
    /// Peak resident memory of the worker, where the kernel tells it.
    pub peak_bytes: Option<u64>,
    /// Processor time of the worker, seconds.
    pub cpu_seconds: f64,
}

/// The result of a job.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "made", rename_all = "snake_case")]
pub enum Made {
    /// What a repair would take.
    Estimate(Predicted),
    /// The model was repaired.
    Repaired {
        /// What came of it.
        figures: Box<Figures>,
        /// The files that were put in place, the model first.
        files: Vec<OutputFile>,
        /// Why it was not copied although nothing is wrong with it, or that was not looked at.
        not_copied: Option<String>,
    },
    /// Nothing is wrong with the model, so it was copied.
    Copied {
        /// The files that were put in place, the model first.
        files: Vec<OutputFile>,
    },
    /// There is no result.
    Nothing {
        /// Whose fault it is.
        blame: Blame,
        /// What went wrong, in one line.
        message: String,
        /// Whether a disk is full: other models will meet the same.
        is_disk_full: bool,
    },
}

impl Made {
    /// Whether the worker was asked to stop.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        matches!(self, Self::Nothing { blame: Blame::Interrupted, .. })
    }
}

/// What a model will take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
            // JSON has no infinity.
            seconds: estimate.seconds.min(f64::MAX),
            memory_bytes: estimate.memory_bytes,
            disk_bytes: estimate.disk_bytes,
            leaf_cells: estimate.leaf_cells,
            depth: estimate.grid.depth,
        }
    }
}

/// What of an outcome has columns in the journal, and the whole of it as text. Numbers that JSON
/// cannot hold are not there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// How good the result is.
    pub verdict: Verdict,
    /// What a person should look at.
    pub reasons: Vec<String>,
    /// Of the grid.
    pub depth: u32,
    /// Triangles of the input.
    pub triangles_before: u64,
    /// Triangles of the result.
    pub triangles_after: u64,
    /// Edges of an odd number of triangles in the input.
    pub open_edges_before: u64,
    /// Triangles of the input that are copies of others.
    pub duplicates_before: u64,
    /// Openings of the input.
    pub openings_before: u64,
    /// Area of the result over that of the input.
    pub area_ratio: Option<f64>,
    /// Volume of the result, cubic model units.
    pub volume: Option<f64>,
    /// The outcome, as JSON; that of the whole where parts were kept apart.
    pub outcome: String,
    /// Where parts were kept apart, [`MOST_PARTS`] of them at most: what is worth a look first, then in
    /// the order of the file.
    pub parts: Vec<PartLine>,
}

/// The most parts that are kept of a model, for its page.
pub const MOST_PARTS: usize = 500;

/// A part that was repaired for itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartLine {
    /// Its name.
    pub name: String,
    /// How good its result is.
    pub verdict: Verdict,
    /// What a person should look at.
    pub reasons: Vec<String>,
    /// How often it stands in the scene.
    pub places: u64,
    /// Triangles of the part.
    pub triangles_before: u64,
    /// Triangles of its result.
    pub triangles_after: u64,
}

impl PartLine {
    fn of(outcome: &Outcome) -> Option<Self> {
        let part = outcome.part.as_ref()?;
        Some(Self {
            name: part.name.clone(),
            verdict: outcome.verdict,
            reasons: outcome.reasons.clone(),
            places: part.places,
            triangles_before: outcome.input.stats.triangles,
            triangles_after: outcome.output.proof.triangles,
        })
    }

    /// Adds a part behind those that are as much worth a look; the last gives way.
    fn enter(self, parts: &mut Vec<Self>) {
        let at = parts.partition_point(|other| other.verdict >= self.verdict);
        parts.insert(at, self);
        parts.truncate(MOST_PARTS);
    }
}

impl Figures {
    /// Of an outcome.
    #[must_use]
    pub fn of(outcome: &Outcome) -> Self {
        Self {
            verdict: outcome.verdict,
            reasons: outcome.reasons.clone(),
            depth: outcome.grid.depth,
            triangles_before: outcome.input.stats.triangles,
            triangles_after: outcome.output.proof.triangles,
            open_edges_before: outcome.found.settle.rim_edges,
            duplicates_before: outcome.found.settle.duplicate_triangles,
            openings_before: outcome.found.openings,
            area_ratio: Some(outcome.output.area_ratio),
            volume: Some(outcome.output.proof.volume),
            outcome: serde_json::to_string(outcome).expect("plain records serialise"),
            parts: PartLine::of(outcome).into_iter().collect(),
        }
    }
}

impl Figures {
    /// Of a model whose parts were kept apart, one outcome after another; [`Figures::close_parts`]
    /// does the rest.
    pub(crate) fn add_part(sum: Option<Self>, outcome: &Outcome) -> Self {
        let part = Self::of(outcome);
        let Some(sum) = sum else { return Self { outcome: String::new(), ..part } };
        let mut parts = sum.parts;
        part.parts.into_iter().for_each(|line| line.enter(&mut parts));
        Self {
            parts,
            verdict: sum.verdict.max(part.verdict),
            reasons: sum.reasons,
            depth: sum.depth.max(part.depth),
            triangles_before: sum.triangles_before + part.triangles_before,
            triangles_after: sum.triangles_after + part.triangles_after,
            open_edges_before: sum.open_edges_before + part.open_edges_before,
            duplicates_before: sum.duplicates_before + part.duplicates_before,
            openings_before: sum.openings_before + part.openings_before,
            // Parts have units of their own.
            area_ratio: None,
            volume: None,
            outcome: sum.outcome,
        }
    }

    /// The figures of a model, given those of its parts.
    pub(crate) fn close_parts(sum: Self, whole: &PartsOutcome) -> Self {
        let mut reasons = Vec::new();
        if whole.to_review > 0 {
            reasons.push(format!("{} of {} parts are worth a look", whole.to_review, whole.parts));
        }
        let of_part = |part: &LeftOut| format!("{} is left out: {}", part.name, part.reason);
        reasons.extend(whole.left_out.iter().map(of_part));
        let outcome = serde_json::to_string(whole).expect("plain records serialise");
        Self { verdict: whole.verdict, reasons, outcome, ..sum }
    }
}

/// A file that was put in place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputFile {
    /// Where.
    pub path: RawPath,
    /// What it was then.
    pub stamped: Stamped,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;

    #[test]
    fn names_that_are_no_text_survive() {
        let path = Path::new(OsStr::from_bytes(b"a/\xff \n\"b"));
        let line = serde_json::to_string(&RawPath::new(path)).expect("plain data");
        assert!(!line.contains('\n'));
        let back: RawPath = serde_json::from_str(&line).expect("what was written");
        assert_eq!(back.to_path(), path);
    }
}
