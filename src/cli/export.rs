//! Surfaces of a comparison, coloured by how far they lie from each other.

use std::path::{Path, PathBuf};

use brickmend::deviate::Deviation;
use brickmend::io::{IoError, ReadOptions};
use brickmend::mesh::MeshSource;
use brickmend::monitor::Monitor;
use brickmend::repair::Limits;
use brickmend::report::{Measuring, OpenSource, ReportError, Scene, Side, write_coloured};
use brickmend::store::Scratch;

/// What is written, where, and by what means.
pub(crate) struct Export<'e> {
    pub(crate) folder: &'e Path,
    /// The original, and the file.
    pub(crate) surfaces: [&'e PathBuf; 2],
    pub(crate) limits: &'e Limits,
    pub(crate) monitor: &'e dyn Monitor,
}

impl Export<'_> {
    /// Writes both coloured surfaces; a sixth of the memory budget is for measuring.
    pub(crate) fn write(&self, deviation: Option<&Deviation>) -> Result<(), ExportError> {
        let Some(deviation) = deviation else {
            return Err(ExportError::NoArea { path: self.folder.to_path_buf() });
        };
        let [original, file] = self.surfaces;
        let failed = |source| ExportError::Folder { path: self.folder.to_path_buf(), source };
        std::fs::create_dir_all(self.folder).map_err(failed)?;
        let scratch = Scratch::new(self.limits.work_dir.as_deref().unwrap_or(self.folder));
        let share_bytes = self.limits.max_memory_bytes / 6;
        let options = ReadOptions::in_scene(share_bytes);
        let open = |path: &Path| {
            let source = brickmend::io::open(path, &scratch, &options)?;
            Ok(source as Box<dyn MeshSource<Error = IoError>>)
        };
        let input: &OpenSource<IoError> = &|| open(original);
        let output: &OpenSource<IoError> = &|| open(file);
        let measuring = Some(Measuring { scratch: &scratch, threads: self.limits.threads });
        let scene = Scene { input, output: Some(output), measuring, monitor: self.monitor };
        let ways = [&deviation.original_to_file, &deviation.file_to_original];
        let largest = ways.map(|way| way.largest.as_ref().map_or(0.0, |largest| largest.distance));
        let largest = largest[0].max(largest[1]);
        let real = |path: &Path| path.canonicalize().ok();
        for (side, name) in [(Side::Output, "file.ply"), (Side::Input, "original.ply")] {
            let path = self.folder.join(name);
            let is_model = self
                .surfaces
                .iter()
                .any(|&known| real(known).is_some() && real(known) == real(&path));
            if is_model {
                return Err(ExportError::OverModel { path });
            }
            if !write_coloured(&path, &scene, side, (largest, share_bytes))? {
                return Err(ExportError::NoArea { path });
            }
        }
        Ok(())
    }
}

/// Why there is no export.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ExportError {
    /// The folder cannot be made.
    #[error("Cannot make the folder {path}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's word.
        source: std::io::Error,
    },
    /// One of the two models would be replaced.
    #[error("{path} is a model that is compared; choose another folder for --export")]
    OverModel {
        /// The model.
        path: PathBuf,
    },
    /// There is nothing to measure.
    #[error("{path} is not written: one of the two models has no area")]
    NoArea {
        /// The file, or the folder of both.
        path: PathBuf,
    },
    /// A surface cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}
