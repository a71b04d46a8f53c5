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

mod outcome;
mod part_sink;
mod places;
mod slices;
mod survey;

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rayon::ThreadPool;
use serde::{Deserialize, Serialize};

use crate::contour::Method;
use crate::ingest::{Converted, LOOK_MATERIALS, SOUP, Scattered, scatter};
use crate::io::{
    Format, IoError, LookMap, MATERIALS, Palette, ReadOptions, Sink, Source, WriteOptions,
    check_output, library_name, lost_of_materials,
};
use crate::mesh::{CornerForm, SinkFile};
use crate::monitor::{Counter, Monitor, Recording, Stage};
use crate::repair::RepairError;
use crate::repair::depth::choose_domain;
use crate::repair::finish::conclude;
use crate::repair::length::Ruler;
use crate::repair::levels::Level;
use crate::repair::outcome::{Outcome, Verdict};
pub use crate::repair::parts::outcome::{LeftOut, PartReport, PartsOutcome};
use crate::repair::parts::part_sink::{Numbered, PartSink};
use crate::repair::parts::places::Places;
use crate::repair::parts::slices::Slices;
use crate::repair::plan::MemoryPlan;
use crate::repair::run::{
    Feed, InputIdentity, MOST_WAYS_BACK, Run, keep_input, part_key, run_key, start_threads,
};
use crate::repair::settings::{Limits, Settings, TextureRule};
use crate::repair::stages::{Findings, Handles, check_converted};
use crate::repair::standing::{CONCLUDED, FOUND};
use crate::repair::step::Step;
use crate::repair::surfaces::{Beside, keep_libraries};
use crate::repair::workspace::{Inner, Workspace};
use crate::store::{
    Accountant, FileState, NoCheckpoints, Resources, Spool, StoreError, Texts, TextsWriter,
};
use crate::verify::ProvedSource;

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
    keep_libraries(format, outputs.iter())?;
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
    /// The depth that the whole would have.
    depth: u32,
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
        let beside = Beside { format: self.format, options: &options, workspace: self.workspace };
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
        let (depth, finest) = match whole {
            Ok(domain) => (domain.depth, domain.cell_size() / FINER_THAN_WHOLE),
            // Each part has a place of its own, where numbers may be finer.
            Err(RepairError::OutputTooCoarse { possible_depth, .. }) => (possible_depth, 0.0),
            Err(error) => return Err(error),
        };
        Ok(Model { scattered: Mutex::new(scattered), places, depth, finest })
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

    /// The run of a part, or of all of them.
    fn run_of<'m>(&'m self, feed: Feed<'m>, settings: Settings, finest: f64) -> Run<'m> {
        let output = self.output.to_path_buf();
        Run {
            input: self.input,
            feed,
            finest,
            format: self.format,
            settings,
            levels: vec![Level { decimate: self.settings.decimate, output }],
            limits: self.limits,
            plan: self.plan,
            recording: self.recording,
            accountant: self.accountant,
            seen: self.seen,
        }
    }

    fn open_inner(&self, inner: Inner, is_again: bool) -> Result<Workspace, RepairError> {
        let limits = Limits { fresh: self.limits.fresh && !is_again, ..self.limits.clone() };
        let key = match inner {
            Inner::Part(number) => part_key(self.key, number),
            Inner::Whole => self.key,
        };
        self.workspace.open_inner(inner, &limits, key)
    }

    /// Sends the part whose work folder has `path` back to where that is made.
    fn go_back_for(&self, path: &Path) -> Result<(), RepairError> {
        let folder = path.parent().and_then(Path::file_name).and_then(|name| name.to_str());
        if let Some(inner) = folder.and_then(Inner::named) {
            self.open_inner(inner, true)?.go_back_for(path)?;
        }
        Ok(())
    }

    /// Writes all parts into one file, and proves each; what came of them, and the spool of their
    /// outcomes.
    fn assemble(
        &self,
        model: &mut Model,
        options: &WriteOptions,
        (whole, rebuilt): (&PartsOutcome, &[String]),
        resources: &Resources,
    ) -> Result<(PartsOutcome, FileState), RepairError> {
        let mut outcome = whole.clone();
        let scratch = resources.scratch;
        let lost = match &options.palette {
            Some(palette) => lost_of_materials(palette, self.format, options, scratch),
            None => Ok(Vec::new()),
        };
        let mut lost = lost.map_err(RepairError::Output)?;
        if !self.format.has_parts() {
            lost.push("names of parts".to_owned());
        }
        let sink = crate::io::create(self.workspace.part(), self.format, scratch, options);
        let mut sink = sink.map_err(RepairError::Output)?;
        let is_split = sink.corner_form() == CornerForm::OfVertices;
        let mut found = TextsWriter::create(scratch, FOUND)?;
        let mut there = Numbered::default();
        let mut nothing = None;
        for turn in 0..model.places.len() {
            let (number, at) = model.places.get(turn)?;
            let name = model.scattered_mut().name(number)?;
            self.recording.note(&format!("part {} of {}: {name}", turn + 1, model.places.len()));
            let feed = Feed::Part { of: &model.scattered, number, name: name.clone() };
            let run = self.run_of(feed, self.settings, model.finest / at.stretch);
            let workspace = self.open_inner(Inner::Part(number), !rebuilt.is_empty())?;
            let before = there;
            let written = self.write_part(&run, &workspace, (&mut sink, &name), &mut there);
            let mut findings = match written {
                Ok(findings) => findings,
                Err(error @ (RepairError::EmptyResult { .. } | RepairError::NoTriangle { .. })) => {
                    outcome.empty_parts += 1;
                    outcome.leave_out(number, &name, error.to_string());
                    nothing.get_or_insert(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            findings.is_split = is_split;
            findings.lost_maps.clone_from(&lost);
            let report = PartReport { number, name, places: at.count };
            let files = workspace.files();
            let soup = FileState::find(&files, SOUP)?.clone();
            let resumptions = workspace.resumptions();
            let done = Done { report, before, after: there, soup, resumptions };
            found.push(
                &serde_json::to_string(&(done, findings)).expect("plain records serialise"),
            )?;
        }
        let written = sink.finish().map_err(RepairError::Output)?;
        if let (0, Some(error)) = (there.triangles, nothing) {
            return Err(error);
        }
        self.recording.count(Counter::OutputBytesWritten, written.file.bytes);
        outcome.bytes = written.file.bytes;
        let found = found.finish()?;
        let concluded =
            self.prove(model, (&found, &written.file), rebuilt, &mut outcome, resources)?;
        Ok((outcome, concluded))
    }

    /// Does what is left of a part up to its surface, and hands that to the sink.
    fn write_part(
        &self,
        run: &Run,
        workspace: &Workspace,
        (sink, name): (&mut Sink, &str),
        there: &mut Numbered,
    ) -> Result<Findings, RepairError> {
        let Feed::Part { number, .. } = run.feed else { unreachable!("parts have numbers") };
        let mut findings = run.earlier_findings(workspace)?;
        let mut handles = Handles::default();
        run.steps(workspace, self.pool, &mut findings, &mut handles, Step::Draw)?;
        let resources = Resources { scratch: workspace.scratch(), ..self.resources() };
        let looks = match run.has_sources(&findings) {
            true => {
                let files = workspace.files();
                let materials = FileState::find(&files, MATERIALS)?;
                let looks = FileState::find(&files, LOOK_MATERIALS)?;
                Palette::new(workspace.scratch(), materials).with_looks(looks).looks()?
            }
            false => LookMap::default(),
        };
        self.recording.begin(Stage::Contour, findings.contour.triangles);
        sink.begin_part(number, name).map_err(RepairError::Output)?;
        let mut part = PartSink::new(&mut **sink, looks, *there);
        run.write_into(workspace, &mut findings, (&mut handles, None), &mut part, &resources)?;
        *there = part.after;
        self.recording.end(Stage::Contour);
        Ok(findings)
    }

    /// Reads the file back, and proves each of its parts; the spool of what came of them.
    fn prove(
        &self,
        model: &mut Model,
        (found, file): (&Spool<u8>, &SinkFile),
        rebuilt: &[String],
        outcome: &mut PartsOutcome,
        resources: &Resources,
    ) -> Result<FileState, RepairError> {
        let (part, scratch) = (self.workspace.part().to_path_buf(), resources.scratch.clone());
        check_output(&part, file, &scratch)?;
        let share_bytes = resources.share_bytes / 4;
        let options = match self.format.has_scenes() {
            true => ReadOptions::by_itself(share_bytes),
            false => ReadOptions::in_scene(share_bytes),
        };
        let open_file =
            || -> Result<Source, IoError> { crate::io::open(&part, &scratch, &options) };
        // Each goes through the file once.
        let (mut proved, mut measured) = (Slices::new(open_file), Slices::new(open_file));
        let mut concluded = TextsWriter::create(resources.scratch, CONCLUDED)?;
        let mut texts = Texts::new(found);
        while let Some(text) = texts.next()? {
            let (done, mut findings): (Done, Findings) =
                serde_json::from_str(&text).map_err(|error| {
                    StoreError::damaged(FOUND.as_ref(), 0, "findings", error.to_string())
                })?;
            let Done { report, before, after, soup, resumptions } = done;
            let (of, number, name) = (&model.scattered, report.number, report.name.clone());
            let run = self.run_of(Feed::Part { of, number, name }, self.settings, 0.0);
            let triangles = after.triangles - before.triangles;
            self.recording.begin(Stage::Verify, 2 * triangles);
            let mut open =
                || proved.part(before, after).map(|part| Box::new(part) as ProvedSource<'_, _>);
            run.prove_source(&mut open, self.workspace, &mut findings, resources)?;
            self.recording.end(Stage::Verify);
            if self.settings.deviation {
                self.recording.begin(Stage::Deviate, triangles);
                let mut file = measured.part(before, after).map_err(RepairError::ReadBack)?;
                let scratch = self.workspace.scratch_of(Inner::Part(report.number));
                let inner = Resources { scratch: &scratch, ..*resources };
                findings.deviation = run.deviation((&soup, &mut file), &findings, &inner)?;
                self.recording.end(Stage::Deviate);
            }
            findings.written.vertices = after.vertices - before.vertices;
            findings.written.triangles = triangles;
            findings.written.file = *file;
            run.count_scratch(self.workspace);
            let mut concluded_part = conclude(&run, self.workspace, &findings, rebuilt);
            concluded_part.resume.resumptions = resumptions;
            outcome.add(concluded_part.verdict, report.places, triangles);
            concluded_part.part = Some(report);
            concluded
                .push(&serde_json::to_string(&concluded_part).expect("plain records serialise"))?;
        }
        if outcome.empty_parts + outcome.hidden_places > 0 {
            outcome.verdict = outcome.verdict.max(Verdict::Review);
        }
        Ok(concluded.finish()?.state().clone())
    }
}

impl Model {
    fn scattered_mut(&mut self) -> &mut Scattered {
        self.scattered.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
