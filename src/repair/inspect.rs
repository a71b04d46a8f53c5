//! The order of an inspection: read, prove, diagnose, estimate.
//!
//! In:         a model file, [`InspectSettings`], [`Limits`].
//! Out:        an [`Inspection`]; and files of what was found, if a folder is given for them.
//! Invariant:  depends on the file and the settings alone. Scratch files have no names: nothing is
//!             left of them, however the process ends.
//! Memory:     [`Limits::max_memory_bytes`].
//! Fails:      [`RepairError`]: inputs that cannot be read or have no triangle, budgets below the
//!             floor, lengths in metres for a file without a unit.

use std::path::Path;

use rayon::ThreadPoolBuilder;

use crate::defect::{
    Defect, DefectKind, IntersectingTriangles, Marks, Meeting, OverlappingTriangles,
    TouchingTriangles,
};
use crate::diagnose::{
    DiagnoseError, Diagnosis, Finding, Means, Measure, Model, ModelFacts, Tolerances, diagnose,
};
use crate::ingest::SoupStats;
use crate::io::{Format, IoError, ReadOptions};
use crate::monitor::{Monitor, Stage};
use crate::octree::SnapBox;
use crate::repair::estimate::estimate;
use crate::repair::inspect_export;
use crate::repair::inspection::{
    INSPECTION_VERSION, InspectSettings, Inspection, ModelSize, RepairCost, ToleranceReport,
};
use crate::repair::length::Ruler;
use crate::repair::plan::MemoryPlan;
use crate::repair::settings::{Limits, Settings};
use crate::repair::{Blame, RepairError};
use crate::store::{Scratch, StoreError};
use crate::verify::{
    Outward, Proof, ProofOptions, ProvedSource, VerifyError, Vertices, prove_marking,
};

