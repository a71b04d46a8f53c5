//! The stages of a repair, one after the other.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rayon::ThreadPool;
use serde::{Deserialize, Serialize};

use crate::contour::{ContourOptions, ContourStats, place_vertices, write_surface};
use crate::defect::DefectKind;
use crate::ingest::{
    BinEntry, Bins, DropRecord, SettleStats, Settled, Soup, SoupMeasure, fill_bins, read_soup,
    settle,
};
use crate::io::{CoordinateType, Format, IoError, ReadOptions};
use crate::monitor::{Counter, Monitor, Recording, Stage};
use crate::octree::{BrickKey, Domain, Flips};
use crate::patch::{PatchStats, patch};
use crate::repair::RepairError;
use crate::repair::finish::{Results, conclude};
use crate::repair::outcome::Outcome;
use crate::repair::plan::MemoryPlan;
use crate::repair::settings::{Depth, Limits, Settings};
use crate::repair::workspace::Workspace;
use crate::scan::{HAS_ODD_FACES, ScanItem, ScanStats, scan};
use crate::sign::{FillRule, SignStats, assign_signs};
use crate::store::{Accountant, Backing, BrickFile, Resources, SpoolPeek, StoreError};
use crate::verify::{Failure, Outward, Proof, ProofOptions, prove};

/// Repairs `input` into `output`, whose format is told by its extension (PLY when it has none).
///
/// # Errors
/// [`RepairError`]; then nothing was put in place.
pub fn repair(
    input: &Path,
    output: &Path,
    format: Format,
    settings: &Settings,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<Outcome, RepairError> {
    let plan = MemoryPlan::within(limits)?;
    crate::io::detect(input).map_err(RepairError::Input)?;
    keep_input(input, output)?;
    let pool = start_threads(plan.threads)?;
    let recording = Recording::new(monitor);
    let mut workspace =
        Workspace::open(output, limits.work_dir.as_deref(), run_key(input, settings)?)?;
    let accountant = Accountant::new(limits.max_memory_bytes);
    let run = Run { input, output, format, settings, plan, recording, accountant };
    match run.all_stages(&mut workspace, &pool, limits.backing) {
        Ok(outcome) => {
            workspace.put_in_place()?;
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

/// Refuses an output that is the input under any name: the rename at the end would replace it.
fn keep_input(input: &Path, output: &Path) -> Result<(), RepairError> {
    let identity = |path| std::fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    match (identity(input), identity(output)) {
        (Some(a), Some(b)) if a == b => {
            Err(RepairError::OutputIsInput { path: output.to_path_buf() })
        }
        _ => Ok(()),
    }
}

fn start_threads(threads: usize) -> Result<ThreadPool, RepairError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|number| format!("brick-{number}"))
        .build()
        .map_err(|source| RepairError::Threads { threads, source })
}

/// blake3 of input bytes, settings and version: another key is another run.
fn run_key(input: &Path, settings: &Settings) -> Result<[u8; 32], RepairError> {
    let mut hasher = blake3::Hasher::new();
    let read = || -> std::io::Result<blake3::Hasher> {
        hasher.update_reader(std::fs::File::open(input)?)?;
        Ok(hasher)
    };
    let mut hasher = read().map_err(|source| {
        RepairError::Input(IoError::Input { doing: "read", path: input.to_path_buf(), source })
    })?;
    let settings = serde_json::to_string(settings).expect("plain records serialise");
    hasher.update(settings.as_bytes());
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&crate::store::FORMAT_VERSION.to_le_bytes());
    Ok(*hasher.finalize().as_bytes())
}

/// A run under way.
pub struct Run<'r> {
    pub input: &'r Path,
    pub output: &'r Path,
    pub format: Format,
    pub settings: &'r Settings,
    pub plan: MemoryPlan,
    pub recording: Recording<'r>,
    pub accountant: Accountant,
}

/// What a checkpoint remembers besides the files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Findings {
    pub domain: Domain,
    pub measure: SoupMeasure,
    pub settle: SettleStats,
    pub scan: ScanStats,
    pub patch: PatchStats,
    pub sign: SignStats,
}

