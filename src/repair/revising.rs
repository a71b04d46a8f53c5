//! The step that looks at what the grid makes of the soup, changes the soup where that is not what a
//! person would want, and scans, patches and floods it again: what would be lost is thickened, what
//! nobody sees is left out.

use std::collections::BTreeSet;

use crate::bridge::{Mended, SLAB_ORIGINS, ThickenStats, Thickened, thicken};
use crate::contour::{Method, SurfaceDetail};
use crate::hidden::{Bodies, HiddenStats, Seen, judge, leave_out};
use crate::ingest::{Bins, names_of_parts};
use crate::monitor::Monitor;
use crate::octree::{BinnedSoup, Flips};
use crate::patch::patch;
use crate::repair::RepairError;
use crate::repair::deeper::{DepthTrial, goes_deeper};
use crate::repair::depth::choose_domain;
use crate::repair::run::Run;
use crate::repair::settings::{Depth, HiddenRule, ThinRule};
use crate::repair::stages::{Findings, Handles, hand_on, open_bricks};
use crate::repair::workspace::Workspace;
use crate::scan::{HAS_ODD_FACES, HITS, scan};
use crate::sign::{Exposed, FillRule, Flooded, find_exposed, find_lost, flood};
use crate::store::{BrickFile, FileState, NoCheckpoints, Resources, SpoolWriter};
use crate::transfer::{BorderStats, find_borders, no_borders};

/// What the grid makes of a soup; the hits are among the handles.
struct Scanned {
    flips: Flips,
    flooded: Flooded,
    /// Its files, where they are not those of the steps before.
    files: Vec<FileState>,
}

