//! Repairs every part of a model for itself, and puts all of them into one file.
//!
//! In:         a model file, [`Settings`], [`Limits`].
//! Out:        a file in its place with the names, places and materials of the parts, each part
//!             proven; an [`Outcome`] for each part, and a [`PartsOutcome`].
//! Invariant:  a part becomes what it would become alone in a file, on a grid of its own. What stands
//!             in several places is repaired once, if the format of the output has scenes; else
//!             once for each place, where it stands.
//! Units:      model units; of each part its own, as far as nodes scale it.
//! Memory:     as [`crate::repair::repair`]; one part at a time. Records of parts spill.
//! Fails:      as [`crate::repair::repair`]. A part of which nothing is left is left out and told.
//! Source:     ours. The grid is that of a part alone, but no finer than [`FINER_THAN_WHOLE`] times
//!             that of the whole would be: what is small in a scene need not be finer than that.
//!
//! Each part is a run of its own (`repair/run.rs`) in a folder inside of the work folder, up to the
//! step before the last two: so a run that was stopped goes on within a part, and passes over those
//! that are done. Only reading the file, and writing and proving the output, are begun anew.

mod assemble;
mod outcome;
mod part_sink;
mod places;
mod proving;
mod slices;
mod survey;

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rayon::ThreadPool;
use serde::{Deserialize, Serialize};

use crate::contour::Method;
use crate::ingest::{Converted, Scattered, scatter};
use crate::io::{Format, Palette, ReadOptions, WriteOptions, library_name};
use crate::monitor::{Monitor, Recording, Stage};
use crate::repair::RepairError;
use crate::repair::depth::choose_domain;
use crate::repair::length::Ruler;
use crate::repair::levels::Level;
use crate::repair::outcome::Outcome;
pub use crate::repair::parts::outcome::{LeftOut, PartReport, PartsOutcome};
use crate::repair::parts::part_sink::Numbered;
use crate::repair::parts::places::Places;
use crate::repair::plan::MemoryPlan;
use crate::repair::run::{
    Feed, InputIdentity, MOST_WAYS_BACK, Run, keep_input, part_key, run_key, start_threads,
};
use crate::repair::settings::{Limits, Settings, TextureRule};
use crate::repair::stages::check_converted;
use crate::repair::standing::CONCLUDED;
use crate::repair::surfaces::{Beside, keep_libraries};
use crate::repair::workspace::Workspace;
use crate::store::{Accountant, FileState, NoCheckpoints, Resources, Spool, StoreError, Texts};

/// Cells of a part are no smaller than those of the whole over this.
const FINER_THAN_WHOLE: f64 = 8.0;

/// Repairs the parts of `input`, each for itself, into `output`. `deliver` gets the outcome of each
/// part, in the order of the output, once the file is in place.
///
/// # Errors
/// [`RepairError`]; then nothing was put in place.
pub fn repair_parts(
    input: &Path,
    output: &Path,
    format: Format,
    settings: &Settings,
    limits: &Limits,
    monitor: &dyn Monitor,
    deliver: &mut dyn FnMut(Outcome),
) -> Result<PartsOutcome, RepairError> {
    settings.check()?;
    let plan = MemoryPlan::within(limits)?;
    crate::io::detect(input).map_err(RepairError::Input)?;
    keep_input(input, output)?;
    let pool = start_threads(plan.threads)?;
    let recording = Recording::new(monitor);
    let seen = InputIdentity::of(input)?;
    let key = run_key(input, format, settings, "", &recording)?;
    let outputs = vec![output.to_path_buf()];
    keep_libraries(format, outputs.iter(), limits)?;
    let workspace = Workspace::open(input, output, outputs, limits, key)?;
    let accountant = Accountant::new(limits.max_memory_bytes);
    let assembly = Assembly {
        input,
        output,
        format,
        settings: *settings,
        limits,
        plan,
        recording: &recording,
        accountant: &accountant,
        seen,
        key,
        workspace: &workspace,
        pool: &pool,
    };
    match assembly.to_the_end(deliver) {
        Ok(outcome) => {
            workspace.remove();
            Ok(outcome)
        }
        Err(error) => {
            if !error.keeps_work() {
                workspace.remove();
            }
            Err(error)
        }
    }
}

