//! The last step: how far the written file lies from the soup as it was read.
//!
//! What a repair does on purpose is listed elsewhere in the outcome: walls in place of sheets, fills,
//! patches, fins. So the tolerance is wide, and only what goes beyond it and beyond those lists is a
//! reason to look.

use crate::deviate::{
    DeviateError, Deviation, DeviationOptions, Means, Surface, SurfaceOptions, compare,
};
use crate::ingest::SOUP;
use crate::io::{Format, IoError, ReadOptions};
use crate::mesh::MeshSource;
use crate::octree::SoupSpool;
use crate::repair::RepairError;
use crate::repair::run::Run;
use crate::repair::stages::Findings;
use crate::repair::workspace::Workspace;
use crate::store::{FileState, Resources};

/// Samples of each surface: a share of a twentieth is told within a hundredth.
pub const SAMPLES: u64 = 4000;
/// Samples of the sharp edges of the input.
const CREASE_SAMPLES: u64 = 400;
/// How far from the input the surface may lie by contouring, cells.
const CONTOUR_CELLS: f64 = 1.0;
/// The tolerance is at least so much more, cells: half of a wall of default thickness.
const WALL_CELLS: f64 = 1.0;
/// More of what is seen than this is worth a look when it is lost, beyond what is listed.
const LOST_SHARE: f64 = 0.05;
/// So is more of the surface when it is invented.
const INVENTED_SHARE: f64 = 0.05;

impl Run<'_> {
    /// Measures the written file, unless that is not wanted.
    pub(crate) fn measure(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        findings.deviation = None;
        if self.settings.deviation {
            let share_bytes = resources.share_bytes / 4;
            let options = match self.format {
                // As it is proved: numbers as they were written.
                Format::Glb => ReadOptions::by_itself(share_bytes),
                _ => ReadOptions::in_scene(share_bytes),
            };
            let file = crate::io::open(workspace.part(), resources.scratch, &options);
            let mut file = file.map_err(RepairError::ReadBack)?;
            let files = workspace.files();
            let soup = FileState::find(&files, SOUP)?;
            findings.deviation = self.deviation((soup, &mut *file), findings, resources)?;
        }
        Ok(Vec::new())
    }

    /// Measures what `file` gives, the written file or what it has of a part, against the `soup` that
    /// was read.
    pub(crate) fn deviation<S: MeshSource<Error = IoError> + ?Sized>(
        &self,
        (soup, file): (&FileState, &mut S),
        findings: &Findings,
        resources: &Resources,
    ) -> Result<Option<Deviation>, RepairError> {
        let Resources { scratch, pool, monitor, .. } = *resources;
        let means = Means { scratch, pool, share_bytes: resources.share_bytes / 4 * 3, monitor };
        let asked = SurfaceOptions { samples: SAMPLES, creases: true };
        let soup = SoupSpool::open(scratch, soup)?;
        let before = Surface::of_soup(&soup, &asked, &means)?;
        let after = Surface::read(file, &asked, &means).map_err(|error| match error {
            DeviateError::Source { source } => RepairError::ReadBack(source),
            DeviateError::Store(source) => RepairError::Store(source),
        })?;
        let Some((before, after)) = before.zip(after) else { return Ok(None) };
        let options = self.deviation_options(findings);
        Ok(Some(compare(&before, &after, &options, &means)?))
    }

    fn deviation_options(&self, findings: &Findings) -> DeviationOptions {
        let domain = findings.domain();
        let thickness = self.settings.sheet_thickness.in_cells(&self.ruler(findings), domain);
        let wall = WALL_CELLS.max(thickness.unwrap_or(0.0) / 2.0);
        let merged = self.contour_options(findings).merged_cells();
        let cell = domain.cell_size();
        DeviationOptions {
            crease_samples: CREASE_SAMPLES,
            tolerance: (CONTOUR_CELLS + wall + merged) * cell,
            cell_size: Some(cell),
        }
    }
}

/// Reasons to look at a file for what was measured of it.
pub fn deviation_reasons(findings: &Findings, output_area: f64, reasons: &mut Vec<String>) {
    let Some(deviation) = &findings.deviation else { return };
    let share = |part: f64, whole: f64| part / whole.max(f64::MIN_POSITIVE);
    let tolerance = deviation.tolerance / findings.domain().cell_size();
    let listed = share(findings.settle.fins.area, findings.measure.area);
    let lost = deviation.lost.share;
    if lost > LOST_SHARE + listed {
        let place = deviation.lost.largest.map_or(String::new(), |found| {
            format!("; it is farthest away at {:?}", found.position)
        });
        reasons.push(format!(
            "{:.0} % of what is seen of the input lies more than {tolerance:.1} cells from the \
             output{place}",
            lost * 100.0
        ));
    }
    let patched = share(findings.sign.patch_crossings as f64, findings.sign.crossings as f64);
    let listed = share(findings.mend.filled_area, output_area) + patched;
    if deviation.invented_share > INVENTED_SHARE + listed {
        reasons.push(format!(
            "{:.0} % of the output's area lies more than {tolerance:.1} cells from the input, and \
             closes nothing that was open",
            deviation.invented_share * 100.0
        ));
    }
}
