//! A monitor that looks how many bytes lie in the folders of a run.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use brickmend::monitor::{Monitor, Stage};

/// What each stage still needs of the files that a folder holds, and what it writes. A file that
/// no later step reads may be there or not: it does not count.
const NEEDED: [(Stage, &[&str]); 8] = [
    (Stage::Ingest, &["soup", "attributes", "bins", "drops", "facts"]),
    (
        Stage::Bridge,
        &["soup", "attributes", "bins", "drops", "borders", "rims", "leftout", "added"],
    ),
    (Stage::Scan, &["soup", "attributes", "bins", "leftout", "added", "hits"]),
    (Stage::Patch, &["soup", "attributes", "bins", "leftout", "added", "hits", "faces", "flips"]),
    (
        Stage::Sign,
        &["soup", "attributes", "bins", "leftout", "added", "hits", "flips", "even", "signs"],
    ),
    (Stage::Contour, &["soup", "attributes", "hits", "flips", "signs", "cells", "output"]),
    (Stage::Verify, &["soup", "attributes", "cells", "output"]),
    (Stage::Deviate, &["soup", "attributes", "output"]),
];

/// Watches a folder while a repair works in it.
pub struct DiskWatch {
    folder: PathBuf,
    stage: Mutex<(Option<Stage>, u64)>,
}

impl DiskWatch {
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), stage: Mutex::new((None, 0)) }
    }

    /// The most bytes that were needed at one time.
    pub fn peak(&self) -> u64 {
        self.stage.lock().expect("no test panics in between").1
    }

    fn look(&self) {
        let mut state = self.stage.lock().expect("no test panics in between");
        let Some(stage) = state.0 else { return };
        let named = self.named(stage);
        state.1 = state.1.max(named + self.nameless());
    }

    fn named(&self, stage: Stage) -> u64 {
        let needed = NEEDED.iter().find(|(of, _)| *of == stage).map_or(&[][..], |entry| entry.1);
        let mut files = Vec::new();
        list(&self.folder, &mut files);
        let writes = files.iter().any(|(name, _)| name.starts_with("output"));
        let counts = |name: &str| {
            let placed = writes && (name.starts_with("hits") || name.starts_with("flips"));
            !placed && needed.iter().any(|stem| name.starts_with(stem))
        };
        files.iter().filter(|(name, _)| counts(name)).map(|(_, bytes)| bytes).sum()
    }

    /// Files of the folder that are open and have no name any more.
    fn nameless(&self) -> u64 {
        let Ok(open) = std::fs::read_dir("/proc/self/fd") else { return 0 };
        let size = |entry: std::fs::DirEntry| {
            let target = std::fs::read_link(entry.path()).ok()?;
            let file = std::fs::metadata(entry.path()).ok()?;
            (target.starts_with(&self.folder) && file.nlink() == 0).then_some(file.len())
        };
        open.flatten().filter_map(size).sum()
    }
}

fn list(folder: &Path, files: &mut Vec<(String, u64)>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(file) = entry.metadata() else { continue };
        if file.is_dir() {
            list(&entry.path(), files);
        } else {
            files.push((entry.file_name().to_string_lossy().into_owned(), file.len()));
        }
    }
}

impl Monitor for DiskWatch {
    fn begin(&self, stage: Stage, _total: u64) {
        self.stage.lock().expect("no test panics in between").0 = Some(stage);
        self.look();
    }
    fn advance(&self, _done: u64) {
        self.look();
    }
    fn end(&self, _stage: Stage) {
        self.look();
    }
}
