//! What a repair will take, told before it starts.
//!
//! In:         a model file, and what [`crate::repair::repair`] would be asked for.
//! Out:        an [`Estimate`]: leaves, memory, disk and seconds, with what they rest on.
//! Invariant:  the depth is the one that the repair takes. Memory and disk are upper bounds for 99
//!             of 100 models and more; leaves and seconds are expectations.
//! Memory:     the reader's share; nothing grows with the depth.
//! Fails:      [`RepairError`], as the repair would: unreadable inputs, budgets below the floor.
//! Source:     the sums of [`crate::ingest::sum_up`]; docs/estimate.md has the figures.

mod counts;
mod disk;
mod memory;
mod seconds;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::ingest::{Converted, SoupSums, sum_up};
use crate::io::{Format, ReadOptions};
use crate::monitor::{Monitor, Stage};
use crate::octree::Domain;
use crate::repair::RepairError;
use crate::repair::depth::choose_domain;
use crate::repair::estimate::disk::DiskModel;
use crate::repair::estimate::memory::MemoryModel;
use crate::repair::length::Ruler;
use crate::repair::outcome::as_text;
use crate::repair::plan::{MemoryPlan, floor_bytes};
use crate::repair::settings::{Limits, Settings};
use crate::repair::stages::check_converted;
use crate::store::Scratch;

pub use counts::{Bounds, Counts};
pub use disk::DiskSteps;

/// Version of the schema of estimates.
pub const ESTIMATE_VERSION: u32 = 1;

/// What a repair will take.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// [`ESTIMATE_VERSION`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Path of the input.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Cells with a marked edge, expected.
    pub leaf_cells: u64,
    /// The smallest budget with the threads of the run.
    pub memory_floor_bytes: u64,
    /// Peak of resident memory, at most.
    pub memory_bytes: u64,
    /// Peak of the work folder with the output while it is written, at most.
    pub disk_bytes: u64,
    /// Size of the output, at most.
    pub output_bytes: u64,
    /// Seconds of all stages together, expected.
    pub seconds: f64,
    /// What the triangles of the input add up to.
    pub input: SoupSums,
    /// Everything that changes the result.
    pub settings: Settings,
    /// The grid.
    pub grid: Domain,
    /// Side of a cell, model units.
    pub cell_size: f64,
    /// Counts of the grid.
    pub counts: Counts,
    /// The work folder, step by step, at most.
    pub disk: DiskSteps,
    /// Seconds of each stage.
    pub stages: BTreeMap<Stage, f64>,
    /// `--max-memory`.
    pub budget_bytes: u64,
    /// Threads that would work.
    pub threads: usize,
}

impl Estimate {
    /// [`Estimate::disk_bytes`] for so many levels of detail: their files are there together, and
    /// the signs until the last one.
    #[must_use]
    pub fn disk_bytes_with_levels(&self, levels: u64) -> u64 {
        let Some(before) = levels.checked_sub(1).filter(|before| *before > 0) else {
            return self.disk_bytes;
        };
        // The signs are no more than all that is there while they are made.
        self.disk.peak().max(self.disk.prove + self.disk.relabel) + before * self.output_bytes
    }
}

/// Predicts what [`crate::repair::repair`] would take to write `format`.
///
/// Reads the input once. What the reader spills lies in the folder that `limits` names for work,
/// else in the current one, and is gone afterwards.
///
/// # Errors
/// [`RepairError`], where the repair could not start either.
pub fn estimate(
    input: &Path,
    format: Format,
    settings: &Settings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Estimate, RepairError> {
    settings.check()?;
    let plan = MemoryPlan::within(limits)?;
    let input_format = crate::io::detect(input).map_err(RepairError::Input)?;
    let total = std::fs::metadata(input).map_or(0, |m| m.len());
    monitor.begin(Stage::Ingest, total);
    let scratch = Scratch::new(limits.work_dir.as_deref().unwrap_or(Path::new(".")));
    let options = ReadOptions::in_scene(plan.share_bytes);
    let mut source = crate::io::open(input, &scratch, &options).map_err(RepairError::Input)?;
    let mut converted = Converted::new(&mut *source, settings.unit, settings.to_unit);
    let sums = sum_up(&mut converted, settings.strict, monitor)
        .map_err(|error| RepairError::from_ingest(error, input))?;
    check_converted(input, settings.to_unit, sums.unit)?;
    let input_vertices = source.vertex_count().unwrap_or(0);
    drop(source);
    monitor.end(Stage::Ingest);
    if sums.finite_triangles() == 0 || sums.area == 0.0 {
        return Err(RepairError::no_triangle(input, &sums.stats));
    }
    let thickness = settings.sheet_thickness;
    let ruler = Ruler { bounds: sums.bounds, unit: sums.unit.or(settings.unit) };
    let grid = choose_domain(input, &ruler, settings.depth, thickness, format, 0.0)?;
    let sheet_cells = settings.sheet_thickness.in_cells(&ruler, &grid);
    let no_unit = || RepairError::NoUnit { path: input.to_path_buf() };
    let counts = Counts::predict(&sums, &grid, sheet_cells.ok_or_else(no_unit)?);
    let reader_bytes = scratch.written_bytes();
    let attributes = settings.gets(format, sums.attributes);
    let disk_model = DiskModel {
        sums: &sums,
        counts: &counts,
        cell: grid.cell_size(),
        plan: &plan,
        format,
        has_surfaces: format.has_materials() && (sums.has_materials || settings.tag_patches),
        attributes,
        reader_bytes,
    };
    let files = disk_model.files();
    let mut disk = disk_model.steps(&files);
    if settings.max_triangles.is_none() {
        disk.choose = 0;
    }
    let memory_model = MemoryModel {
        sums: &sums,
        counts: &counts,
        plan: &plan,
        format,
        attributes,
        largest_bin: disk_model.largest_bin(),
        input_format,
        input_vertices,
    };
    let stages = seconds::stages(&sums, &counts, plan.threads);
    Ok(Estimate {
        schema: ESTIMATE_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        path: input.to_path_buf(),
        leaf_cells: counts.leaf_cells,
        memory_floor_bytes: floor_bytes(plan.threads),
        memory_bytes: memory_model.peak(&files, limits.max_memory_bytes),
        disk_bytes: disk.peak(),
        output_bytes: files.output as u64,
        seconds: stages.values().sum(),
        input: sums,
        settings: *settings,
        grid,
        cell_size: grid.cell_size(),
        counts,
        disk,
        stages,
        budget_bytes: limits.max_memory_bytes,
        threads: plan.threads,
    })
}
