//! Draws the conclusion of a level: what was found, invented and dropped, and whether a person should look.

use std::collections::BTreeMap;

use crate::monitor::{Counter, Gauge, Monitor};
use crate::repair::deeper::depth_reason;
use crate::repair::measuring::deviation_reasons;
use crate::repair::outcome::{
    DiskReport, Dropped, Found, Invented, MemoryReport, Outcome, OutputReport, ResumeReport,
    SCHEMA_VERSION, SoupReport, Verdict,
};
use crate::repair::run::Run;
use crate::repair::settings::{Depth, Settings};
use crate::repair::stages::Findings;
use crate::repair::workspace::Workspace;
use crate::verify::Proof;

/// Losing more than this share of the area is worth a look.
const LOST_AREA_SHARE: f64 = 0.2;
/// More of the area than this in walls is worth a look.
const WALLED_AREA_SHARE: f64 = 0.05;
/// So is filling more than this share of the volume.
const FILLED_VOLUME_SHARE: f64 = 0.05;

/// Makes the outcome of the level under way, which is finished.
pub fn conclude(
    run: &Run,
    workspace: &Workspace,
    findings: &Findings,
    rebuilt: &[String],
) -> Outcome {
    let (level, options) = (run.level(findings), run.contour_options(findings));
    let domain = *findings.domain();
    let soup = *findings.soup();
    let proof = findings.proof.clone().unwrap_or_default();
    let cell_volume = domain.cell_size().powi(3);
    let invented = Invented {
        patch_polygons: findings.sign.patch_crossings,
        filled_volume: findings.sign.filled_cells as f64 * cell_volume,
        sealed_by_resolution_volume: findings.sign.sealed_by_resolution_cells as f64 * cell_volume,
        largest_openings: findings.patch.largest.clone(),
    };
    let dropped = dropped(findings);
    let area_ratio = proof.area / findings.measure.area;
    let broken = broken_promises(&proof);
    let mut reasons = reasons(run, findings, &invented, &dropped, area_ratio, &proof);
    deviation_reasons(findings, proof.area, &mut reasons);
    let verdict = judge(&broken, &mut reasons);
    run.recording.gauge(Gauge::GrantedBytes, run.accountant.peak_bytes());
    Outcome {
        schema: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        part: None,
        verdict,
        reasons,
        input: SoupReport {
            path: run.input.to_path_buf(),
            stats: soup.stats,
            parts: soup.parts,
            materials: soup.materials,
            bounds: soup.bounds,
            measure: findings.measure,
        },
        settings: Settings { decimate: level.decimate, ..run.settings },
        grid: domain,
        depth_reason: depth_reason(run.settings.depth, &domain, &findings.trials),
        cell_size: domain.cell_size(),
        found: Found {
            settle: findings.settle,
            odd_faces: findings.patch.odd_faces,
            openings: findings.patch.components,
            multi_edges: findings.scan.multi_edges,
        },
        invented,
        dropped,
        output: OutputReport {
            path: level.output.clone(),
            bytes: findings.written.file.bytes,
            proof,
            area_ratio,
            decimate_cells: options.merged_cells(),
            contour: findings.contour,
            caveat: run.settings.method.caveat().map(str::to_owned),
        },
        deviation: findings.deviation.clone(),
        exports: None,
        mend: findings.mend.clone(),
        thickened: findings.thickened,
        hidden: findings.hidden.clone(),
        transfer: run.transfer_report(findings),
        scan: findings.scan,
        patch: findings.patch.clone(),
        votes: findings.flood.votes,
        sign: findings.sign,
        stages: BTreeMap::new(),
        counters: Counter::ALL.map(|c| (c, run.recording.total(c))).into_iter().collect(),
        memory: MemoryReport {
            budget_bytes: run.accountant.budget_bytes(),
            granted_bytes: run.accountant.peak_bytes(),
            peak_bytes: None,
            threads: run.plan.threads,
            resident: Gauge::ALL.map(|g| (g, run.recording.peak(g))).into_iter().collect(),
        },
        disk: DiskReport {
            limit_bytes: run.limits.max_disk_bytes,
            peak_bytes: workspace.scratch().peak_bytes(),
        },
        resume: ResumeReport { resumptions: workspace.resumptions(), rebuilt: rebuilt.to_vec() },
    }
}

/// The verdict; promises that are broken are the first reason.
fn judge(broken: &[String], reasons: &mut Vec<String>) -> Verdict {
    if !broken.is_empty() {
        reasons.insert(0, format!("The output is not sound: {}", broken.join("; ")));
        return Verdict::Fail;
    }
    if reasons.is_empty() { Verdict::Pass } else { Verdict::Review }
}

/// Why a proof does not hold.
pub fn broken_promises(proof: &Proof) -> Vec<String> {
    proof.failures().iter().map(ToString::to_string).collect()
}

