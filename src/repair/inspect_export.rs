//! All triangles and edges with a defect, as files that other tools open.
//!
//! In:         a model, and the marks of an inspection.
//! Out:        one PLY for each kind that was found, named after it.
//! Invariant:  a file is in place when it is complete, by rename. Those of kinds that were not
//!             found are removed, so that none tells of an earlier inspection. Never the input.
//! Memory:     a sixteenth of the share for the shapes of one kind.
//! Fails:      [`RepairError`]: the folder cannot be written, the scratch disk fails.

use std::path::{Path, PathBuf};

use crate::defect::{DefectKind, Marks};
use crate::diagnose::{Means, Model};
use crate::io::{LooseKind, LooseShape, write_loose_shapes};
use crate::repair::RepairError;
use crate::repair::run::keep_input;
use crate::store::{Sequence, StoreError, sync_folder};

fn file_of(folder: &Path, kind: DefectKind) -> PathBuf {
    let name = serde_json::to_value(kind).expect("a kind is a word");
    folder.join(format!("{}.ply", name.as_str().expect("a kind is a word")))
}

fn kinds() -> impl Iterator<Item = DefectKind> {
    Marks::OF_TRIANGLES.into_iter().chain(Marks::OF_EDGES)
}

fn failed(operation: &'static str, path: &Path, error: std::io::Error) -> RepairError {
    RepairError::Output(StoreError::io(operation, path, error).into())
}

/// Makes the folder, and refuses it where a file would replace the input.
pub(crate) fn prepare(folder: &Path, input: &Path) -> Result<(), RepairError> {
    std::fs::create_dir_all(folder).map_err(|error| failed("create", folder, error))?;
    kinds().try_for_each(|kind| keep_input(input, &file_of(folder, kind)))
}

/// Writes what is marked.
pub(crate) fn write(
    folder: &Path,
    model: &Model,
    marks: Marks,
    means: &Means<'_>,
) -> Result<(), RepairError> {
    let mut marks = marks.finish().map_err(RepairError::Store)?;
    let mut absent: Vec<DefectKind> = kinds().collect();
    while let Some(kind) = marks.kind() {
        absent.retain(|&other| other != kind);
        let mut shapes = Sequence::new(means.scratch, means.share_bytes / 16);
        model
            .each_marked(kind, &mut marks, means, |triangle, points| {
                shapes.push(LooseShape { points, triangle })
            })
            .map_err(RepairError::Store)?;
        write_kind(&file_of(folder, kind), kind, &shapes, means)?;
    }
    for path in absent.into_iter().map(|kind| file_of(folder, kind)) {
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(failed("remove", &path, error));
            }
            _ => {}
        }
    }
    sync_folder(folder).map_err(|error| RepairError::Output(error.into()))
}

fn write_kind(
    path: &Path,
    kind: DefectKind,
    shapes: &Sequence<LooseShape>,
    means: &Means<'_>,
) -> Result<(), RepairError> {
    let loose = match Marks::OF_EDGES.contains(&kind) {
        true => LooseKind::Edges,
        false => LooseKind::Triangles,
    };
    let part = path.with_extension("ply.part");
    let written = write_loose_shapes(&part, kind.noun(0), loose, shapes, means.scratch)
        .map_err(RepairError::Output)
        .and_then(|()| std::fs::rename(&part, path).map_err(|e| failed("rename", path, e)));
    if written.is_err() {
        // What failed is told already.
        let _ = std::fs::remove_file(&part);
    }
    written
}
