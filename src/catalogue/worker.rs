//! What a worker process does with a job.
//!
//! In:         a [`Job`]. Out: an [`Ending`]; the result, if there is one, is in its place.
//! Invariant:  whatever the model is, the answer is an ending; what kills the process is told by
//!             the system to the batch.
//! Memory:     that of the job, held by the repair.

use std::path::{Path, PathBuf};

use crate::catalogue::beside::{share_bytes, side_files};
use crate::catalogue::copy::{Copied, CopyRequest, copy_if_sound};
use crate::catalogue::job::{Ending, Figures, Job, Made, OutputFile, Predicted, RawPath, Task};
use crate::catalogue::stamp::Stamped;
use crate::contour::SurfaceDetail;
use crate::io::{Format, is_image_of, library_name, named_files};
use crate::monitor::Monitor;
use crate::repair::{Limits, Outcome, PartsRule, RepairError, estimate, repair, repair_parts};
use crate::store::Scratch;

/// Does what `job` asks for. The caller fills in what the kernel knows of the process, `stamp` what
/// the caller's monitor knows of a repair.
#[must_use]
pub fn do_job(job: &Job, monitor: &dyn Monitor, stamp: &dyn Fn(&mut Outcome)) -> Ending {
    let input_path = job.input.to_path();
    let limits = limits_of(job);
    let (mut input, mut beside) = (None, None);
    let made = match job.task {
        Task::Estimate => predict(job, &input_path, monitor),
        Task::Repair | Task::RepairBroken => {
            // Before it is read for the repair: a later change makes the stamp fit no longer.
            input = Stamped::read(&input_path, &|| monitor.cancelled()).ok();
            beside = side_files(&input_path, &limits, monitor);
            make(job, &input_path, monitor, stamp)
        }
    };
    let made = made.unwrap_or_else(|error| {
        // What is missing beside a model may be why it cannot be read.
        beside = beside.take().or_else(|| side_files(&input_path, &limits, monitor));
        nothing(&error)
    });
    Ending { made, input, beside, peak_bytes: None, cpu_seconds: 0.0 }
}

fn limits_of(job: &Job) -> Limits {
    Limits {
        max_memory_bytes: job.max_memory_bytes,
        threads: job.threads,
        max_disk_bytes: job.max_disk_bytes,
        work_dir: Some(job.work_dir.to_path()),
        replaces: job.replaces.iter().map(RawPath::to_path).collect(),
        ..Limits::default()
    }
}

fn predict(job: &Job, input: &Path, monitor: &dyn Monitor) -> Result<Made, RepairError> {
    let limits = limits_of(job);
    let estimate = estimate(input, job.format, &job.settings, &limits, monitor)?;
    Ok(Made::Estimate(Predicted::of(&estimate)))
}

fn make(
    job: &Job,
    input: &Path,
    monitor: &dyn Monitor,
    stamp: &dyn Fn(&mut Outcome),
) -> Result<Made, RepairError> {
    let (output, limits) = (job.output.to_path(), limits_of(job));
    let mut not_copied = None;
    if job.task == Task::RepairBroken {
        let copy = job.as_is.as_ref().map(RawPath::to_path);
        let (output, limits) = (copy.as_deref(), &limits);
        let request = CopyRequest { input, output, limits, is_one_of_many: true };
        match copy_if_sound(&request, monitor)? {
            Copied::Done(files) => return Ok(Made::Copied { files: known_again(&files)? }),
            Copied::NotSound => {}
            Copied::Not(reason) => not_copied = reason,
        }
    }
    if job.settings.parts == PartsRule::Separate {
        return make_parts(job, input, (&output, &limits), not_copied, monitor);
    }
    let mut outcome = repair(input, &output, job.format, &job.settings, &limits, monitor)?;
    stamp(&mut outcome);
    let files = known_again(&files_of(&output, job.format, Beside::of(&outcome), &limits)?)?;
    Ok(Made::Repaired { figures: Box::new(Figures::of(&outcome)), files, not_copied })
}

/// Repairs the parts of a model, each for itself.
fn make_parts(
    job: &Job,
    input: &Path,
    (output, limits): (&Path, &Limits),
    not_copied: Option<String>,
    monitor: &dyn Monitor,
) -> Result<Made, RepairError> {
    let (mut sum, mut beside) = (None, Beside::default());
    let mut deliver = |outcome: Outcome| {
        beside = beside.with(Beside::of(&outcome));
        sum = Some(Figures::add_part(sum.take(), &outcome));
    };
    let (format, settings) = (job.format, &job.settings);
    let whole = repair_parts(input, output, format, settings, limits, monitor, &mut deliver)?;
    let sum = sum.expect("a file has a part at least");
    let files = known_again(&files_of(output, job.format, beside, limits)?)?;
    Ok(Made::Repaired { figures: Box::new(Figures::close_parts(sum, &whole)), files, not_copied })
}

/// What may lie beside a result.
#[derive(Clone, Copy, Default)]
struct Beside {
    has_library: bool,
    has_images: bool,
}

impl Beside {
    fn of(outcome: &Outcome) -> Self {
        let has_library = outcome.transfer.surfaces != SurfaceDetail::None;
        Self { has_library, has_images: has_library && outcome.transfer.attributes.uvs }
    }

    fn with(self, other: Self) -> Self {
        Self {
            has_library: self.has_library || other.has_library,
            has_images: self.has_images || other.has_images,
        }
    }
}

/// The files of a result, the model first: the library of an OBJ file, and the images beside it that
/// are its own.
fn files_of(
    output: &Path,
    format: Format,
    beside: Beside,
    limits: &Limits,
) -> Result<Vec<PathBuf>, RepairError> {
    let mut files = vec![output.to_path_buf()];
    if format == Format::Obj && beside.has_library {
        files.push(output.with_file_name(library_name(output)));
    }
    if matches!(format, Format::Obj | Format::Ply) && beside.has_images {
        let scratch = Scratch::new(limits.work_dir.as_deref().unwrap_or(Path::new(".")));
        let named = named_files(output, &scratch, share_bytes(limits));
        let named = named.map_err(RepairError::ReadBack)?;
        let there = named.files.into_iter().filter(|(_, is_there)| *is_there);
        let there = there.map(|(way, _)| output.with_file_name(way));
        files.extend(there.filter(|path| is_image_of(output, path)));
    }
    Ok(files)
}

/// What was put in place is known again by this; stopping now would lose it.
fn known_again(files: &[PathBuf]) -> Result<Vec<OutputFile>, RepairError> {
    let stamped = files.iter().map(|path| {
        Ok(OutputFile { path: RawPath::new(path), stamped: Stamped::read(path, &|| false)? })
    });
    stamped.collect()
}

/// An error as the batch is told of it: cause after cause in one line.
fn nothing(error: &RepairError) -> Made {
    let mut message = error.to_string();
    let mut is_disk_full = false;
    let mut source: Option<&dyn std::error::Error> = Some(error);
    while let Some(cause) = source {
        is_disk_full |= cause.downcast_ref().is_some_and(is_full);
        source = cause.source();
        if let Some(cause) = source {
            message.push_str(&format!(": {cause}"));
        }
    }
    Made::Nothing { blame: error.blame(), message, is_disk_full }
}

/// The system's word for a full disk, whoever wraps it.
fn is_full(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}
