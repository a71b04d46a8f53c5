//! Models with which nothing is wrong: copied byte for byte with the files that they name, not
//! repaired.

use std::path::{Path, PathBuf};

use crate::catalogue::beside::share_bytes;
use crate::catalogue::copy_files::{Placing, place};
use crate::io::{
    Format, IoError, MOST_NAMED, NamedFiles, ReadOptions, format_of_name, named_files,
};
use crate::mesh::MeshSource;
use crate::monitor::Monitor;
use crate::repair::{Blame, Limits, MemoryPlan, RepairError};
use crate::store::Scratch;
use crate::verify::{Outward, ProofOptions, VerifyError, Vertices, prove};

/// A model that is to be copied if nothing is wrong with it.
#[derive(Clone, Copy, Debug)]
pub struct CopyRequest<'c> {
    /// The model.
    pub input: &'c Path,
    /// Where its copy goes; `None` where only another format would be a result.
    pub output: Option<&'c Path>,
    /// Memory, threads, work folder, and the files of an earlier result that may be replaced.
    pub limits: &'c Limits,
    /// Whether the models beside it have results beside its own, whose files are theirs.
    pub is_one_of_many: bool,
}

/// What came of a [`CopyRequest`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Copied {
    /// These files are in place, the model first.
    Done(Vec<PathBuf>),
    /// Something is wrong with it, or cannot be told.
    NotSound,
    /// It was not copied for another reason, in one line; there may be none that is worth a word.
    Not(Option<String>),
}

/// Copies a model with the files that it names, all or nothing, if it is sound.
///
/// Sound is what every output of a repair is: closed, 2-manifold, consistently oriented outward,
/// without degenerate or intersecting triangles. The files that it names are put where their names
/// lead from the output, within its folder, and never over what has other bytes and is none of
/// [`Limits::replaces`].
///
/// # Errors
/// The disk fails, the input changes meanwhile, or the monitor asks to stop. What is wrong with the
/// input is none: the repair tells it.
pub fn copy_if_sound(request: &CopyRequest, monitor: &dyn Monitor) -> Result<Copied, RepairError> {
    let input = request.input;
    let folder =
        request.limits.work_dir.as_deref().or_else(|| request.output.and_then(Path::parent));
    let scratch = Scratch::new(folder.unwrap_or(Path::new("")));
    let named = match named_files(input, &scratch, share_bytes(request.limits)) {
        Ok(named) => named,
        Err(error) => return told_by_the_repair(error),
    };
    let Some(output) = request.output.filter(|output| is_copy_a_result(input, output)) else {
        let has_others = !named.files.is_empty() || named.outside.is_some();
        let reason = "not looked whether it could be copied with the files that it names: the \
                      result has another format or is not packed";
        return Ok(Copied::Not(has_others.then(|| reason.to_owned())));
    };
    let before = Placing::stamps(input, &named);
    if !is_sound(input, &scratch, request.limits, monitor)? {
        return Ok(Copied::NotSound);
    }
    if let Some(reason) = reason_against(&named) {
        return Ok(Copied::Not(Some(not_copied(&reason))));
    }
    match Placing::plan(request, output, &named)? {
        Ok(placing) => Ok(Copied::Done(place(&placing, &before, request.limits)?)),
        Err(reason) => Ok(Copied::Not(Some(not_copied(&reason)))),
    }
}

/// Whether the very bytes of a model are a result under this name.
fn is_copy_a_result(input: &Path, output: &Path) -> bool {
    let is_packed = crate::io::unpacked_name(input) != input;
    let format: Option<Format> = format_of_name(output);
    !is_packed
        && input.extension() == output.extension()
        && format.is_some()
        && format_of_name(input) == format
}

fn not_copied(reason: &str) -> String {
    format!("nothing is wrong with it, but it was not copied: {reason}")
}

fn reason_against(named: &NamedFiles) -> Option<String> {
    if let Some(name) = &named.outside {
        return Some(format!("it names {name}, outside of its folder"));
    }
    named.has_more.then(|| format!("it names more than {MOST_NAMED} files"))
}

/// What cannot be read is told by the repair, which has more to say of it.
fn told_by_the_repair(error: IoError) -> Result<Copied, RepairError> {
    let error = RepairError::Input(error);
    if error.blame() == Blame::Input { Ok(Copied::NotSound) } else { Err(error) }
}

fn is_sound(
    input: &Path,
    scratch: &Scratch,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<bool, RepairError> {
    let plan = MemoryPlan::within(limits)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build();
    let threads = plan.threads;
    let pool = pool.map_err(|source| RepairError::Threads { threads, source })?;
    let share_bytes = plan.share_bytes;
    let options = ProofOptions {
        share_bytes,
        outward: Outward::AlternatesWithNesting,
        vertices: Vertices::Positions,
        intersections: true,
    };
    let mut open = || {
        let source = crate::io::open(input, scratch, &ReadOptions::in_scene(share_bytes))?;
        Ok(source as Box<dyn MeshSource<Error = _> + Send>)
    };
    match prove(&mut open, scratch, &options, &pool, monitor) {
        Ok(proof) => Ok(proof.holds()),
        Err(VerifyError::Store(error)) => Err(error.into()),
        Err(VerifyError::Source { source }) => {
            Ok(!matches!(told_by_the_repair(source)?, Copied::NotSound))
        }
    }
}
