//! What came of a model whose parts were kept apart. See docs/parts.md.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::monitor::Stage;
use crate::repair::outcome::{SCHEMA_VERSION, StageReport, Verdict, as_text};

/// The most parts that are named which are not in the output.
const MOST_NAMED: usize = 16;

/// Which part of its model an outcome is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartReport {
    /// Its number in the file.
    pub number: u32,
    /// Its name there.
    pub name: String,
    /// How often it stands in the scene.
    pub places: u64,
}

/// A part that is not in the output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Its number in the file.
    pub number: u32,
    /// Its name there.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// What came of all parts together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartsOutcome {
    /// Version of the schema.
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// The worst of the parts' verdicts; that of a model with parts left out is no better than
    /// [`Verdict::Review`].
    pub verdict: Verdict,
    /// The input.
    #[serde(serialize_with = "as_text")]
    pub input: PathBuf,
    /// The output.
    #[serde(serialize_with = "as_text")]
    pub output: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Parts in the output.
    pub parts: u64,
    /// Places where they stand.
    pub places: u64,
    /// Triangles of all parts, each counted once.
    pub triangles: u64,
    /// Parts whose outcomes a person should look at.
    pub to_review: u64,
    /// Parts without a result of their own.
    pub empty_parts: u64,
    /// Places where nobody sees from outside of the whole what stands there.
    pub hidden_places: u64,
    /// The first of both kinds.
    pub left_out: Vec<LeftOut>,
    /// Timings, by stage, of all parts; stamped by the caller, who has a clock.
    pub stages: BTreeMap<Stage, StageReport>,
    /// Peak resident memory of the process, where the kernel tells it; stamped by the caller.
    pub peak_bytes: Option<u64>,
}

impl PartsOutcome {
    pub(crate) fn new(input: PathBuf, output: PathBuf) -> Self {
        Self {
            schema: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            verdict: Verdict::Pass,
            input,
            output,
            bytes: 0,
            parts: 0,
            places: 0,
            triangles: 0,
            to_review: 0,
            empty_parts: 0,
            hidden_places: 0,
            left_out: Vec::new(),
            stages: BTreeMap::new(),
            peak_bytes: None,
        }
    }

    /// Takes note of a part that is not in the output.
    pub(crate) fn leave_out(&mut self, number: u32, name: &str, reason: String) {
        if self.left_out.len() < MOST_NAMED {
            self.left_out.push(LeftOut { number, name: name.to_owned(), reason });
        }
    }

    /// Takes note of a part in the output.
    pub(crate) fn add(&mut self, verdict: Verdict, places: u64, triangles: u64) {
        self.parts += 1;
        self.places += places;
        self.triangles += triangles;
        self.to_review += u64::from(verdict != Verdict::Pass);
        self.verdict = self.verdict.max(verdict);
    }
}
