//! What a repair took away and what it added, as files that tools of modellers open.
//!
//! In:         the input, the output in its place, its outcome.
//! Out:        up to three PLY files: `removed.ply`, pieces of the input that are not near the output;
//!             `added.ply`, pieces of the output that are not near the input; `patches.ply`, triangles
//!             of the output whose material tells that they close an opening.
//! Invariant:  the files depend on both models and the tolerance alone. A file is in place when it is
//!             complete, by rename; one without a triangle is not there, nor one of an earlier run.
//! Units:      model units, those of the output.
//! Memory:     the share: three eighths for a surface while it is read, three more while pieces are
//!             found, a sixteenth for pieces; and as much again for the reader.
//! Fails:      [`LayersError`].

mod error;

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use glam::DVec3;
use rayon::ThreadPool;

use crate::contour::SurfaceDetail;
use crate::deviate::{Gap, Means, Target};
use crate::ingest::Converted;
use crate::io::{
    Format, IoError, LooseKind, LooseShape, ReadOptions, Source, detect, write_loose_shapes,
};
use crate::mesh::{LengthUnit, MeshSource, Surface, TriangleBatch};
use crate::monitor::Monitor;
use crate::repair::{LayerReport, LayersReport, Length, Outcome, Reach, Ruler, Settings};
use crate::report::image_staged::StagedFile;
use crate::store::{Scratch, Sequence, StoreError, sync_folder};

pub use error::LayersError;

/// What lies farther away than this is apart, unless the user says otherwise: a surface by contouring lies
/// within a cell of its input, and a vertex within the threshold of merging besides.
pub const DEFAULT_TOLERANCE: Reach = Reach::Cells(1.5);
/// Edges of pieces are not halved below this: borders are as right.
const FINEST_CELLS: f64 = 0.5;

const REMOVED: &str = "removed.ply";
const ADDED: &str = "added.ply";
const PATCHES: &str = "patches.ply";
const ALL: [&str; 3] = [REMOVED, ADDED, PATCHES];

/// Which layers are written, where, and by what means.
pub struct Layers<'l> {
    /// The folder that they are in.
    pub folder: &'l Path,
    /// The model that was repaired.
    pub input: &'l Path,
    /// What came of it.
    pub output: &'l Path,
    /// What lies farther away than this is removed or added.
    pub tolerance: Reach,
    /// Those of the repair: units are of interest.
    pub settings: &'l Settings,
    /// Where files without names lie, and what they may take.
    pub scratch: &'l Scratch,
    /// Threads that measure; they change no byte.
    pub threads: usize,
    /// For measuring; a reader may have as much besides.
    pub share_bytes: u64,
    /// Asked whether to stop.
    pub monitor: &'l dyn Monitor,
}

/// Triangles of a layer.
struct Found {
    shapes: Sequence<LooseShape>,
    area: f64,
}

impl Found {
    fn new(layers: &Layers) -> Self {
        let shapes = Sequence::new(layers.scratch, layers.share_bytes / 16);
        Self { shapes, area: 0.0 }
    }

    fn add(&mut self, points: [[f64; 3]; 3], number: u64, area: f64) -> Result<(), StoreError> {
        self.area += area;
        self.shapes.push(LooseShape { points, number })
    }
}

