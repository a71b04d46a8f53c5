//! Puts copies of a model and of the files that it names in their places.
//!
//! In:         what a model names, and where its copy goes. Out: the files in place.
//! Invariant:  nothing is replaced that has other bytes, but for the files of an earlier result.
//!             What is named is in place before what names it. No name leads out of the folder of
//!             the copy, also not by links.
//! Memory:     the names.

use std::ffi::OsString;
use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::catalogue::copy::CopyRequest;
use crate::catalogue::stamp::{Stamp, Stamped};
use crate::io::{NamedFiles, format_of_name, unpacked_name};
use crate::repair::{Limits, RepairError};
use crate::store::{StoreError, sync_folder};

/// A file on its way.
struct Move {
    from: PathBuf,
    to: PathBuf,
    /// Whether the very bytes are there already.
    is_there: bool,
}

/// All files of a copy, the model last.
pub(crate) struct Placing {
    moves: Vec<Move>,
    output: PathBuf,
}

/// Why a copy cannot be made, in one line.
type Reason = String;

impl Placing {
    /// What the file system says of a model and of the files that it names.
    pub(crate) fn stamps(input: &Path, named: &NamedFiles) -> Vec<(PathBuf, Option<Stamp>)> {
        let there = named.files.iter().filter(|(_, is_there)| **is_there);
        let beside = there.map(|(way, _)| folder_of(input).join(way));
        let all = beside.chain([input.to_path_buf()]);
        all.map(|path| (path.clone(), Stamp::at(&path))).collect()
    }

    /// Finds the place of every file; why there is none for one.
    pub(crate) fn plan(
        request: &CopyRequest,
        output: &Path,
        named: &NamedFiles,
    ) -> Result<Result<Self, Reason>, StoreError> {
        let (from, to) = (folder_of(request.input), folder_of(output));
        let mut moves = Vec::new();
        for way in named.files.iter().filter(|(_, is_there)| **is_there).map(|(way, _)| way) {
            let (from, to) = (from.join(way), to.join(way));
            if to == output {
                continue;
            }
            if request.is_one_of_many
                && let Some(reason) = reason_of_others(request.input, output, &from)?
            {
                return Ok(Err(reason));
            }
            if !stays_inside(folder_of(output), &to)? {
                return Ok(Err(format!("{} leads out of the folder", way.display())));
            }
            let is_there = has_bytes_of(&to, &from)?;
            let may_be_replaced = request.limits.replaces.contains(&to) && !to.is_dir();
            if !is_there && !may_be_replaced && to.symlink_metadata().is_ok() {
                return Ok(Err(format!("there is another {} beside the output", way.display())));
            }
            moves.push(Move { from, to, is_there });
        }
        let (from, to) = (request.input.to_path_buf(), output.to_path_buf());
        moves.push(Move { from, to, is_there: false });
        Ok(Ok(Self { moves, output: output.to_path_buf() }))
    }
}

/// Puts all files in their places, the model last, unless one of `before` is no longer what it was.
///
/// # Errors
/// [`RepairError::InputChanged`], or the disk fails; then the model is not in place.
pub(crate) fn place(
    placing: &Placing,
    before: &[(PathBuf, Option<Stamp>)],
    limits: &Limits,
) -> Result<Vec<PathBuf>, RepairError> {
    let mut placed = Vec::new();
    for Move { from, to, is_there } in &placing.moves {
        if !is_there {
            let part = part_of(&placing.output, to, limits);
            let copied = put(from, to, &part, before);
            if copied.is_err() {
                // What is left of it is of no use; that it cannot be removed changes nothing.
                let _ = std::fs::remove_file(&part);
            }
            copied?;
        }
        placed.push(to.clone());
    }
    placed.rotate_right(1);
    Ok(placed)
}

fn put(
    from: &Path,
    to: &Path,
    part: &Path,
    before: &[(PathBuf, Option<Stamp>)],
) -> Result<(), RepairError> {
    let folder = folder_of(to);
    std::fs::create_dir_all(folder).map_err(|e| StoreError::io("create", folder, e))?;
    copy_to(from, part)?;
    let known = before.iter().find(|(path, _)| path == from);
    if known.is_some_and(|(_, stamp)| *stamp != Stamp::at(from)) {
        return Err(RepairError::InputChanged { path: from.to_path_buf() });
    }
    std::fs::rename(part, to).map_err(|e| StoreError::io("put in place", to, e))?;
    Ok(sync_folder(folder)?)
}

