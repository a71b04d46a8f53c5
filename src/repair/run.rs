//! A run from start to end: the lock, the key, the steps, the ways back, and the outputs in place.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rayon::ThreadPool;

use crate::contour::Method;
use crate::ingest::Scattered;
use crate::io::{Format, IoError, check_output};
use crate::monitor::{Counter, Monitor, Recording};
use crate::repair::RepairError;
use crate::repair::estimate::estimate;
use crate::repair::finish::conclude;
use crate::repair::length::Reach;
use crate::repair::levels::Level;
use crate::repair::outcome::Outcome;
use crate::repair::plan::MemoryPlan;
use crate::repair::settings::{Limits, Settings};
use crate::repair::stages::{Findings, FinishedLevel, Handles};
use crate::repair::step::Step;
use crate::repair::surfaces::keep_libraries;
use crate::repair::workspace::Workspace;
use crate::store::{Accountant, Resources, StoreError};

/// Files of the work folder that are made again in one run; beyond that the disk is not to be
/// trusted.
pub(crate) const MOST_WAYS_BACK: usize = 3;

/// Repairs `input` into `output`, whose format is told by its extension (PLY when it has none).
///
/// A run that was stopped goes on from its last checkpoint when it is started again with the same
/// input, settings and output.
///
/// # Errors
/// [`RepairError`]; then nothing was put in place.
pub fn repair(
    input: &Path,
    output: &Path,
    format: Format,
    settings: &Settings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Outcome, RepairError> {
    let level = Level { decimate: settings.decimate, output: output.to_path_buf() };
    let work = Work { input, output, format, settings: *settings, levels: vec![level] };
    let outcomes = run(work, "", limits, monitor)?;
    Ok(outcomes.into_iter().next_back().expect("one level has one outcome"))
}

/// Repairs `input` into one file for each of `levels`, which take the place of
/// [`Settings::decimate`]; all else is done once. The names are that of `output` with the level
/// before the extension: `out.0.1cells.ply`. Each file is what [`repair`] makes of that threshold.
///
/// The files come into place one by one; a run that is stopped keeps those that are, and goes on
/// with the next.
///
/// # Errors
/// [`RepairError`].
pub fn repair_levels(
    input: &Path,
    output: &Path,
    format: Format,
    settings: &Settings,
    levels: &[Reach],
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Vec<Outcome>, RepairError> {
    let Some(&decimate) = levels.first() else { return Ok(Vec::new()) };
    if settings.method != Method::Mdc {
        return Err(RepairError::NothingToMerge { option: "--lod" });
    }
    let named = serde_json::to_string(levels).expect("plain records serialise");
    let levels = Level::beside(output, levels)?;
    let settings = Settings { decimate, ..*settings };
    run(Work { input, output, format, settings, levels }, &named, limits, monitor)
}

/// What is to be done.
struct Work<'w> {
    input: &'w Path,
    /// What the work folder is named after.
    output: &'w Path,
    format: Format,
    settings: Settings,
    levels: Vec<Level>,
}

/// Does all of `work`; `named` are the levels as far as the settings do not tell them.
fn run(
    work: Work,
    named: &str,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Vec<Outcome>, RepairError> {
    let Work { input, output, format, settings, levels } = work;
    settings.check()?;
    let plan = MemoryPlan::within(limits)?;
    crate::io::detect(input).map_err(RepairError::Input)?;
    levels.iter().try_for_each(|level| keep_input(input, &level.output))?;
    let pool = start_threads(plan.threads)?;
    let recording = Recording::new(monitor);
    let seen = InputIdentity::of(input)?;
    let key = run_key(input, format, &settings, named, &recording)?;
    let outputs: Vec<PathBuf> = levels.iter().map(|level| level.output.clone()).collect();
    keep_libraries(format, outputs.iter(), limits)?;
    let workspace = Workspace::open(input, output, outputs, limits, key)?;
    let accountant = Accountant::new(limits.max_memory_bytes);
    let run = Run {
        input,
        feed: Feed::File,
        finest: 0.0,
        format,
        settings,
        levels,
        limits,
        plan,
        recording: &recording,
        accountant: &accountant,
        seen,
    };
    match run.to_the_end(&workspace, &pool) {
        Ok(outcomes) => {
            workspace.remove();
            Ok(outcomes)
        }
        Err(error) => {
            if !error.keeps_work() {
                workspace.remove();
            }
            Err(error)
        }
    }
}

/// Refuses an output that is the input under any name: the rename at the end would replace it.
pub(crate) fn keep_input(input: &Path, output: &Path) -> Result<(), RepairError> {
    let identity = |path| std::fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    match (identity(input), identity(output)) {
        (Some(a), Some(b)) if a == b => {
            Err(RepairError::OutputIsInput { path: output.to_path_buf() })
        }
        _ => Ok(()),
    }
}

pub(crate) fn start_threads(threads: usize) -> Result<ThreadPool, RepairError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|number| format!("brick-{number}"))
        .build()
        .map_err(|source| RepairError::Threads { threads, source })
}

