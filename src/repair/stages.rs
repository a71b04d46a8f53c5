//! The steps of a repair: each opens what earlier ones left, does its work, and names its files.

use std::path::Path;
use std::sync::PoisonError;

use serde::{Deserialize, Serialize};

use crate::bridge::{MendStats, Mended, ThickenStats};
use crate::contour::{CELLS, ContourOptions, ContourStats, place_vertices, separate};
use crate::deviate::Deviation;
use crate::hidden::HiddenStats;
use crate::ingest::{
    Bins, Converted, LeftOut, SettleStats, Soup, SoupFacts, SoupMeasure, drop_fins, fill_bins,
    read_soup, settle,
};
use crate::io::{IoError, ReadOptions};
use crate::mesh::{LengthUnit, MeshSource, SinkFile, SinkStats};
use crate::monitor::Monitor;
use crate::octree::{Domain, Flips, SignBricks};
use crate::patch::{PatchStats, patch};
use crate::repair::RepairError;
use crate::repair::choose::{Trials, most_trials};
use crate::repair::deeper::DepthTrial;
use crate::repair::depth::choose_domain;
use crate::repair::length::Ruler;
use crate::repair::measuring::SAMPLES;
use crate::repair::outcome::Outcome;
use crate::repair::run::{Feed, Run};
use crate::repair::settings::Settings;
use crate::repair::step::Step;
use crate::repair::workspace::Workspace;
use crate::scan::{HAS_ODD_FACES, HITS, ScanStats, scan};
use crate::sign::{FillRule, FloodStats, Flooded, SIGNS, SignStats, assign_signs, flood};
use crate::store::{BrickFile, FileState, Resources, StoreError};
use crate::transfer::{BORDERS, BorderStats};
use crate::verify::Proof;

/// A level of detail whose file is in its place.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FinishedLevel {
    /// What came of it.
    pub outcome: Outcome,
    /// The file.
    pub file: SinkFile,
}

/// What the finished steps found out; a checkpoint remembers it besides the files.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Findings {
    soup: Option<SoupFacts>,
    pub domain: Option<Domain>,
    pub measure: SoupMeasure,
    /// Copies that are in no bin.
    pub(crate) left_out: LeftOut,
    /// Bricks that triangles touch.
    pub bins: u64,
    pub settle: SettleStats,
    pub mend: MendStats,
    pub thickened: ThickenStats,
    /// The depths that were tried.
    pub trials: Vec<DepthTrial>,
    /// The grid to begin anew with.
    pub deeper: Option<Domain>,
    pub borders: BorderStats,
    pub scan: ScanStats,
    pub patch: PatchStats,
    pub flood: FloodStats,
    pub hidden: HiddenStats,
    pub sign: SignStats,
    /// The threshold, cells, where it was raised for fewer triangles.
    raised_cells: Option<f64>,
    /// Counts when the cells are as they stay.
    #[serde(default)]
    pub(crate) placed: ContourStats,
    /// The same with those of writing.
    pub contour: ContourStats,
    /// Whether the output has a vertex once for each attribute that its corners have.
    #[serde(default)]
    pub(crate) is_split: bool,
    /// Images and maps of materials that the output does not show.
    #[serde(default)]
    pub(crate) lost_maps: Vec<String>,
    pub written: SinkStats,
    pub proof: Option<Proof>,
    /// How far the written file lies from the soup.
    #[serde(default)]
    pub deviation: Option<Deviation>,
    /// The levels before the one under way.
    pub finished: Vec<FinishedLevel>,
}

impl Findings {
    /// Nothing but the levels that are in place.
    pub fn after(finished: Vec<FinishedLevel>) -> Self {
        Self { finished, ..Self::default() }
    }

    /// What was found out about the input.
    pub fn soup(&self) -> &SoupFacts {
        self.soup.as_ref().expect("the input is read first")
    }

    /// Whether light passes triangles of the input.
    pub fn has_panes(&self) -> bool {
        self.soup().stats.transparent_triangles > 0
    }

    /// The grid.
    pub fn domain(&self) -> &Domain {
        self.domain.as_ref().expect("the grid is laid when the input was read")
    }
}

/// Bins and brick files that are handed from step to step while the run lasts. A later run, and a step that
/// finds none here, opens them.
#[derive(Default)]
pub struct Handles {
    pub(crate) bins: Option<Bins>,
    pub(crate) hits: Option<BrickFile>,
    pub(crate) borders: Option<BrickFile>,
    pub(crate) signs: Option<BrickFile>,
    pub(crate) cells: Option<BrickFile>,
    pub(crate) surface: Option<BrickFile>,
}