impl Run<'_> {
    pub(crate) fn revise(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        findings.thickened = ThickenStats::default();
        findings.hidden = HiddenStats::default();
        let depth = findings.domain().depth;
        findings.trials.retain(|trial| trial.depth < depth);
        findings.trials.push(DepthTrial { depth, thin_share: 0.0 });
        let files = workspace.files();
        let (flips, flooded) = (Flips::open(resources, &files)?, Flooded::open(resources, &files)?);
        let mut scanned = Scanned { flips, flooded, files: Vec::new() };
        // No later step reads them.
        let bins = match handles.bins.take() {
            Some(bins) => bins,
            None => Bins::open(resources, &files, findings.left_out)?,
        };
        let mended = Mended::open(resources, &files)?;
        let mut soup = mended.soup(bins.spools());
        let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
        let thickened = self.thicken(&soup, hits, &scanned, findings, resources)?;
        if let Some(thickened) = &thickened {
            if self.begins_deeper(findings, resources)? {
                return Ok(Vec::new());
            }
            soup = thickened.soup(&soup);
            scanned = self.scan_again(&soup, findings, handles, resources)?;
        }
        let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
        let seen = self.hide(&soup, hits, &scanned, findings, &files, resources)?;
        if let Some(seen) = &seen {
            soup = seen.soup(bins.spools());
            scanned = self.scan_again(&soup, findings, handles, resources)?;
        }
        let hits = open_bricks(&mut handles.hits, HITS, workspace, resources)?;
        let borders = self.find_borders(&soup, hits, findings, resources)?;
        scanned.files.extend(hand_on(borders, &mut handles.borders));
        scanned.files.push(match &thickened {
            Some(thickened) => thickened.origins.state().clone(),
            None => {
                let none = SpoolWriter::<u32>::create(resources.scratch, SLAB_ORIGINS)?;
                none.finish()?.state().clone()
            }
        });
        Ok(scanned.files)
    }

    /// Finds where materials may meet, if the output tells of several.
    fn find_borders(
        &self,
        soup: &BinnedSoup,
        hits: &BrickFile,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<BrickFile, RepairError> {
        findings.borders = BorderStats::default();
        let soup_facts = findings.soup();
        let has_borders = self.drawn_detail(findings) != SurfaceDetail::None
            && (soup_facts.materials.max(soup_facts.looks) > 1 || self.settings.tag_patches)
            && self.settings.method == Method::Mdc;
        if !has_borders {
            return Ok(no_borders(resources)?);
        }
        let resources = &Resources { checkpoints: &NoCheckpoints, ..*resources };
        let options = (self.settings.crease_deg, self.settings.tag_patches);
        let (borders, stats) = find_borders(soup, hits, findings.domain(), options, resources)
            .map_err(RepairError::Transfer)?;
        findings.borders = stats;
        Ok(borders)
    }

    /// Thickens what would be lost.
    fn thicken(
        &self,
        soup: &BinnedSoup,
        hits: &BrickFile,
        scanned: &Scanned,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Option<Thickened>, RepairError> {
        if self.settings.thin == ThinRule::Drop {
            return Ok(None);
        }
        let Scanned { flips, flooded, .. } = scanned;
        let lost = find_lost(hits, flips, flooded, resources).map_err(RepairError::Sign)?;
        if lost.is_empty() {
            return Ok(None);
        }
        let options = self.mend_options(findings)?;
        let given = findings.soup().stats.triangles;
        let numbers = (given, given + findings.mend.added_triangles);
        let found = thicken(soup, lost, &options, findings.domain(), numbers, resources)?;
        Ok(found.map(|(thickened, stats)| {
            findings.thickened = stats;
            thickened
        }))
    }

    /// Leaves out what nobody sees; `None` where that changes nothing.
    fn hide(
        &self,
        soup: &BinnedSoup,
        hits: &BrickFile,
        scanned: &Scanned,
        findings: &mut Findings,
        files: &[FileState],
        resources: &Resources,
    ) -> Result<Option<Seen>, RepairError> {
        let is_asked = self.settings.hidden == HiddenRule::Remove
            && self.settings.fill_rule == FillRule::Solid;
        // One closed surface around one volume hides nothing.
        let is_single = findings.flood.closed_volumes <= 1
            && findings.settle.rim_edges == 0
            && findings.soup().parts <= 1;
        if !is_asked || is_single {
            return Ok(None);
        }
        let domain = *findings.domain();
        let given = findings.soup().stats.triangles;
        let added = findings.mend.added_triangles + findings.thickened.added_triangles;
        let mut bodies = Bodies::join(soup, given + added, &domain, resources)?;
        let Scanned { flips, flooded, .. } = scanned;
        let Exposed { places, touched, occupancy } =
            find_exposed(hits, flips, flooded, &domain, |source| bodies.of(source), resources)
                .map_err(RepairError::Sign)?;
        let (mut verdicts, mut stats) = judge(places, touched, occupancy, &bodies, resources)?;
        let judged = (&mut bodies, &mut verdicts);
        let seen = leave_out(soup, given, judged, &domain, &mut stats, resources)?;
        let numbers: BTreeSet<u32> = stats.largest.iter().map(|body| body.part_number).collect();
        let names = names_of_parts(&numbers, files, resources)?;
        for body in &mut stats.largest {
            body.part = names.get(&body.part_number).cloned().unwrap_or_default();
        }
        if stats.hidden_bodies > 0 {
            let count = stats.hidden_bodies;
            self.recording.note(&format!("{count} bodies that nobody sees are left out"));
        }
        findings.hidden = stats;
        Ok(seen)
    }

    /// Scans, patches and floods a soup that was changed. As a whole: what is noted on the way
    /// belongs to the steps of before.
    fn scan_again(
        &self,
        soup: &BinnedSoup,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Scanned, RepairError> {
        let resources = &Resources { checkpoints: &NoCheckpoints, ..*resources };
        let domain = *findings.domain();
        handles.hits = None;
        let (hits, stats) = scan(soup, &domain, resources)?;
        findings.scan = stats;
        let cell_units = f64::from(domain.cell_units);
        let (flips, stats) =
            patch(&hits, HAS_ODD_FACES, cell_units, resources).map_err(RepairError::Patch)?;
        findings.patch = stats;
        let rule = self.settings.fill_rule;
        let (flooded, stats) =
            flood(&hits, &flips, (rule, findings.has_panes()), &domain, resources)
                .map_err(RepairError::Sign)?;
        findings.flood = stats;
        let mut files = hand_on(hits, &mut handles.hits);
        files.push(flips.state().clone());
        files.extend(flooded.files());
        Ok(Scanned { flips, flooded, files })
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
        let (ruler, thickness) = (self.ruler(findings), settings.sheet_thickness);
        // An output that cannot hold a deeper grid is no reason to end the run.
        match choose_domain(self.input, &ruler, depth, thickness, self.format, 0.0) {
            Ok(domain) if domain.cell_size() < self.finest => return Ok(false),
            Ok(domain) => findings.deeper = Some(domain),
            Err(RepairError::OutputTooCoarse { .. }) => return Ok(false),
            Err(error) => return Err(error),
        }
        Ok(true)
    }
}