/// blake3 of input bytes, settings, levels, format and version: another key is another run.
pub(crate) fn run_key(
    input: &Path,
    format: Format,
    settings: &Settings,
    levels: &str,
    monitor: &dyn Monitor,
) -> Result<[u8; 32], RepairError> {
    let mut hasher = blake3::Hasher::new();
    let failed = |source| {
        RepairError::Input(IoError::Input { doing: "read", path: input.to_path_buf(), source })
    };
    let mut file = std::fs::File::open(input).map_err(failed)?;
    let mut block = vec![0; 128 << 10];
    loop {
        if monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        match std::io::Read::read(&mut file, &mut block) {
            Ok(0) => break,
            Ok(count) => hasher.update(&block[..count]),
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(e) => return Err(failed(e)),
        };
    }
    let settings = serde_json::to_string(settings).expect("plain records serialise");
    hasher.update(settings.as_bytes());
    hasher.update(levels.as_bytes());
    hasher.update(format!("{format:?}").as_bytes());
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&crate::store::FORMAT_VERSION.to_le_bytes());
    Ok(*hasher.finalize().as_bytes())
}

/// The key of a part of a run with this `key`.
pub(crate) fn part_key(key: [u8; 32], number: u32) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new_keyed(&key);
    hasher.update(&number.to_le_bytes());
    *hasher.finalize().as_bytes()
}

/// Passes on nothing but the wish to stop.
struct OnlyCancel<'m> {
    monitor: &'m dyn Monitor,
}

impl Monitor for OnlyCancel<'_> {
    fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }
}

/// What tells that a file was replaced or changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputIdentity {
    device: u64,
    inode: u64,
    len_bytes: u64,
    changed: (i64, i64),
}

impl InputIdentity {
    pub(crate) fn of(path: &Path) -> Result<Self, RepairError> {
        let failed = |source| {
            RepairError::Input(IoError::Input { doing: "open", path: path.to_path_buf(), source })
        };
        let file: Metadata = std::fs::metadata(path).map_err(failed)?;
        Ok(Self {
            device: file.dev(),
            inode: file.ino(),
            len_bytes: file.len(),
            changed: (file.mtime(), file.mtime_nsec()),
        })
    }
}

/// Where the triangles of a run come from.
pub enum Feed<'r> {
    /// The input file.
    File,
    /// A part of it.
    Part {
        /// All of them.
        of: &'r Mutex<Scattered>,
        /// Which.
        number: u32,
        /// Its name.
        name: String,
    },
}

/// A run under way.
pub struct Run<'r> {
    pub input: &'r Path,
    pub feed: Feed<'r>,
    /// No cell is smaller, as far as that can be.
    pub finest: f64,
    pub format: Format,
    pub settings: Settings,
    /// The thresholds, one after the other, and their files.
    pub levels: Vec<Level>,
    pub limits: &'r Limits,
    pub plan: MemoryPlan,
    pub recording: &'r Recording<'r>,
    pub accountant: &'r Accountant,
    pub seen: InputIdentity,
}