/// The brick file in `held`, or the one that an earlier run left.
pub(crate) fn open_bricks<'h>(
    held: &'h mut Option<BrickFile>,
    name: &str,
    workspace: &Workspace,
    resources: &Resources,
) -> Result<&'h BrickFile, StoreError> {
    match held {
        Some(file) => Ok(file),
        None => {
            let files = workspace.files();
            let state = FileState::find(&files, name)?;
            let file = BrickFile::open(resources.scratch, state, resources.cached_windows)?;
            Ok(held.insert(file))
        }
    }
}

/// The bricks of signs with the hits that they come from, in `held` or as an earlier run left them.
pub(crate) fn open_signs<'h>(
    [hits, signs]: [&'h mut Option<BrickFile>; 2],
    workspace: &Workspace,
    resources: &Resources,
) -> Result<SignBricks<'h>, StoreError> {
    let hits = open_bricks(hits, HITS, workspace, resources)?;
    let signs = open_bricks(signs, SIGNS, workspace, resources)?;
    Ok(SignBricks::new(signs, hits))
}

/// The bins in `held`, or those that an earlier run left.
pub(crate) fn open_bins<'h>(
    held: &'h mut Option<Bins>,
    workspace: &Workspace,
    findings: &Findings,
    resources: &Resources,
) -> Result<&'h Bins, StoreError> {
    match held {
        Some(bins) => Ok(bins),
        None => {
            let bins = Bins::open(resources, &workspace.files(), findings.left_out)?;
            Ok(held.insert(bins))
        }
    }
}

