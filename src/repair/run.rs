//! A run from start to end: the lock, the key, the steps, the ways back, and the output in place.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rayon::ThreadPool;

use crate::io::{Format, IoError, check_output};
use crate::monitor::{Counter, Monitor, Recording};
use crate::repair::RepairError;
use crate::repair::estimate::estimate;
use crate::repair::finish::conclude;
use crate::repair::outcome::Outcome;
use crate::repair::plan::MemoryPlan;
use crate::repair::settings::{Limits, Settings};
use crate::repair::stages::{Findings, Handles};
use crate::repair::step::Step;
use crate::repair::workspace::Workspace;
use crate::store::{Accountant, Resources, StoreError};

/// Files of the work folder that are made again in one run; beyond that the disk is not to be
/// trusted.
const MOST_WAYS_BACK: usize = 3;

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
    let plan = MemoryPlan::within(limits)?;
    crate::io::detect(input).map_err(RepairError::Input)?;
    keep_input(input, output)?;
    let pool = start_threads(plan.threads)?;
    let recording = Recording::new(monitor);
    let seen = InputIdentity::of(input)?;
    let key = run_key(input, format, settings, &recording)?;
    let workspace = Workspace::open(input, output, limits, key)?;
    let accountant = Accountant::new(limits.max_memory_bytes);
    let run = Run { input, output, format, settings, limits, plan, recording, accountant, seen };
    match run.to_the_end(&workspace, &pool) {
        Ok(outcome) => {
            workspace.remove();
            Ok(outcome)
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
fn keep_input(input: &Path, output: &Path) -> Result<(), RepairError> {
    let identity = |path| std::fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    match (identity(input), identity(output)) {
        (Some(a), Some(b)) if a == b => {
            Err(RepairError::OutputIsInput { path: output.to_path_buf() })
        }
        _ => Ok(()),
    }
}

fn start_threads(threads: usize) -> Result<ThreadPool, RepairError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|number| format!("brick-{number}"))
        .build()
        .map_err(|source| RepairError::Threads { threads, source })
}

/// blake3 of input bytes, settings, format and version: another key is another run.
fn run_key(
    input: &Path,
    format: Format,
    settings: &Settings,
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
    hasher.update(format!("{format:?}").as_bytes());
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&crate::store::FORMAT_VERSION.to_le_bytes());
    Ok(*hasher.finalize().as_bytes())
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
    fn of(path: &Path) -> Result<Self, RepairError> {
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

/// A run under way.
pub struct Run<'r> {
    pub input: &'r Path,
    pub output: &'r Path,
    pub format: Format,
    pub settings: &'r Settings,
    pub limits: &'r Limits,
    pub plan: MemoryPlan,
    pub recording: Recording<'r>,
    pub accountant: Accountant,
    seen: InputIdentity,
}

impl Run<'_> {
    /// Does all steps that are left and puts the output in its place. A file of the work folder
    /// that turns out damaged is made again from the step before.
    fn to_the_end(&self, workspace: &Workspace, pool: &ThreadPool) -> Result<Outcome, RepairError> {
        self.check_disk_limit(workspace)?;
        let _leases = self.plan.lease(&self.accountant)?;
        let mut rebuilt = Vec::new();
        loop {
            let error = match self.steps(workspace, pool) {
                Ok(findings) => {
                    let scratch = workspace.scratch();
                    self.recording.count(Counter::ScratchBytesRead, scratch.read_bytes());
                    self.recording.count(Counter::ScratchBytesWritten, scratch.written_bytes());
                    self.recording.count(Counter::SpilledRuns, scratch.spilled_runs());
                    return Ok(conclude(self, workspace, findings, rebuilt));
                }
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
        let quiet = OnlyCancel { monitor: &self.recording };
        let needed_bytes =
            estimate(self.input, self.format, self.settings, &limits, &quiet)?.disk_bytes;
        if needed_bytes > limit_bytes {
            return Err(RepairError::DiskBelowEstimate { limit_bytes, needed_bytes });
        }
        Ok(())
    }

    /// Does the steps that are left; what all of them found out.
    fn steps(&self, workspace: &Workspace, pool: &ThreadPool) -> Result<Findings, RepairError> {
        let mut findings = self.earlier_findings(workspace)?;
        if workspace.is_in_place() {
            return Ok(findings);
        }
        if let (None, Some(written)) = (workspace.next_step(), workspace.written()) {
            check_output(workspace.part(), &written, workspace.scratch())?;
        }
        let mut handles = Handles::default();
        while let Some(step) = workspace.next_step() {
            if self.recording.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            let checkpoints = workspace.checkpoints(step, &self.recording);
            let resources = Resources {
                scratch: workspace.scratch(),
                pool,
                share_bytes: self.plan.share_bytes,
                cached_windows: self.plan.cached_windows,
                backing: self.limits.backing,
                checkpoints: &checkpoints,
                monitor: &self.recording,
            };
            let files = self.step(step, workspace, &mut findings, &mut handles, &resources)?;
            let text = serde_json::to_string(&findings).expect("plain records serialise");
            workspace.finish_step(step, files, text)?;
            self.recording.checkpoint(step.name(), 0);
        }
        workspace.put_in_place()?;
        Ok(findings)
    }

    /// What the steps of an earlier run found out.
    fn earlier_findings(&self, workspace: &Workspace) -> Result<Findings, RepairError> {
        if workspace.next_step() == Some(Step::Read) {
            return Ok(Findings::default());
        }
        // Numbers that JSON cannot hold (infinite areas) are not worth a special case.
        match serde_json::from_str(&workspace.findings()) {
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
