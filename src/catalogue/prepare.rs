//! Finds out what is to be done: the walk, what changed since the last run, what results are left.
//!
//! In:         the folder of the models, the journal, the results.
//! Out:        the journal: models to be done are pending.
//! Invariant:  a model is settled only if its content and that of the files which it names, its
//!             settings, the version of the program and the files of its result are what they were
//!             when it was done. What the file system
//!             says of a file is believed where it says that nothing changed, and nowhere else.
//! Memory:     numbers of models.
//! Fails:      [`CatalogueError`].

use std::path::{Path, PathBuf};

use crate::catalogue::CatalogueError;
use crate::catalogue::fleet::Fleet;
use crate::catalogue::journal::{Enrolled, Journal, Seen, SideRow};
use crate::catalogue::names::{result_format, wished_name};
use crate::catalogue::options::{BatchOptions, Wanted};
use crate::catalogue::stamp::{Stamp, Stamped};
use crate::catalogue::walk::{Found, PassedBy, walk, walk_listed};
use crate::io::Format;
use crate::store::{Digest, Digester, FORMAT_VERSION, StoreError};

/// Files beside models that are looked at in one go.
const SIDE_FILES_AT_ONCE: u32 = 1024;
/// How often the caller hears of the progress.
const TOLD_EVERY: usize = 256;

/// What a walk came to.
#[derive(Clone, Debug, Default)]
pub struct Prepared {
    /// Models that were found.
    pub found: u64,
    /// Files that are none.
    pub passed: PassedBy,
    /// What the journal says of them.
    pub enrolled: Enrolled,
}

