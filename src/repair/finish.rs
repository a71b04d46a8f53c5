//! Draws the conclusion: what was found, invented and dropped, and whether a person should look.

use std::collections::BTreeMap;

use crate::contour::ContourStats;
use crate::ingest::Soup;
use crate::monitor::{Counter, Gauge, Monitor};
use crate::repair::outcome::{
    Dropped, Found, Invented, MemoryReport, Outcome, OutputReport, SCHEMA_VERSION, SoupReport,
    Verdict,
};
use crate::repair::settings::Depth;
use crate::repair::stages::{Findings, Run};
use crate::verify::Proof;

/// Losing more than this share of the area is worth a look.
const LOST_AREA_SHARE: f64 = 0.2;
/// So is filling more than this share of the volume.
const FILLED_VOLUME_SHARE: f64 = 0.05;

/// What the stages brought.
pub struct Results {
    pub soup: Soup,
    pub findings: Findings,
    pub contour: ContourStats,
    pub bytes: u64,
    pub proof: Proof,
}

/// Makes the outcome of a finished run.
pub fn conclude(run: &Run, results: Results) -> Outcome {
    let Results { soup, findings, contour, bytes, proof } = results;
    let cell_volume = findings.domain.cell_size().powi(3);
    let invented = Invented {
        patch_polygons: findings.sign.patch_crossings,
        sheet_corners: findings.sign.sheet_corners,
        filled_volume: findings.sign.filled_cells as f64 * cell_volume,
        sealed_by_resolution_volume: findings.sign.sealed_by_resolution_cells as f64 * cell_volume,
        largest_openings: findings.patch.largest.clone(),
    };
    let dropped = dropped(&findings);
    let area_ratio = proof.area / findings.measure.area;
    let reasons = reasons(run, &soup, &findings, &invented, &dropped, area_ratio, &proof);
    run.recording.gauge(Gauge::GrantedBytes, run.accountant.peak_bytes());
    Outcome {
        schema: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        verdict: if reasons.is_empty() { Verdict::Pass } else { Verdict::Review },
        reasons,
        input: SoupReport {
            path: run.input.to_path_buf(),
            stats: soup.stats,
            parts: soup.parts,
            materials: soup.materials,
            bounds: soup.bounds,
            measure: findings.measure,
        },
        settings: *run.settings,
        grid: findings.domain,
        cell_size: findings.domain.cell_size(),
        found: Found {
            settle: findings.settle,
            odd_faces: findings.patch.odd_faces,
            openings: findings.patch.components,
            multi_edges: findings.scan.multi_edges,
        },
        invented,
        dropped,
        output: OutputReport { path: run.output.to_path_buf(), bytes, proof, area_ratio, contour },
        scan: findings.scan,
        patch: findings.patch,
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
    }
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
    soup: &Soup,
    findings: &Findings,
    invented: &Invented,
    dropped: &Dropped,
    area_ratio: f64,
    proof: &Proof,
) -> Vec<String> {
    let mut reasons = Vec::new();
    if area_ratio < 1.0 - LOST_AREA_SHARE {
        let lost = (1.0 - area_ratio) * 100.0;
        reasons.push(format!(
            "{lost:.0} % of the input's area is not in the output: {} triangles are copies of \
             others; of {} grid edges that triangles cross, {} belong to walls thinner than a \
             cell, {} are inside of the solid",
            findings.settle.duplicate_triangles + findings.settle.interface_triangles,
            findings.scan.hit_edges,
            dropped.thin_edges,
            dropped.buried_edges
        ));
    } else if dropped.share_of_surface > LOST_AREA_SHARE {
        let share = dropped.share_of_surface * 100.0;
        reasons.push(format!(
            "{share:.0} % of the grid edges that triangles cross belong to walls thinner than a cell"
        ));
    }
    if invented.sheet_corners > 0 {
        reasons.push(format!(
            "Open sheets became plates of about a cell: {} corners of the grid lie behind them",
            invented.sheet_corners
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
        let wanted = length.in_model_units(&soup.bounds).unwrap_or(f64::INFINITY);
        if findings.domain.depth == max_depth && findings.domain.cell_size() > 2.0 * wanted {
            reasons.push(format!(
                "The tolerance {length} asks for more than depth {max_depth}: cells are {}",
                findings.domain.cell_size()
            ));
        }
    }
    reasons
}
