//! Verifies a file: proves the guarantees, and measures how far it lies from an original.
//!
//! In:         a model file of any format, maybe another one that it was made from, by whichever
//!             tool; [`VerifySettings`], [`Limits`].
//! Out:        a [`Verification`]. Nothing is written but scratch files without names.
//! Invariant:  the result depends on the two files and the settings alone.
//! Memory:     [`Limits::max_memory_bytes`].
//! Fails:      [`RepairError`]: a file that cannot be read, an original without a triangle that has
//!             an area, a budget, the disk, or a request to stop. A file that is not sound, or has
//!             no triangle, is a verdict.

use std::path::Path;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::deviate::{
    DeviateError, Deviation, DeviationOptions, Means, Surface, SurfaceOptions, compare,
};
use crate::ingest::SoupStats;
use crate::io::{Format, IoError, ReadOptions};
use crate::mesh::{LengthUnit, TriangleBatch};
use crate::monitor::{Monitor, Stage};
use crate::octree::SnapBox;
use crate::repair::RepairError;
use crate::repair::length::{Length, Ruler};
use crate::repair::plan::MemoryPlan;
use crate::repair::settings::Limits;
use crate::repair::thresholds::{Threshold, VerifySettings};
use crate::repair::verdict::{Compared, judge};
use crate::repair::verification::{
    SurfaceReport, Thresholds, VERIFICATION_VERSION, Verification, VertexNames, is_closed,
};
use crate::store::Scratch;
use crate::verify::{Outward, Proof, ProofOptions, VerifyError, Vertices, prove};

/// Of so many samples of the area, one of the sharp edges.
const SAMPLES_PER_CREASE: u64 = 10;

/// Proves the guarantees of the model at `file`, and compares it with the one at `original`.
///
/// Scratch files lie in the folder that `limits` names for work, else in the current one.
///
/// # Errors
/// [`RepairError`], see the head of the file.
pub fn verify_file(
    file: &Path,
    original: Option<&Path>,
    settings: &VerifySettings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Verification, RepairError> {
    let plan = MemoryPlan::within(limits)?;
    let threads = plan.threads;
    let folder = limits.work_dir.as_deref().unwrap_or(Path::new("."));
    let scratch = Scratch::limited(folder, limits.max_disk_bytes.unwrap_or(u64::MAX));
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RepairError::Threads { threads, source })?;
    let share_bytes = plan.share_bytes;
    let verifying = Verifying { settings, scratch, share_bytes, pool, monitor };
    // What cannot be read is told before work starts.
    original.map_or(Ok(Format::Ply), crate::io::detect).map_err(RepairError::Input)?;
    let vertices = verifying.vertex_names(file)?;
    let names = match vertices {
        VertexNames::Numbers => Vertices::Numbers,
        VertexNames::Places => Vertices::Positions,
    };
    let proof = verifying.prove(file, names, Outward::AlternatesWithNesting, true)?;
    let report = SurfaceReport::new(file, &proof);
    let beside = original.map(|path| verifying.beside(path, file, &proof)).transpose()?;
    let compared = beside.as_ref().map(|beside| Compared {
        file: &report,
        original: &beside.original,
        deviation: beside.deviation.as_ref(),
        are_solids: beside.are_solids,
    });
    let with_thresholds = compared.as_ref().zip(beside.as_ref().map(|b| &b.thresholds));
    let (verdict, reasons) = judge(&proof, with_thresholds);
    let (original, deviation, thresholds) = match beside {
        Some(Beside { original, deviation, thresholds, .. }) => {
            (Some(original), deviation, Some(thresholds))
        }
        None => (None, None, None),
    };
    Ok(Verification {
        schema: VERIFICATION_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        verdict,
        reasons,
        file: report,
        vertices,
        proof,
        original,
        deviation,
        thresholds,
    })
}

/// A verification under way.
struct Verifying<'v> {
    settings: &'v VerifySettings,
    scratch: Scratch,
    share_bytes: u64,
    pool: ThreadPool,
    monitor: &'v dyn Monitor,
}

/// What the comparison tells.
struct Beside {
    original: SurfaceReport,
    deviation: Option<Deviation>,
    thresholds: Thresholds,
    are_solids: bool,
}

