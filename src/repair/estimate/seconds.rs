//! How long a run will take.
//!
//! Rates of one core, measured; see docs/estimate.md for the machine. They are the expectation, not
//! a bound: another machine, a busy one or a slow disk takes its own time.

use std::collections::BTreeMap;

use crate::ingest::SoupSums;
use crate::monitor::Stage;
use crate::repair::estimate::counts::Counts;

/// Nanoseconds of one core.
const PER_INPUT_BYTE: f64 = 6.0;
const PER_TRIANGLE: f64 = 200.0;
const PER_PAIR: f64 = 400.0;
const PER_PAIR_MENDED: f64 = 900.0;
const PER_SCANNED_PAIR: f64 = 160.0;
const PER_HIT: f64 = 70.0;
const PER_FLIP: f64 = 450.0;
const PER_ODD_FACE: f64 = 600.0;
const PER_CROSSING_SIGNED: f64 = 80.0;
const PER_BRICK: f64 = 60_000.0;
const PER_CROSSING_PLACED: f64 = 1100.0;
const PER_TRIANGLE_PROVED: f64 = 250.0;
const PER_TRIANGLE_MEASURED: f64 = 300.0;
/// Share of a stage that more threads make shorter.
const PARALLEL: [(Stage, f64); 8] = [
    (Stage::Ingest, 0.5),
    (Stage::Bridge, 0.3),
    (Stage::Scan, 0.9),
    (Stage::Patch, 0.5),
    (Stage::Sign, 0.8),
    (Stage::Contour, 0.9),
    (Stage::Verify, 0.5),
    (Stage::Deviate, 0.3),
];

/// Seconds of each stage with so many threads.
pub fn stages(sums: &SoupSums, counts: &Counts, threads: usize) -> BTreeMap<Stage, f64> {
    let pairs = counts.brick_triangles as f64;
    let crossings = counts.hits as f64;
    let bricks = counts.bricks as f64;
    let core = |stage| match stage {
        Stage::Ingest => {
            PER_INPUT_BYTE * sums.stats.input_bytes as f64
                + PER_TRIANGLE * sums.stats.triangles as f64
                + PER_PAIR * pairs
        }
        Stage::Bridge if sums.rims.edges == 0.0 => 0.0,
        Stage::Bridge => PER_PAIR_MENDED * pairs,
        Stage::Scan => PER_SCANNED_PAIR * pairs + PER_HIT * counts.hits as f64,
        Stage::Patch => {
            PER_FLIP * counts.at_most.flips as f64 + PER_ODD_FACE * counts.at_most.odd_faces as f64
        }
        Stage::Sign => PER_CROSSING_SIGNED * crossings + PER_BRICK * bricks,
        Stage::Contour => PER_CROSSING_PLACED * crossings,
        Stage::Verify => PER_TRIANGLE_PROVED * 2.0 * crossings,
        Stage::Deviate => PER_TRIANGLE_MEASURED * (2.0 * crossings + sums.stats.triangles as f64),
    };
    let with_threads = |(stage, share)| {
        let alone: f64 = 1.0 - share;
        (stage, 1e-9 * core(stage) * (alone + share / threads as f64))
    };
    PARALLEL.map(with_threads).into()
}
