//! What a worker process does with a job.
//!
//! In:         a [`Job`]. Out: an [`Ending`]; the result, if there is one, is in its place.
//! Invariant:  whatever the model is, the answer is an ending; what kills the process is told by
//!             the system to the batch.
//! Memory:     that of the job, held by the repair.

use std::path::{Path, PathBuf};

use crate::catalogue::copy::copy_if_sound;
use crate::catalogue::job::{Ending, Figures, Job, Made, OutputFile, Predicted, RawPath, Task};
use crate::catalogue::stamp::Stamped;
use crate::contour::SurfaceDetail;
use crate::io::{Format, library_name};
use crate::monitor::Monitor;
use crate::repair::{Limits, Outcome, PartsRule, RepairError, estimate, repair, repair_parts};

/// Does what `job` asks for. The caller fills in what the kernel knows of the process, `stamp` what
/// the caller's monitor knows of a repair.
#[must_use]
pub fn do_job(job: &Job, monitor: &dyn Monitor, stamp: &dyn Fn(&mut Outcome)) -> Ending {
    let input_path = job.input.to_path();
    let mut input = None;
    let made = match job.task {
        Task::Estimate => predict(job, &input_path, monitor),
        Task::Repair | Task::RepairBroken => {
            // Before it is read for the repair: a later change makes the stamp fit no longer.
            input = Stamped::read(&input_path, &|| monitor.cancelled()).ok();
            make(job, &input_path, monitor, stamp)
        }
    };
    let made = made.unwrap_or_else(|error| nothing(&error));
    Ending { made, input, peak_bytes: None, cpu_seconds: 0.0 }
}

fn limits_of(job: &Job) -> Limits {
    Limits {
        max_memory_bytes: job.max_memory_bytes,
        threads: job.threads,
        max_disk_bytes: job.max_disk_bytes,
        work_dir: Some(job.work_dir.to_path()),
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
    if job.task == Task::RepairBroken
        && copy_if_sound(input, &output, job.format, &limits, monitor)?
    {
        return Ok(Made::Copied { files: known_again(&[output])? });
    }
    if job.settings.parts == PartsRule::Separate {
        return make_parts(job, input, (&output, &limits), monitor);
    }
    let mut outcome = repair(input, &output, job.format, &job.settings, &limits, monitor)?;
    stamp(&mut outcome);
    let files = known_again(&files_of(&output, job.format, has_surfaces(&outcome)))?;
    Ok(Made::Repaired { figures: Box::new(Figures::of(&outcome)), files })
}

/// Repairs the parts of a model, each for itself.
fn make_parts(
    job: &Job,
    input: &Path,
    (output, limits): (&Path, &Limits),
    monitor: &dyn Monitor,
) -> Result<Made, RepairError> {
    let (mut sum, mut has_library) = (None, false);
    let mut deliver = |outcome: Outcome| {
        has_library |= has_surfaces(&outcome);
        sum = Some(Figures::add_part(sum.take(), &outcome));
    };
    let (format, settings) = (job.format, &job.settings);
    let whole = repair_parts(input, output, format, settings, limits, monitor, &mut deliver)?;
    let sum = sum.expect("a file has a part at least");
    let files = known_again(&files_of(output, job.format, has_library))?;
    Ok(Made::Repaired { figures: Box::new(Figures::close_parts(sum, &whole)), files })
}

fn has_surfaces(outcome: &Outcome) -> bool {
    outcome.transfer.surfaces != SurfaceDetail::None
}

/// The files of a result: beside an OBJ file lies its library.
fn files_of(output: &Path, format: Format, has_library: bool) -> Vec<PathBuf> {
    let mut files = vec![output.to_path_buf()];
    let library = output.with_file_name(library_name(output));
    if format == Format::Obj && has_library {
        files.push(library);
    }
    files
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