/// All parts on their way into one file.
struct Assembly<'a> {
    input: &'a Path,
    output: &'a Path,
    format: Format,
    settings: Settings,
    limits: &'a Limits,
    plan: MemoryPlan,
    recording: &'a Recording<'a>,
    accountant: &'a Accountant,
    seen: InputIdentity,
    key: [u8; 32],
    workspace: &'a Workspace,
    pool: &'a ThreadPool,
}

/// The file, as it was read.
struct Model {
    scattered: Mutex<Scattered>,
    places: Places,
    /// Cells are no smaller, in the scene.
    finest: f64,
}

/// A part in the output.
#[derive(Serialize, Deserialize)]
struct Done {
    report: PartReport,
    /// What is in front of it, and what there is with it.
    before: Numbered,
    after: Numbered,
    /// Its triangles as they were read.
    soup: FileState,
    resumptions: u32,
}

impl Assembly<'_> {
    fn resources(&self) -> Resources<'_> {
        Resources {
            scratch: self.workspace.scratch(),
            pool: self.pool,
            share_bytes: self.plan.share_bytes,
            cached_windows: self.plan.cached_windows,
            backing: self.limits.backing,
            checkpoints: &NoCheckpoints,
            monitor: self.recording,
        }
    }

    fn to_the_end(&self, deliver: &mut dyn FnMut(Outcome)) -> Result<PartsOutcome, RepairError> {
        let _leases = self.plan.lease(self.accountant)?;
        let resources = self.resources();
        let mut model = self.read(&resources)?;
        self.workspace.keep_parts(model.scattered_mut().part_count())?;
        let (input, output) = (self.input.to_path_buf(), self.output.to_path_buf());
        let mut whole = PartsOutcome::new(input, output);
        if let Some(scene) = self.survey(&mut model, &mut whole, &resources)? {
            model.scattered_mut().scene = scene;
            model.places = Places::find(model.scattered_mut(), &resources)?;
        }
        let options = self.write_options(&mut model);
        let beside = Beside {
            format: self.format,
            options: &options,
            workspace: self.workspace,
            replaces: &self.limits.replaces,
        };
        beside.keep_images()?;
        let mut rebuilt = Vec::new();
        let (outcome, concluded) = loop {
            let error = match self.assemble(&mut model, &options, (&whole, &rebuilt), &resources) {
                Ok(assembled) => break assembled,
                Err(error) => error,
            };
            let Some(path) = error.damaged_file().map(Path::to_path_buf) else { return Err(error) };
            if rebuilt.len() == MOST_WAYS_BACK {
                return Err(error);
            }
            self.recording.note(&format!("{error}; writing the parts again"));
            self.go_back_for(&path)?;
            rebuilt.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
        };
        beside.put()?;
        self.workspace.put_in_place()?;
        self.recording.note(&format!("{} is in place", self.output.display()));
        let spool = Spool::open(self.workspace.scratch(), &concluded)?;
        let mut texts = Texts::new(&spool);
        while let Some(text) = texts.next()? {
            let mut outcome: Outcome = serde_json::from_str(&text).map_err(|error| {
                StoreError::damaged(CONCLUDED.as_ref(), 0, "an outcome", error.to_string())
            })?;
            // Text cannot hold every path.
            outcome.input.path = self.input.to_path_buf();
            outcome.output.path = self.output.to_path_buf();
            deliver(outcome);
        }
        Ok(outcome)
    }

    /// Reads the file into the order of its parts.
    fn read(&self, resources: &Resources) -> Result<Model, RepairError> {
        let length = std::fs::metadata(self.input).map_or(0, |file| file.len());
        self.recording.begin(Stage::Ingest, length);
        let options = match self.format.has_scenes() {
            true => ReadOptions::by_itself(resources.share_bytes / 2),
            false => ReadOptions::in_scene(resources.share_bytes / 2),
        };
        let mut source =
            crate::io::open(self.input, resources.scratch, &options).map_err(RepairError::Input)?;
        let Settings { unit, to_unit, strict, .. } = self.settings;
        let mut converted = Converted::new(&mut *source, unit, to_unit);
        let mut scattered = scatter(&mut converted, strict, resources)
            .map_err(|error| RepairError::from_ingest(error, self.input))?;
        check_converted(self.input, to_unit, scattered.unit)?;
        drop(source);
        if InputIdentity::of(self.input)? != self.seen {
            return Err(RepairError::InputChanged { path: self.input.to_path_buf() });
        }
        let places = Places::find(&mut scattered, resources)?;
        self.recording.end(Stage::Ingest);
        if places.bounds.lo[0] > places.bounds.hi[0] {
            return Err(RepairError::no_triangle(self.input, &scattered.stats));
        }
        let unit = scattered.unit.or(self.settings.unit);
        let ruler = Ruler { bounds: places.bounds, unit };
        let Settings { depth, sheet_thickness, .. } = self.settings;
        let whole = choose_domain(self.input, &ruler, depth, sheet_thickness, self.format, 0.0);
        let finest = match whole {
            Ok(domain) => domain.cell_size() / FINER_THAN_WHOLE,
            // Each part has a place of its own, where numbers may be finer.
            Err(RepairError::OutputTooCoarse { .. }) => 0.0,
            Err(error) => return Err(error),
        };
        Ok(Model { scattered: Mutex::new(scattered), places, finest })
    }

    /// How the whole is written.
    fn write_options(&self, model: &mut Model) -> WriteOptions {
        let scattered = model.scattered_mut();
        let shows = self.format.has_materials() && self.settings.method != Method::Mc;
        let has_palette = shows && (scattered.has_materials() || self.settings.tag_patches);
        let [materials, images] = &scattered.palette;
        let palette = Palette::new(self.workspace.scratch(), materials);
        WriteOptions {
            palette: has_palette.then(|| palette.with_images(images, self.input)),
            tag_patches: self.settings.tag_patches,
            attributes: self.settings.gets(self.format, scattered.attributes()),
            copies_images: self.settings.textures == TextureRule::Copy,
            scene: self.format.has_scenes().then(|| scattered.scene.clone()),
            output: self.output.to_path_buf(),
            unit: scattered.unit.or(self.settings.unit),
            library: library_name(self.output),
        }
    }

    /// The run of a part.
    fn run_of<'m>(&'m self, feed: Feed<'m>, finest: f64) -> Run<'m> {
        let output = self.output.to_path_buf();
        Run {
            input: self.input,
            feed,
            finest,
            format: self.format,
            settings: self.settings,
            levels: vec![Level { decimate: self.settings.decimate, output }],
            limits: self.limits,
            plan: self.plan,
            recording: self.recording,
            accountant: self.accountant,
            seen: self.seen,
        }
    }

    fn open_part(&self, number: u32, is_again: bool) -> Result<Workspace, RepairError> {
        let limits = Limits { fresh: self.limits.fresh && !is_again, ..self.limits.clone() };
        self.workspace.open_part(number, &limits, part_key(self.key, number))
    }

    /// Sends the part whose work folder has `path` back to where that is made.
    fn go_back_for(&self, path: &Path) -> Result<(), RepairError> {
        if let Some(number) = self.workspace.part_with(path) {
            self.open_part(number, true)?.go_back_for(path)?;
        }
        Ok(())
    }
}

impl Model {
    fn scattered_mut(&mut self) -> &mut Scattered {
        self.scattered.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
