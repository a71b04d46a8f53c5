//! All that has a defect, as files that other tools open: triangles, edges and points.
//!
//! In:         a model, and the marks of an inspection; the file once more where it lists vertices
//!             that no triangle has.
//! Out:        one PLY for each kind that was found, named after it.
//! Invariant:  a file is in place when it is complete, by rename. Those of kinds that were not
//!             found are removed, so that none tells of an earlier inspection. Never the input.
//! Memory:     a sixteenth of the share for the shapes of one kind; an eighth for the vertices of one,
//!             or a quarter for the file.
//! Fails:      [`RepairError`]: the folder cannot be written, the input or the scratch disk fails.

use std::path::{Path, PathBuf};

use crate::defect::{DefectKind, Marked, Marks, SortedMarks};
use crate::diagnose::{Means, Model};
use crate::io::{LooseKind, LooseShape, ReadOptions, write_loose_shapes};
use crate::mesh::TriangleBatch;
use crate::repair::RepairError;
use crate::repair::run::keep_input;
use crate::store::{Sequence, StoreError, sync_folder};

fn file_of(folder: &Path, kind: DefectKind) -> PathBuf {
    let name = serde_json::to_value(kind).expect("a kind is a word");
    folder.join(format!("{}.ply", name.as_str().expect("a kind is a word")))
}

fn kinds() -> impl Iterator<Item = DefectKind> {
    DefectKind::ALL.into_iter().filter(|&kind| Marked::with(kind).is_some())
}

fn failed(operation: &'static str, path: &Path, error: std::io::Error) -> RepairError {
    RepairError::Output(StoreError::io(operation, path, error).into())
}

/// Makes the folder, and refuses it where a file would replace the input.
pub(crate) fn prepare(folder: &Path, input: &Path) -> Result<(), RepairError> {
    std::fs::create_dir_all(folder).map_err(|error| failed("create", folder, error))?;
    kinds().try_for_each(|kind| keep_input(input, &file_of(folder, kind)))
}

/// Writes what is marked of a model, which was read from `input`.
pub(crate) fn write(
    folder: &Path,
    (model, input): (&Model, &Path),
    marks: Marks,
    means: &Means<'_>,
) -> Result<(), RepairError> {
    let mut marks = marks.finish().map_err(RepairError::Store)?;
    let mut absent: Vec<DefectKind> = kinds().collect();
    while let Some(kind) = marks.kind() {
        let (loose, shapes) = shapes_of(kind, (model, input), &mut marks, means)?;
        // A vertex may be at no place.
        if !shapes.is_empty() {
            absent.retain(|&other| other != kind);
            write_kind(&file_of(folder, kind), kind, (loose, &shapes), means)?;
        }
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

/// What is marked with a kind, in the order of the file.
fn shapes_of(
    kind: DefectKind,
    (model, input): (&Model, &Path),
    marks: &mut SortedMarks,
    means: &Means<'_>,
) -> Result<(LooseKind, Sequence<LooseShape>), RepairError> {
    let mut shapes = Sequence::new(means.scratch, means.share_bytes / 16);
    let mut push = |number, points| shapes.push(LooseShape { points, number });
    let loose = match Marked::with(kind) {
        _ if kind == DefectKind::IsolatedVertex => {
            each_listed(input, marks, means, |vertex, point| push(vertex, [point; 3]))?;
            return Ok((LooseKind::Vertices, shapes));
        }
        Some(Marked::Vertex) => {
            model
                .each_marked_vertex(kind, marks, means, |triangle, point| {
                    push(triangle, [point; 3])
                })
                .map_err(RepairError::Store)?;
            return Ok((LooseKind::Points, shapes));
        }
        Some(Marked::Corner) => LooseKind::Points,
        Some(Marked::Edge) => LooseKind::Edges,
        Some(Marked::Triangle) | None => LooseKind::Triangles,
    };
    model.each_marked(kind, marks, means, push).map_err(RepairError::Store)?;
    Ok((loose, shapes))
}

/// Shows the marked ones of the vertices that no triangle has, as far as they have a place.
fn each_listed(
    input: &Path,
    marks: &mut SortedMarks,
    means: &Means<'_>,
    mut visit: impl FnMut(u64, [f64; 3]) -> Result<(), StoreError>,
) -> Result<(), RepairError> {
    let options = ReadOptions::in_scene(means.share_bytes / 4);
    let mut source = crate::io::open(input, means.scratch, &options).map_err(RepairError::Input)?;
    let stopped = || means.monitor.cancelled().then_some(RepairError::Store(StoreError::Cancelled));
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).map_err(RepairError::Input)? {
        stopped().map_or(Ok(()), Err)?;
    }
    drop(batch);
    let kind = DefectKind::IsolatedVertex;
    let mut next = marks.take_any(kind).map_err(RepairError::Store)?;
    let (mut first, mut positions) = (0_u64, Vec::new());
    while source.next_vertices(&mut positions).map_err(RepairError::Input)? {
        stopped().map_or(Ok(()), Err)?;
        let end = first + positions.len() as u64;
        while let Some(vertex) = next.map(u64::from).filter(|&vertex| vertex < end) {
            let position = positions[(vertex - first) as usize];
            if position.iter().all(|x| x.is_finite()) {
                visit(vertex, position).map_err(RepairError::Store)?;
            }
            next = marks.take_any(kind).map_err(RepairError::Store)?;
        }
        first = end;
    }
    while next.is_some() {
        next = marks.take_any(kind).map_err(RepairError::Store)?;
    }
    Ok(())
}

fn write_kind(
    path: &Path,
    kind: DefectKind,
    (loose, shapes): (LooseKind, &Sequence<LooseShape>),
    means: &Means<'_>,
) -> Result<(), RepairError> {
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
