//! What the tests of whole repairs share: soups, ways to break them, files, and judgement.

pub mod breakage;
pub mod disk_watch;
pub mod image;
pub mod library;
pub mod obj;
pub mod page;
pub mod program;
pub mod run;
pub mod schema;
pub mod soups;
pub mod surface;
pub mod targets;

use std::path::{Path, PathBuf};

use brickmend::io::Format;
use brickmend::monitor::Void;
use brickmend::repair::{Depth, Limits, Outcome, RepairError, Settings, repair};
use brickmend::sign::FillRule;

/// A file or folder of `testdata/`.
pub fn testdata(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata").join(path)
}

/// Repairs `input` at `depth` into a PLY file in a folder that is gone afterwards.
pub fn repair_at(input: &Path, depth: u32, fill_rule: FillRule) -> Result<Outcome, RepairError> {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let settings = Settings { depth: Depth::Levels(depth), fill_rule, ..Settings::default() };
    let limits = Limits { max_memory_bytes: 256 << 20, threads: 2, ..Limits::default() };
    let output = folder.path().join("out.ply");
    let outcome = repair(input, &output, Format::Ply, &settings, &limits, &Void);
    assert_eq!(outcome.is_ok(), output.exists(), "an output appears exactly on success");
    outcome
}