impl Run<'_> {
    fn all_stages(
        &self,
        workspace: &mut Workspace,
        pool: &ThreadPool,
        backing: Backing,
    ) -> Result<Outcome, RepairError> {
        let _leases = self.plan.lease(&self.accountant)?;
        let scratch = workspace.scratch().clone();
        let resources = Resources {
            scratch: &scratch,
            pool,
            share_bytes: self.plan.share_bytes,
            cached_windows: self.plan.cached_windows,
            backing,
            monitor: &self.recording,
        };
        let (soup, bins, mut findings, settled) = self.ingest(&resources)?;
        workspace.checkpoint(Stage::Ingest, to_json(&findings))?;
        let hits = self.scan(&bins, &settled, &mut findings, &resources)?;
        workspace.checkpoint(Stage::Scan, to_json(&findings))?;
        let flips = self.patch(&hits, &mut findings, &resources)?;
        workspace.checkpoint(Stage::Patch, to_json(&findings))?;
        let signs = self.sign(&hits, &flips, &mut findings, &resources)?;
        drop(hits);
        workspace.checkpoint(Stage::Sign, to_json(&findings))?;
        let (contour, bytes) = self.contour(&signs, &findings, workspace.part(), &resources)?;
        drop(signs);
        workspace.checkpoint(Stage::Contour, to_json(&findings))?;
        let proof = self.verify(workspace, &resources)?;
        workspace.checkpoint(Stage::Verify, to_json(&findings))?;
        self.count_scratch(&resources);
        Ok(conclude(self, Results { soup, findings, contour, bytes, proof }))
    }

    fn ingest(
        &self,
        resources: &Resources,
    ) -> Result<(Soup, Bins, Findings, Settled), RepairError> {
        let total = std::fs::metadata(self.input).map_or(0, |m| m.len());
        self.recording.begin(Stage::Ingest, total);
        let options = ReadOptions { share_bytes: resources.share_bytes };
        let mut source =
            crate::io::open(self.input, resources.scratch, &options).map_err(RepairError::Input)?;
        let soup = read_soup(&mut *source, self.settings.strict, resources)
            .map_err(|e| RepairError::from_ingest(e, self.input))?;
        drop(source);
        if soup.spool.is_empty() {
            return Err(self.no_triangle(&soup));
        }
        let domain = self.choose_domain(&soup)?;
        let (bins, measure) = fill_bins(&soup, &domain, resources)?;
        if measure.area == 0.0 {
            return Err(self.no_triangle(&soup));
        }
        let settled = settle(&bins, &domain, soup.stats.triangles, resources)?;
        self.recording.end(Stage::Ingest);
        let findings = Findings {
            domain,
            measure,
            settle: settled.stats,
            scan: ScanStats::default(),
            patch: PatchStats::default(),
            sign: SignStats::default(),
        };
        Ok((soup, bins, findings, settled))
    }

    fn no_triangle(&self, soup: &Soup) -> RepairError {
        let stats = &soup.stats;
        let side = soup.bounds.longest();
        let beyond = !soup.spool.is_empty() && side > 0.0 && !(1e-75..1e75).contains(&side);
        let why = if beyond {
            format!(" (sides of {side:e} have areas beyond double precision)")
        } else {
            String::new()
        };
        let reason = format!(
            "{} read, {} with corners that are not finite, {} faces with wild indices, {} faces \
             with fewer than three corners, {} without area{why}",
            stats.triangles,
            stats.nonfinite_triangles,
            stats.discarded.wild_index_faces,
            stats.discarded.short_faces,
            soup.spool.len()
        );
        RepairError::NoTriangle { path: self.input.to_path_buf(), reason }
    }

    fn choose_domain(&self, soup: &Soup) -> Result<Domain, RepairError> {
        let single = self.format.coordinates() == CoordinateType::F32;
        let around = |depth| {
            Domain::around(&soup.bounds, depth, single)
                .map_err(|possible_depth| RepairError::OutputTooCoarse { depth, possible_depth })
        };
        match self.settings.depth {
            Depth::Levels(depth) => around(depth),
            Depth::Tolerance { length, max_depth } => {
                let tolerance = length
                    .in_model_units(&soup.bounds)
                    .ok_or_else(|| RepairError::NoUnit { path: self.input.to_path_buf() })?;
                let mut domain = around(*Depth::RANGE.start())?;
                for depth in *Depth::RANGE.start() + 1..=max_depth {
                    if domain.cell_size() <= 2.0 * tolerance {
                        break;
                    }
                    domain = around(depth)?;
                }
                Ok(domain)
            }
        }
    }

    fn scan(
        &self,
        bins: &Bins,
        settled: &Settled,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<BrickFile, RepairError> {
        self.recording.begin(Stage::Scan, bins.triangles.len());
        let mut items = ScanItems::new(bins, settled);
        let (hits, stats) = scan(&bins.triangles, || items.next(), &findings.domain, resources)?;
        findings.scan = stats;
        self.recording.end(Stage::Scan);
        Ok(hits)
    }

    fn patch(
        &self,
        hits: &BrickFile,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Flips, RepairError> {
        self.recording.begin(Stage::Patch, findings.scan.open_bricks);
        let cell_units = f64::from(findings.domain.cell_units);
        let (flips, stats) =
            patch(hits, HAS_ODD_FACES, cell_units, resources).map_err(RepairError::Patch)?;
        findings.patch = stats;
        self.recording.end(Stage::Patch);
        Ok(flips)
    }

    fn sign(
        &self,
        hits: &BrickFile,
        flips: &Flips,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<BrickFile, RepairError> {
        self.recording.begin(Stage::Sign, 2 * findings.scan.bricks);
        let rule = self.settings.fill_rule;
        let (signs, stats) = assign_signs(hits, flips, rule, &findings.domain, resources)
            .map_err(RepairError::Sign)?;
        findings.sign = stats;
        self.recording.end(Stage::Sign);
        if stats.crossings == 0 {
            return Err(self.empty_result(findings));
        }
        Ok(signs)
    }

    fn empty_result(&self, findings: &Findings) -> RepairError {
        let sign = &findings.sign;
        let cell = findings.domain.cell_size();
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

    fn contour(
        &self,
        signs: &BrickFile,
        findings: &Findings,
        part: &Path,
        resources: &Resources,
    ) -> Result<(ContourStats, u64), RepairError> {
        self.recording.begin(Stage::Contour, 2 * signs.len() as u64);
        let options =
            ContourOptions { method: self.settings.method, crease_deg: self.settings.crease_deg };
        let (cells, mut stats) = place_vertices(signs, &findings.domain, &options, resources)
            .map_err(RepairError::Contour)?;
        let mut sink =
            crate::io::create(part, self.format, resources.scratch).map_err(RepairError::Output)?;
        write_surface(&cells, &findings.domain, &options, &mut *sink, &mut stats, resources)
            .map_err(RepairError::from_write)?;
        let written = sink.finish().map_err(RepairError::Output)?;
        self.recording.count(Counter::OutputBytesWritten, written.bytes);
        self.recording.end(Stage::Contour);
        Ok((stats, written.bytes))
    }

    fn verify(&self, workspace: &Workspace, resources: &Resources) -> Result<Proof, RepairError> {
        let options = ReadOptions { share_bytes: resources.share_bytes / 4 };
        let mut open = || crate::io::open(workspace.part(), resources.scratch, &options);
        let outward = match self.settings.fill_rule {
            FillRule::Solid => Outward::AllPositive,
            FillRule::Evenodd => Outward::AlternatesWithNesting,
        };
        let proof_options = ProofOptions { share_bytes: resources.share_bytes / 2, outward };
        let proof = prove(&mut open, resources.scratch, &proof_options, &self.recording)
            .map_err(RepairError::from_verify)?;
        // Cavities face inward, and where two components share a cell they may cross: then nesting
        // does not tell which way one should face. That is for a person, see the reasons.
        let nested = self.settings.fill_rule == FillRule::Evenodd;
        let failures = proof.failures();
        if failures.iter().all(|failure| nested && is_about_nesting(failure)) {
            return Ok(proof);
        }
        let failures: Vec<String> = failures.iter().map(ToString::to_string).collect();
        Err(RepairError::ProofFailed {
            failures: failures.join("; "),
            folder: workspace.folder().to_path_buf(),
        })
    }

    fn count_scratch(&self, resources: &Resources) {
        let scratch = resources.scratch;
        self.recording.count(Counter::ScratchBytesRead, scratch.read_bytes());
        self.recording.count(Counter::ScratchBytesWritten, scratch.written_bytes());
        self.recording.count(Counter::SpilledRuns, scratch.spilled_runs());
    }
}

/// Whether a failure is about which way a component faces, and nothing else.
pub fn is_about_nesting(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Defects(DefectKind::InwardComponent, _) | Failure::UndecidedComponents(_)
    )
}

fn to_json(findings: &Findings) -> String {
    serde_json::to_string(findings).expect("plain records serialise")
}

/// Walks bins and drops side by side.
struct ScanItems<'b> {
    bins: SpoolPeek<'b, BinEntry>,
    drops: SpoolPeek<'b, DropRecord>,
}

impl<'b> ScanItems<'b> {
    fn new(bins: &'b Bins, settled: &'b Settled) -> Self {
        Self { bins: SpoolPeek::new(&bins.entries), drops: SpoolPeek::new(&settled.drops) }
    }

    fn next(&mut self) -> Result<Option<ScanItem>, StoreError> {
        let Some(BinEntry { brick, first, count }) = self.bins.next()? else { return Ok(None) };
        let drops = self.drops.take_while(|drop| drop.brick == brick, |drop| drop.source)?;
        Ok(Some(ScanItem { brick: BrickKey(brick), first, count, drops }))
    }
}