/// Enters all models and marks those that are to be done.
///
/// # Errors
/// [`CatalogueError`].
pub fn prepare(
    journal: &mut Journal,
    run: i64,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<Prepared, CatalogueError> {
    let mut found = 0;
    let (enrolled, passed) = journal.enrol(run, &options.source, |enter| {
        let mut visit = |model: Found| {
            if fleet.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            found += 1;
            enter(see(options, model))
        };
        match &options.listed {
            Some(listed) => walk_listed(&options.source, listed, &options.selection, &mut visit),
            None => {
                let hidden: Vec<PathBuf> = options.target.canonicalize().into_iter().collect();
                walk(&options.source, &hidden, &options.selection, &mut visit)
            }
        }
    })?;
    journal.note_walk(run, found, &passed)?;
    for (file, stamp) in &enrolled.renamed {
        let path = options.target.join(file);
        // Only what is still as we put it there is ours to remove.
        if Stamp::at(&path) == Some(*stamp) {
            std::fs::remove_file(&path).map_err(|e| StoreError::io("remove", &path, e))?;
        }
    }
    if let Some(condition) = options.retry.condition() {
        journal.ask_anew_where(run, &condition)?;
    }
    check_inputs(journal, &enrolled.touched, options, fleet)?;
    check_beside(journal, run, options, fleet)?;
    check_results(journal, run, options, fleet)?;
    Ok(Prepared { found, passed, enrolled })
}

fn see(options: &BatchOptions, model: Found) -> Seen {
    let wanted = (options.wanted)(&model.relative);
    let path = options.source.join(&model.relative);
    // What has no format is told when it is read.
    let format = result_format(&path, wanted.format).unwrap_or(Format::Ply);
    let wish = wished_name(&model.relative, format);
    let settings = settings_digest(&wanted);
    Seen { relative: model.relative, stamp: model.stamp, wish, format, settings }
}

/// Digest of all that changes the result of a model besides the model itself.
fn settings_digest(wanted: &Wanted) -> Digest {
    let mut digester = Digester::default();
    let settings = serde_json::to_string(&wanted.settings).expect("plain records serialise");
    digester.update(settings.as_bytes());
    digester.update(&[u8::from(wanted.only_broken)]);
    digester.update(env!("CARGO_PKG_VERSION").as_bytes());
    digester.update(&FORMAT_VERSION.to_le_bytes());
    digester.digest()
}

/// Asks anew for models whose content changed.
fn check_inputs(
    journal: &mut Journal,
    touched: &[i64],
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    let mut changed = Vec::new();
    for &id in touched {
        let row = journal.model(id)?;
        let path = options.source.join(&row.relative);
        match read_again(&path, fleet)? {
            Some(now) if row.digest == Some(now.digest) => journal.set_stamp(id, &now.stamp)?,
            now => {
                if let Some(now) = now {
                    journal.set_stamp(id, &now.stamp)?;
                }
                changed.push(id);
            }
        }
    }
    journal.ask_anew(&changed, "the model changed")
}

/// Asks anew for models that name a file which is not what it was. The list is that of the journal:
/// no model is read for it.
fn check_beside(
    journal: &mut Journal,
    run: i64,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    let mut last = SideRow::default();
    // Many models may name one file: it is read once.
    let mut read: Option<(PathBuf, Option<Stamped>)> = None;
    loop {
        let rows = journal.side_files_after(run, &last, SIDE_FILES_AT_ONCE)?;
        let Some(end) = rows.last() else { return Ok(()) };
        last = end.clone();
        for SideRow { model, path: relative, then } in rows {
            if fleet.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            let path = options.source.join(&relative);
            let stamp = Stamp::at(&path);
            if stamp == then.map(|then| then.stamp) && !(options.rehash && then.is_some()) {
                continue;
            }
            let now = match &read {
                Some((known, now)) if *known == path => *now,
                _ => stamp.map(|_| read_again(&path, fleet)).transpose()?.flatten(),
            };
            read = Some((path, now));
            let what = match (then, now) {
                (Some(then), Some(now)) if then.digest == now.digest => {
                    journal.set_side_stamp(model, &relative, &now.stamp)?;
                    continue;
                }
                (None, None) => continue,
                (Some(_), Some(_)) => "changed",
                (Some(_), None) => "is gone",
                (None, Some(_)) => "is there now",
            };
            let because = format!("its file {} {what}", relative.to_string_lossy());
            journal.ask_anew(&[model], &because)?;
        }
    }
}

/// Asks anew for models whose result is not what was put in place.
fn check_results(
    journal: &mut Journal,
    run: i64,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<(), CatalogueError> {
    let ids = journal.with_results(run)?;
    let (mut lost, mut changed) = (Vec::new(), Vec::new());
    for (done, &id) in ids.iter().enumerate() {
        if done % TOLD_EVERY == 0 {
            fleet.looking(done as u64, ids.len() as u64);
            if fleet.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
        }
        let files = journal.files(id)?;
        let mut is_there = !files.is_empty();
        for (file, put) in files {
            is_there = is_there && is_still(journal, id, &file, &put, options, fleet)?;
        }
        if !is_there {
            lost.push(id);
        } else if options.rehash && !is_input_still(journal, id, options, fleet)? {
            changed.push(id);
        }
    }
    journal.ask_anew(&lost, "a file of its result is not what was put there")?;
    journal.ask_anew(&changed, "the model changed")
}

fn is_still(
    journal: &mut Journal,
    id: i64,
    file: &Path,
    put: &Stamped,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<bool, CatalogueError> {
    let path = options.target.join(file);
    if !options.rehash && Stamp::at(&path) == Some(put.stamp) {
        return Ok(true);
    }
    match read_again(&path, fleet)? {
        Some(now) if now.digest == put.digest => {
            journal.set_file_stamp(id, file, &now.stamp)?;
            Ok(true)
        }
        _ => Ok(false),
    }
}

fn is_input_still(
    journal: &mut Journal,
    id: i64,
    options: &BatchOptions,
    fleet: &dyn Fleet,
) -> Result<bool, CatalogueError> {
    let row = journal.model(id)?;
    let now = read_again(&options.source.join(&row.relative), fleet)?;
    Ok(now.is_some_and(|now| row.digest == Some(now.digest)))
}

/// The file as it is now; `None` where it cannot be read.
fn read_again(path: &Path, fleet: &dyn Fleet) -> Result<Option<Stamped>, CatalogueError> {
    match Stamped::read(path, &|| fleet.cancelled()) {
        Ok(now) => Ok(Some(now)),
        Err(StoreError::Cancelled) => Err(StoreError::Cancelled.into()),
        Err(_) => Ok(None),
    }
}