fn dropped(findings: &Findings) -> Dropped {
    let sign = &findings.sign;
    Dropped {
        thin_edges: sign.thin_edges,
        buried_edges: sign.buried_edges,
        share_of_surface: sign.thin_edges as f64 / findings.scan.hit_edges.max(1) as f64,
    }
}

fn reasons(
    run: &Run,
    findings: &Findings,
    invented: &Invented,
    dropped: &Dropped,
    area_ratio: f64,
    proof: &Proof,
) -> Vec<String> {
    let domain = findings.domain();
    let mut reasons = Vec::new();
    // Where what is seen was measured, that tells what was lost; what nobody sees may go.
    if findings.deviation.is_none() {
        reasons.extend(area_reason(findings, dropped, area_ratio));
    }
    let walled = findings.mend.walled_area / findings.measure.area.max(f64::MIN_POSITIVE);
    if walled > WALLED_AREA_SHARE {
        reasons.push(format!(
            "{:.0} % of the area belongs to open sheets, which became walls",
            walled * 100.0
        ));
    }
    let thickened = findings.thickened.area / findings.measure.area.max(f64::MIN_POSITIVE);
    if thickened > WALLED_AREA_SHARE {
        reasons.push(format!(
            "{:.0} % of the area belongs to walls thinner than a cell, which became thicker",
            thickened * 100.0
        ));
    }
    if findings.mend.crowded_rims + findings.mend.crowded_samples > 0 {
        reasons.push(format!(
            "{} edges are open in places with too many of them to tell holes; the patch closed them",
            findings.mend.crowded_rims.max(findings.mend.crowded_samples)
        ));
    }
    if invented.filled_volume > FILLED_VOLUME_SHARE * proof.volume {
        let share = invented.filled_volume / proof.volume * 100.0;
        reasons.push(format!(
            "{share:.0} % of the volume was filled because nothing from outside reaches it"
        ));
    }
    let nesting = proof.inward_components + proof.undecided_components;
    if nesting > 0 {
        reasons.push(format!(
            "{nesting} components cross others within a cell, so nesting does not tell whether \
             they face the right way"
        ));
    }
    if let Some(dense) = findings.measure.dense_box {
        reasons.push(format!(
            "99.9 % of the area lies in {:?} to {:?}; far parts make the grid coarse for it",
            dense.lo, dense.hi
        ));
    }
    if let Depth::Tolerance { length, max_depth } = run.settings.depth {
        let wanted = length.in_model_units(&run.ruler(findings)).unwrap_or(f64::INFINITY);
        if domain.depth == max_depth && domain.cell_size() > 2.0 * wanted {
            reasons.push(format!(
                "The tolerance {length} asks for more than depth {max_depth}: cells are {}",
                domain.cell_size()
            ));
        }
    }
    reasons
}

/// Why the areas of input and output make a look worth it, if they do.
fn area_reason(findings: &Findings, dropped: &Dropped, area_ratio: f64) -> Option<String> {
    if area_ratio < 1.0 - LOST_AREA_SHARE {
        let lost = (1.0 - area_ratio) * 100.0;
        return Some(format!(
            "{lost:.0} % of the input's area is not in the output: {} triangles are copies of \
             others; of {} grid edges that triangles cross, {} belong to walls thinner than a \
             cell, {} are inside of the solid",
            findings.settle.duplicate_triangles + findings.settle.interface_triangles,
            findings.scan.hit_edges,
            dropped.thin_edges,
            dropped.buried_edges
        ));
    }
    let share = dropped.share_of_surface * 100.0;
    (dropped.share_of_surface > LOST_AREA_SHARE).then(|| {
        format!(
            "{share:.0} % of the grid edges that triangles cross belong to walls thinner than a cell"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_that_is_not_sound_fails_whatever_else_there_is_to_look_at() {
        let sound = Proof { triangles: 4, ..Proof::default() };
        let pinched = Proof { nonmanifold_edges: 2, ..sound.clone() };
        let broken = broken_promises(&pinched);
        let mut reasons = vec!["Much area is gone".to_owned()];
        assert_eq!(judge(&broken, &mut reasons), Verdict::Fail);
        assert_eq!(reasons[0], "The output is not sound: 2 non-manifold edges");
        let broken = broken_promises(&sound);
        assert_eq!(judge(&broken, &mut reasons[1..].to_vec()), Verdict::Review);
        assert_eq!(judge(&broken, &mut Vec::new()), Verdict::Pass);
    }

    #[test]
    fn every_failure_is_a_broken_promise() {
        let nested = Proof { triangles: 8, inward_components: 1, ..Proof::default() };
        assert_eq!(broken_promises(&nested).len(), 1);
        let open = Proof { boundary_edges: 3, ..nested };
        assert_eq!(broken_promises(&open)[0], "3 boundary edges");
    }
}
