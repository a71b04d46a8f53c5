//! The step that mends the soup before it is scanned.

use crate::bridge::{HoleRule, Known, MendOptions, mend};
use crate::ingest::Settled;
use crate::repair::RepairError;
use crate::repair::length::Reach;
use crate::repair::run::Run;
use crate::repair::settings::MaxHole;
use crate::repair::stages::{Findings, Handles, open_bins};
use crate::repair::workspace::Workspace;
use crate::store::{FileState, Resources};

impl Run<'_> {
    pub(crate) fn mend(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let bins = open_bins(&mut handles.bins, workspace, findings, resources)?;
        let settled = Settled::open(resources, &workspace.files(), findings.settle)?;
        let soup = bins.without(&settled.drops);
        let stats = &findings.soup().stats;
        let known = Known {
            triangles: stats.triangles,
            rim_edges: findings.settle.rim_edges,
            has_panes: findings.has_panes(),
        };
        let options = self.mend_options(findings)?;
        let (mended, stats) = mend(&soup, &options, findings.domain(), known, resources)?;
        findings.mend = stats;
        Ok(mended.files())
    }

    pub(crate) fn mend_options(&self, findings: &Findings) -> Result<MendOptions, RepairError> {
        let (ruler, domain) = (self.ruler(findings), findings.domain());
        let in_model_units = |length: Reach| {
            let cells = length.in_cells(&ruler, domain);
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
            bounds: ruler.bounds,
            keeps_origins: self.has_sources(findings),
        })
    }
}