/// Tells what is wrong with the model at `input`, and what a repair would take.
///
/// Scratch files lie in the folder that `limits` names for work, else in the current one.
///
/// # Errors
/// [`RepairError`], see the head of the file.
pub fn inspect(
    input: &Path,
    settings: &InspectSettings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Inspection, RepairError> {
    inspect_exporting(input, settings, None, limits, monitor)
}

/// [`inspect`], and writes all that has a defect into the folder `export`, one PLY for each kind that
/// is found and has something to show ([`crate::defect::Marked`]).
///
/// # Errors
/// As [`inspect`]; the folder cannot be written, or one of its files would be the input.
pub fn inspect_exporting(
    input: &Path,
    settings: &InspectSettings,
    export: Option<&Path>,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Inspection, RepairError> {
    if let Some(folder) = export {
        inspect_export::prepare(folder, input)?;
    }
    let plan = MemoryPlan::within(limits)?;
    let scratch = Scratch::new(limits.work_dir.as_deref().unwrap_or(Path::new(".")));
    let share_bytes = plan.share_bytes;
    let model = read(input, &Means { scratch: &scratch, share_bytes, monitor })?;
    let facts = model.facts();
    if facts.triangles == 0 {
        let stats = SoupStats { discarded: facts.discarded, ..SoupStats::default() };
        return Err(RepairError::no_triangle(input, &stats));
    }
    let tolerances = in_model_units(settings, facts, input)?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(plan.threads)
        .build()
        .map_err(|source| RepairError::Threads { threads: plan.threads, source })?;
    // What was read has a fifth of the share.
    let options = ProofOptions {
        share_bytes: share_bytes / 2,
        outward: Outward::NotAsked,
        vertices: Vertices::Numbers,
        intersections: true,
    };
    // Of the share this is what neither the model nor any look takes.
    let marks = export.map(|_| Marks::new(&scratch, share_bytes / 32));
    let mut open =
        || -> Result<ProvedSource<'_, StoreError>, StoreError> { Ok(Box::new(model.source())) };
    let proof = prove_marking(&mut open, &scratch, &options, marks.as_ref(), &pool, monitor)
        .map_err(|error| match error {
            VerifyError::Source { source } | VerifyError::Store(source) => {
                RepairError::Store(source)
            }
        })?;
    drop(pool);
    let means = Means { scratch: &scratch, share_bytes, monitor };
    let diagnosis = diagnose(&model, &tolerances, marks.as_ref(), &means)?;
    if let (Some(folder), Some(marks)) = (export, marks) {
        inspect_export::write(folder, (&model, input), marks, &means)?;
    }
    let has_names = model.has_names();
    let facts = facts.clone();
    drop(model);
    let repair = cost(input, settings, limits, monitor)?;
    let path = input.to_path_buf();
    Ok(conclude(path, (facts, has_names), proof, diagnosis, tolerances, repair))
}

fn read(input: &Path, means: &Means<'_>) -> Result<Model, RepairError> {
    let total = std::fs::metadata(input).map_or(0, |metadata| metadata.len());
    means.monitor.begin(Stage::Ingest, total);
    // The sorts and the tape of the model take the rest.
    let options = ReadOptions::in_scene(means.share_bytes / 4);
    let source = crate::io::open(input, means.scratch, &options);
    let mut source = source.map_err(RepairError::Input)?;
    let model =
        Model::read(&mut *source, means).map_err(|error: DiagnoseError<IoError>| match error {
            DiagnoseError::Source { source } => RepairError::Input(source),
            DiagnoseError::Store(error) => RepairError::Store(error),
        })?;
    means.monitor.end(Stage::Ingest);
    Ok(model)
}

fn ruler_of(facts: &ModelFacts, settings: &InspectSettings) -> Ruler {
    let [lo, hi] = facts.bounds.unwrap_or_default();
    Ruler { bounds: SnapBox { lo, hi }, unit: facts.unit.or(settings.unit) }
}

fn in_model_units(
    settings: &InspectSettings,
    facts: &ModelFacts,
    input: &Path,
) -> Result<Tolerances, RepairError> {
    let ruler = ruler_of(facts, settings);
    let no_unit = || RepairError::NoUnit { path: input.to_path_buf() };
    let length = |length: crate::repair::Length| length.in_model_units(&ruler).ok_or_else(no_unit);
    Ok(Tolerances {
        thin: length(settings.thin)?,
        tiny: length(settings.tiny)?,
        junction: length(settings.junction)?,
    })
}

/// What a repair with default settings would take; `None` where the model itself is refused.
fn cost(
    input: &Path,
    settings: &InspectSettings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Option<RepairCost>, RepairError> {
    let settings = Settings { unit: settings.unit, ..Settings::default() };
    match estimate(input, Format::Ply, &settings, limits, monitor) {
        Ok(estimate) => Ok(Some(RepairCost {
            depth: estimate.grid.depth,
            cell_size: estimate.cell_size,
            leaf_cells: estimate.leaf_cells,
            memory_bytes: estimate.memory_bytes,
            disk_bytes: estimate.disk_bytes,
            output_bytes: estimate.output_bytes,
            seconds: estimate.seconds,
        })),
        Err(error) if matches!(error.blame(), Blame::Input | Blame::Usage | Blame::Model) => {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

fn conclude(
    path: std::path::PathBuf,
    (facts, has_names): (ModelFacts, bool),
    proof: Proof,
    diagnosis: Diagnosis,
    tolerances: Tolerances,
    repair: Option<RepairCost>,
) -> Inspection {
    let is_closed = proof.boundary_edges == 0 && proof.inconsistent_edges == 0;
    let volume = Some(proof.volume).filter(|_| is_closed && diagnosis.shells.count > 0);
    let size = ModelSize {
        triangles: facts.triangles,
        vertices: facts.positions,
        listed_vertices: facts.listed_vertices,
        merged_vertices: facts.used_vertices - facts.positions,
        edges: diagnosis.edges,
        euler_characteristic: proof.euler_characteristic,
        unit: facts.unit,
        bounds: facts.bounds,
        diagonal: facts.bounds.map_or(0.0, |[lo, hi]| SnapBox { lo, hi }.diagonal()),
        area: proof.area,
        volume,
    };
    let discarded = facts.discarded;
    let mut findings = diagnosis.findings;
    let counted = Finding::counted;
    findings.push(counted(DefectKind::WildFace, discarded.wild_index_faces, Vec::new()));
    findings.push(counted(DefectKind::ShortFace, discarded.short_faces, Vec::new()));
    let lengths = [diagnosis.loops.total_length, diagnosis.crowded_length];
    findings.extend(proved(&proof, lengths, has_names));
    findings.retain(|finding| finding.count > 0);
    findings.sort_by_key(|finding| (finding.is_note, finding.kind));
    let Tolerances { thin, tiny, junction } = tolerances;
    Inspection {
        schema: INSPECTION_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        path,
        is_sound: findings.iter().all(|finding| finding.is_note),
        size,
        parts: facts.parts,
        materials: facts.materials,
        shells: diagnosis.shells,
        rims: diagnosis.loops,
        findings,
        tolerances: ToleranceReport { thin, tiny, junction },
        repair,
    }
}

/// What the proof found, kind by kind.
fn proved(proof: &Proof, [open, crowded]: [f64; 2], has_names: bool) -> Vec<Finding> {
    let places = |kind: DefectKind| -> Vec<Defect> {
        let own = proof.places.iter().filter(|place| place.kind() == kind).copied();
        own.map(|place| if has_names { place } else { without_names(place) }).collect()
    };
    let mut findings: Vec<Finding> = [
        DefectKind::NonfiniteTriangle,
        DefectKind::BoundaryEdge,
        DefectKind::NonmanifoldEdge,
        DefectKind::InconsistentEdge,
        DefectKind::NonmanifoldVertex,
        DefectKind::DegenerateTriangle,
    ]
    .into_iter()
    .map(|kind| {
        let count = proof.count(kind);
        match kind {
            DefectKind::BoundaryEdge => {
                Finding::sized(kind, count, (Measure::TotalLength, open), places(kind))
            }
            DefectKind::NonmanifoldEdge => {
                Finding::sized(kind, count, (Measure::TotalLength, crowded), places(kind))
            }
            _ => Finding::counted(kind, count, places(kind)),
        }
    })
    .collect();
    // Duplicates are counted by triangles, not by pairs.
    for (meeting, kind, count) in [
        (Meeting::Crossing, DefectKind::IntersectingTriangles, proof.meetings.crossing),
        (Meeting::Overlapping, DefectKind::OverlappingTriangles, proof.meetings.overlapping),
        (Meeting::Touching, DefectKind::TouchingTriangles, proof.meetings.touching),
    ] {
        let pairs = proof.places.iter().filter_map(|place| match place {
            Defect::IntersectingTriangles(pair) if pair.meeting == meeting => Some(told(*pair)),
            _ => None,
        });
        findings.push(Finding::counted(kind, count, pairs.collect()));
    }
    findings
}

/// A pair under the name of its way to meet.
fn told(pair: IntersectingTriangles) -> Defect {
    let IntersectingTriangles { triangles, position, meeting } = pair;
    match meeting {
        Meeting::Overlapping => {
            Defect::OverlappingTriangles(OverlappingTriangles { triangles, position })
        }
        Meeting::Touching => Defect::TouchingTriangles(TouchingTriangles { triangles, position }),
        Meeting::Crossing | Meeting::Duplicate => Defect::IntersectingTriangles(pair),
    }
}

/// A place without the numbers of vertices, which are none of the file's.
fn without_names(mut place: Defect) -> Defect {
    match &mut place {
        Defect::BoundaryEdge(defect) => defect.edge.vertices = None,
        Defect::NonmanifoldEdge(defect) => defect.edge.vertices = None,
        Defect::InconsistentEdge(defect) => defect.edge.vertices = None,
        Defect::NonmanifoldVertex(defect) => defect.vertex.vertex = None,
        _ => {}
    }
    place
}