/// A file in the work folder if that is on the same file system, else one beside the output, of a
/// name that no other model has.
fn part_of(output: &Path, to: &Path, limits: &Limits) -> PathBuf {
    let device = |folder: &Path| std::fs::metadata(folder).map(|folder| folder.dev()).ok();
    let beside = folder_of(output);
    let work = limits.work_dir.as_deref();
    match work.filter(|folder| device(folder) == device(beside) && folder_of(to).exists()) {
        Some(folder) => folder.join("output.part"),
        None => {
            let mut hidden = OsString::from(".");
            hidden.push(output.file_name().unwrap_or_default());
            hidden.push(".brickmend.part");
            beside.join(hidden)
        }
    }
}

fn copy_to(input: &Path, part: &Path) -> Result<(), StoreError> {
    let failed = |doing, path: &Path| {
        let path = path.to_path_buf();
        move |error| StoreError::io(doing, &path, error)
    };
    let mut from = File::open(input).map_err(failed("open", input))?;
    let mut to = File::create(part).map_err(failed("create", part))?;
    std::io::copy(&mut from, &mut to).map_err(failed("copy to", part))?;
    to.sync_all().map_err(failed("synchronise", part))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether the folder of `path`, as far as it is there, lies within `folder` or is it.
fn stays_inside(folder: &Path, path: &Path) -> Result<bool, StoreError> {
    let real =
        |path: &Path| path.canonicalize().map_err(|e| StoreError::io("find the folder", path, e));
    if !folder.exists() {
        return Ok(true);
    }
    let there = path.ancestors().skip(1).find(|ancestor| ancestor.symlink_metadata().is_ok());
    let there = there.unwrap_or(folder);
    Ok(folder.starts_with(there) || there.is_dir() && real(there)?.starts_with(real(folder)?))
}

/// Whether there is a file at `path` that has the very bytes of another.
fn has_bytes_of(path: &Path, other: &Path) -> Result<bool, StoreError> {
    let (Some(one), Some(two)) = (Stamp::at(path), Stamp::at(other)) else { return Ok(false) };
    if one.bytes != two.bytes || path.symlink_metadata().is_ok_and(|m| m.is_symlink()) {
        return Ok(false);
    }
    let digest = |path| Stamped::read(path, &|| false).map(|stamped| stamped.digest);
    Ok(digest(path)? == digest(other)?)
}

/// Why the place of a file belongs to the result of another model: it is that of a model, or has the
/// name of the library or of an image of one.
fn reason_of_others(
    input: &Path,
    output: &Path,
    from: &Path,
) -> Result<Option<Reason>, StoreError> {
    let name = from.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if from != input && format_of_name(from).is_some() {
        return Ok(Some(format!("{name}, which it names, is a model itself")));
    }
    let library = name.strip_suffix(".mtl");
    let image = name.split_once(".texture-").map(|(stem, _)| stem);
    let Some(stem) = library.or(image) else { return Ok(None) };
    let is_own = output.file_stem().is_some_and(|own| own.to_string_lossy() == stem);
    if is_own && folder_of(from) == folder_of(input) {
        return Ok(None);
    }
    let folder = folder_of(from);
    let failed = |e| StoreError::io("list", folder, e);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let unpacked = unpacked_name(&path);
        let is_of_stem = unpacked.file_stem().is_some_and(|own| own.to_string_lossy() == stem);
        if is_of_stem && path != *input && format_of_name(&path).is_some() {
            let other = path.file_name().unwrap_or_default().to_string_lossy();
            return Ok(Some(format!("the result of {other} may have a {name} of its own")));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_inside_also_where_links_lead_elsewhere() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let inside = folder.path().join("in");
        std::fs::create_dir_all(inside.join("tex")).expect("a folder");
        std::os::unix::fs::symlink(folder.path(), inside.join("up")).expect("a link");
        let stays = |way: &str| stays_inside(&inside, &inside.join(way)).expect("readable");
        assert!(stays("a.png") && stays("tex/a.png") && stays("new/er/a.png"));
        assert!(!stays("up/a.png") && !stays("up/new/a.png"));
    }

    #[test]
    fn what_belongs_to_other_models_is_theirs() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name);
        for name in ["a.obj", "b.OBJ.gz", "kit.mtl"] {
            std::fs::write(path(name), "x").expect("writable");
        }
        let reason = |name: &str| {
            reason_of_others(&path("a.obj"), Path::new("out/a.obj"), &path(name)).expect("listable")
        };
        for free in ["a.mtl", "kit.mtl", "wood.png", "a.texture-0.png", "kit.texture-0.png"] {
            assert_eq!(reason(free), None, "{free}");
        }
        for taken in ["b.mtl", "b.texture-1.png", "c.ply"] {
            assert!(reason(taken).is_some(), "{taken}");
        }
    }
}