impl Run<'_> {
    /// Does one step; the files that it left.
    pub(crate) fn step(
        &self,
        step: Step,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        self.recording.begin(step.stage(), self.work_of(step, findings));
        let files = match step {
            Step::Read => self.read(findings, resources)?,
            Step::Bin => self.bin(workspace, findings, handles, resources)?,
            Step::Settle => self.settle(workspace, findings, handles, resources)?,
            Step::Mend => self.mend(workspace, findings, handles, resources)?,
            Step::Scan => scan_bins(workspace, findings, handles, resources)?,
            Step::Patch => patch_bricks(workspace, findings, handles, resources)?,
            Step::Flood => {
                flood_bricks(self.settings.fill_rule, workspace, findings, handles, resources)?
            }
            Step::Revise => self.revise(workspace, findings, handles, resources)?,
            Step::Sign => self.sign(workspace, findings, handles, resources)?,
            Step::Choose => self.choose(workspace, findings, handles, resources)?,
            Step::Place => self.place(workspace, findings, handles, resources)?,
            Step::Separate => self.separate(workspace, findings, handles, resources)?,
            Step::Draw => self.draw(workspace, findings, handles, resources)?,
            Step::Write => self.write(workspace, findings, handles, resources)?,
            Step::Prove => self.prove(workspace, findings, resources)?,
            Step::Measure => self.measure(workspace, findings, resources)?,
        };
        self.recording.end(step.stage());
        Ok(files)
    }

    /// How much work a step expects, in the unit in which it tells its progress.
    fn work_of(&self, step: Step, findings: &Findings) -> u64 {
        match step {
            Step::Read => std::fs::metadata(self.input).map_or(0, |file| file.len()),
            Step::Bin => findings.soup().stats.triangles,
            Step::Settle | Step::Scan => findings.bins,
            Step::Mend | Step::Revise => 0,
            Step::Patch => findings.scan.open_bricks,
            Step::Flood | Step::Sign => findings.scan.bricks,
            Step::Choose if self.settings.max_triangles.is_some() => {
                most_trials(self.contour_options(findings).decimate_cells) * findings.sign.bricks
            }
            Step::Choose => 0,
            Step::Place => findings.sign.bricks,
            Step::Separate => 0,
            Step::Draw if self.attributes(findings).any() => 2 * findings.sign.bricks,
            Step::Draw => 0,
            Step::Write if self.attributes(findings).any() => {
                findings.contour.vertices + findings.contour.triangles
            }
            Step::Write => 2 * findings.sign.bricks,
            // Read once, and joined once.
            Step::Prove => 2 * findings.written.triangles,
            Step::Measure if self.settings.deviation => {
                findings.soup().stats.triangles + findings.written.triangles + 2 * SAMPLES
            }
            Step::Measure => 0,
        }
    }

    fn read(
        &self,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let mut soup = match &self.feed {
            Feed::File => {
                let options = ReadOptions::in_scene(resources.share_bytes);
                let source = crate::io::open(self.input, resources.scratch, &options);
                // What the reader holds of the share is free once it is read.
                let mut source = source.map_err(RepairError::Input)?;
                let Settings { unit, to_unit, .. } = self.settings;
                let soup =
                    self.read_from(&mut Converted::new(&mut *source, unit, to_unit), resources)?;
                check_converted(self.input, to_unit, soup.facts.unit)?;
                soup
            }
            Feed::Part { of, number, name } => {
                let mut parts = of.lock().unwrap_or_else(PoisonError::into_inner);
                let mut source = parts.part(*number, name)?;
                self.read_from(&mut source, resources)?
            }
        };
        soup.part_looks(resources).map_err(RepairError::Input)?;
        self.check_unchanged()?;
        findings.soup = Some(soup.facts);
        if soup.spool.is_empty() {
            return Err(RepairError::no_triangle(self.input, &findings.soup().stats));
        }
        let (settings, ruler) = (&self.settings, self.ruler(findings));
        let thickness = settings.sheet_thickness;
        let (depth, format) = (settings.depth, self.format);
        let domain = choose_domain(self.input, &ruler, depth, thickness, format, self.finest)?;
        if self.levels().iter().any(|level| level.decimate.in_cells(&ruler, &domain).is_none()) {
            return Err(RepairError::NoUnit { path: self.input.to_path_buf() });
        }
        findings.domain = Some(domain);
        self.mend_options(findings)?;
        Ok(soup.files())
    }

    /// Reads a source to its end.
    fn read_from<S: MeshSource<Error = IoError> + ?Sized>(
        &self,
        source: &mut S,
        resources: &Resources,
    ) -> Result<Soup, RepairError> {
        read_soup(source, self.settings.strict, self.takes(), resources)
            .map_err(|e| RepairError::from_ingest(e, self.input))
    }

    fn bin(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        // Images of parts belong to the whole.
        if matches!(self.feed, Feed::File) {
            self.keep_images(workspace, findings)?;
        }
        let soup = Soup::open(resources, &workspace.files(), *findings.soup())?;
        let (bins, measure) = fill_bins(soup, findings.domain(), resources)?;
        findings.measure = measure;
        findings.bins = bins.spools().count()?;
        findings.left_out = bins.left_out;
        if measure.area == 0.0 {
            return Err(RepairError::no_triangle(self.input, &findings.soup().stats));
        }
        let files = bins.files();
        handles.bins = Some(bins);
        Ok(files)
    }

    fn settle(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let bins = open_bins(&mut handles.bins, workspace, findings, resources)?;
        let (triangles, area) = (findings.soup().stats.triangles, findings.measure.area);
        let domain = findings.domain();
        let settled = settle(bins, domain, triangles, resources)?;
        let rule = self.settings.sheets;
        let settled = drop_fins(bins, settled, rule, domain, (triangles, area), resources)?;
        findings.settle = settled.stats;
        Ok(vec![settled.drops.state().clone()])
    }

    fn sign(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let files = workspace.files();
        let flips = Flips::open(resources, &files)?;
        let flooded = Flooded::open(resources, &files)?;
        let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
        let borders = open_bricks(&mut handles.borders, BORDERS, workspace, resources)?;
        let rule = (self.settings.fill_rule, findings.domain());
        let (signs, stats) = assign_signs((hits, Some(borders)), &flips, &flooded, rule, resources)
            .map_err(RepairError::Sign)?;
        findings.sign = stats;
        handles.borders = None;
        if stats.crossings == 0 {
            return Err(self.empty_result(findings));
        }
        Ok(hand_on(signs, &mut handles.signs))
    }

    fn empty_result(&self, findings: &Findings) -> RepairError {
        let sign = &findings.sign;
        let cell = findings.domain().cell_size();
        let reason = if findings.scan.hit_edges == 0 {
            format!("no triangle crosses an edge of the grid, whose cells are {cell} wide")
        } else {
            format!(
                "of {} grid edges that triangles cross, {} belong to walls thinner than a cell \
                 ({cell})",
                findings.scan.hit_edges, sign.thin_edges
            )
        };
        RepairError::EmptyResult { path: self.input.to_path_buf(), reason }
    }

    /// What lengths are measured by.
    pub(crate) fn ruler(&self, findings: &Findings) -> Ruler {
        let soup = findings.soup();
        Ruler { bounds: soup.bounds, unit: soup.unit.or(self.settings.unit) }
    }

    pub(crate) fn contour_options(&self, findings: &Findings) -> ContourOptions {
        let ruler = self.ruler(findings);
        let asked_cells = self.level(findings).decimate.in_cells(&ruler, findings.domain());
        let decimate_cells = findings.raised_cells.or(asked_cells);
        ContourOptions {
            method: self.settings.method,
            crease_deg: self.settings.crease_deg,
            decimate_cells: decimate_cells.expect("refused when the grid was laid"),
            surfaces: self.drawn_detail(findings),
            sources: self.has_sources(findings),
        }
    }

    fn choose(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        findings.raised_cells = None;
        if let Some(limit) = self.settings.max_triangles {
            let files = [&mut handles.hits, &mut handles.signs];
            let signs = open_signs(files, workspace, resources)?;
            let (domain, options) = (findings.domain(), self.contour_options(findings));
            let trials = Trials { signs, domain, options, resources: *resources };
            findings.raised_cells = Some(trials.choose(limit)?);
        }
        Ok(Vec::new())
    }

    fn place(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let signs = open_signs([&mut handles.hits, &mut handles.signs], workspace, resources)?;
        let (cells, stats) =
            place_vertices(signs, findings.domain(), &self.contour_options(findings), resources)
                .map_err(RepairError::Contour)?;
        findings.contour = stats;
        // What comes next looks at few of these.
        [&handles.hits, &handles.signs].into_iter().flatten().for_each(BrickFile::let_windows_go);
        Ok(hand_on(cells, &mut handles.cells))
    }

    fn separate(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let signs = open_signs([&mut handles.hits, &mut handles.signs], workspace, resources)?;
        let cells = open_bricks(&mut handles.cells, CELLS, workspace, resources)?;
        let (domain, options) = (findings.domain(), self.contour_options(findings));
        let (surface, stats) =
            separate(signs, cells, domain, &options, &findings.contour, resources)
                .map_err(RepairError::Contour)?;
        (findings.placed, findings.contour) = (stats, stats);
        // Another level opens them again, unless they are in memory only.
        let more = self.has_more_levels(findings);
        for file in [&mut handles.hits, &mut handles.signs] {
            file.take_if(|file| !more || file.state().is_some());
        }
        Ok(hand_on(surface, &mut handles.surface))
    }
}

