//! Every model below the folder that `BRICKMEND_MODELS` names; nothing without it.

use std::path::{Path, PathBuf};

use brickmend::io::{IoError, detect};
use brickmend::repair::Blame;
use brickmend::sign::FillRule;

use crate::support::repair_at;

/// Deep enough for several bricks a side, quick enough for a library.
const DEPTH: u32 = 7;

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("BRICKMEND_MODELS names a readable folder");
    for entry in entries {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}

#[test]
fn every_model_of_the_named_folder_is_repaired_or_refused_for_its_content() {
    let Some(folder) = std::env::var_os("BRICKMEND_MODELS") else { return };
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    let mut repaired = 0;
    for file in files {
        if matches!(detect(&file), Err(IoError::Unreadable { .. })) {
            continue;
        }
        match repair_at(&file, DEPTH, FillRule::Solid) {
            Ok(outcome) => {
                let proof = &outcome.output.proof;
                assert!(proof.holds(), "{}: {:?}", file.display(), proof.failures());
                repaired += 1;
            }
            Err(error) => {
                let blame = error.blame();
                let content = matches!(blame, Blame::Input | Blame::Model);
                assert!(content, "{}: {error}", file.display());
            }
        }
    }
    assert!(repaired > 0, "the folder holds no model");
}