impl Verifying<'_> {
    fn open(&self, path: &Path) -> Result<crate::io::Source, IoError> {
        crate::io::open(path, &self.scratch, &ReadOptions::in_scene(self.share_bytes / 4))
    }

    /// What tells vertices of a file apart: formats that list a vertex once for each attribute of its
    /// corners do not say by numbers which triangles hang together.
    fn vertex_names(&self, path: &Path) -> Result<VertexNames, RepairError> {
        let format = crate::io::detect(path).map_err(RepairError::Input)?;
        let mut is_split = self.settings.by_place || format == Format::Glb;
        if format == Format::Ply && !is_split {
            let mut batch = TriangleBatch::default();
            let mut source = self.open(path).map_err(RepairError::Input)?;
            source.next_batch(&mut batch).map_err(RepairError::Input)?;
            is_split = !batch.uvs.is_empty() || !batch.colours.is_empty();
        }
        Ok(if is_split { VertexNames::Places } else { VertexNames::Numbers })
    }

    fn prove(
        &self,
        path: &Path,
        vertices: Vertices,
        outward: Outward,
        intersections: bool,
    ) -> Result<Proof, RepairError> {
        let share_bytes = self.share_bytes / 2;
        let options = ProofOptions { share_bytes, outward, vertices, intersections };
        let mut open = || self.open(path);
        prove(&mut open, &self.scratch, &options, &self.pool, self.monitor).map_err(|error| {
            match error {
                VerifyError::Source { source } => RepairError::Input(source),
                VerifyError::Store(error) => RepairError::Store(error),
            }
        })
    }

    /// Proves what the original is, and measures.
    fn beside(&self, path: &Path, file: &Path, proved: &Proof) -> Result<Beside, RepairError> {
        let places = Vertices::Positions;
        let mut proof = self.prove(path, places, Outward::NotAsked, false)?;
        // Pairs of a soup are many, and tell nothing here.
        let mut are_solids = is_closed(&proof) && is_closed(proved);
        if are_solids {
            proof = self.prove(path, places, Outward::AlternatesWithNesting, true)?;
            are_solids = proof.intersecting_pairs + proved.intersecting_pairs == 0;
        }
        let original = SurfaceReport::new(path, &proof);
        let (surface, unit) = self.read(path)?;
        let Some((surface, bounds)) = surface.zip(proof.bounds) else {
            return Err(no_area(path, &proof));
        };
        let [lo, hi] = bounds;
        let unit = unit.or(self.settings.unit);
        let ruler = Ruler { bounds: SnapBox { lo, hi }, unit };
        let length = |length: Length| {
            let no_unit = || RepairError::NoUnit { path: path.to_path_buf() };
            length.in_model_units(&ruler).ok_or_else(no_unit)
        };
        let thresholds = thresholds(self.settings, &length)?;
        let options = DeviationOptions {
            crease_samples: self.settings.samples.div_ceil(SAMPLES_PER_CREASE),
            tolerance: length(self.settings.tolerance)?,
            cell_size: self.settings.cell.map(length).transpose()?,
        };
        let deviation = match self.read(file)?.0 {
            Some(of_file) => Some(compare(&surface, &of_file, &options, &self.means())?),
            None => None,
        };
        self.monitor.end(Stage::Deviate);
        Ok(Beside { original, deviation, thresholds, are_solids })
    }

    fn means(&self) -> Means<'_> {
        let Self { scratch, share_bytes, pool, monitor, .. } = self;
        Means { scratch, pool, share_bytes: share_bytes / 4 * 3, monitor: *monitor }
    }

    /// A surface, and what a unit of its file is.
    fn read(
        &self,
        path: &Path,
    ) -> Result<(Option<Surface<'static>>, Option<LengthUnit>), RepairError> {
        self.monitor.begin(Stage::Deviate, 0);
        let mut source = self.open(path).map_err(RepairError::Input)?;
        let samples = self.settings.samples;
        let options = SurfaceOptions { samples, creases: true };
        let surface = Surface::read(&mut *source, &options, &self.means());
        let surface = surface.map_err(|error| match error {
            DeviateError::Source { source } => RepairError::Input(source),
            DeviateError::Store(error) => RepairError::Store(error),
        })?;
        Ok((surface, source.unit()))
    }
}

fn no_area(path: &Path, proof: &Proof) -> RepairError {
    let stats = SoupStats {
        triangles: proof.triangles,
        nonfinite_triangles: proof.nonfinite_triangles,
        ..SoupStats::default()
    };
    RepairError::no_triangle(path, &stats)
}

fn thresholds(
    settings: &VerifySettings,
    length: &impl Fn(Length) -> Result<f64, RepairError>,
) -> Result<Thresholds, RepairError> {
    let VerifySettings { max_deviation, .. } = *settings;
    Ok(Thresholds {
        max_deviation: Threshold {
            review: length(max_deviation.review)?,
            fail: max_deviation.fail.map(length).transpose()?,
        },
        max_lost: plain(settings.max_lost, |share| share.0),
        max_invented: plain(settings.max_invented, |share| share.0),
        max_normal_deg: plain(settings.max_normal, |angle| angle.0),
        min_creases: plain(settings.min_creases, |share| share.0),
        max_volume: plain(settings.max_volume, |share| share.0),
        max_components: plain(settings.max_components, |count| count as f64),
        max_genus: plain(settings.max_genus, |count| count as f64),
    })
}

fn plain<T: Copy>(threshold: Threshold<T>, number: impl Fn(T) -> f64) -> Threshold<f64> {
    Threshold { review: number(threshold.review), fail: threshold.fail.map(number) }
}