/// Refuses numbers that should have been turned into another unit and were not.
pub(crate) fn check_converted(
    input: &Path,
    to: Option<LengthUnit>,
    found: Option<LengthUnit>,
) -> Result<(), RepairError> {
    match to {
        Some(to) if found != Some(to) => {
            Err(RepairError::NothingToConvert { path: input.to_path_buf() })
        }
        _ => Ok(()),
    }
}

/// Keeps a brick file for the next step; how a later run finds it again.
pub(crate) fn hand_on(file: BrickFile, held: &mut Option<BrickFile>) -> Vec<FileState> {
    let state = file.state().cloned();
    *held = Some(file);
    state.into_iter().collect()
}

fn scan_bins(
    workspace: &Workspace,
    findings: &mut Findings,
    handles: &mut Handles,
    resources: &Resources,
) -> Result<Vec<FileState>, RepairError> {
    let bins = open_bins(&mut handles.bins, workspace, findings, resources)?;
    let mended = Mended::open(resources, &workspace.files())?;
    let soup = mended.soup(bins.spools());
    let (hits, stats) = scan(&soup, findings.domain(), resources)?;
    findings.scan = stats;
    Ok(hand_on(hits, &mut handles.hits))
}

fn patch_bricks(
    workspace: &Workspace,
    findings: &mut Findings,
    handles: &mut Handles,
    resources: &Resources,
) -> Result<Vec<FileState>, RepairError> {
    let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
    let cell_units = f64::from(findings.domain().cell_units);
    let (flips, stats) =
        patch(hits, HAS_ODD_FACES, cell_units, resources).map_err(RepairError::Patch)?;
    findings.patch = stats;
    Ok(vec![flips.state().clone()])
}

fn flood_bricks(
    rule: FillRule,
    workspace: &Workspace,
    findings: &mut Findings,
    handles: &mut Handles,
    resources: &Resources,
) -> Result<Vec<FileState>, RepairError> {
    let flips = Flips::open(resources, &workspace.files())?;
    let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
    let (flooded, stats) =
        flood(hits, &flips, (rule, findings.has_panes()), findings.domain(), resources)
            .map_err(RepairError::Sign)?;
    findings.flood = stats;
    Ok(flooded.files())
}
