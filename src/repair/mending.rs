//! The steps that change the soup before it is contoured: mending, and thickening with what has to
//! be done again for it.

use crate::bridge::{HoleRule, MendOptions, Mended, ThickenStats, mend, thicken};
use crate::ingest::{Bins, Settled};
use crate::octree::Flips;
use crate::patch::patch;
use crate::repair::RepairError;
use crate::repair::deeper::{DepthTrial, goes_deeper};
use crate::repair::depth::choose_domain;
use crate::repair::length::Reach;
use crate::repair::run::Run;
use crate::repair::settings::{Depth, MaxHole, ThinRule};
use crate::repair::stages::{Findings, Handles, hand_on, open_bricks};
use crate::repair::workspace::Workspace;
use crate::scan::{HAS_ODD_FACES, HITS, scan};
use crate::sign::{Flooded, find_lost, flood};
use crate::store::{FileState, NoCheckpoints, Resources};

impl Run<'_> {
    pub(crate) fn mend(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let files = workspace.files();
        let bins = Bins::open(resources, &files, findings.left_out)?;
        let settled = Settled::open(resources, &files, findings.settle)?;
        let soup = bins.without(&settled.drops);
        let triangles = (findings.soup().stats.triangles, findings.settle.rim_edges);
        let options = self.mend_options(findings)?;
        let (mended, stats) = mend(&soup, &options, findings.domain(), triangles, resources)?;
        findings.mend = stats;
        Ok(mended.files())
    }

    /// Thickens what would be lost, and makes hits, flips and flood anew with it.
    pub(crate) fn thicken(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        findings.thickened = ThickenStats::default();
        let depth = findings.domain().depth;
        findings.trials.retain(|trial| trial.depth < depth);
        findings.trials.push(DepthTrial { depth, thin_share: 0.0 });
        if self.settings.thin == ThinRule::Drop {
            return Ok(Vec::new());
        }
        let files = workspace.files();
        let domain = *findings.domain();
        let lost = {
            let flips = Flips::open(resources, &files)?;
            let flooded = Flooded::open(resources, &files)?;
            let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
            find_lost(hits, &flips, &flooded, resources).map_err(RepairError::Sign)?
        };
        if lost.is_empty() {
            return Ok(Vec::new());
        }
        let bins = Bins::open(resources, &files, findings.left_out)?;
        let mended = Mended::open(resources, &files)?;
        let soup = mended.soup(bins.spools());
        let options = self.mend_options(findings)?;
        let given = findings.soup().stats.triangles;
        let numbers = (given, given + findings.mend.added_triangles);
        let found = thicken(&soup, lost, &options, &domain, numbers, resources)?;
        let Some((thickened, stats)) = found else { return Ok(Vec::new()) };
        findings.thickened = stats;
        if self.begins_deeper(findings, resources)? {
            return Ok(Vec::new());
        }
        // Made anew as a whole: what is noted on the way belongs to the steps of before.
        let resources = &Resources { checkpoints: &NoCheckpoints, ..*resources };
        handles.hits = None;
        let (hits, stats) = scan(&thickened.soup(&soup), &domain, resources)?;
        findings.scan = stats;
        let cell_units = f64::from(domain.cell_units);
        let (flips, stats) =
            patch(&hits, HAS_ODD_FACES, cell_units, resources).map_err(RepairError::Patch)?;
        findings.patch = stats;
        let rule = self.settings.fill_rule;
        let (flooded, votes) =
            flood(&hits, &flips, rule, &domain, resources).map_err(RepairError::Sign)?;
        findings.votes = votes;
        let mut files = hand_on(hits, &mut handles.hits);
        files.push(flips.state().clone());
        files.extend(flooded.files());
        Ok(files)
    }

    /// Lays a deeper grid where that is of use.
    fn begins_deeper(
        &self,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<bool, RepairError> {
        let share = findings.thickened.area / findings.measure.area.max(f64::MIN_POSITIVE);
        if let Some(trial) = findings.trials.last_mut() {
            trial.thin_share = share;
        }
        let settings = &self.settings;
        let disk = (resources.scratch.peak_bytes(), self.limits.max_disk_bytes);
        if !goes_deeper(findings, (settings.depth, settings.thin), disk) {
            return Ok(false);
        }
        let depth = Depth::Levels(findings.domain().depth + 1);
        let (bounds, thickness) = (&findings.soup().bounds, settings.sheet_thickness);
        // An output that cannot hold a deeper grid is no reason to end the run.
        match choose_domain(self.input, bounds, depth, thickness, self.format) {
            Ok(domain) => findings.deeper = Some(domain),
            Err(RepairError::OutputTooCoarse { .. }) => return Ok(false),
            Err(error) => return Err(error),
        }
        Ok(true)
    }

    pub(crate) fn mend_options(&self, findings: &Findings) -> Result<MendOptions, RepairError> {
        let (bounds, domain) = (&findings.soup().bounds, findings.domain());
        let in_model_units = |length: Reach| {
            let cells = length.in_cells(bounds, domain);
            let no_unit = || RepairError::NoUnit { path: self.input.to_path_buf() };
            cells.map(|cells| cells * domain.cell_size()).ok_or_else(no_unit)
        };
        let settings = &self.settings;
        Ok(MendOptions {
            holes: match settings.max_hole {
                MaxHole::Auto => HoleRule::Auto,
                MaxHole::All => HoleRule::All,
                MaxHole::Size(size) => HoleRule::UpTo(in_model_units(size)?),
            },
            max_gap: in_model_units(settings.max_gap)?,
            thickness: in_model_units(settings.sheet_thickness)?,
            crease_deg: settings.crease_deg,
            bounds: *bounds,
        })
    }
}