impl Run<'_> {
    /// Does all steps that are left and puts the outputs in their places. A file of the work folder
    /// that turns out damaged is made again from the step before.
    fn to_the_end(
        &self,
        workspace: &Workspace,
        pool: &ThreadPool,
    ) -> Result<Vec<Outcome>, RepairError> {
        self.check_disk_limit(workspace)?;
        let _leases = self.plan.lease(self.accountant)?;
        let mut rebuilt = Vec::new();
        loop {
            let error = match self.all_levels(workspace, pool, &rebuilt) {
                Ok(outcomes) => return Ok(outcomes),
                Err(error) => error,
            };
            let Some(path) = error.damaged_file().map(Path::to_path_buf) else { return Err(error) };
            if rebuilt.len() == MOST_WAYS_BACK {
                return Err(error);
            }
            let Some(step) = workspace.go_back_for(&path)? else { return Err(error) };
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            self.recording.note(&format!("{error}; going back to {}", step.name()));
            rebuilt.push(name);
        }
    }

    /// Refuses a disk limit below the estimate, as long as no work would be lost by that.
    fn check_disk_limit(&self, workspace: &Workspace) -> Result<(), RepairError> {
        let Some(limit_bytes) = self.limits.max_disk_bytes else { return Ok(()) };
        if workspace.next_step() != Some(Step::Read) {
            return Ok(());
        }
        let limits =
            Limits { work_dir: Some(workspace.folder().to_path_buf()), ..self.limits.clone() };
        // The estimate reads the input as well; what it reads is not what the run reads.
        let quiet = OnlyCancel { monitor: self.recording };
        let needed_bytes = estimate(self.input, self.format, &self.settings, &limits, &quiet)?
            .disk_bytes_with_levels(self.levels.len() as u64);
        if needed_bytes > limit_bytes {
            return Err(RepairError::DiskBelowEstimate { limit_bytes, needed_bytes });
        }
        Ok(())
    }

    /// Does the levels that are left; what came of all of them.
    fn all_levels(
        &self,
        workspace: &Workspace,
        pool: &ThreadPool,
        rebuilt: &[String],
    ) -> Result<Vec<Outcome>, RepairError> {
        let mut findings = self.earlier_findings(workspace)?;
        self.forget_lost_levels(workspace, &mut findings)?;
        let mut handles = Handles::default();
        loop {
            if !workspace.is_in_place() {
                let last = Step::Measure;
                self.steps(workspace, pool, &mut findings, &mut handles, last)?;
                self.put_beside(workspace, &findings)?;
                workspace.put_in_place()?;
                let output = self.level(&findings).output.display();
                self.recording.note(&format!("{output} is in place"));
            }
            self.count_scratch(workspace);
            let outcome = conclude(self, workspace, &findings, rebuilt);
            if !self.has_more_levels(&findings) {
                return Ok(self.outcomes(findings, outcome));
            }
            findings.finished.push(FinishedLevel { outcome, file: findings.written.file });
            workspace.go_back_to(Step::Choose, to_text(&findings))?;
        }
    }

    /// The outcomes of the levels before, and of the last one.
    fn outcomes(&self, findings: Findings, last: Outcome) -> Vec<Outcome> {
        let finished = findings.finished.into_iter().zip(&self.levels).map(|(done, level)| {
            let mut outcome = done.outcome;
            // Text cannot hold every path.
            outcome.input.path = self.input.to_path_buf();
            outcome.output.path = level.output.clone();
            outcome
        });
        finished.chain([last]).collect()
    }

    /// All levels.
    pub(crate) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The level under way.
    pub(crate) fn level(&self, findings: &Findings) -> &Level {
        &self.levels[findings.finished.len()]
    }

    /// Whether others follow the level under way.
    pub(crate) fn has_more_levels(&self, findings: &Findings) -> bool {
        findings.finished.len() + 1 < self.levels.len()
    }

    /// Goes back to the first level of an earlier run whose file is not what it wrote.
    fn forget_lost_levels(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
    ) -> Result<(), RepairError> {
        let is_lost = |(done, level): (&FinishedLevel, &Level)| {
            check_output(&level.output, &done.file, workspace.scratch()).is_err()
        };
        let Some(lost) = findings.finished.iter().zip(&self.levels).position(is_lost) else {
            return Ok(());
        };
        findings.finished.truncate(lost);
        Ok(workspace.go_back_to(Step::Choose, to_text(findings))?)
    }

    /// Brings the counters up to what moved so far.
    pub(crate) fn count_scratch(&self, workspace: &Workspace) {
        let scratch = workspace.scratch();
        for (counter, total) in [
            (Counter::ScratchBytesRead, scratch.read_bytes()),
            (Counter::ScratchBytesWritten, scratch.written_bytes()),
            (Counter::SpilledRuns, scratch.spilled_runs()),
        ] {
            self.recording.count(counter, total - self.recording.total(counter));
        }
    }

    /// Does the steps that are left of the level under way, up to the `last`.
    pub(crate) fn steps(
        &self,
        workspace: &Workspace,
        pool: &ThreadPool,
        findings: &mut Findings,
        handles: &mut Handles,
        last: Step,
    ) -> Result<(), RepairError> {
        // What was proved before this run may have been changed since.
        let is_proved = workspace.next_step().is_none_or(|step| step > Step::Prove);
        if let Some(written) = workspace.written().filter(|_| is_proved) {
            check_output(workspace.part(), &written, workspace.scratch())?;
        }
        loop {
            if let Some(domain) = findings.deeper.take() {
                self.recording.note(&format!("beginning anew at depth {}", domain.depth));
                findings.domain = Some(domain);
                *handles = Handles::default();
                workspace.go_back_to(Step::Bin, to_text(findings))?;
            }
            let Some(step) = workspace.next_step().filter(|step| *step <= last) else { break };
            if self.recording.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            let checkpoints = workspace.checkpoints(step, self.recording);
            let resources = Resources {
                scratch: workspace.scratch(),
                pool,
                share_bytes: self.plan.share_bytes,
                cached_windows: self.plan.cached_windows,
                backing: self.limits.backing,
                checkpoints: &checkpoints,
                monitor: self.recording,
            };
            let files = self.step(step, workspace, findings, handles, &resources)?;
            // What the next level starts from outlives this one.
            let next = self.has_more_levels(findings).then_some(Step::Choose);
            workspace.finish_step(step, next, files, to_text(findings))?;
            self.recording.checkpoint(step.name(), 0);
        }
        Ok(())
    }

    /// What the steps of an earlier run found out.
    pub(crate) fn earlier_findings(&self, workspace: &Workspace) -> Result<Findings, RepairError> {
        let found: Result<Findings, _> = serde_json::from_str(&workspace.findings());
        if workspace.next_step() == Some(Step::Read) {
            let finished = found.map(|found| found.finished).unwrap_or_default();
            return Ok(Findings::after(finished));
        }
        // Numbers that JSON cannot hold (infinite areas) are not worth a special case.
        match found {
            Ok(findings) => Ok(findings),
            Err(_) => {
                workspace.start_again()?;
                Ok(Findings::default())
            }
        }
    }

    /// The key belongs to the input as it was; the triangles should too.
    pub(crate) fn check_unchanged(&self) -> Result<(), RepairError> {
        if InputIdentity::of(self.input)? == self.seen {
            return Ok(());
        }
        Err(RepairError::InputChanged { path: self.input.to_path_buf() })
    }
}

/// Findings as the manifest holds them.
fn to_text(findings: &Findings) -> String {
    serde_json::to_string(findings).expect("plain records serialise")
}
