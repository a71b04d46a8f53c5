//! What a repair took away and added, as layers in a folder.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use brickmend::monitor::Monitor;
use brickmend::repair::{LayersReport, Limits, Outcome, Reach, Settings};
use brickmend::report::{DEFAULT_TOLERANCE, Layers, LayersError};
use brickmend::store::Scratch;
use clap::Args;

use crate::cli::numbers::short;
use crate::cli::progress::on_one_line;

/// Whether layers are written, and what is in them.
#[derive(Debug, Args)]
#[command(next_help_heading = "Report")]
pub struct LayerArguments {
    /// Write what the repair took away and what it added as PLY into this folder: removed.ply of the
    /// input, added.ply of the output, and with --tag-patches patches.ply; see docs/layers.md.
    #[arg(long, value_name = "DIR")]
    pub export: Option<PathBuf>,
    /// What lies farther from the other model than this is removed or added; in cells (1.5cells), in
    /// model units, with a unit, or in % of the bounding box diagonal.
    #[arg(long, requires = "export", value_name = "LENGTH", default_value_t = DEFAULT_TOLERANCE,
          value_parser = parse_tolerance)]
    export_tolerance: Reach,
}

/// A repair whose layers are wanted.
pub(crate) struct Wanted<'w> {
    pub(crate) arguments: &'w LayerArguments,
    pub(crate) input: &'w Path,
    pub(crate) output: &'w Path,
    pub(crate) settings: &'w Settings,
    pub(crate) limits: &'w Limits,
    pub(crate) monitor: &'w dyn Monitor,
}

impl Wanted<'_> {
    /// Makes the folder, and refuses what cannot be before the work begins.
    pub(crate) fn prepare(&self) -> Result<(), LayersError> {
        // Other folders may not be there yet.
        let folder = self.output.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        self.run((folder, 1), |layers| layers.prepare()).unwrap_or(Ok(()))
    }

    /// Takes away the layers of an earlier run.
    pub(crate) fn clear(&self) -> Result<(), LayersError> {
        self.run((self.scratch_folder(), 1), |layers| layers.clear()).unwrap_or(Ok(()))
    }

    /// Writes the layers, if they are wanted, and notes them in the outcome.
    pub(crate) fn write(&self, outcome: &mut Outcome) -> Result<(), LayersError> {
        let means = (self.scratch_folder(), outcome.memory.threads);
        let written = self.run(means, |layers| layers.write(outcome)).transpose()?;
        outcome.exports = written;
        Ok(())
    }

    fn scratch_folder(&self) -> &Path {
        let folders = [&self.limits.work_dir, &self.arguments.export];
        folders.into_iter().flatten().next().map_or(Path::new("."), PathBuf::as_path)
    }

    /// A sixth of the memory budget is for measuring, as much for a reader.
    fn run<T>(
        &self,
        (scratch_folder, threads): (&Path, usize),
        work: impl FnOnce(&Layers) -> T,
    ) -> Option<T> {
        let folder = self.arguments.export.as_deref()?;
        let limit_bytes = self.limits.max_disk_bytes.unwrap_or(u64::MAX);
        let scratch = Scratch::limited(scratch_folder, limit_bytes);
        let Self { input, output, settings, monitor, .. } = *self;
        Some(work(&Layers {
            folder,
            input,
            output,
            tolerance: self.arguments.export_tolerance,
            settings,
            scratch: &scratch,
            threads,
            share_bytes: self.limits.max_memory_bytes / 6,
            monitor,
        }))
    }
}

/// The layers as text, a line for each that has a file.
pub(crate) fn lines(layers: &LayersReport) -> String {
    let mut text = String::new();
    let all = [
        ("removed", Some(&layers.removed)),
        ("added", Some(&layers.added)),
        ("patches", layers.patches.as_ref()),
    ];
    for (name, layer) in all {
        let Some(layer) = layer else { continue };
        let Some(file) = &layer.file else { continue };
        let (triangles, area) = (layer.triangles, short(layer.area));
        let _ = write!(text, "\n  {name}: {triangles} triangles, area {area}: ");
        text.push_str(&on_one_line(file));
    }
    text
}

fn parse_tolerance(text: &str) -> Result<Reach, String> {
    match text.parse::<Reach>() {
        Ok(Reach::Cells(cells)) if cells <= 0.0 => {
            Err("what touches is not apart: give more than 0".to_owned())
        }
        Ok(length) => Ok(length),
        Err(error) => Err(error.to_string()),
    }
}