impl Layers<'_> {
    /// Makes the folder, before the repair: refuses one in which a layer would replace a model, and a
    /// tolerance that cannot be told.
    ///
    /// # Errors
    /// [`LayersError`].
    pub fn prepare(&self) -> Result<(), LayersError> {
        self.unit()?;
        let made = std::fs::create_dir_all(self.folder);
        made.map_err(|error| LayersError::folder("create", self.folder, error))?;
        for path in ALL.map(|name| self.folder.join(name)) {
            if [self.input, self.output].iter().any(|model| are_one(model, &path)) {
                return Err(LayersError::OverModel { path });
            }
        }
        Ok(())
    }

    /// Removes the layers of an earlier run, of a model in which nothing was changed.
    ///
    /// # Errors
    /// [`LayersError::Folder`].
    pub fn clear(&self) -> Result<(), LayersError> {
        ALL.iter().try_for_each(|name| remove(&self.folder.join(name)))
    }

    /// Writes the layers of a repair that is done.
    ///
    /// # Errors
    /// [`LayersError`]; layers that were put in place before stay.
    pub fn write(&self, outcome: &Outcome) -> Result<LayersReport, LayersError> {
        let threads = self.threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|source| LayersError::Threads { threads, source })?;
        // What the output takes counts against the limit of the disk as before.
        self.scratch.adopt(self.output);
        let tolerance = self.tolerance(outcome)?;
        let gap = Gap { tolerance, finest: FINEST_CELLS * outcome.cell_size };
        let of = |one, other| format!("of the {one}, farther than {tolerance} from the {other}");
        let found = self.apart([self.input, self.output], &gap, &pool)?;
        let removed = self.put(REMOVED, &of("input", "output"), &found)?;
        let found = self.apart([self.output, self.input], &gap, &pool)?;
        let added = self.put(ADDED, &of("output", "input"), &found)?;
        let patches = if outcome.transfer.surfaces == SurfaceDetail::MaterialAndPatch {
            let found = self.patches()?;
            Some(self.put(PATCHES, "of the output, what closes openings", &found)?)
        } else {
            remove(&self.folder.join(PATCHES))?;
            None
        };
        sync_folder(self.folder).map_err(LayersError::scratch)?;
        Ok(LayersReport { tolerance, removed, added, patches })
    }

    /// What a model unit is, where the tolerance asks for it.
    fn unit(&self) -> Result<Option<LengthUnit>, LayersError> {
        if !matches!(self.tolerance, Reach::Length(Length::Metres(_))) {
            return Ok(None);
        }
        let Settings { unit: said, to_unit, .. } = *self.settings;
        let mut source = self.open(self.input)?;
        let mut source = Converted::new(&mut *source, said, to_unit);
        let read = source.next_batch(&mut TriangleBatch::default());
        read.map_err(|error| LayersError::source(self.input, error))?;
        let unit = source.unit().or(said);
        let no_unit = || LayersError::NoUnit { path: self.input.to_path_buf() };
        unit.map(Some).ok_or_else(no_unit)
    }

    /// The tolerance, model units.
    fn tolerance(&self, outcome: &Outcome) -> Result<f64, LayersError> {
        let ruler = Ruler { bounds: outcome.input.bounds, unit: self.unit()? };
        let no_unit = || LayersError::NoUnit { path: self.input.to_path_buf() };
        match self.tolerance {
            Reach::Cells(cells) => Ok(cells * outcome.cell_size),
            Reach::Length(length) => length.in_model_units(&ruler).ok_or_else(no_unit),
        }
    }

    /// A model as the repair read it or wrote it.
    fn open(&self, path: &Path) -> Result<Source, LayersError> {
        let failed = |error| LayersError::source(path, error);
        let is_written_glb = path == self.output && detect(path).map_err(failed)? == Format::Glb;
        // The nodes of a GLB that we wrote turn its numbers into metres.
        let options = match is_written_glb {
            true => ReadOptions::by_itself(self.share_bytes),
            false => ReadOptions::in_scene(self.share_bytes),
        };
        crate::io::open(path, self.scratch, &options).map_err(failed)
    }

    /// In the unit of the output, which is that of the input or another one.
    fn converted<'s>(
        &self,
        path: &Path,
        source: &'s mut Source,
    ) -> Converted<'s, dyn MeshSource<Error = IoError> + Send> {
        let Settings { unit, to_unit, .. } = *self.settings;
        let to_unit = to_unit.filter(|_| path == self.input);
        Converted::new(&mut **source, unit, to_unit)
    }

    /// What of one model is not near the other.
    fn apart(
        &self,
        [one, other]: [&Path; 2],
        gap: &Gap,
        pool: &ThreadPool,
    ) -> Result<Found, LayersError> {
        let Self { scratch, share_bytes, monitor, .. } = *self;
        let means = Means { scratch, pool, share_bytes, monitor };
        let target = {
            let mut source = self.open(other)?;
            let mut source = self.converted(other, &mut source);
            let target = Target::read(&mut source, &means);
            target.map_err(|error| LayersError::deviate(other, error))?
        };
        let too_large = || LayersError::TooLarge { path: other.to_path_buf() };
        let target = target.ok_or_else(too_large)?;
        let mut found = Found::new(self);
        let mut source = self.open(one)?;
        let mut source = self.converted(one, &mut source);
        let cut = target.apart(&mut source, gap, &means, |piece| {
            Ok(found.add(piece.corners, piece.number, piece.area())?)
        });
        cut.map_err(|error| LayersError::deviate(one, error))?;
        Ok(found)
    }

    /// The triangles of the output that close openings.
    fn patches(&self) -> Result<Found, LayersError> {
        let failed = |error| LayersError::source(self.output, error);
        let mut source = self.open(self.output)?;
        let (mut found, mut batch) = (Found::new(self), TriangleBatch::default());
        // The material that was asked for last, and whether it is one of patches.
        let mut last = None;
        let mut number = 0;
        while source.next_batch(&mut batch).map_err(failed)? {
            if self.monitor.cancelled() {
                return Err(LayersError::Cancelled);
            }
            for (corners, &material) in batch.corners.iter().zip(&batch.materials) {
                let is_patch = match last {
                    Some((known, is_patch)) if known == material => is_patch,
                    _ => {
                        let name = source.material(material).map_err(failed)?.name;
                        name.ends_with(Surface::PATCH_ENDING)
                    }
                };
                last = Some((material, is_patch));
                if is_patch {
                    let [a, b, c] = corners.map(DVec3::from);
                    let area = (b - a).cross(c - a).length() / 2.0;
                    found.add(*corners, number, area).map_err(LayersError::scratch)?;
                }
                number += 1;
            }
        }
        Ok(found)
    }

    /// Puts a layer in place, or takes away one of an earlier run where there is nothing in it.
    fn put(&self, name: &str, comment: &str, found: &Found) -> Result<LayerReport, LayersError> {
        let path = self.folder.join(name);
        let triangles = found.shapes.len();
        if triangles == 0 {
            remove(&path)?;
            return Ok(LayerReport::default());
        }
        let staged = StagedFile::create(&path).map_err(LayersError::InPlace)?;
        let (kind, shapes) = (LooseKind::Triangles, &found.shapes);
        write_loose_shapes(staged.partial(), comment, kind, shapes, self.scratch)
            .map_err(|error| LayersError::layer(&path, error))?;
        staged.put_in_place().map_err(LayersError::InPlace)?;
        let file = Some(path.to_string_lossy().into_owned());
        Ok(LayerReport { file, triangles, area: found.area })
    }
}

fn remove(path: &Path) -> Result<(), LayersError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(LayersError::folder("remove", path, error))
        }
        _ => Ok(()),
    }
}

/// Whether two paths lead to one file, or will when it is there.
fn are_one(one: &Path, other: &Path) -> bool {
    let identity = |path| std::fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    let place = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    let same_file = identity(one).is_some() && identity(one) == identity(other);
    same_file || place(one).is_some() && place(one) == place(other)
}
